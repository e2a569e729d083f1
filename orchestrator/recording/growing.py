"""A `.npy` file that grows along its first axis and can be read at any time."""

import hashlib
import io
from pathlib import Path
from typing import Any, Final

import numpy as np

BUFFER_LIMIT: Final = 1 << 20
"""What is appended is held back up to so many bytes."""


class GrowingArray:
    """Appends rows to a `.npy` file.

    NumPy pads the header for a first axis of up to 21 digits, so that it can be rewritten in
    place. Rows are written first and the header afterwards: at no time does it promise more than
    the file holds, even if the process is killed in between. No file stays open.

    Attributes:
        digest: SHA-256 of the rows written so far.
    """

    __slots__ = ("_buffered", "_chunk_bytes", "_chunks", "_descr", "_path", "_row_bytes",
                 "_row_shape", "_written", "digest")  # fmt: skip

    def __init__(self, path: Path, dtype: "np.dtype[Any]", row_shape: tuple[int, ...] = ()) -> None:
        self.digest = hashlib.sha256()
        self._path = path
        self._descr = np.lib.format.dtype_to_descr(dtype)
        self._row_shape = row_shape
        self._row_bytes = dtype.itemsize * int(np.prod(row_shape, dtype=np.int64))
        self._chunks: list[bytes] = []
        self._chunk_bytes = 0
        self._buffered = 0
        self._written = 0
        path.write_bytes(self._header(0))

    def append(self, rows: bytes, count: int = 1) -> None:
        """Append `count` rows, given in C order."""
        self._chunks.append(rows)
        self._buffered += count
        self._chunk_bytes += len(rows)
        if self._chunk_bytes > BUFFER_LIMIT:
            self.flush()

    def flush(self) -> None:
        """Write out everything that was appended."""
        if not self._buffered:
            return
        header = self._header(self._written + self._buffered)
        rows = b"".join(self._chunks)
        with self._path.open("r+b") as file:
            # not the end of the file: an earlier attempt may have failed halfway
            file.seek(len(header) + self._written * self._row_bytes)
            file.write(rows)
            file.flush()
            file.seek(0)
            file.write(header)
        self.digest.update(rows)
        self._written += self._buffered
        self._buffered = self._chunk_bytes = 0
        self._chunks.clear()

    def _header(self, count: int) -> bytes:
        file = io.BytesIO()
        shape = (count, *self._row_shape)
        record = {"descr": self._descr, "fortran_order": False, "shape": shape}
        np.lib.format.write_array_header_1_0(file, record)
        return file.getvalue()
