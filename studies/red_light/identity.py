"""Who is who: the roles of the encounter, and which vehicle a detected object is.

The detector does not know that; the evaluation may.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import NO_VEHICLE
from studies.red_light.traces import Array, Scene, Traces


@dataclass(frozen=True, slots=True, kw_only=True)
class Roles:
    """The vehicles of the encounter, `NO_VEHICLE` for one that never entered.

    Attributes:
        ego: the vehicle that the policy drives.
        hidden: the vehicle that the ego cannot see.
        sharing: the vehicle that shares its sensor data.
    """

    ego: int
    hidden: int
    sharing: int


MARGIN: Final = 0.5
"""How far the middle of an object may lie beside the body that it is [m]: half of what two trucks
in adjacent lanes are apart, and what a vehicle moves between a scan and the scene it is compared
with."""


def vehicles_of(objects: Array, traces: Traces) -> Array:
    """The vehicle that each object is.

    Args:
        objects: `OBJECT` records, shape (object,).
        traces: the recording; each object is compared with the scene at the time of its scan.

    Returns:
        Ids of vehicles: the middle of the object's box lies in its body or within `MARGIN` of it,
        and deepest in that one; `NO_VEHICLE` if there is none. int64, shape (object,).
    """
    found = np.full(len(objects), NO_VEHICLE, np.int64)
    for time in np.unique(objects["time"]):
        rows = objects["time"] == time
        found[rows] = _nearest(objects[rows], traces.scene(int(time)))
    return found


def _nearest(objects: Array, scene: Scene) -> Array:
    if len(scene.ids) == 0:
        return np.full(len(objects), NO_VEHICLE, np.int64)
    offset = objects["position"][:, None] - scene.position[None, :, :2]
    cos, sin = np.cos(scene.heading), np.sin(scene.heading)
    along = np.abs(cos * offset[..., 0] + sin * offset[..., 1]) - scene.size[:, 0] / 2.0
    across = np.abs(-sin * offset[..., 0] + cos * offset[..., 1]) - scene.size[:, 1] / 2.0
    outside = np.maximum(along, across)  # (object, vehicle), negative inside
    best = np.argmin(outside, axis=1)
    is_found = np.take_along_axis(outside, best[:, None], axis=1)[:, 0] <= MARGIN
    return np.where(is_found, scene.ids[best], NO_VEHICLE)
