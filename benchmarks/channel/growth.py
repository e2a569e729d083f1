"""The grid of 200 vehicles made larger or smaller at constant density."""

from dataclasses import replace
from typing import Final

import numpy as np
import numpy.typing as npt

from benchmarks.channel.layout import Float, Layout

Int = npt.NDArray[np.int32]

TILE: Final = 600.0
"""Four blocks of 150 m [m]: with this period the streets of the grid continue across its border."""

MIDDLE: Final = 318.75
"""Both coordinates of the middle of the square [m]: an eighth of a block from a crossing. There 50
and 1000 vehicles are equally dense, 465 per km^2, and 100, 200 and 500 are 443 to 595 per km^2:
streets come in whole numbers."""

_BORDER: Final = 20.0
"""Half the width of a crossing, and then some [m]."""


def grid_of(layout: Layout, count: int) -> Layout:
    """`count` vehicles of an endless grid of streets.

    The layout is repeated in both directions with the period `TILE`; its outermost streets to the
    east and to the north are left out, since those to the west and to the south come to lie there.
    Of the endless grid this takes the vehicles nearest to `MIDDLE` by their larger coordinate
    difference, a square, and the buildings that reach into the square.

    Args:
        layout: streets every 150 m from 0 to `TILE`, both ways.
        count: the number of vehicles.
    """
    inside = np.flatnonzero(np.all(layout.front[0] < TILE - _BORDER, axis=1))
    reach = int(np.ceil(np.sqrt(count / len(inside)) / 2)) + 1
    shifts = _shifts(reach)
    front = layout.front[:, np.newaxis, inside] + shifts[:, np.newaxis]
    front = front.reshape(layout.scenes, -1, 2)
    source = np.tile(inside, len(shifts))
    away = np.abs(front[0] - MIDDLE).max(axis=1)
    chosen = np.sort(np.argsort(away, kind="stable")[:count])
    vertex, index = _buildings(layout, shifts, half=float(away[chosen].max()))
    return replace(
        layout,
        front=front[:, chosen],
        heading=layout.heading[:, source[chosen]],
        size=layout.size[source[chosen]],
        vertex=vertex,
        index=index,
    )


def _shifts(reach: int) -> Float:
    steps = np.arange(-reach, reach + 1) * TILE
    return np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)


def _buildings(layout: Layout, shifts: Float, *, half: float) -> tuple[Float, Int]:
    """The buildings of the endless grid that reach into the square of side `2 * half`."""
    rings: list[Float] = []
    for shift in shifts:
        for number in range(layout.buildings):
            ring = layout.vertex[layout.index == number] + shift
            low, high = ring.min(axis=0) - MIDDLE, ring.max(axis=0) - MIDDLE
            if np.all(low < half) and np.all(high > -half):
                rings.append(ring)
    lengths = [len(ring) for ring in rings]
    index = np.repeat(np.arange(len(rings), dtype=np.int32), lengths)
    return np.concatenate(rings), index
