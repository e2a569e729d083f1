"""Messages of features as one Binary signal: what a sharer's encoder makes of a scan.

docs/formats.md, "Features", describes the layout for readers in other languages.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import FEATURES, FRAME, frame, unframe
from orchestrator.signal import Array
from orchestrator.timebase import Time

MAGIC: Final = "FEAT"
COORDINATES: Final = 3
"""Numbers of a keypoint before its features: x, y, z."""
MOST_BYTES: Final = 1 << 24
"""Size of the largest message that is read or written [byte], 21 scans of 65,536 raw points."""

_NUMBER: Final = np.dtype("<f4")
_ENCODERS: Final = 1 << 64


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FeaturesMessage:
    """The features of one scan, or what arrived of them.

    Attributes:
        vehicle: number of the vehicle that carries the sensor.
        time: when the scan was taken [ns].
        position: where the sensor is, world frame [m], float64, shape (3,).
        heading: direction of the sensor's x axis, counter-clockwise from east [rad].
        capacity: number of keypoints of a complete message; missing ones are padded on the air.
        dimensions: number of features of a keypoint.
        keypoints: by falling importance, float32, shape (keypoint, 3 + dimensions); the position in
            the levelled sensor frame (x along the heading, y left, z up from the sensor [m]), then
            the features.
        encoder: which one made the features, 0 to 2^64 - 1; 0: none did, or it does not say.
            Features mean something to whoever knows their encoder only.
    """

    vehicle: int
    time: Time
    position: Array
    heading: float
    capacity: int
    dimensions: int
    keypoints: Array
    encoder: int = 0

    @property
    def keypoint_size(self) -> int:
        """Size of one keypoint on the air [byte]."""
        return (COORDINATES + self.dimensions) * _NUMBER.itemsize

    @property
    def size(self) -> int:
        """Size of the message on the air, padding included [byte]."""
        return self.capacity * self.keypoint_size


def read_features(data: bytes) -> list[FeaturesMessage]:
    """The messages in a "FEAT" Binary signal; none if it is empty.

    Args:
        data: the signal; the keypoints are read-only views of it.

    Raises:
        ValueError: `data` is not such a signal, and why.
    """
    rows = unframe(MAGIC, data, FEATURES)
    start = FRAME.itemsize + rows.nbytes
    size = max(len(data) - start, 0)
    if size % _NUMBER.itemsize:
        raise ValueError(f"`{MAGIC}` frame: {size} bytes after its records are no float32 numbers")
    numbers = np.frombuffer(data, _NUMBER, offset=start) if size else np.empty(0, _NUMBER)
    messages, first = [], 0
    for k, row in enumerate(rows):
        width = COORDINATES + int(row["dimensions"])
        end = first + int(row["keypoints"]) * width
        if row["first"] != first:
            raise ValueError(
                f"`{MAGIC}` message {k} begins at number {row['first']}, but the one before it "
                f"ends at {first}"
            )
        if end > len(numbers):
            raise ValueError(
                f"`{MAGIC}` frame is cut short in message {k}: {row['keypoints']} keypoints of "
                f"{width} numbers end at number {end}, and there are {len(numbers)}"
            )
        message = FeaturesMessage(
            vehicle=int(row["vehicle"]),
            time=int(row["time"]),
            position=row["position"],
            heading=float(row["heading"]),
            capacity=int(row["capacity"]),
            dimensions=int(row["dimensions"]),
            keypoints=numbers[first:end].reshape(int(row["keypoints"]), width),
            encoder=int(row["encoder"]),
        )
        _check(message, k)
        messages.append(message)
        first = end
    if first != len(numbers):
        raise ValueError(f"`{MAGIC}` frame has {len(numbers) - first} numbers after its messages")
    return messages


def write_features(messages: Sequence[FeaturesMessage]) -> bytes:
    """`messages` as one "FEAT" Binary signal, in their order; undone by `read_features`.

    Raises:
        ValueError: a message breaks its declaration, and how.
    """
    rows, first = np.zeros(len(messages), FEATURES), 0
    for k, message in enumerate(messages):
        _check(message, k)
        rows[k] = (
            message.vehicle,
            message.time,
            message.position,
            message.heading,
            len(message.keypoints),
            message.capacity,
            message.dimensions,
            first,
            message.encoder,
        )
        first += message.keypoints.size
    return frame(MAGIC, rows, b"".join(message.keypoints.tobytes() for message in messages))


def _check(message: FeaturesMessage, k: int) -> None:
    """Refuse message `k` of a signal if it is not what `FeaturesMessage` declares."""
    name = f"`{MAGIC}` message {k}, of vehicle {message.vehicle}"
    shape, width = message.keypoints.shape, COORDINATES + message.dimensions
    if message.capacity < 1 or message.dimensions < 0:
        raise ValueError(
            f"{name}, has the capacity {message.capacity} and {message.dimensions} dimensions; "
            "they must be at least 1 and 0"
        )
    if not 0 <= message.encoder < _ENCODERS:
        raise ValueError(f"{name}, has the encoder {message.encoder}; it must be 0 to 2^64 - 1")
    if message.size > MOST_BYTES:
        raise ValueError(
            f"{name}, has a capacity of {message.capacity} keypoints of {width} numbers, "
            f"{message.size} B; at most {MOST_BYTES} B are sent"
        )
    if len(shape) != 2 or shape[1] != width or message.keypoints.dtype != _NUMBER:
        raise ValueError(
            f"{name}, has keypoints {message.keypoints.dtype}{list(shape)}; with "
            f"{message.dimensions} dimensions they are float32[keypoint, {width}]"
        )
    if shape[0] > message.capacity:
        raise ValueError(f"{name}, has {shape[0]} keypoints; its capacity is {message.capacity}")
    if not np.isfinite((*message.position, message.heading)).all():
        raise ValueError(
            f"{name}, has the position {[float(x) for x in message.position]} and the heading "
            f"{message.heading}; they must be finite"
        )
    if not np.isfinite(message.keypoints).all():
        row, column = np.argwhere(~np.isfinite(message.keypoints))[0].tolist()
        raise ValueError(
            f"{name}, has {float(message.keypoints[row, column])} as number {column} of keypoint "
            f"{row}; all must be finite"
        )
