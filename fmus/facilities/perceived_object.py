"""One perceived object in a CPM: its data elements, and what a receiver makes of them.

Data elements are those of ETSI TS 102 894-2 V2.1.1. Confidences are sent as "unavailable": the
detector does not estimate them.
"""

import math
from typing import Any, Final

import numpy as np

from fmus.messages.records import OBJECT
from orchestrator.signal import Array
from orchestrator.timebase import Time

POSITION_STEP: Final = 0.01
"""Resolution of an object's position [m] (CartesianCoordinateLarge)."""
VELOCITY_STEP: Final = 0.01
"""Resolution of a velocity component [m/s] (VelocityComponentValue)."""
DIMENSION_STEP: Final = 0.1
"""Resolution of a length, width or height [m] (ObjectDimensionValue)."""
ANGLE_STEP: Final = math.radians(0.1)
"""Resolution of an angle [rad] (CartesianAngleValue)."""
TIME_STEP: Final = 1_000_000
"""Resolution of times [ns] (TimestampIts, DeltaTimeMilliSecondSigned)."""

_QUARTER: Final = 900
"""A quarter turn, in steps of an angle; beyond it the sides of a box change places."""
_ROUNDING: Final = 1e-6
"""How far a value may lie above a multiple of a step by rounding, in steps; double precision."""


def to_element(
    row: np.void, age: Time, reference_time: Time, reference: Array
) -> dict[str, object]:
    """The data element PerceivedObject: the centre of its box, relative to the sender, and sides.

    The axes are east and north (TS 103 324, PerceivedObjects); the box is turned by zAngle.

    Args:
        row: an `OBJECT` record.
        age: how long the object has been tracked [ns].
        reference_time: of the message [ns].
        reference: the sender's position as the message says it, world frame [m], shape (2,).
    """
    center = row["position"] - reference
    along, across = row["size"]
    late = round_up((int(row["time"]) - reference_time) / TIME_STEP, 1.0, -2048, 2047)
    return {
        "objectId": int(row["instance"]) % 2**16,
        "measurementDeltaTime": late,
        "position": {
            "xCoordinate": _coordinate(center[0]),
            "yCoordinate": _coordinate(center[1]),
        },
        "velocity": (
            "cartesianVelocity",
            {
                "xVelocity": _velocity(row["velocity"][0]),
                "yVelocity": _velocity(row["velocity"][1]),
            },
        ),
        "angles": {"zAngle": {"value": _angle(row["angle"]), "confidence": 127}},
        "objectDimensionZ": _dimension(row["height"]),
        "objectDimensionY": _dimension(across),
        "objectDimensionX": _dimension(along),
        "objectAge": min(age // TIME_STEP, 2047),
        "sensorIdList": [1],
        "classification": [{"objectClass": ("vehicleSubClass", 0), "confidence": 101}],
    }


def to_record(row: dict[str, Any], station: int, time: Time, reference: Array) -> Array:
    """The `OBJECT` record, of shape (), that a receiver makes of one PerceivedObject.

    Args:
        row: the decoded data element.
        station: the sender.
        time: of the message [ns].
        reference: the sender's position as the message says it, world frame [m], shape (2,).
    """
    center = reference + [
        row["position"][axis]["value"] * POSITION_STEP for axis in ("xCoordinate", "yCoordinate")
    ]
    velocity = row["velocity"][1]
    sides = [_length(row["objectDimensionX"]), _length(row["objectDimensionY"])]
    quarters, rest = divmod(row["angles"]["zAngle"]["value"], _QUARTER)
    record = np.zeros((), OBJECT)
    record["sensor"] = station
    record["time"] = time + row["measurementDeltaTime"] * TIME_STEP
    record["instance"] = row["objectId"]
    record["position"] = center
    record["angle"] = rest * ANGLE_STEP
    record["size"] = sides[::-1] if quarters % 2 else sides
    record["height"] = _length(row["objectDimensionZ"])
    record["velocity"] = [
        velocity[axis]["value"] * VELOCITY_STEP for axis in ("xVelocity", "yVelocity")
    ]
    return record


def _coordinate(value: float) -> dict[str, int]:
    return {"value": round_up(value, POSITION_STEP, -131072, 131071), "confidence": 4096}


def _velocity(value: float) -> dict[str, int]:
    return {"value": round_up(value, VELOCITY_STEP, -16383, 16382), "confidence": 127}


def _angle(value: float) -> int:
    return round_up(value, ANGLE_STEP, 0, _QUARTER)


def _dimension(value: float) -> dict[str, int]:
    return {"value": round_up(value, DIMENSION_STEP, 1, 255), "confidence": 32}


def _length(dimension: dict[str, int]) -> float:
    return dimension["value"] * DIMENSION_STEP


def round_up(value: float, step: float, low: int = 0, high: int = 2**31) -> int:
    """The data element for `value`: n means "at most n steps, and more than n - 1"."""
    return min(max(math.ceil(value / step - _ROUNDING), low), high)
