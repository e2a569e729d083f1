"""A `.npy` file that grows along its first axis and can be read at any time."""

import io
from pathlib import Path
from typing import Any

import numpy as np


class GrowingArray:
    """Appends rows to a `.npy` file.

    NumPy pads the header for a first axis of up to 21 digits, so that it can be rewritten in
    place. Rows are written first and the header afterwards: at no time does it promise more than
    the file holds, even if the process is killed in between. No file stays open.
    """

    __slots__ = ("_descr", "_path", "_row_bytes", "_row_shape", "_written")

    def __init__(self, path: Path, dtype: "np.dtype[Any]", row_shape: tuple[int, ...] = ()) -> None:
        self._path = path
        self._descr = np.lib.format.dtype_to_descr(dtype)
        self._row_shape = row_shape
        self._row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        self._written = 0
        path.write_bytes(self._header(0))

    def append(self, rows: bytes, count: int) -> None:
        """Write `count` rows, given in C order."""
        header = self._header(self._written + count)
        with self._path.open("r+b") as file:
            # not the end of the file: an earlier attempt may have failed halfway
            file.seek(len(header) + self._written * self._row_bytes)
            file.write(rows)
            file.flush()
            file.seek(0)
            file.write(header)
        self._written += count

    def content(self) -> bytes:
        """All rows, in C order."""
        with self._path.open("rb") as file:
            file.seek(len(self._header(self._written)))
            return file.read(self._written * self._row_bytes)

    def remove(self) -> None:
        """Remove the file."""
        self._path.unlink()

    def _header(self, count: int) -> bytes:
        file = io.BytesIO()
        shape = (count, *self._row_shape)
        record = {"descr": self._descr, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, record)
        return file.getvalue()
