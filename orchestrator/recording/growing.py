"""A `.npy` file that grows along its first axis and can be read at any time."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from orchestrator.disk import naming


class GrowingArray:
    """Appends rows to a `.npy` file.

    NumPy pads the header for a first axis of up to 21 digits, so that it can be rewritten in
    place. Rows are written first and the header afterwards: at no time does it promise more than
    the file holds, even if the process is killed in between. No file stays open. There is none
    before the first rows.
    """

    __slots__ = ("_descr", "_path", "_row_bytes", "_row_shape", "_written")

    def __init__(self, path: Path, dtype: "np.dtype[Any]", row_shape: tuple[int, ...] = ()) -> None:
        self._path = path
        self._descr = np.lib.format.dtype_to_descr(dtype)
        self._row_shape = row_shape
        self._row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        self._written = 0

    def append(self, rows: bytes | memoryview, count: int) -> None:
        """Write `count` rows, given in C order."""
        header = self._header(self._written + count)
        file = self._path.open("r+b" if self._written else "w+b", buffering=0)
        with naming(self._path), file:
            if not self._written:
                _write(file, self._header(0))
            # not the end of the file: an earlier attempt may have failed halfway
            file.seek(len(header) + self._written * self._row_bytes)
            _write(file, rows)
            file.seek(0)
            _write(file, header)
        self._written += count

    def remove(self) -> None:
        """Remove the file."""
        self._path.unlink()

    def _header(self, count: int) -> bytes:
        file = io.BytesIO()
        shape = (count, *self._row_shape)
        record = {"descr": self._descr, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, record)
        return file.getvalue()


def _write(file: io.FileIO, data: bytes | memoryview) -> None:
    """Write all of `data`; the system may take less at once."""
    rest = memoryview(data)
    while rest:
        rest = rest[file.write(rest) :]


def read_growing(path: Path) -> tuple[npt.NDArray[Any], str]:
    """The rows in a file that a `GrowingArray` writes or wrote, and what is wrong with it.

    Returns:
        The rows that are there from the first to the last byte, read-only, shape (row, ...);
        nothing, or how the
        file was cut, with the place.
    """
    data = path.read_bytes()
    file = io.BytesIO(data)
    try:
        np.lib.format.read_magic(file)
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    except ValueError:
        return np.zeros(0), f"`{path}` is damaged at byte 0: no header of an array" if data else ""
    start, row_bytes = file.tell(), dtype.itemsize * int(np.prod(shape[1:], dtype=np.int64))
    there = min(shape[0], (len(data) - start) // row_bytes) if row_bytes else shape[0]
    rows = np.ndarray((there, *shape[1:]), dtype, data, start)
    if there < shape[0]:
        return rows, f"`{path}` ends at byte {len(data)}, within row {there} of {shape[0]}"
    return rows, ""
