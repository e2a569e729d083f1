"""A `.npy` file that grows along its first axis and can be read at any time."""

import errno
import io
from functools import lru_cache
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

    __slots__ = ("_after", "_before", "_path", "_row_bytes", "_written")

    def __init__(self, path: Path, dtype: "np.dtype[Any]", row_shape: tuple[int, ...] = ()) -> None:
        self._path = path
        self._before, self._after = _header(dtype, row_shape)
        self._row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        self._written = 0

    def replace(self, rows: bytes | memoryview, count: int) -> None:
        """Let the file, whatever was in it, have these rows; a reader finds either."""
        path = self._path
        self._path = path.with_name(f"{path.name}.draft")
        self.append(rows, count)
        with naming(path):
            self._path.replace(path)
        self._path = path

    def append(self, rows: bytes | memoryview, count: int) -> None:
        """Write `count` rows, given in C order."""
        header = self._header(self._written + count)
        file = self._path.open("r+b" if self._written else "w+b", buffering=0)
        with naming(self._path), file:
            if not self._written:
                write_all(file, self._header(0))
            # not the end of the file: an earlier attempt may have failed halfway
            file.seek(len(header) + self._written * self._row_bytes)
            write_all(file, rows)
            file.seek(0)
            write_all(file, header)
        self._written += count

    def read_into(self, rows: memoryview) -> None:
        """Read back what was written; `rows` has as many bytes.

        Raises:
            OSError: somebody has removed the file, or cut it.
        """
        header = len(self._header(self._written))
        with naming(self._path), self._path.open("rb", buffering=0) as file:
            file.seek(header)
            rest = rows
            while rest:
                count = file.readinto(rest)
                if not count:
                    raise OSError(errno.EIO, "rows that were written are not there any more")
                rest = rest[count:]

    def remove(self) -> None:
        """Remove the file."""
        self._path.unlink()

    def _header(self, count: int) -> bytes:
        """Digits take the place of spaces at its end."""
        digits = str(count).encode()
        return self._before + digits + self._after[: -len(digits)] + b"\n"


@lru_cache(maxsize=64)
def _header(dtype: "np.dtype[Any]", row_shape: tuple[int, ...]) -> tuple[bytes, bytes]:
    """The header of a file without rows, before their number and after it."""
    file = io.BytesIO()
    descr = np.lib.format.dtype_to_descr(dtype)
    record = {"descr": descr, "fortran_order": False, "shape": (0, *row_shape)}
    np.lib.format.write_array_header_1_0(file, record)
    before, shape, after = file.getvalue().rpartition(b"'shape': (")
    return before + shape, after[1:]


def write_all(file: io.FileIO, data: bytes | memoryview) -> None:
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
