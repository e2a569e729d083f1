"""What a shared library is made for, from its first bytes: ELF, PE or Mach-O."""

import struct
from dataclasses import dataclass
from typing import Final

from typing_extensions import override

HEAD: Final = 4096
"""How much of a library is enough to tell [byte]."""

_ELF: Final = {
    3: "x86",
    8: "mips",
    20: "ppc",
    21: "ppc64",
    22: "s390x",
    40: "arm",
    62: "x86_64",
    183: "aarch64",
    243: "riscv64",
}
_PE: Final = {0x14C: "x86", 0x1C4: "arm", 0x8664: "x86_64", 0xAA64: "aarch64"}
_MACH_O: Final = {7: "x86", 12: "arm", 0x1000007: "x86_64", 0x100000C: "aarch64"}

_FORMATS: Final = {"linux": "ELF", "windows": "PE", "darwin": "Mach-O"}
_ELF_LIBRARY: Final = 3
_LOADED: Final = 1  # PT_LOAD
_MOST_SLICES: Final = 16  # Java's classes start like Mach-O's universal binaries


@dataclass(frozen=True, slots=True)
class Binary:
    """What a library is made for.

    Attributes:
        format: `ELF`, `PE` or `Mach-O`.
        architectures: one or, in a universal binary, several.
    """

    format: str
    architectures: tuple[str, ...]

    @override
    def __str__(self) -> str:
        return f"{self.format} for {' and '.join(self.architectures)}"

    def runs_on(self, platform: str) -> bool:
        """Whether a process of `platform` can load it, e.g. `x86_64-linux`."""
        (architecture,) = needed(platform).architectures
        return self.format == needed(platform).format and architecture in self.architectures


def needed(platform: str) -> Binary:
    """What a process of `platform` can load, e.g. `x86_64-linux`."""
    architecture, _, system = platform.rpartition("-")
    return Binary(_FORMATS.get(system, system), (architecture,))


def identify(head: bytes) -> Binary | None:
    """What the library that starts with `head` is made for; `None` if it is no shared library."""
    try:
        return _elf(head) or _pe(head) or _mach_o(head) or _universal(head)
    except struct.error:
        return None  # it ends too early


def extent(head: bytes) -> int:
    """How much of the file of the ELF library that starts with `head` is loaded [byte].

    Linux does not compare that with the size of the file: a process that loads a library that was
    cut is killed when it comes to what is missing. Other systems refuse one themselves: 0.
    """
    is_64, order = head[4:5] == b"\x02", ">" if head[5:6] == b"\x02" else "<"
    at, counts = (32, 54) if is_64 else (28, 42)
    # System V ABI, chapter 5: type, then offset and size in the file
    row = f"{order}I4xQ16xQ" if is_64 else f"{order}II8xI"
    try:
        if head[:4] != b"\x7fELF":
            return 0
        (table,) = struct.unpack_from(f"{order}Q" if is_64 else f"{order}I", head, at)
        size, count = struct.unpack_from(f"{order}HH", head, counts)
        rows = [struct.unpack_from(row, head, table + size * k) for k in range(count)]
    except struct.error:
        return 0
    return max((start + length for kind, start, length in rows if kind == _LOADED), default=0)


def _elf(head: bytes) -> Binary | None:
    if head[:4] != b"\x7fELF":
        return None
    order = ">" if head[5:6] == b"\x02" else "<"
    kind, machine = struct.unpack_from(f"{order}HH", head, 16)
    return Binary("ELF", (_name(_ELF, machine),)) if kind == _ELF_LIBRARY else None


def _pe(head: bytes) -> Binary | None:
    if head[:2] != b"MZ":
        return None
    (start,) = struct.unpack_from("<I", head, 0x3C)
    signature, machine = struct.unpack_from("<4sH", head, start)
    return Binary("PE", (_name(_PE, machine),)) if signature == b"PE\0\0" else None


def _mach_o(head: bytes) -> Binary | None:
    if head[:4] not in {b"\xcf\xfa\xed\xfe", b"\xce\xfa\xed\xfe"}:
        return None
    return Binary("Mach-O", (_name(_MACH_O, struct.unpack_from("<I", head, 4)[0]),))


def _universal(head: bytes) -> Binary | None:
    if head[:4] not in {b"\xca\xfe\xba\xbe", b"\xca\xfe\xba\xbf"}:
        return None
    size = 20 if head[3] == 0xBE else 32
    (count,) = struct.unpack_from(">I", head, 4)
    if not 0 < count <= _MOST_SLICES:
        return None
    types = [struct.unpack_from(">I", head, 8 + size * i)[0] for i in range(count)]
    return Binary("Mach-O", tuple(_name(_MACH_O, type_) for type_ in types))


def _name(names: dict[int, str], machine: int) -> str:
    return names.get(machine, f"machine {machine:#x}")
