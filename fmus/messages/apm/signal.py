"""APM messages as one Binary signal."""

from collections.abc import Iterable
from typing import Final

import numpy as np

from fmus.messages.records import FRAME

_MAGIC: Final = b"APMS"
_VERSION: Final = 1
_ALIGNMENT: Final = 8
_PREFIX: Final = np.dtype([("size", "<u4"), ("zero", "<u4")])


def join(messages: Iterable[bytes]) -> bytes:
    """One "APMS" Binary signal of encoded APM messages, in their order; undone by `split`."""
    blocks = []
    for message in messages:
        prefix = np.array([(len(message), 0)], _PREFIX).tobytes()
        blocks.append(prefix + message + bytes(-len(message) % _ALIGNMENT))
    head = np.array([(_MAGIC, _VERSION, len(blocks), 0)], FRAME)
    return head.tobytes() + b"".join(blocks)


def split(apms_signal: bytes) -> list[bytes]:
    """The messages in an "APMS" Binary signal, encoded as they are; none if it is empty.

    Raises:
        ValueError: `apms_signal` is not such a signal, and why.
    """
    if not apms_signal:
        return []
    if len(apms_signal) < FRAME.itemsize:
        raise ValueError(f"an `APMS` frame has at least 16 bytes, not {len(apms_signal)}")
    head = np.frombuffer(apms_signal, FRAME, 1)[0]
    if head["magic"] != _MAGIC or head["version"] != _VERSION or head["record_size"] != 0:
        raise ValueError(f"not an `APMS` frame of version 1: {apms_signal[:16]!r}")
    messages, start = [], FRAME.itemsize
    for index in range(int(head["count"])):
        if len(apms_signal) < start + _PREFIX.itemsize:
            raise ValueError(f"`APMS` frame is cut short before message {index}")
        size = int(np.frombuffer(apms_signal, _PREFIX, 1, start)[0]["size"])
        start += _PREFIX.itemsize
        end = start + size + -size % _ALIGNMENT
        if len(apms_signal) < end:
            raise ValueError(f"`APMS` frame is cut short in message {index} of {size} bytes")
        messages.append(apms_signal[start : start + size])
        start = end
    if start != len(apms_signal):
        raise ValueError(f"`APMS` frame has {len(apms_signal) - start} bytes after its messages")
    return messages
