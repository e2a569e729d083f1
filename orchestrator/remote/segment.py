"""Pieces of memory without a name, which processes hand each other by descriptor.

Nothing of them is in a file system, so nothing is left when a process is killed: the system takes a
segment back when the last process that maps it is gone.
"""

import contextlib
import mmap
import os
import sys
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from orchestrator.errors import CosimError
from orchestrator.signal import Array

if sys.platform != "win32":
    import fcntl

OFFSET_BITS: Final = 40
"""A place is one integer: the offset in its lower bits, the number of the segment above."""

_MASK: Final = (1 << OFFSET_BITS) - 1
_LEAST_SEGMENT: Final = 1 << 24
_SEAL_FUTURE_WRITE: Final = 0x10
"""The seal is one of Linux 5.1; Python's `fcntl` has it from 3.13 on."""


class PlaceError(CosimError):
    """A place is not in memory that is shared."""


def can_share() -> bool:
    """Whether this system has such memory."""
    if sys.platform != "linux":
        return False
    try:
        os.close(os.memfd_create("nlosim"))
    except OSError:
        return False
    return True


@dataclass(frozen=True, slots=True)
class Segment:
    """A piece of memory that this process sees.

    Attributes:
        number: by which all processes know it.
        size: [byte].
        descriptor: to hand on.
        memory: the mapping; writable where the segment was made.
    """

    number: int
    size: int
    descriptor: int
    memory: mmap.mmap

    @classmethod
    def create(cls, number: int, size: int) -> "Segment":
        """A new one. Only this process can write it, and nobody can make it smaller."""
        descriptor = os.memfd_create("nlosim", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        os.ftruncate(descriptor, size)
        memory = mmap.mmap(descriptor, size)
        # who maps what another process cuts off is killed by the system
        fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK)
        with contextlib.suppress(OSError):  # older systems have no such seal
            fcntl.fcntl(descriptor, fcntl.F_ADD_SEALS, _SEAL_FUTURE_WRITE)
        return cls(number, size, descriptor, memory)

    @classmethod
    def attach(cls, number: int, size: int, descriptor: int) -> "Segment":
        """That of another process, to read.

        Raises:
            PlaceError: it is not as large as it is said to be.
        """
        if os.fstat(descriptor).st_size < size:
            raise PlaceError(f"segment {number} of {size} bytes is too small")
        seals = fcntl.fcntl(descriptor, fcntl.F_GET_SEALS)
        if not seals & fcntl.F_SEAL_SHRINK:
            raise PlaceError(f"segment {number} may become smaller")
        return cls(number, size, descriptor, mmap.mmap(descriptor, size, prot=mmap.PROT_READ))

    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        """The array at `place`, as a view.

        Args:
            place: where it is.
            shape: any.
            dtype: of its elements.

        Raises:
            PlaceError: it would reach beyond the segment.
        """
        if dtype.hasobject:
            raise PlaceError(f"elements of type {dtype} are addresses, which nobody shares")
        try:
            return np.ndarray(shape, dtype, self.memory, place & _MASK)
        except (TypeError, ValueError) as error:
            raise PlaceError(
                f"an array of {dtype}{list(shape)} in segment {self.number}: {error}"
            ) from None

    def read(self, place: int, length: int) -> bytes:
        """A copy of `length` bytes at `place`.

        Raises:
            PlaceError: they would reach beyond the segment.
        """
        offset = place & _MASK
        if offset + length > self.size:
            raise PlaceError(f"{length} bytes at {offset} of segment {self.number} do not exist")
        return self.memory[offset : offset + length]

    def close(self) -> None:
        """Close the descriptor; arrays stay as long as somebody has them."""
        os.close(self.descriptor)


class Arena:
    """Room for values that others see: places are given out, and given back when all are done.

    Args:
        owner: the number of this process; different for all that share, below 4096.
    """

    def __init__(self, owner: int) -> None:
        self._first = owner << 12
        self._segments: list[Segment] = []
        self._used = 0
        self._free: dict[int, list[int]] = {}
        self._sizes: dict[int, int] = {}

    @property
    def segments(self) -> list[Segment]:
        """All of them, oldest first."""
        return self._segments

    def place(self, value: Array | bytes) -> int:
        """Copy `value`, an array of any shape or bytes, to a place that nobody else has."""
        if isinstance(value, bytes):
            place, segment = self._room(len(value))
            offset = place & _MASK
            segment.memory[offset : offset + len(value)] = value
        else:
            place, segment = self._room(value.nbytes)
            np.ndarray(value.shape, value.dtype, segment.memory, place & _MASK)[...] = value
        return place

    def free(self, place: int) -> None:
        """Give a place back.

        Raises:
            PlaceError: it was not given out.
        """
        bits = self._sizes.get(place)
        if bits is None:
            raise PlaceError(f"there is no place {place} here")
        self._free[bits].append(place)

    def close(self) -> None:
        """Close all segments."""
        while self._segments:
            self._segments.pop().close()

    def _room(self, size: int) -> tuple[int, Segment]:
        """A free place for `size` bytes, rounded up to a power of two, and its segment."""
        bits = max(12, (size - 1).bit_length())
        free = self._free.setdefault(bits, [])
        place = free.pop() if free else self._fresh(bits)
        return place, self._segments[(place >> OFFSET_BITS) - self._first]

    def _fresh(self, bits: int) -> int:
        size = 1 << bits
        if not self._segments or self._used + size > self._segments[-1].size:
            number = self._first + len(self._segments)
            # large: only what is written takes memory, and few segments are few descriptors
            self._segments.append(Segment.create(number, max(_LEAST_SEGMENT, 4 * size)))
            self._used = 0
        place = self._segments[-1].number << OFFSET_BITS | self._used
        self._used += size
        self._sizes[place] = bits
        return place
