"""Scans with the poses that their vehicles believe to have."""

import numpy as np

from fmus.localisation.pose_errors import Offsets
from fmus.messages.records import FRAME, SENSOR, unframe


def stamped(points: bytes, offsets: Offsets) -> bytes:
    """Scans whose sensors are where their vehicles believe to be.

    The sensor turns about itself: it is not moved by an error of the heading. Points are as
    measured, in the sensor's frame.

    Args:
        points: an "LPTS" Binary signal.
        offsets: of all vehicles with a scan.

    Raises:
        ValueError: `points` is no such signal.
    """
    sensors = unframe("LPTS", points, SENSOR).copy()
    rows = offsets.rows(sensors["vehicle"])
    sensors["position"][:, :2] += offsets.position[rows]
    sensors["heading"] += offsets.heading[rows]
    begin = FRAME.itemsize
    return b"".join(
        (
            memoryview(points)[:begin],
            sensors.tobytes(),
            memoryview(points)[begin + sensors.nbytes :],
        )
    )


def sensing(points: bytes) -> np.ndarray:
    """The vehicles with a scan in `points`, int64, shape (sensor,).

    Raises:
        ValueError: `points` is no "LPTS" Binary signal.
    """
    vehicles: np.ndarray = unframe("LPTS", points, SENSOR)["vehicle"]
    return vehicles
