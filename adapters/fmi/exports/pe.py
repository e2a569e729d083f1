"""The export directory of PE (Microsoft, PE Format, section 6.3)."""

import struct
from collections.abc import Iterator
from typing import Final

from adapters.fmi.exports.names import text_at

_PLUS: Final = 0x20B
"""The mark of the optional header of 64-bit files."""


def exported(binary: bytes) -> Iterator[str]:
    """The exported names; none if there is no export directory.

    Raises:
        struct.error, ValueError: the file is damaged.
    """
    (header,) = struct.unpack_from("<I", binary, 0x3C)
    (count,) = struct.unpack_from("<H", binary, header + 6)
    (size,) = struct.unpack_from("<H", binary, header + 20)
    optional = header + 24
    (mark,) = struct.unpack_from("<H", binary, optional)
    directory, length = struct.unpack_from("<II", binary, optional + (112 if mark == _PLUS else 96))
    if not directory or not length:
        return
    sections = [
        struct.unpack_from("<III", binary, optional + size + 40 * k + 12) for k in range(count)
    ]

    def at(address: int) -> int:
        """The place in the file of an address relative to the image."""
        for begin, raw, place in sections:
            if begin <= address < begin + raw:
                return int(address - begin + place)
        raise ValueError(f"the address {address:#x} is in no section")

    names, table = struct.unpack_from("<I4xI", binary, at(directory) + 24)
    if not names:
        return
    place = at(table)
    for k in range(names):
        (address,) = struct.unpack_from("<I", binary, place + 4 * k)
        yield text_at(binary, at(address))
