"""Memory that both ends of a link see, so that large values need not travel.

A transport between processes of one machine offers `SharedMemory`; a value then travels as its
place. `NothingShared` is the memory of all other transports.
"""

import abc
import sys
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.remote.segment import PlaceError, Segment
from orchestrator.signal import Array


class SharedMemory(abc.ABC):
    """One end of the memory that a link shares.

    Attributes:
        least: the smallest value that is worth a place [byte].
    """

    least: int

    @abc.abstractmethod
    def place(self, value: Array | bytes) -> int:
        """Have `value` where the peer can see it; it must not change any more.

        Args:
            value: an array of elements that are plain bytes, any shape; or bytes.

        Returns:
            Its place, which the peer gets once for every call.
        """

    @abc.abstractmethod
    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        """The array that the peer has at `place`, read-only, where it is; call it once.

        Args:
            place: where it is.
            shape: any.
            dtype: of its elements.

        Raises:
            PlaceError: there is no such place.
        """

    @abc.abstractmethod
    def reserve(self, size: int) -> tuple[int, Array]:
        """Memory that the peer sees, and nobody else, as long as both live.

        Args:
            size: how much [byte].

        Returns:
            Its place, and the memory itself, to be written at any time: uint8, shape (size,).
        """

    @abc.abstractmethod
    def mapped(self, place: int, size: int) -> Array:
        """What the peer has reserved: uint8, shape (size,), read-only; it changes.

        Args:
            place: where it is.
            size: [byte].

        Raises:
            PlaceError: there is no such place.
        """

    @abc.abstractmethod
    def arrive(self, places: Sequence[int], segments: Sequence[tuple[int, int, int]]) -> None:
        """Take what came beside a message.

        Args:
            places: those that the peer does not need any more.
            segments: number, size [byte] and descriptor of each that the peer has not used yet.

        Raises:
            PlaceError: they are not the peer's.
        """

    @abc.abstractmethod
    def leave(self) -> tuple[Sequence[int], Sequence[Segment]]:
        """What has to go beside the next message: places and segments, as for `arrive`."""

    @abc.abstractmethod
    def read(self, place: int, length: int, signal: int) -> bytes:
        """A copy of `length` bytes that the peer has at `place`; call it once.

        Handed on as the object that it is, it need not be copied again, until the next value of the
        same signal comes.

        Args:
            place: where they are.
            length: how many.
            signal: the number of the signal of this link whose value they are.

        Raises:
            PlaceError: there is no such place.
        """


class NothingShared(SharedMemory):
    """Every value travels."""

    least = sys.maxsize

    @override
    def place(self, value: Array | bytes) -> int:
        raise AssertionError

    @override
    def array(self, place: int, shape: tuple[int, ...], dtype: "np.dtype[Any]") -> Array:
        raise PlaceError("no memory is shared with the peer")

    @override
    def reserve(self, size: int) -> tuple[int, Array]:
        raise PlaceError("no memory is shared with the peer")

    @override
    def mapped(self, place: int, size: int) -> Array:
        raise PlaceError("no memory is shared with the peer")

    @override
    def arrive(self, places: Sequence[int], segments: Sequence[tuple[int, int, int]]) -> None:
        raise PlaceError("no memory is shared with the peer")

    @override
    def leave(self) -> tuple[Sequence[int], Sequence[Segment]]:
        return (), ()

    @override
    def read(self, place: int, length: int, signal: int) -> bytes:
        raise PlaceError("no memory is shared with the peer")


NOTHING_SHARED: Final = NothingShared()
