"""Whether a shared library can remember anything outside its instances.

Two instances in one library disturb each other if its code can change memory that belongs to the
library: global and static variables. What the loader writes is no such memory: it protects tables
of addresses against changes before any code runs (the segment `PT_GNU_RELRO`), or fills slots of
them when a function is first called. Everything here is a proof from the file, of ELF for 64 bits
(System V ABI, chapters 4 and 5); where it does not succeed, the library may remember something.
"""

import re
import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Final, TypeAlias

from adapters.fmi.exports.elf import Section, sections_of
from adapters.fmi.exports.names import text_at

Range: TypeAlias = tuple[int, int]
"""Addresses from the first to before the second."""

_LOAD, _DYNAMIC, _TLS, _RELRO = 1, 2, 7, 0x6474E552
_WRITABLE: Final = 2
_SYMTAB, _RELA, _DYNSYM = 2, 4, 11
_JUMP_SLOT: Final = {62: 7, 183: 1026}
"""The relocation of a slot for the address of a function, by machine: x86-64, AArch64."""
_WORD: Final = 8
_RESERVED: Final = 3 * _WORD
"""What a table of slots begins with: the loader's own."""

_NEEDED, _PLTGOT, _SYMBOLS, _INIT, _FINI, _JMPREL = 1, 3, 6, 12, 13, 23
_INIT_ARRAY, _FINI_ARRAY, _INIT_SIZE, _FINI_SIZE = 25, 26, 27, 28
_PREINIT_ARRAY, _AUXILIARY, _FILTER = 32, 0x7FFFFFFD, 0x7FFFFFFF

_C_LIBRARY: Final = re.compile(r"(lib(c|m|dl|pthread|rt)|ld-linux(-[\w-]+)?)\.so\.\d+")
_TELLS_COPIES_APART: Final = re.compile(
    r"_?dl.*|(pkey_)?mprotect|(__cxa_)?(at_quick_exit|atexit)|on_exit|.*atfork"
)
"""Functions that know which library calls, or change what it may write."""

_OBJECT, _FILE = 1, 4
_START_FILE: Final = "crtstuff.c"
_START_CODE: Final = {
    _INIT: "_init",
    _FINI: "_fini",
    _INIT_ARRAY: "__frame_dummy_init_array_entry",
    _FINI_ARRAY: "__do_global_dtors_aux_fini_array_entry",
}
"""What a compiler adds to every library: by the entry of the dynamic table that names it."""


def remembers_nothing(library: bytes) -> bool:
    """Whether the file of a library proves that its code changes no memory but that of instances.

    It has no variables of a thread and no writable memory but what the loader fills and what the
    compiler's own start code (`crtstuff.c`) counts, which the table of symbols must say; nothing
    of its own runs when it is loaded or unloaded; it needs nothing but the C library, of which it
    calls no function that tells one copy of a library from another.

    Args:
        library: the file. Anything else than a sound one proves nothing.
    """
    try:
        return _is_proven(library)
    except (struct.error, IndexError, ValueError, OverflowError):
        return False


@dataclass(frozen=True, slots=True)
class _Segment:
    kind: int
    flags: int
    place: int
    address: int
    size: int

    @property
    def span(self) -> Range:
        return self.address, self.address + self.size


@dataclass(frozen=True, slots=True)
class _Symbol:
    name: str
    info: int
    section: int
    address: int
    size: int

    @property
    def kind(self) -> int:
        return self.info & 15


def _is_proven(library: bytes) -> bool:
    if library[:6] != b"\x7fELF\x02\x01":
        return False
    (machine,) = struct.unpack_from("<H", library, 18)
    segments = list(_segments(library))
    if machine not in _JUMP_SLOT or any(each.kind == _TLS for each in segments):
        return False
    sections = list(sections_of(library, "<", is_64=True))
    (dynamic,) = (each for each in segments if each.kind == _DYNAMIC)
    entries = list(_entries(library, dynamic))
    writable = [s.span for s in segments if s.kind == _LOAD and s.flags & _WRITABLE]
    filled = [segment.span for segment in segments if segment.kind == _RELRO]
    filled += _slots(library, sections, dict(entries), _JUMP_SLOT[machine])
    if _rest(writable, filled) > 2 * _WORD:
        return False  # more than start code has; most libraries are done with here
    told = next((each for each in sections if each.kind == _SYMTAB), None)
    start = _start_code(_symbols(library, sections, told)) if told else {}
    filled += [span for name, span in start.items() if name in {"completed", "__dso_handle"}]
    return (
        not _rest(writable, filled)
        and _runs_only(start, entries)
        and _leans_on_the_c_library(library, sections, entries)
    )


def _segments(library: bytes) -> Iterator[_Segment]:
    (table,) = struct.unpack_from("<Q", library, 32)
    size, count = struct.unpack_from("<HH", library, 54)
    for k in range(count):
        yield _Segment(*struct.unpack_from("<IIQQ16xQ", library, table + k * size))


def _entries(library: bytes, table: _Segment) -> Iterator[tuple[int, int]]:
    """Tag and value of the entries of the dynamic table, until its end."""
    for at in range(table.place, table.place + table.size, 2 * _WORD):
        tag, value = struct.unpack_from("<qQ", library, at)
        if tag == 0:
            return
        yield tag, value
    raise ValueError("the dynamic table does not end")


def _symbols(library: bytes, sections: list[Section], table: Section) -> Iterator[_Symbol]:
    names = sections[table.link]
    text = library[names.place : names.place + names.size]
    for at in range(table.place, table.place + table.size, table.entry):
        name, info, section, address, size = struct.unpack_from("<IBxHQQ", library, at)
        yield _Symbol(text_at(text, name), info, section, address, size)


def _leans_on_the_c_library(
    library: bytes, sections: list[Section], entries: list[tuple[int, int]]
) -> bool:
    """Whether only the C library is needed, and nothing of it that tells copies apart."""
    (symbols,) = (each for each in sections if each.kind == _DYNSYM)
    if dict(entries).get(_SYMBOLS) != symbols.address:
        return False  # the loader reads another table than we do
    names = sections[symbols.link]
    text = library[names.place : names.place + names.size]
    needed = [text_at(text, value) for tag, value in entries if tag == _NEEDED]
    imported = (each.name for each in _symbols(library, sections, symbols) if not each.section)
    return all(map(_C_LIBRARY.fullmatch, needed)) and not any(
        map(_TELLS_COPIES_APART.fullmatch, imported)
    )


def _start_code(symbols: Iterable[_Symbol]) -> dict[str, Range]:
    """What is known of the compiler's start code by name; the names of variables lose their number.

    Nothing if there is none: then somebody else may have written functions of these names.
    """
    found: dict[str, Range] = {}
    file = ""
    for each in symbols:
        if each.kind == _FILE:
            file = each.name
        elif file == _START_FILE and each.kind == _OBJECT and each.name.startswith("completed."):
            found["completed"] = (each.address, each.address + each.size)
        elif each.name in {"__dso_handle", *_START_CODE.values()}:
            found[each.name] = (each.address, each.address + _WORD)
    return found if "completed" in found else {}


def _runs_only(start: dict[str, Range], entries: list[tuple[int, int]]) -> bool:
    """Whether nothing but the start code runs when the library comes and goes."""
    for tag, value in entries:
        if tag in {_PREINIT_ARRAY, _AUXILIARY, _FILTER}:
            return False
        if tag in _START_CODE and start.get(_START_CODE[tag], (0, 0))[0] != value:
            return False
        if tag in {_INIT_SIZE, _FINI_SIZE} and value != _WORD:
            return False
    return True


def _slots(
    library: bytes, sections: list[Section], entries: dict[int, int], jump_slot: int
) -> Iterator[Range]:
    """Where the loader writes addresses of functions, at the latest when they are first called."""
    if _JMPREL not in entries:
        return
    (table,) = (s for s in sections if s.kind == _RELA and s.address == entries[_JMPREL])
    places = range(table.place, table.place + table.size, table.entry)
    for k, at in enumerate(places):
        slot, info = struct.unpack_from("<QQ", library, at)
        if k == 0 and slot - entries.get(_PLTGOT, slot) == _RESERVED:
            yield slot - _RESERVED, slot
        if info & 0xFFFFFFFF == jump_slot:
            yield slot, slot + _WORD


def _rest(spans: Iterable[Range], filled: Iterable[Range]) -> int:
    """How many addresses of `spans` are in none of `filled`."""
    rest = 0
    for at, end in spans:
        for begin, until in sorted(filled):
            rest += max(min(begin, end) - at, 0)
            at = max(at, until)  # noqa: PLW2901  (what is left of the span)
        rest += max(end - at, 0)
    return rest
