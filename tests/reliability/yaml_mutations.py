"""Files of YAML, changed as nobody should write them."""

import copy
import random
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any, Final, TypeAlias

import yaml

Address: TypeAlias = tuple[str | int, ...]

_TEXTS: Final = (
    "", " ", "\0", "\x1b[2J", "\u2028", "\U0010ffff", "é" * 300, "a" * 100_000, "null", "~", "on",
    "1_000", "0x10", "1e3", "../../../../etc/passwd", "/dev/zero", "/dev/stdin", "/", ".", "..",
    "red_light.yaml", "a.b.c", "${HOME}", "{{x}}", "%s%n", "-1 s", "1 parsec", "5 kg",
    "1 m/s/s/s", "NaN m", "inf", "1e400 s", "0 s", "9e99 m", "1 s 2 s",
    "m", "os:system",
    "orchestrator.cli:main", "a b:c", ":", "x:", "builtins:eval",
    "\U0001d518", "\ud7ff", "=", "*", "&a", "!!python/none",
)  # fmt: skip

_NUMBERS: Final = (
    0, -1, 1, 2**31, 2**63, 2**64, -(2**63), 10**30, 10**400, 1e308, 5e-324, -0.0, 0.1,
    float("inf"), float("-inf"), float("nan"), 1e-9, 3.0000000001, 10**9, 65536,
)  # fmt: skip

_UNITS: Final = ("s", "ms", "km/h", "dBm", "m", "deg", "%", "B", "Hz", "mol", "", "µs", "°", "m²")

_LINES: Final = (
    "<<: *x", "a: &a [*a]", "\t- x", "? [1, 2]: 3", "- - - -", "%YAML 9.9", "---", "...",
    "!!set {a}", "key: |\n", "key: >-2\n x", "'", '"', '"\\U00110000"', '"\\ud800"',
    "!!binary AAAA", "? ", "{", "]",
    "2026-11-24: 2026-11-24T00:00:00Z", "yes: no", "a: b: c", "\ufeff", "\x85", "#" * 5000,
)  # fmt: skip


def addresses(data: Any, at: Address = ()) -> list[Address]:
    """Of all values but the whole."""
    found: list[Address] = []
    items = (
        data.items()
        if isinstance(data, dict)
        else enumerate(data)
        if isinstance(data, list)
        else ()
    )
    for key, value in items:
        found += [(*at, key), *addresses(value, (*at, key))]
    return found


def value_at(data: Any, address: Address) -> Any:
    """What is there."""
    for key in address:
        data = data[key]
    return data


def odd_value(rng: random.Random) -> Any:
    """Something that hardly anything expects."""
    return rng.choice(
        (
            lambda: rng.choice(_TEXTS),
            lambda: rng.choice(_NUMBERS),
            lambda: rng.choice((None, True, False, [], {}, [[]], {"": None}, [None], {"a": {}})),
            lambda: f"{rng.choice(_NUMBERS)} {rng.choice(_UNITS)}",
        )
    )()


def _set(data: Any, address: Address, value: Any) -> None:
    value_at(data, address[:-1])[address[-1]] = value


def _delete(data: Any, rng: random.Random) -> None:
    address = rng.choice(addresses(data))
    del value_at(data, address[:-1])[address[-1]]


def _duplicate(data: Any, rng: random.Random) -> None:
    """A value is repeated in its list, or under another key."""
    address = rng.choice(addresses(data))
    holder, value = value_at(data, address[:-1]), value_at(data, address)
    if isinstance(holder, list):
        holder.insert(rng.randrange(len(holder) + 1), copy.deepcopy(value))
    else:
        holder[f"{address[-1]}{rng.choice(('2', ' ', '', '.', '[0..3]', '{i}'))}"] = copy.deepcopy(
            value
        )


def _swap(data: Any, rng: random.Random) -> None:
    found = addresses(data)
    one, two = rng.choice(found), rng.choice(found)
    values = copy.deepcopy(value_at(data, one)), copy.deepcopy(value_at(data, two))
    _set(data, one, values[1])
    if two[: len(one)] != one:
        _set(data, two, values[0])


def _retype(data: Any, rng: random.Random) -> None:
    address = rng.choice(addresses(data))
    value = value_at(data, address)
    ways: tuple[Callable[[], Any], ...] = (
        lambda: [value],
        lambda: {"a": value},
        lambda: str(value),
        lambda: None,
        lambda: len(str(value)),
        lambda: bool(value),
        lambda: list(value) if isinstance(value, dict) else {str(value)[:9]: value},
    )
    _set(data, address, rng.choice(ways)())


def _number(data: Any, rng: random.Random) -> None:
    def is_number(value: Any) -> bool:
        return isinstance(value, int | float) or (
            isinstance(value, str) and value[:1].isdigit() and " " in value
        )

    found = [a for a in addresses(data) if is_number(value_at(data, a))] or addresses(data)
    address = rng.choice(found)
    value = value_at(data, address)
    number = rng.choice(_NUMBERS)
    unit = str(value).partition(" ")[2] if isinstance(value, str) else ""
    _set(data, address, f"{number} {unit}" if unit else number)


def _unit(data: Any, rng: random.Random) -> None:
    found = [
        a for a in addresses(data) if isinstance(v := value_at(data, a), str) and v[:1].isdigit()
    ] or addresses(data)
    address = rng.choice(found)
    number = str(value_at(data, address)).partition(" ")[0]
    _set(data, address, f"{number}{rng.choice((' ', '', '  '))}{rng.choice(_UNITS)}")


def _text(data: Any, rng: random.Random) -> None:
    found = [a for a in addresses(data) if isinstance(value_at(data, a), str)]
    _set(data, rng.choice(found or addresses(data)), rng.choice(_TEXTS))


def _odd(data: Any, rng: random.Random) -> None:
    _set(data, rng.choice(addresses(data)), odd_value(rng))


def _key(data: Any, rng: random.Random) -> None:
    """A key is misspelt, or odd."""
    found = [a for a in addresses(data) if isinstance(a[-1], str)]
    address = rng.choice(found or addresses(data))
    holder, key = value_at(data, address[:-1]), address[-1]
    if not isinstance(holder, dict):
        return
    text = str(key)
    place = rng.randrange(len(text) + 1)
    ways = (
        text[:place] + text[place + 1 :],
        text[:place] + rng.choice("abc.é[]{}0 /:\0"[:-1]) + text[place:],
        text.upper(),
        rng.choice(_TEXTS),
        rng.choice(_NUMBERS),
        f"{text}[0..{rng.choice((3, 0, -1, 10**9))}]",
    )
    holder[rng.choice(ways)] = holder.pop(key)


def _nesting(data: Any, rng: random.Random) -> None:
    address = rng.choice(addresses(data))
    value = value_at(data, address)
    for _ in range(rng.choice((3, 30, 70, 200))):
        value = [value] if rng.random() < 0.5 else {"a": value}
    _set(data, address, value)


_OF_DATA: Final[Mapping[str, Callable[[Any, random.Random], None]]] = {
    "delete": _delete,
    "duplicate": _duplicate,
    "swap": _swap,
    "retype": _retype,
    "extreme number": _number,
    "wrong unit": _unit,
    "odd text": _text,
    "odd value": _odd,
    "odd key": _key,
    "nesting": _nesting,
}


def _bytes(text: bytes, rng: random.Random) -> bytes:
    data = bytearray(text)
    for _ in range(rng.choice((1, 1, 2, 5, 20))):
        place = rng.randrange(len(data) + 1)
        way = rng.randrange(4)
        if way == 0 and place < len(data):
            data[place] ^= 1 << rng.randrange(8)
        elif way == 1:
            data[place:place] = bytes(rng.randrange(256) for _ in range(rng.choice((1, 3, 40))))
        elif way == 2:
            del data[place : place + rng.choice((1, 2, 9, 200))]
        else:
            other = rng.randrange(len(data) + 1)
            data[place:place] = data[other : other + rng.choice((1, 9, 300))]
    return bytes(data)


def _lines(text: bytes, rng: random.Random) -> bytes:
    lines = text.split(b"\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        place = rng.randrange(len(lines))
        way = rng.randrange(5)
        if way == 0:
            lines.insert(place, lines[rng.randrange(len(lines))])
        elif way == 1:
            lines[place] = b" " * rng.choice((1, 2, 7)) + lines[place]
        elif way == 2:
            lines[place] = lines[place].lstrip()
        elif way == 3:
            left = len(lines[place]) - len(lines[place].lstrip())
            lines.insert(place, b" " * left + rng.choice(_LINES).encode("utf-8"))
        else:
            del lines[place : place + rng.choice((1, 3))]
            lines.append(b"")
    return b"\n".join(lines)


def _aliases(text: bytes, rng: random.Random) -> bytes:
    """Anchors on values, and aliases of them elsewhere: loops, and a billion laughs."""
    lines = text.split(b"\n")
    keyed = [
        i for i, line in enumerate(lines) if b": " in line and not line.lstrip().startswith(b"#")
    ]
    if not keyed:
        return text
    way = rng.randrange(4)
    one = rng.choice(keyed)
    key, _, value = lines[one].partition(b": ")
    if way == 0:
        lines[one] = key + b": &x " + value
        for two in rng.sample(keyed, min(3, len(keyed))):
            if two != one:
                lines[two] = lines[two].partition(b": ")[0] + b": *x"
    elif way == 1:
        lines[one] = key + b": &x [*x]"
    elif way == 2:
        laughs = [b"[" + b",".join([b"a"] * 9) + b"]"]
        names = b"abcdefghijklm"
        text_ = b"&a " + laughs[0]
        for before, name in pairwise(names):
            refs = b",".join([b"*" + bytes([before])] * 9)
            text_ += b", &" + bytes([name]) + b" [" + refs + b"]"
        lines[one] = key + b": [" + text_ + b"]"
    else:
        lines[one] = key + b": *nowhere"
    return b"\n".join(lines)


def _size(text: bytes, rng: random.Random) -> bytes:
    """Much of something, or next to nothing."""
    ways: tuple[Callable[[], bytes], ...] = (
        lambda: b"",
        lambda: text[: rng.randrange(len(text))],
        lambda: text * rng.choice((2, 20)),
        lambda: text + b"\n" + b"".join(b"k%d: 1\n" % i for i in range(rng.choice((100, 30_000)))),
        lambda: b"[" * rng.choice((100, 50_000)),
        lambda: b"a: " * 5000,
        lambda: b"{a: " * 20_000,
        lambda: text.decode().encode("utf-16"),
        lambda: text.replace(b"\n", b"\r"),
        lambda: text.replace(b"\n", b"\r\n"),
        lambda: text.replace(b"  ", b"\t"),
        lambda: b"- " * 20_000,
    )
    return rng.choice(ways)()


_OF_TEXT: Final[Mapping[str, Callable[[bytes, random.Random], bytes]]] = {
    "bytes": _bytes,
    "lines": _lines,
    "aliases": _aliases,
    "size": _size,
}

WAYS: Final = (*_OF_DATA, *_OF_TEXT)
"""The names of what can be done to a file."""


def mutated_data(data: Any, rng: random.Random) -> Any:
    """A copy of `data`, changed in one of the ways that change its structure or its values."""
    whole = {"": copy.deepcopy(data)}
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if addresses(whole):
            _OF_DATA[rng.choice([*_OF_DATA])](whole, rng)
    return whole.get("", whole)


def mutated(text: bytes, way: str, rng: random.Random) -> bytes:
    """The file `text`, changed in one of `WAYS`, once or a few times."""
    if way in _OF_TEXT:
        return _OF_TEXT[way](text, rng)
    data = yaml.safe_load(text)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        if addresses(data):
            _OF_DATA[way](data, rng)
    try:
        written: str = yaml.safe_dump(data, sort_keys=False, allow_unicode=rng.random() < 0.5)
    except RecursionError:
        return b"a: " + b"[" * 500
    return written.encode("utf-8", errors="surrogatepass")
