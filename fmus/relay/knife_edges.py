"""Loss by several bodies in a row, for many hops at once: the channel's formulas in NumPy.

Multiple isolated obstacles (Boban, Vinhoza, Ferreira, Barros, Tonguz, "Impact of vehicles as
obstacles in vehicular ad hoc networks", IEEE JSAC 29(1), 2011, after ITU-R P.526), with the
conventions of docs/physics-channel.md, section "Vehicles".
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.physics.propagation import knife_edge_loss
from fmus.relay.crossings import Crossings
from orchestrator.signal import Array

_SAME_EDGE: Final = 1e-3
"""Edges nearer to each other than this along a hop act as one [m]."""


def shadowing(found: Crossings, start: Array, end: Array, roof: Array, wavelength: float) -> Array:
    r"""Loss of each hop by the bodies that it runs over.

    A rope stretched over antennas and roofs touches the major edges;

    $$ L = \sum J(\text{majors}) + \sum J(\text{highest in each gap}) + C . $$

    Args:
        found: the crossings; `hop` counts the rows of `start`.
        start: antenna of one end, x, y and height [m], shape (hop, 3).
        end: antenna of the other end [m], shape (hop, 3).
        roof: height of each obstacle [m], shape (obstacle,).
        wavelength: of the carrier [m].

    Returns:
        The loss [dB], shape (hop,).
    """
    loss = np.zeros(len(start))
    if len(found.hop) == 0:
        return loss
    hop, row = np.unique(found.hop, return_inverse=True)
    length = np.linalg.norm(end[hop] - start[hop], axis=-1)
    margin = np.minimum(wavelength, length / 4.0)
    distance = found.middle * length[row]
    distance = np.clip(distance, margin[row], (length - margin)[row])
    profile = _Profile.of(
        row, distance, roof[found.obstacle], length, np.stack([start[hop, 2], end[hop, 2]])
    )
    loss[hop] = profile.loss(np.sqrt(2.0 / wavelength))
    return loss


@dataclass(frozen=True, slots=True)
class _Profile:
    """Points along each hop: an antenna, edges by distance, the other antenna.

    Unused places before the last have height -inf and lie at the far end.
    """

    distance: Array
    height: Array

    @classmethod
    def of(
        cls, row: Array, distance: Array, height: Array, length: Array, ends: Array
    ) -> "_Profile":
        order = np.lexsort((distance, row))
        row, distance, height = row[order], distance[order], height[order].copy()
        same = (row[1:] == row[:-1]) & (np.diff(distance) <= _SAME_EDGE)
        lower = height[1:] < height[:-1]
        height[1:][same & lower] = -np.inf
        height[:-1][same & ~lower] = -np.inf
        place = np.arange(len(row)) - np.searchsorted(row, row) + 1
        width = int(place.max()) + 2
        distances = np.broadcast_to(length[:, None], (len(length), width)).copy()
        heights = np.full((len(length), width), -np.inf)
        distances[:, 0] = 0.0
        heights[:, 0], heights[:, -1] = ends
        distances[row, place], heights[row, place] = distance, height
        return cls(distances, heights)

    def loss(self, scale: float) -> Array:
        """The loss of each hop [dB], shape (hop,); `scale` is sqrt(2 / wavelength)."""
        rope = self._rope()
        majors = self._edge(rope[:, :-2], rope[:, 1:-1], rope[:, 2:], scale)
        return np.asarray(majors.sum(axis=1) + self._gaps(rope, scale) + self._spacing(rope))

    def _rope(self) -> Array:
        """Indices of the points that the rope touches, the last repeated to the width."""
        every = np.arange(len(self.distance))
        end = self.distance.shape[1] - 1
        points = np.arange(end + 1)
        at = np.zeros(len(every), np.int64)
        rope = [at]
        while (at < end).any():
            ahead = points > at[:, None]
            rise = self.height - self.height[every, at][:, None]
            run = np.where(ahead, self.distance - self.distance[every, at][:, None], 1.0)
            at = np.where(ahead, rise / run, -np.inf).argmax(axis=1)
            at = np.where(rope[-1] == end, end, at)
            rope.append(at)
        return np.stack(rope, axis=1)

    def _take(self, index: Array) -> tuple[Array, Array]:
        return (
            np.take_along_axis(self.distance, index, axis=1),
            np.take_along_axis(self.height, index, axis=1),
        )

    def _edge(self, before: Array, at: Array, after: Array, scale: float) -> Array:
        """J of the edges `at`, each over the line between two points; 0 where they coincide."""
        (da, ha), (do, ho), (db, hb) = map(self._take, (before, at, after))
        one, other = do - da, db - do
        with np.errstate(divide="ignore", invalid="ignore"):
            above = ho - (ha + (hb - ha) * one / (one + other))
            v = above * np.sqrt((one + other) / (one * other)) * scale
        real = (at > before) & (after > at) & np.isfinite(ho)
        return np.where(real, knife_edge_loss(np.where(real, v, -1.0)), 0.0)

    def _gaps(self, rope: Array, scale: float) -> Array:
        """J of the highest edges between neighbours of the rope, summed over each hop."""
        hop, place = np.nonzero(np.diff(rope, axis=1) > 1)
        before, after = rope[hop, place], rope[hop, place + 1]
        distance, height = self.distance[hop], self.height[hop]
        every = np.arange(len(hop))
        da, ha = distance[every, before], height[every, before]
        slope = (height[every, after] - ha) / (distance[every, after] - da)
        height = height - slope[:, None] * (distance - da[:, None])
        points = np.arange(self.distance.shape[1])
        within = (points > before[:, None]) & (points < after[:, None])
        highest = np.where(within, height, -np.inf).argmax(axis=1)
        gaps = _Profile(self.distance[hop], self.height[hop])
        loss = gaps._edge(before[:, None], highest[:, None], after[:, None], scale)
        return np.bincount(hop, loss[:, 0], minlength=len(rope))

    def _spacing(self, rope: Array) -> Array:
        """C of the major edges [dB]; 0 for a single one."""
        distance, _ = self._take(rope)
        step = np.diff(distance, axis=1)
        before, after = step[:, :-1], step[:, 1:]
        end = self.distance.shape[1] - 1
        edge = (rope[:, 1:-1] > 0) & (rope[:, 1:-1] < end)
        last = edge & (rope[:, 2:] == end)
        with np.errstate(divide="ignore"):
            divisor = np.where(last, distance[:, -1:], np.where(edge, after, 1.0))
        factor = np.where(edge, (before + after) / np.where(edge, divisor, 1.0), 1.0)
        several = np.count_nonzero(edge, axis=1) > 1
        return np.where(several, 10.0 * np.log10(factor).sum(axis=1), 0.0)
