"""What a shared library exports, whichever format it has."""

import struct

from adapters.fmi.exports import elf, mach_o, pe


class ExportsError(ValueError):
    """The table of exports of a library cannot be read; a sentence."""


def exported(binary: bytes) -> frozenset[str]:
    """The names that a library exports.

    Args:
        binary: the file. Of a universal one, what all of its parts export.

    Raises:
        ExportsError: it is of no format that we know, or its table is damaged.
    """
    try:
        if binary[:4] == b"\x7fELF":
            return frozenset(elf.exported(binary))
        if binary[:2] == b"MZ":
            return frozenset(pe.exported(binary))
        if binary[:4] in mach_o.MAGIC:
            return frozenset(mach_o.exported(binary))
        if binary[:4] in mach_o.UNIVERSAL:
            parts = [frozenset(mach_o.exported(part)) for part in mach_o.parts(binary)]
            return frozenset.intersection(*parts)
    except (struct.error, IndexError, ValueError, OverflowError) as error:
        raise ExportsError(f"its table of exported functions is damaged: {error}") from error
    raise ExportsError("it is no shared library: neither ELF nor PE nor Mach-O")
