"""Frames of Zstandard: what is made is read, and what is damaged is told before it takes memory."""

import sys

import numpy as np
import pytest

from orchestrator.zstd import Compressor, ZstdError, decompressed

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

CONTENT = b"to and fro " * 1000


def test_what_is_compressed_is_read_whatever_the_options() -> None:
    near, far = Compressor(1), Compressor(1, checksum=True, window_log=20)
    for each in (near, far, far):  # one after the other
        frame = each.frame(CONTENT)
        assert len(frame) < len(CONTENT) / 50
        assert decompressed(frame) == decompressed(frame, len(CONTENT)) == CONTENT
    assert decompressed(near.frame(b"")) == b""
    numbers = np.arange(6.0).reshape(2, 3)
    assert decompressed(near.frame(numbers)) == numbers.tobytes()
    assert len(far.frame(CONTENT)) > len(near.frame(CONTENT))  # by the checksum


def test_repetitions_far_apart_are_found_if_they_are_looked_for() -> None:
    some = np.random.default_rng(1).bytes(3 << 20)
    near, far = (len(Compressor(1, window_log=log).frame(some + some)) for log in (0, 23))
    assert far < 0.51 * near


@pytest.mark.parametrize("size", [0, 1, 3, 5, 20])
def test_a_frame_that_is_cut_is_damaged(size: int) -> None:
    frame = Compressor(3, checksum=True).frame(CONTENT)
    with pytest.raises(ZstdError):
        decompressed(frame[:size])
    with pytest.raises(ZstdError, match="a frame of 11000 bytes is cut"):
        decompressed(frame[:-1])


def test_a_frame_of_more_than_there_can_be_asks_for_no_memory() -> None:
    frame = Compressor(3).frame(bytes(1_000_000))
    with pytest.raises(ZstdError, match="a frame announces 1000000 bytes"):
        decompressed(frame, 999_999)
    open_end = zstd.ZstdCompressor()
    unknown = open_end.compress(bytes(1_000_000)) + open_end.flush()
    with pytest.raises(ZstdError, match="a frame announces any number of bytes"):
        decompressed(unknown)
