"""Buildings from a SUMO file of polygons."""

from pathlib import Path
from typing import Final

import numpy as np

from adapters.replay.findings import Findings, Place
from adapters.replay.shapes import read_shape
from adapters.replay.xml_stream import Element, read_xml
from adapters.traffic.geometry import Float
from adapters.traffic.remarks import no_buildings, no_heights
from adapters.traffic.surroundings import Buildings, open_ring

_BUILDING: Final = "building"
_ROOT: Final = "additional"
_YES: Final = frozenset({"true", "1", "yes", "on", "t", "x"})
"""What SUMO takes for true."""


def read_buildings(path: Path, default_height: float, findings: Findings) -> Buildings:
    """The polygons whose type is `building`, or begins with `building.`, in the file's order.

    Args:
        path: of the file with `<poly>` elements.
        default_height: of buildings without `<param key="height" .../>` [m].
        findings: takes what is wrong with it.
    """
    reader = _Reader(default_height, findings)
    for _ in read_xml(path, findings, reader.start):
        pass
    reader.finish()
    return Buildings.of(reader.rings, reader.heights)


class _Reader:
    def __init__(self, default_height: float, findings: Findings) -> None:
        self.rings: list[Float] = []
        self.heights: list[float] = []
        self._default = default_height
        self._findings = findings
        self._is_building = False
        self._places: list[Place] = []  # of the buildings
        self._silent: set[int] = set()  # those without a height
        self._others: dict[str, list[Place]] = {}

    def start(self, element: Element) -> None:
        """Take the start of an element."""
        if not element.parent and element.tag != _ROOT:
            what = f"`<{element.tag}>` is no SUMO file of polygons, whose root is `<{_ROOT}>`"
            self._findings.note(element.place, what)
        elif element.tag == "poly":
            written = element.attributes.get("type", "")
            self._is_building = written == _BUILDING or written.startswith(f"{_BUILDING}.")
            if self._is_building:
                self._silent.add(len(self.rings))
                self._places.append(element.place)
                self.rings.append(self._ring(element))
                self.heights.append(self._default)
            else:
                self._others.setdefault(written, []).append(element.place)
        elif self._is_building and element.tag == "param" and element.parent == "poly":
            self._take(element)

    def finish(self) -> None:
        """The file has been read: how many polygons are no buildings, or say no height."""
        for kind, places in self._others.items():
            self._findings.remark(places[0], no_buildings(len(places), kind))
        if self._silent:
            what = no_heights(len(self._silent), len(self.rings), self._default)
            self._findings.remark(self._places[min(self._silent)], what)

    def _ring(self, element: Element) -> Float:
        name = element.attributes.get("id", "")
        shape = read_shape(element.attributes.get("shape", ""))
        if element.attributes.get("geo", "").lower() in _YES:
            what = f"building `{name}` is in degrees (`geo`); metres of the net are needed"
            self._findings.note(element.place, what)
        if shape is None:
            what = f"`shape` of building `{name}` is no list of points, as in `0,0 10,0 10,5`"
            self._findings.note(element.place, what)
            return np.zeros((3, 2))
        ring = open_ring(shape)
        if len(ring) < 3:
            what = f"building `{name}` has {len(ring)} corners, at least 3 are needed"
            self._findings.note(element.place, what)
        return ring

    def _take(self, param: Element) -> None:
        if param.attributes.get("key") == "height":
            self.heights[-1] = self._height(param)
            self._silent.discard(len(self.heights) - 1)

    def _height(self, element: Element) -> float:
        written = element.attributes.get("value", "")
        try:
            height = float(written)
        except ValueError:
            height = 0.0
        if not 0.0 < height < np.inf:
            what = f"`height` is `{written}`, a positive number of metres is needed"
            self._findings.note(element.place, what)
        return height
