"""The codec of APM messages, compiled from the sources of the FMU."""

import ctypes
from ctypes import byref, c_size_t
from pathlib import Path
from typing import Final

from fmus.messages.apm import Apm
from fmus.native.unit import compile_parts, load_unit
from tests.fmus.driver import Refused

_SOURCES: Final = (
    "apm.c",
    "compression.c",
    "range_coder.c",
    "seen_compression.c",
    "kernel.c",
    "portable_math.c",
)


class NativeCodec:
    """The compiled library."""

    def __init__(self, folder: Path) -> None:
        wrapper = Path(__file__).with_suffix(".c")
        self._library = compile_parts(
            load_unit("perception"), _SOURCES, wrapper=wrapper, folder=folder
        )
        self._library.compressed.restype = c_size_t
        self.taken = 0
        """Bytes of memory that the last call of `decode` took."""

    def compress(self, apm: Apm, capacity: int) -> bytes | None:
        """The compressed form of cells and layer in at most `capacity` bytes, if there is one."""
        out = ctypes.create_string_buffer(capacity + 1)
        layer = None if apm.layer is None else apm.layer.tobytes()
        cells = apm.cells.tobytes()
        size: int = self._library.compressed(
            out, c_size_t(capacity), cells, layer, *apm.cells.shape, apm.levels
        )
        assert out.raw[capacity] == 0, "written beyond the capacity"
        return out.raw[:size] or None

    def decode(self, message: bytes) -> bytes:
        """The cells and then the layer in `message`.

        Raises:
            Refused: the message is malformed.
        """
        used, taken, why = c_size_t(), c_size_t(), ctypes.create_string_buffer(256)
        out = ctypes.create_string_buffer(8 << 20)
        refused = self._library.decoded(
            message, c_size_t(len(message)), out, c_size_t(len(out)), byref(used), byref(taken), why
        )
        self.taken = taken.value
        if refused:
            raise Refused(why.value.decode())
        return out.raw[: used.value]
