"""What three ways of sharing send in one scan, in bytes above the lower layers."""

from collections.abc import Mapping
from typing import Final

import numpy as np

from fmus.facilities.cpm import Cpm, encode
from orchestrator.signal import Array
from studies.verification.perception.scene import Scene

FEATURES: Final = 67_072
"""Features of one scan: 128 key points with 3 coordinates and 128 channels in single precision
(Cui et al., COOPERNAUT, CVPR 2022)."""
SMALL_FEATURES: Final = 33_152
"""The same in half the bytes: 128 channels in half precision, coordinates in one byte each."""
RAW_POINT: Final = 16
"""One lidar point: three coordinates and the intensity in single precision."""
_RANGE: Final = 50.0


def cpm_sizes(scene: Scene, objects: Array) -> Mapping[int, int]:
    """Bytes of the collective perception message of each equipped vehicle, by its id.

    Every object that a vehicle detects is in its message, as in the first one after it was found.

    Args:
        scene: has their positions.
        objects: OBJECT records of all of them.
    """
    sizes = {}
    for sender in scene.equipped:
        own = objects[objects["sensor"] == sender]
        vehicle = scene.by_id[sender]
        message = Cpm(
            station=sender,
            time=0,
            position=np.array(vehicle.position),
            heading=vehicle.heading,
            objects=own,
            ages=np.zeros(len(own), np.int64),
            perceived=len(own),
            sensor_range=_RANGE,
        )
        sizes[sender] = len(encode(message))
    return sizes
