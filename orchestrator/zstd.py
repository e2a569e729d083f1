"""Frames of Zstandard: of Python itself from 3.14 on, of the backport of its module before."""

import sys
from typing import TYPE_CHECKING, Any, Final, cast

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

if TYPE_CHECKING:
    import numpy as np
    from typing_extensions import Buffer

ZstdError: Final = zstd.ZstdError
"""A frame is damaged."""

_AT_ONCE: Final = zstd.ZstdCompressor.FLUSH_FRAME


class Compressor:
    """Makes frames; the same bytes of the same content whenever the library is the same.

    Args:
        level: the higher, the smaller and slower.
        checksum: whether frames have one.
        window_log: repetitions are looked for over so many bytes, as a power of 2; 0: only nearby.
    """

    __slots__ = ("_compressor",)

    def __init__(self, level: int, *, checksum: bool = False, window_log: int = 0) -> None:
        options: dict[int, int] = {zstd.CompressionParameter.compression_level: level}
        if checksum:
            options[zstd.CompressionParameter.checksum_flag] = 1
        if window_log:
            options[zstd.CompressionParameter.enable_long_distance_matching] = 1
            options[zstd.CompressionParameter.window_log] = window_log
        self._compressor = zstd.ZstdCompressor(options=options)

    def frame(self, content: "Buffer | np.ndarray[Any, Any]") -> bytes:
        """A frame with `content`, bytes or an array of any shape in C order."""
        data: Any = content  # before Python 3.12 the types do not say that an array is a buffer
        return self._compressor.compress(data, _AT_ONCE)


def decompressed(frame: bytes, most: int = sys.maxsize - 1) -> bytes:
    """The content of a frame.

    Args:
        frame: as `Compressor.frame` made it.
        most: bytes that it can have; no memory is asked for more.

    Raises:
        ZstdError: it is damaged, cut, or has more.
    """
    size = cast("int | None", zstd.get_frame_info(frame).decompressed_size)
    if size is None or size > most:
        raise ZstdError(f"a frame announces {'any number of' if size is None else size} bytes")
    decompressor = zstd.ZstdDecompressor()
    content = decompressor.decompress(frame, size + 1)
    if not decompressor.eof or len(content) != size:
        raise ZstdError(f"a frame of {size} bytes is cut")
    return content
