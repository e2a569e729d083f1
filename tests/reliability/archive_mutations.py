"""Archives of FMUs, changed: their ZIP structure, and the model description in them."""

import copy
import io
import random
import struct
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable, Mapping
from typing import Final, TypeAlias

from tests.reliability.byte_mutations import mutated_bytes

Entries: TypeAlias = list[tuple[str, bytes]]

DESCRIPTION: Final = "modelDescription.xml"

_TEXTS: Final = (
    "", " ", "x" * 100_000, "0", "-1", "1", "4294967296", "18446744073709551616", "1e400", "NaN",
    "INF", "true", "1 2 3", "é\u2028", "\U0010ffff", "../../x", "/dev/zero", "a.b[3]", "&#x41;",
    "input", "output", "parameter", "independent", "structuralParameter", "calculated", "local",
    "constant", "fixed", "tunable", "discrete", "continuous", "exact", "initial", "3.0", "2.0",
    "1.0", "4.0", "0x10", "1,5", "9" * 400,
)  # fmt: skip

_DEVICE: Final = b'<!DOCTYPE x [<!ENTITY e SYSTEM "file:///dev/zero">]>'

_NAMES: Final = (
    "../evil", "/etc/x", "a\\b", "C:x", "con", "a" * 300, "a/" * 400 + "b", "\u202e.xml", "x\n",
    "MODELDESCRIPTION.XML", "binaries", "binaries/", "resources/../../x", "", ".", "a\tb",
    "binaries/x86_64-linux/extra.so", "binaries/linux64/x.so", "sources/buildDescription.xml",
    "terminalsAndIcons/terminalsAndIcons.xml", "documentation/licenses/x",
)  # fmt: skip


def entries_of(content: bytes) -> Entries:
    """Names and contents of an archive."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return [(name, archive.read(name)) for name in archive.namelist()]


def archived(entries: Entries, method: int = zipfile.ZIP_STORED) -> bytes:
    """An archive of these."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in entries:
            archive.writestr(zipfile.ZipInfo(name), content, method)
    return buffer.getvalue()


def _of_xml(change: Callable[[ET.Element, random.Random], None]) -> "_Way":
    def way(entries: Entries, rng: random.Random) -> bytes:
        root = ET.fromstring(dict(entries)[DESCRIPTION])  # noqa: S314
        for _ in range(rng.choice((1, 1, 1, 2, 4))):
            change(root, rng)
        return _with_description(entries, ET.tostring(root, encoding="utf-8"))

    return way


def _with_description(entries: Entries, text: bytes) -> bytes:
    return archived([(n, text if n == DESCRIPTION else c) for n, c in entries])


def _any(root: ET.Element, rng: random.Random) -> ET.Element:
    return rng.choice([*root.iter()])


def _parent(root: ET.Element, rng: random.Random) -> ET.Element:
    return rng.choice([each for each in root.iter() if len(each)] or [root])


def _value(root: ET.Element, rng: random.Random) -> None:
    element = rng.choice([each for each in root.iter() if each.attrib] or [root])
    name = rng.choice([*element.attrib] or ["x"])
    other = _any(root, rng).attrib.values()
    element.set(name, rng.choice((*_TEXTS, *other)))


def _attribute(root: ET.Element, rng: random.Random) -> None:
    element = rng.choice([each for each in root.iter() if each.attrib] or [root])
    if element.attrib and rng.random() < 0.6:
        del element.attrib[rng.choice([*element.attrib])]
    else:
        known = [name for each in root.iter() for name in each.attrib]
        element.set(rng.choice(known or ["x"]), rng.choice(_TEXTS))


def _remove(root: ET.Element, rng: random.Random) -> None:
    parent = _parent(root, rng)
    if len(parent):
        parent.remove(rng.choice([*parent]))


def _repeat(root: ET.Element, rng: random.Random) -> None:
    parent = _parent(root, rng)
    if len(parent):
        again = copy.deepcopy(rng.choice([*parent]))
        _parent(root, rng).insert(rng.randrange(3), again)


def _rename(root: ET.Element, rng: random.Random) -> None:
    element = _any(root, rng)
    element.tag = rng.choice((_any(root, rng).tag, "Unknown", "fmiModelDescription", "Float64"))


def _text(root: ET.Element, rng: random.Random) -> None:
    _any(root, rng).text = rng.choice(_TEXTS)


def _nested(root: ET.Element, rng: random.Random) -> None:
    at = _parent(root, rng)
    for _ in range(rng.choice((10, 300))):
        at = ET.SubElement(at, at.tag)


def _xml_bytes(entries: Entries, rng: random.Random) -> bytes:
    return _with_description(entries, mutated_bytes(dict(entries)[DESCRIPTION], rng))


def _markup(entries: Entries, rng: random.Random) -> bytes:
    """What XML can do beyond elements: entities, other encodings, deep nesting."""
    text = dict(entries)[DESCRIPTION]
    root = text.index(b"<fmiModelDescription")
    body = text[root:]
    laughs = b"".join(
        b'<!ENTITY l%d "%s">' % (i, b"&l%d;" % (i - 1) * 10 if i else b"lol") for i in range(9)
    )
    ways: tuple[Callable[[], bytes], ...] = (
        lambda: b"<!DOCTYPE x [" + laughs + b"]>" + body.replace(b'name="', b'name="&l8;', 1),
        lambda: _DEVICE + body.replace(b">", b">&e;", 1),
        lambda: b'<?xml version="1.0" encoding="utf-16"?>' + body,
        lambda: b'<?xml version="1.0" encoding="ebcdic-nowhere"?>' + body,
        lambda: text.decode().encode("utf-16"),
        lambda: b"\xef\xbb\xbf" + text,
        lambda: b"<a>" * 50_000,
        lambda: b"",
        lambda: body + body,
        lambda: b"<?xml version='1.1'?>" + body,
        lambda: text.replace(b"</fmiModelDescription>", b"<![CDATA[" + b"x" * 10**6),
        lambda: text.replace(b'name="', b'name="&#0;', 1),
    )  # fmt: skip
    return _with_description(entries, rng.choice(ways)())


def _entry(entries: Entries, rng: random.Random) -> bytes:
    """An entry is missing, has another name or is there twice; or one is there that is not due."""
    found = list(entries)
    place = rng.randrange(len(found))
    name, content = found[place]
    match rng.randrange(5):
        case 0:
            del found[place]
        case 1:
            found[place] = (rng.choice(_NAMES), content)
        case 2:
            found.append((rng.choice(_NAMES), b"x"))
        case 3:
            found.append((name, content[: rng.randrange(len(content) + 1)]))
        case 4:
            other = rng.randrange(len(found))
            found[place], found[other] = (name, found[other][1]), (found[other][0], content)
    return archived(found)


def _method(entries: Entries, rng: random.Random) -> bytes:
    methods = (zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA)
    content = archived(entries, rng.choice(methods))
    return mutated_bytes(content, rng) if rng.random() < 0.7 else content


def _mode(entries: Entries, rng: random.Random) -> bytes:
    """Links, devices, pipes, folders."""
    buffer = io.BytesIO()
    place = rng.randrange(len(entries))
    with zipfile.ZipFile(buffer, "w") as archive:
        for number, (name, content) in enumerate(entries):
            info = zipfile.ZipInfo(name)
            if number == place:
                kinds = (0o120777, 0o060666, 0o010644, 0o040755, 0o020666, 0)
                info.external_attr = rng.choice(kinds) << 16
                info.flag_bits |= rng.choice((0, 1, 8, 0x800))
                info.create_system = rng.choice((0, 3, 255))
            archive.writestr(info, content)
    return buffer.getvalue()


def _growth(entries: Entries, rng: random.Random) -> bytes:
    """Much that is nothing."""
    size = rng.choice((1 << 20, 1 << 25))
    more = [("resources/zeros", bytes(size))]
    if rng.random() < 0.3:
        more = [(f"resources/{i}", b"") for i in range(3000)]
    return archived([*entries, *more], zipfile.ZIP_DEFLATED)


def _frame(entries: Entries, rng: random.Random) -> bytes:
    """Bytes of local headers and of the directory, which say where and how long entries are."""
    content = bytearray(archived(entries))
    places = [
        i for i in range(len(content) - 4) if content[i : i + 2] == b"PK" and content[i + 2] < 8
    ]
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.choice(places) + rng.randrange(46)
        number = rng.choice((0, 1, 0xFFFF, 0xFFFFFFFF, 0x7FFFFFFF, rng.getrandbits(32)))
        size = rng.choice((1, 2, 4))
        piece = struct.pack("<I", number)[:size]
        content[at : at + size] = piece[: len(content) - at]
    return bytes(content)


def _bytes(entries: Entries, rng: random.Random) -> bytes:
    return mutated_bytes(archived(entries), rng)


def _around(entries: Entries, rng: random.Random) -> bytes:
    content = archived(entries)
    ways: tuple[Callable[[], bytes], ...] = (
        lambda: rng.randbytes(rng.choice((1, 100))) + content,
        lambda: content + rng.randbytes(rng.choice((1, 100))),
        lambda: content + content,
        lambda: content[: rng.randrange(len(content))],
        lambda: content[rng.randrange(len(content)) :],
        lambda: archived([("inner.fmu", content)]),
        lambda: b"",
        lambda: bytes(1000),
        lambda: b"PK\x05\x06" + bytes(18),
    )
    return rng.choice(ways)()


def _library(entries: Entries, rng: random.Random) -> bytes:
    """A library that was cut, or that is none; never other machine code, which would be run."""
    found = list(entries)
    places = [i for i, (name, _) in enumerate(found) if name.endswith(".so")]
    for place in places:
        name, content = found[place]
        cut = rng.choice((0, 4, 20, 64, 1000, len(content) // 2, len(content) - 1))
        found[place] = (name, rng.choice((content[:cut], b"", b"#!/bin/sh\n", bytes(cut))))
    return archived(found)


_Way: TypeAlias = Callable[[Entries, random.Random], bytes]

WAYS: Final[Mapping[str, _Way]] = {
    "XML: value": _of_xml(_value),
    "XML: attribute": _of_xml(_attribute),
    "XML: element removed": _of_xml(_remove),
    "XML: element repeated": _of_xml(_repeat),
    "XML: element renamed": _of_xml(_rename),
    "XML: text": _of_xml(_text),
    "XML: nesting": _of_xml(_nested),
    "XML: bytes": _xml_bytes,
    "XML: markup": _markup,
    "ZIP: entry": _entry,
    "ZIP: method": _method,
    "ZIP: mode": _mode,
    "ZIP: growth": _growth,
    "ZIP: headers": _frame,
    "ZIP: bytes": _bytes,
    "ZIP: around": _around,
    "library cut": _library,
}
"""What can be done to an archive, by name."""
