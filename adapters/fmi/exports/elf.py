"""The dynamic symbols of ELF (System V ABI, chapters 4 and 5)."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from adapters.fmi.exports.names import text_at

_DYNSYM: Final = 11
_GLOBAL, _WEAK, _UNIQUE = 1, 2, 10
_ANY_TYPE, _FUNCTION, _INDIRECT = 0, 2, 10
_DEFAULT, _PROTECTED = 0, 3


@dataclass(frozen=True, slots=True)
class Section:
    """A row of the table of sections.

    Attributes:
        kind: of the section, `sh_type`.
        address: where it lies in memory.
        place: where it lies in the file [byte].
        size: of it [byte].
        link: the index of the section that belongs to it.
        entry: the size of its rows [byte].
    """

    kind: int
    address: int
    place: int
    size: int
    link: int
    entry: int


def exported(binary: bytes) -> Iterator[str]:
    """The functions that are defined here and seen from outside.

    Raises:
        struct.error, IndexError, ValueError: the file is damaged, or has no dynamic symbols.
    """
    is_64 = binary[4] == 2
    order = "<" if binary[5] == 1 else ">"
    sections = list(sections_of(binary, order, is_64=is_64))
    table = next((section for section in sections if section.kind == _DYNSYM), None)
    if table is None:
        raise ValueError("there are no dynamic symbols")
    names = sections[table.link]
    text = binary[names.place : names.place + names.size]
    for place in range(table.place, table.place + table.size, table.entry):
        name, info, other, where = _symbol(binary, order, place, is_64=is_64)
        binding, kind = info >> 4, info & 15
        is_function = kind in {_ANY_TYPE, _FUNCTION, _INDIRECT}
        is_seen = other & 3 in {_DEFAULT, _PROTECTED} and binding in {_GLOBAL, _WEAK, _UNIQUE}
        if where and is_function and is_seen:
            yield text_at(text, name)


def _symbol(binary: bytes, order: str, place: int, *, is_64: bool) -> tuple[int, int, int, int]:
    """Name, binding and type, visibility, and section of a symbol; section 0 is none."""
    if is_64:
        name, info, other, where = struct.unpack_from(f"{order}IBBH", binary, place)
    else:
        name, info, other, where = struct.unpack_from(f"{order}I8xBBH", binary, place)
    return name, info, other, where


def sections_of(binary: bytes, order: str, *, is_64: bool) -> Iterator[Section]:
    """The table of sections, in the byte order `order` of `struct`.

    Raises:
        struct.error: it is damaged.
    """
    if is_64:
        (table,) = struct.unpack_from(f"{order}Q", binary, 40)
        size, count = struct.unpack_from(f"{order}HH", binary, 58)
        form = f"{order}4xI8xQQQI12xQ"
    else:
        (table,) = struct.unpack_from(f"{order}I", binary, 32)
        size, count = struct.unpack_from(f"{order}HH", binary, 46)
        form = f"{order}4xI4xIIII8xI"
    for k in range(count):
        yield Section(*struct.unpack_from(form, binary, table + k * size))
