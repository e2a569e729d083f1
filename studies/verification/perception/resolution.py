r"""What a matrix of a certain cell size could do at best.

If every vehicle knew exactly which share of each cell of its matrix it sees, the ego vehicle could
expect a candidate to reveal

$$ \int_{road} (1 - e(x)) v(x) dx $$

where e is the seen share of the ego vehicle's cell in which x lies, v that of the candidate's cell.
It is an expectation because nobody knows where in a cell the seen part is. Whoever it ranks first
is the best that matrices of this size can do without that knowledge.
"""

from collections.abc import Mapping
from typing import Final

import numpy as np
import numpy.typing as npt
import shapely
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.scene import Float, Scene, Vehicle

Bool = npt.NDArray[np.bool_]

CELLS: Final = (5.0, 2.5, 1.25)
"""Sides of the cells [m]."""
_STEP: Final = 0.5
"""Distance of the points that areas are sampled at [m]."""


def best_by_cells(
    scene: Scene, interest: BaseGeometry, known: Mapping[int, BaseGeometry], cell: float
) -> int:
    """The candidate that exact matrices with cells of this side would choose.

    Args:
        scene: what there is.
        interest: the ego vehicle's area of interest.
        known: the part of it that each equipped vehicle knows, by id.
        cell: side of a cell [m].
    """
    points = _points(interest)
    shares = {
        one: _shares(points, shapely.contains_xy(area, points[:, 0], points[:, 1]), vehicle, cell)
        for one, area in known.items()
        for vehicle in (scene.by_id[one],)
    }
    wanted = 1.0 - shares[scene.ego]
    return max(scene.candidates, key=lambda one: float(wanted @ shares[one]))


def _points(area: BaseGeometry) -> Float:
    low_x, low_y, high_x, high_y = area.bounds
    x, y = np.meshgrid(
        np.arange(low_x + _STEP / 2, high_x, _STEP), np.arange(low_y + _STEP / 2, high_y, _STEP)
    )
    inside = shapely.contains_xy(area, x.ravel(), y.ravel())
    return np.column_stack([x.ravel()[inside], y.ravel()[inside]])


def _shares(points: Float, seen: Bool, vehicle: Vehicle, cell: float) -> Float:
    """Of each point, the seen share of the points in its cell, shape (point,)."""
    cosine, sine = np.cos(vehicle.heading), np.sin(vehicle.heading)
    local = (points - np.array(vehicle.position)) @ np.array([[cosine, -sine], [sine, cosine]])
    index = np.floor(local / cell).astype(np.int64)
    _, place = np.unique(index, axis=0, return_inverse=True)
    share: Float = np.bincount(place, seen.astype(float)) / np.bincount(place)
    return share[place]
