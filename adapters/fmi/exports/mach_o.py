"""The exports of Mach-O: the trie of the dynamic linker, or the table of symbols of older files.

Names are those of mach-o/loader.h of Apple's open-source headers; the trie is described in
mach-o/loader.h at `dyld_info_command`.
"""

import struct
from collections.abc import Iterator
from typing import Final

from adapters.fmi.exports.names import LONGEST, text_at

MAGIC: Final = frozenset({b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe"})
"""How files for one architecture begin; those of Mac OS 9's time, big-endian, are not known."""

UNIVERSAL: Final = frozenset({b"\xca\xfe\xba\xbe", b"\xca\xfe\xba\xbf"})
"""How files for several architectures begin."""

_MOST_PARTS: Final = 16

_SYMTAB: Final = 0x2
_DYLD_INFO: Final = frozenset({0x22, 0x80000022})
_EXPORTS_TRIE: Final = 0x80000033

_DEBUGGING, _PRIVATE, _TYPE, _EXTERNAL = 0xE0, 0x10, 0x0E, 0x01


def parts(binary: bytes) -> Iterator[bytes]:
    """The files for each architecture in a universal one.

    Raises:
        struct.error, ValueError: it is damaged.
    """
    (count,) = struct.unpack_from(">I", binary, 4)
    if not 0 < count <= _MOST_PARTS:
        raise ValueError(f"it says that it has {count} parts")
    form, size = (">QQ", 32) if binary[3] == 0xBF else (">II", 20)
    for k in range(count):
        place, length = struct.unpack_from(form, binary, 8 + size * k + 8)
        yield binary[place : place + length]


def exported(binary: bytes) -> Iterator[str]:
    """The exported names, as C writes them: without the underscore before each.

    Raises:
        struct.error, IndexError, ValueError: the file is damaged, or no Mach-O.
    """
    if binary[:4] not in MAGIC:
        raise ValueError("a part is no Mach-O")
    found = list(_commands(binary))
    tries = [
        (place + offset)
        for kind, place in found
        for offset in ((40,) if kind in _DYLD_INFO else (8,) if kind == _EXPORTS_TRIE else ())
    ]
    if tries:
        for place in tries:
            start, size = struct.unpack_from("<II", binary, place)
            yield from _plain(_leaves(binary[start : start + size]))
        return
    for kind, place in found:
        if kind == _SYMTAB:
            yield from _plain(_symbols(binary, place))


def _plain(names: Iterator[str]) -> Iterator[str]:
    return (name[1:] for name in names if name.startswith("_"))


def _commands(binary: bytes) -> Iterator[tuple[int, int]]:
    """Kind and place of each load command."""
    (count,) = struct.unpack_from("<I", binary, 16)
    place = 32 if binary[0] == 0xCF else 28
    for _ in range(count):
        kind, size = struct.unpack_from("<II", binary, place)
        if size < 8:
            raise ValueError(f"a load command has {size} bytes")
        yield kind, place
        place += size


def _leaves(trie: bytes) -> Iterator[str]:
    """The names in a trie; nodes that lead back are not followed again."""
    if not trie:
        return
    seen, waiting = {0}, [(0, b"")]
    while waiting:
        place, name = waiting.pop()
        size, place = _number(trie, place)
        if size:
            yield name.decode("utf-8", "replace")
        place += size
        count = trie[place]
        place += 1
        for _ in range(count):
            end = trie.index(b"\0", place, place + LONGEST - len(name))
            child, after = _number(trie, end + 1)
            if child not in seen:
                seen.add(child)
                waiting.append((child, name + trie[place:end]))
            place = after


def _number(data: bytes, place: int) -> tuple[int, int]:
    """An unsigned number in LEB128, and where it ends."""
    value = shift = 0
    while True:
        byte = data[place]
        place += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if not byte & 0x80:
            return value, place


def _symbols(binary: bytes, command: int) -> Iterator[str]:
    """The external symbols that are defined here."""
    start, count, names, length = struct.unpack_from("<IIII", binary, command + 8)
    size = 16 if binary[0] == 0xCF else 12
    text = binary[names : names + length]
    for k in range(count):
        name, kind = struct.unpack_from("<IB", binary, start + size * k)
        is_defined = not kind & _DEBUGGING and kind & _TYPE
        if is_defined and kind & _EXTERNAL and not kind & _PRIVATE:
            yield text_at(text, name)
