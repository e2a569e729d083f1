"""The net of a scene: edges, lanes, the links between them and junctions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from adapters.traffic.geometry import Float


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """A way over a junction: from the end of one lane to the start of another."""

    to_lane: str
    via: str
    direction: str
    """`s` straight, `l` left, `r` right, `t` turn-around (SUMO's letters)."""


_FAR: Final = 1e5
"""A net beyond this [m] is counted from its own corner: sensors keep positions in single precision,
which is exact to a centimetre up to here."""

_GRID: Final = 1000.0
"""That corner is rounded down to a multiple of this [m]."""


class Net:
    """The roads of a SUMO simulation, which do not change.

    All positions are relative to `origin` in the coordinates of the net.

    Args:
        modules: of SUMO, as `Connection` has them.
        origin: x and y [m]; `None` for that of the net, or, if the net is far from it (UTM
            coordinates without an offset), the corner of the net rounded down to whole kilometres.

    Attributes:
        origin: x and y in the coordinates of the net [m].
    """

    def __init__(self, modules: Any, origin: tuple[float, float] | None) -> None:
        self._edge, self._junction, self._lane = modules.edge, modules.junction, modules.lane
        self._simulation = modules.simulation
        self._edges: dict[str, None] | None = None
        self._lanes: dict[str, None] | None = None
        if origin is None:
            origin = _origin_of(*self._simulation.getNetBoundary())
        self.origin = origin
        self._shift = np.array(origin)

    def lanes(self) -> list[str]:
        """Lanes outside junctions, sorted by name."""
        if self._lanes is None:
            names = (lane for lane in self._lane.getIDList() if not lane.startswith(":"))
            self._lanes = dict.fromkeys(sorted(names))
        return list(self._lanes)

    def has_lane(self, lane: str) -> bool:
        """Whether the net has `lane`, outside junctions."""
        self.lanes()
        return lane in (self._lanes or {})

    def edges(self) -> list[str]:
        """Edges outside junctions, sorted by name."""
        if self._edges is None:
            names = (edge for edge in self._edge.getIDList() if not edge.startswith(":"))
            self._edges = dict.fromkeys(sorted(names))
        return list(self._edges)

    def has_edge(self, edge: str) -> bool:
        """Whether the net has `edge`, outside junctions."""
        self.edges()
        return edge in (self._edges or {})

    def edge_of(self, lane: str) -> str:
        """The edge that `lane` belongs to."""
        return str(self._lane.getEdgeID(lane))

    def lanes_of(self, edge: str) -> list[str]:
        """The lanes of `edge`, from right to left."""
        return [f"{edge}_{k}" for k in range(self._edge.getLaneNumber(edge))]

    def index_of(self, lane: str) -> int:
        """The index of `lane` on its edge; 0 is the rightmost."""
        return int(lane.rsplit("_", 1)[1])

    def lane_length(self, lane: str) -> float:
        """The length of `lane` [m]."""
        return float(self._lane.getLength(lane))

    def lane_width(self, lane: str) -> float:
        """The width of `lane` [m]."""
        return float(self._lane.getWidth(lane))

    def allowed(self, lane: str) -> list[str]:
        """The classes of SUMO that may use `lane`."""
        return list(self._lane.getAllowed(lane))

    def allows(self, lane: str, vehicle_class: str) -> bool:
        """Whether vehicles of SUMO's `vehicle_class` may use `lane`."""
        return vehicle_class == "ignoring" or vehicle_class in self._lane.getAllowed(lane)

    def ends_of(self, edge: str) -> tuple[str, str]:
        """The junctions that `edge` comes from and leads to."""
        return self._edge.getFromJunction(edge), self._edge.getToJunction(edge)

    def junction_shape(self, junction: str) -> Float:
        """Vertices [m], shape (vertex, 2), as written: open or closed ring; there may be none."""
        return self.relative(self._junction.getShape(junction))

    def lane_shape(self, lane: str) -> Float:
        """Centre line [m], shape (vertex, 2)."""
        return self.relative(self._lane.getShape(lane))

    def links(self, lane: str) -> list[Link]:
        """Where `lane` leads, from right to left."""
        return [
            Link(to_lane=to, via=via, direction=letter)
            for to, _, _, _, via, _, letter, _ in self._lane.getLinks(lane)
        ]

    def speed_limit(self, lane: str) -> float:
        """The speed limit on `lane` [m/s]."""
        return float(self._lane.getMaxSpeed(lane))

    def way_between(self, start: str, end: str, kind: str) -> list[str]:
        """The edges of the fastest way from edge `start` to edge `end`; none if there is none."""
        found = self._simulation.findRoute(start, end, kind)
        return list(found.edges)

    def relative(self, shape: Sequence[Sequence[float]]) -> Float:
        """Points from the origin, without their heights [m], shape (vertex, 2).

        Args:
            shape: as SUMO says them, of two coordinates or three; there may be none.
        """
        points = np.array(shape, dtype=np.float64).reshape(len(shape), -1)[:, :2]
        shifted: Float = points.reshape(-1, 2) - self._shift
        return shifted


def _origin_of(low: Sequence[float], high: Sequence[float]) -> tuple[float, float]:
    """What the positions of a net are counted from.

    Args:
        low: its lower left corner [m].
        high: its upper right corner [m].
    """
    if max(map(abs, (*low[:2], *high[:2]))) <= _FAR:
        return 0.0, 0.0
    x, y = (math.floor(each / _GRID) * _GRID for each in low[:2])
    return x, y
