"""The drivable surface from a SUMO net.

https://sumo.dlr.de/docs/Networks/SUMO_Road_Networks.html has the format.
"""

from pathlib import Path
from typing import Final

import numpy as np

from adapters.replay.findings import Findings, Place
from adapters.replay.shapes import read_shape
from adapters.replay.xml_stream import Element, read_xml
from adapters.traffic.geometry import Float
from adapters.traffic.remarks import flat
from adapters.traffic.surroundings import RoadSurface, area, open_ring, strip

ROOT: Final = "net"

_CARS: Final = "passenger"
_LANE_WIDTH: Final = 3.2
"""Metres: SUMO's width of lanes that do not say their own."""


def read_road(path: Path, findings: Findings) -> RoadSurface:
    """Lanes outside junctions that passenger cars may use, and the junctions at their ends.

    Ordered by name, lanes first. Lanes inside junctions are left out: they lie within the
    junction's own polygon.

    Args:
        path: of the net (`*.net.xml`, which may be compressed).
        findings: takes what is wrong with it.
    """
    reader = _Reader(findings)
    for _ in read_xml(path, findings, reader.start):
        pass
    reader.finish()
    return RoadSurface.of([] if findings else reader.rings())


class _Reader:
    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._ends: set[str] = set()
        self._edge_ends: set[str] = set()
        self._is_inside = False
        self._lanes: dict[str, tuple[Float, float]] = {}
        self._junctions: dict[str, Float] = {}
        self._low, self._high = np.inf, -np.inf
        self._first_high: Place | None = None

    def start(self, element: Element) -> None:
        """Take the start of an element."""
        tag, attributes = element.tag, element.attributes
        if not element.parent and tag != ROOT:
            what = f"`<{tag}>` is no SUMO net, whose root is `<{ROOT}>`"
            self._findings.note(element.place, what)
        elif tag == "edge" and element.parent == ROOT:
            self._is_inside = attributes.get("id", "").startswith(":")  # of a junction
            self._edge_ends = {attributes.get("from", ""), attributes.get("to", "")}
        elif tag == "lane" and element.parent == "edge":
            if not self._is_inside and _allows_cars(element):
                self._take_lane(element)
        elif tag == "junction" and element.parent == ROOT:
            shape = self._shape(element) if attributes.get("shape") else np.zeros((0, 2))
            self._junctions[attributes.get("id", "")] = open_ring(shape)

    def finish(self) -> None:
        """The net has been read: whether it goes up and down."""
        if self._first_high is not None and self._low < self._high:
            self._findings.remark(self._first_high, flat(self._low, self._high))

    def rings(self) -> list[Float]:
        """The outlines of lanes and junctions, shape (vertex, 2) each."""
        lanes = [strip(*self._lanes[name]) for name in sorted(self._lanes)]
        ends = [self._junctions[name] for name in sorted(self._ends) if name in self._junctions]
        return [*lanes, *(ring for ring in ends if area(ring) > 0.0)]  # a dead end has none

    def _take_lane(self, lane: Element) -> None:
        shape = self._shape(lane)
        self._look_at_heights(lane)
        if not np.any(np.diff(shape, axis=0)):
            self._findings.note(lane.place, "`shape` of this lane has fewer than two points")
        try:
            width = float(lane.attributes.get("width", _LANE_WIDTH))
        except ValueError:
            width = 0.0
        if not 0.0 < width < np.inf:
            what = f"`width` is `{lane.attributes.get('width')}`, a positive number is needed"
            self._findings.note(lane.place, what)
        self._lanes[lane.attributes.get("id", "")] = (shape, width)
        self._ends |= self._edge_ends

    def _look_at_heights(self, lane: Element) -> None:
        """Note the heights of a lane's points, which are at 0 m if they say none."""
        points = [point.split(",") for point in lane.attributes.get("shape", "").split()]
        try:
            heights = [float(point[2]) if len(point) > 2 else 0.0 for point in points]
        except ValueError:  # SUMO itself cannot read it
            return
        if any(len(point) > 2 for point in points) and self._first_high is None:
            self._first_high = lane.place
        self._low, self._high = min([self._low, *heights]), max([self._high, *heights])

    def _shape(self, element: Element) -> Float:
        shape = read_shape(element.attributes.get("shape", ""))
        if shape is None:
            name = element.attributes.get("id", "")
            what = f"`shape` of {element.tag} `{name}` is no list of points, as in `0,0 10,0`"
            self._findings.note(element.place, what)
            return np.array([[0.0, 0.0], [1.0, 0.0]])
        return shape


def _allows_cars(lane: Element) -> bool:
    allowed = lane.attributes.get("allow")
    if allowed is not None:
        return not {_CARS, "all"}.isdisjoint(allowed.split())
    return {_CARS, "all"}.isdisjoint(lane.attributes.get("disallow", "").split())
