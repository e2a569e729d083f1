"""The outputs of one unit in memory: signals of fixed size, one after the other."""

import ctypes
import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from orchestrator.native import NativePlace
from orchestrator.plan.layouts import Bytes, Source
from orchestrator.signal import Array, Connector, Signal, Signals

_POINTER: Final = ctypes.sizeof(ctypes.c_void_p)
_SMALL: Final = 256
"""So many bytes are copied once more sooner than looked at in place."""


class Outputs:
    """The outputs of one unit.

    Args:
        connectors: the outputs, in the order in which they lie in memory.
        shapes: of those that are arrays, over the whole run.
        block: memory for the arrays; without, it is made here.

    Attributes:
        places: of the outputs that are arrays.
        binaries: names of those of type Binary, in order.
        block: the arrays, a multiple of 8 bytes, shape (byte,).
        bytes: the Binary values.
        bases: the addresses of both.
    """

    def __init__(
        self,
        connectors: Mapping[str, Connector],
        shapes: Mapping[str, tuple[int, ...]],
        block: Array | None = None,
    ) -> None:
        self.places: dict[str, NativePlace] = {}
        self.binaries = [name for name, c in connectors.items() if c.is_binary]
        end = 0
        for name, connector in connectors.items():
            if connector.is_binary:
                continue
            dtype = np.dtype(connector.dtype)
            shape = shapes[name]
            offset = -(-end // dtype.itemsize) * dtype.itemsize
            size = dtype.itemsize * math.prod(shape)
            self.places[name] = NativePlace(offset, size, dtype, shape)
            end = offset + size
        size = -(-max(end, 1) // 8) * 8
        self.block: Array = np.zeros(size, np.uint8) if block is None else block
        self._view = self.block.data
        self.bytes = (Bytes * max(len(self.binaries), 1))()
        self.bases = (ctypes.c_void_p * 2)(self.block.ctypes.data, ctypes.addressof(self.bytes))

    def offset(self, name: str) -> int:
        """Where an array begins in the block, or a `Bytes` among those [byte]."""
        if name in self.places:
            return self.places[name].offset
        return self.binaries.index(name) * ctypes.sizeof(Bytes)

    def source(self, name: str, version: int) -> Source:
        """An output of this memory, which stays where it is.

        Args:
            name: of the output.
            version: the address of what counts its values.
        """
        base = ctypes.addressof(self.bases) + (0 if name in self.places else _POINTER)
        return Source(base, self.offset(name), version)

    def put(self, name: str, value: Signal, library: Any) -> None:
        """Write one output."""
        if isinstance(value, bytes):
            failed = library.plan_assign(self.bytes[self.binaries.index(name)], value, len(value))
            if failed:
                raise MemoryError(f"no room for {len(value)} bytes of `{name}`")
            return
        place = self.places[name]
        is_small = place.size <= _SMALL
        self._view[place.offset : place.offset + place.size] = (
            value.tobytes() if is_small else np.ascontiguousarray(value).data.cast("B")
        )

    def values(self) -> Signals:
        """A copy of all outputs; the arrays are read-only."""
        copy = self.block.tobytes()
        found: dict[str, Signal] = {}
        for name, place in self.places.items():
            found[name] = np.ndarray(place.shape, place.dtype, copy, place.offset)
        for name, each in zip(self.binaries, self.bytes, strict=False):
            found[name] = ctypes.string_at(each.data, each.size) if each.size else b""
        return found

    def release(self, library: Any) -> None:
        """Free what the engine allocated."""
        for each in self.bytes:
            library.plan_release(each)
