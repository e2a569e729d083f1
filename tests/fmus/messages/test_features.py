"""Messages of features as one signal: nothing is changed, nothing copied, nothing odd is read."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from fmus.messages.features import MOST_BYTES, FeaturesMessage, read_features, write_features
from fmus.messages.records import FEATURES, FRAME, frame

FINITE = st.floats(-1e9, 1e9)


@st.composite
def messages(draw: st.DrawFn) -> FeaturesMessage:
    capacity, dimensions = draw(st.integers(1, 9)), draw(st.integers(0, 5))
    shape = (draw(st.integers(0, capacity)), 3 + dimensions)
    number = st.floats(allow_nan=False, allow_infinity=False, width=32)
    return FeaturesMessage(
        vehicle=draw(st.integers(-(2**63), 2**63 - 1)),
        time=draw(st.integers(-(2**63), 2**63 - 1)),
        position=draw(arrays(np.float64, 3, elements=FINITE)),
        heading=draw(FINITE),
        capacity=capacity,
        dimensions=dimensions,
        keypoints=draw(arrays(np.float32, shape, elements=number)),
        encoder=draw(st.integers(0, 2**64 - 1)),
    )


def message(**changes: Any) -> FeaturesMessage:
    plain = FeaturesMessage(
        vehicle=7,
        time=5,
        position=np.array([1.0, 2.0, 3.0]),
        heading=0.5,
        capacity=4,
        dimensions=2,
        keypoints=np.arange(10, dtype=np.float32).reshape(2, 5),
    )
    return replace(plain, **changes)


@settings(deadline=None)
@given(st.lists(messages(), max_size=5))
def test_what_is_written_is_read_bit_for_bit(sent: list[FeaturesMessage]) -> None:
    signal = write_features(sent)
    read = read_features(signal)
    assert write_features(read) == signal
    for ours, theirs in zip(sent, read, strict=True):
        for name in ("vehicle", "time", "heading", "capacity", "dimensions", "size", "encoder"):
            assert getattr(ours, name) == getattr(theirs, name)
        assert ours.position.tobytes() == theirs.position.tobytes()
        assert ours.keypoints.tobytes() == theirs.keypoints.tobytes()
        assert ours.keypoints.shape == theirs.keypoints.shape


def test_reading_copies_nothing_and_protects_the_signal() -> None:
    signal = write_features([message(), message(vehicle=8)])
    for read in read_features(signal):
        assert np.shares_memory(read.keypoints, np.frombuffer(signal, np.uint8))
        with pytest.raises(ValueError, match="read-only"):
            read.keypoints[0, 0] = 1.0


def test_an_empty_signal_has_no_messages_and_no_messages_are_a_frame() -> None:
    assert read_features(b"") == []
    assert read_features(write_features([])) == []


@pytest.mark.parametrize(
    ("capacity", "dimensions", "size"),
    [(128, 128, 67_072), (32, 256, 33_152), (65_536, 0, 786_432)],
)
def test_messages_have_the_published_sizes(capacity: int, dimensions: int, size: int) -> None:
    """COOPERNAUT's two, and its early fusion: 60 x 2^20 bit/s of raw points at 10 Hz."""
    keypoints = np.zeros((0, 3 + dimensions), np.float32)
    sent = message(capacity=capacity, dimensions=dimensions, keypoints=keypoints)
    assert sent.size == size


@pytest.mark.parametrize(
    ("changes", "error"),
    [
        ({"capacity": 0, "keypoints": np.zeros((0, 5), np.float32)}, "capacity 0 and 2 dim"),
        ({"dimensions": -1}, "-1 dimensions; they must be at least 1 and 0"),
        ({"capacity": 1}, "has 2 keypoints; its capacity is 1"),
        ({"capacity": 10**6}, f"1000000 keypoints of 5 numbers, 20000000 B; at most {MOST_BYTES}"),
        (
            {"keypoints": np.zeros((2, 4), np.float32)},
            r"float32\[2, 4\]; .* float32\[keypoint, 5\]",
        ),
        ({"keypoints": np.zeros((2, 5))}, r"keypoints float64\[2, 5\]"),
        ({"keypoints": np.zeros(5, np.float32)}, r"keypoints float32\[5\]"),
        ({"encoder": -1}, r"has the encoder -1; it must be 0 to 2\^64 - 1"),
        ({"encoder": 2**64}, "has the encoder 18446744073709551616; it must be"),
        ({"heading": np.nan}, "heading nan; they must be finite"),
        ({"position": np.array([0.0, np.inf, 0.0])}, r"position \[0.0, inf, 0.0\]"),
        (
            {"keypoints": np.array([[0] * 5, [0, 0, 0, np.nan, 0]], np.float32)},
            "has nan as number 3 of keypoint 1; all must be finite",
        ),
    ],
)
def test_a_wrong_message_is_not_written(changes: dict[str, Any], error: str) -> None:
    with pytest.raises(ValueError, match="`FEAT` message 1, of vehicle 7, .*" + error):
        write_features([message(), message(**changes)])


def without_keypoints(**declared: int) -> bytes:
    row = np.zeros(1, FEATURES)
    for field, value in declared.items():
        row[field] = value
    return frame("FEAT", row)


def corrupted(field: str, value: Any, k: int = 1) -> bytes:
    """A signal of two messages with one field of a record changed."""
    signal = write_features([message(), message()])
    rows = np.frombuffer(signal, FEATURES, 2, FRAME.itemsize).copy()
    rows[field][k] = value
    return frame("FEAT", rows, signal[FRAME.itemsize + rows.nbytes :])


@pytest.mark.parametrize(
    ("signal", "error"),
    [
        (b"FEAT", "not a `FEAT` frame of version 1"),
        (frame("OBJS", np.zeros(0, FEATURES)), "not a `FEAT` frame"),
        (write_features([message()])[:-4], "cut short in message 0: 2 keypoints of 5 numbers end"),
        (write_features([message()])[:-1], "39 bytes after its records are no float32 numbers"),
        (write_features([message()])[:40], "1 records is cut short"),
        (frame("FEAT", np.zeros(1, "V64")), "records have 72 bytes, not 64"),
        (write_features([message()]) + bytes(8), "has 2 numbers after its messages"),
        (corrupted("first", 9), "message 1 begins at number 9, but the one before it ends at 10"),
        (corrupted("first", 0), "message 1 begins at number 0"),
        (corrupted("keypoints", 3), "cut short in message 1: 3 keypoints of 5 numbers end at"),
        (corrupted("keypoints", 2**32 - 1), "cut short in message 1: 4294967295 keypoints"),
        (corrupted("dimensions", 2**32 - 1), "cut short in message 1"),
        (corrupted("capacity", 1), "message 1, of vehicle 7, has 2 keypoints; its capacity is 1"),
        (corrupted("capacity", 0), "message 1, of vehicle 7, has the capacity 0"),
        (without_keypoints(capacity=1, dimensions=2**32 - 1), "1 keypoints of 4294967298 numbers"),
        (without_keypoints(capacity=2**32 - 1), "4294967295 keypoints of 3 numbers"),
        (corrupted("heading", np.inf), "heading inf; they must be finite"),
    ],
)
def test_what_is_no_such_signal_is_refused(signal: bytes, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        read_features(signal)


@given(st.binary(max_size=300), st.integers(0, 3))
def test_no_bytes_do_worse_than_a_value_error(tail: bytes, count: int) -> None:
    head = np.array([(b"FEAT", 1, count, FEATURES.itemsize)], FRAME).tobytes()
    try:
        read = read_features(head + tail)
    except ValueError:
        return
    assert write_features(read) == head + tail
