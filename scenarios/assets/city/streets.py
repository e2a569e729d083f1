"""The streets of a SUMO net: what buildings stand along, and where vehicles and persons go."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, TypeAlias
from xml.etree import ElementTree as ET

Point: TypeAlias = tuple[float, float]

_HEADER: Final = re.compile(r"<!-- generated.*?-->\n\s*", re.DOTALL)
_USUAL_WIDTH: Final = 3.2
"""Width of lanes that do not say theirs [m], SUMO's default."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lane:
    """A lane, of a street or over a junction.

    Attributes:
        shape: its centre line [m].
        width: [m].
    """

    shape: tuple[Point, ...]
    width: float

    @property
    def length(self) -> float:
        """Of the centre line [m]."""
        return math.fsum(map(math.dist, self.shape, self.shape[1:]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Streets:
    """What is read of a net.

    Attributes:
        kerbs: the rightmost lane of each edge, by the name of the edge.
        lanes: all lanes, those over junctions included.
        following: where each edge leads, by vehicles; without turning back, unless it is a dead
            end.
        lengths: of the edges [m].
    """

    kerbs: Mapping[str, Lane]
    lanes: Sequence[Lane]
    following: Mapping[str, Sequence[str]]
    lengths: Mapping[str, float]


def without_header(net: str) -> str:
    """A net without the comment that has the date."""
    return _HEADER.sub("", net, count=1)


def read_streets(net: str) -> Streets:
    """The streets of a net.

    Args:
        net: the text of a `*.net.xml`.
    """
    root = ET.fromstring(net)  # noqa: S314 - netgenerate has just made it
    kerbs: dict[str, Lane] = {}
    lanes = []
    for edge in root.iter("edge"):
        found = [_lane(lane) for lane in edge.iter("lane")]
        if edge.get("function") not in ("walkingarea", "crossing"):
            lanes += found
        if edge.get("function") is None:
            kerbs[str(edge.get("id"))] = found[0]
    onwards: dict[str, set[str]] = {edge: set() for edge in kerbs}
    back: dict[str, set[str]] = {edge: set() for edge in kerbs}
    for link in root.iter("connection"):
        start, end = str(link.get("from")), str(link.get("to"))
        if start in kerbs and end in kerbs:
            (back if link.get("dir") == "t" else onwards)[start].add(end)
    following = {edge: sorted(onwards[edge] or back[edge]) for edge in kerbs}
    lengths = {edge: kerb.length for edge, kerb in kerbs.items()}
    return Streets(kerbs=kerbs, lanes=lanes, following=following, lengths=lengths)


def _lane(lane: ET.Element) -> Lane:
    shape = []
    for point in str(lane.get("shape")).split():
        x, y = point.split(",")[:2]
        shape.append((float(x), float(y)))
    return Lane(shape=tuple(shape), width=float(lane.get("width", _USUAL_WIDTH)))
