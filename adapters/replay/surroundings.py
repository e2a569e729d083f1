"""Buildings and the road around replayed traffic, and what is remarkable about their files."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from adapters.replay.buildings import read_buildings
from adapters.replay.findings import Findings
from adapters.replay.net import read_road
from adapters.traffic.surroundings import Buildings, RoadSurface
from orchestrator.errors import Problem

_State: TypeAlias = tuple[Path, int, int] | None
"""A file, when it was written [ns] and its length [byte]; `None` if there is none to read."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What two files say.

    Attributes:
        buildings, road: as far as they can be read.
        problems: what is wrong with the files, one line each.
        remarks: what is not wrong, but may not be meant.
    """

    buildings: Buildings
    road: RoadSurface
    problems: tuple[str, ...]
    remarks: tuple[Problem, ...]


def read_surroundings(
    buildings: Path | None, net: Path | None, default_height: float
) -> Surroundings:
    """Read the files, but for those that were read last and are as they were.

    Args:
        buildings: SUMO's file of polygons; `None`: there are no buildings.
        net: of SUMO; `None`: there is no road surface.
        default_height: of buildings that say none [m].
    """
    return _read(_state(buildings), _state(net), default_height)


@lru_cache(maxsize=1)
def _read(buildings: _State, net: _State, default_height: float) -> Surroundings:
    found, road = Buildings.of([], []), RoadSurface.of([])
    problems: list[str] = []
    remarks: list[Problem] = []
    if buildings is not None:
        findings = Findings(buildings[0])
        found = read_buildings(buildings[0], default_height, findings)
        problems += findings.lines(str)
        remarks += findings.remarks
    if net is not None:
        findings = Findings(net[0])
        road = read_road(net[0], findings)
        problems += findings.lines(str)
        remarks += findings.remarks
    return Surroundings(
        buildings=found, road=road, problems=tuple(problems), remarks=tuple(remarks)
    )


def _state(path: Path | None) -> _State:
    if path is None:
        return None
    try:
        state = path.stat()
    except OSError:
        return path, 0, 0  # whoever reads it says what is wrong
    return path, state.st_mtime_ns, state.st_size
