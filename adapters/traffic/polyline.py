"""Polylines in the plane: centre lines of lanes and routes."""

import math

import numpy as np

from adapters.traffic.geometry import Float


class Polyline:
    """A polyline, measured by the distance along it from its first vertex; immutable."""

    def __init__(self, vertices: Float) -> None:
        """Take the vertices [m], shape (vertex, 2): at least two, no two neighbours equal."""
        self.vertices = vertices
        self.vectors = np.diff(vertices, axis=0)
        lengths = np.hypot(self.vectors[:, 0], self.vectors[:, 1])
        self._stations = np.concatenate([[0.0], np.cumsum(lengths)])
        # plain numbers: there are few segments, and NumPy costs more than it saves on few
        self._segments = [
            (
                float(x),
                float(y),
                float(dx / length),
                float(dy / length),
                float(length),
                float(start),
            )
            for (x, y), (dx, dy), length, start in zip(
                vertices[:-1], self.vectors, lengths, self._stations[:-1], strict=True
            )
        ]

    @property
    def length(self) -> float:
        """The length of the whole polyline [m]."""
        return float(self._stations[-1])

    def station(self, x: float, y: float) -> float:
        """Distance along the polyline [m] of its point nearest to `x`, `y` [m]."""
        nearest, found = math.inf, 0.0
        for start_x, start_y, ahead_x, ahead_y, length, start in self._segments:
            to_x, to_y = x - start_x, y - start_y
            along = min(max(to_x * ahead_x + to_y * ahead_y, 0.0), length)
            apart = (to_x - along * ahead_x) ** 2 + (to_y - along * ahead_y) ** 2
            if apart < nearest:
                nearest, found = apart, start + along
        return found

    def at(self, station: float) -> Float:
        """The point [m], shape (2,), at `station` [m]; beyond the ends, the end."""
        x, y = (np.interp(station, self._stations, axis) for axis in self.vertices.T)
        return np.array([x, y])

    def beyond(self, station: float) -> Float:
        """The rest of the polyline from `station` [m] on, shape (vertex, 2)."""
        return np.vstack([self.at(station), self.vertices[self._stations > station]])

    def crossing(self, other: "Polyline") -> Float | None:
        """The first point [m], shape (2,), of this polyline that lies on `other`, if any."""
        for start, along in zip(self.vertices[:-1], self.vectors, strict=True):
            fraction = _first_crossing(start, along, other)
            if fraction is not None:
                point: Float = start + fraction * along
                return point
        return None


def _first_crossing(start: Float, along: Float, other: Polyline) -> float | None:
    """Where in 0..1 the segment from `start` meets `other` first, if at all."""
    determinant = along[0] * other.vectors[:, 1] - along[1] * other.vectors[:, 0]
    crosses = determinant != 0.0  # parallel segments meet nowhere, or everywhere
    apart, vectors = (other.vertices[:-1] - start)[crosses], other.vectors[crosses]
    here = (apart[:, 0] * vectors[:, 1] - apart[:, 1] * vectors[:, 0]) / determinant[crosses]
    there = (apart[:, 0] * along[1] - apart[:, 1] * along[0]) / determinant[crosses]
    within = (here >= 0.0) & (here <= 1.0) & (there >= 0.0) & (there <= 1.0)
    return float(here[within].min()) if within.any() else None
