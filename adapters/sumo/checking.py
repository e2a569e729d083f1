"""What `nlosim check` finds in a SUMO scene."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from adapters.sumo.checks.demand import DemandElements, Scene
from adapters.sumo.checks.departures import UNSORTED, Departures
from adapters.sumo.checks.findings import Findings
from adapters.sumo.checks.net import NetElements, Roads
from adapters.sumo.checks.polygons import HEIGHTS, SHAPES, PolygonReader
from adapters.sumo.checks.reading import WellFormed, read
from adapters.sumo.files import FileKind, NamedFile, SceneFiles, read_scene
from adapters.sumo.parameters import BUILDING_HEIGHT
from adapters.sumo.probing import probe
from orchestrator.errors import Location, Problem

_MESOSCOPIC: Final = (
    "with `mesosim` SUMO has queues instead of lanes: bodies overlap, and places between the ends "
    "of queues are estimates; entities cannot take part"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneCheck:
    """What has been found in the files of a scene.

    Attributes:
        files: of the scene.
        problems: what keeps it from being simulated, each at its place, in the order of the files.
        remarks: what is not wrong, but may not be meant.
        declared: where ids are declared, by kind and id.
        is_empty: whether no vehicle, person or flow is declared.
        roads: edges and lanes of the net.
        types: vehicle types, without distributions of them.
    """

    files: SceneFiles
    roads: Roads
    types: frozenset[str]
    declared: Mapping[tuple[str, str], Location]
    problems: tuple[Problem, ...]
    remarks: tuple[Problem, ...]
    is_empty: bool


def check_scene(
    config: Path, *, thorough: bool, building_height: float = BUILDING_HEIGHT
) -> SceneCheck:
    """Check the files of a scene.

    Args:
        config: the configuration (`*.sumocfg`).
        thorough: whether SUMO opens the scene, too, in a process of its own; that is done only
            if nothing else is wrong.
        building_height: of buildings that say none [m].
    """
    files, problems = read_scene(config)
    forgiven = {SHAPES, HEIGHTS, UNSORTED}
    if files.is_on("ignore-route-errors"):
        forgiven.add("unknown edges")
    findings = Findings(forgiven=frozenset(forgiven))
    roads = Roads()
    scene = Scene(findings, roads, PolygonReader(findings, roads, building_height))
    unreadable = _read_contents(files, scene)
    problems = sorted({*problems, *unreadable, *findings.problems()}, key=_place)
    if files.is_on("mesosim"):
        findings.remark(files.settings["mesosim"].where, _MESOSCOPIC)
    remarks = findings.all_remarks()
    if thorough and not problems:
        seen = probe(files, scene.ids)
        problems, remarks = list(seen.problems), [*remarks, *seen.remarks]
    return SceneCheck(
        files=files,
        problems=tuple(problems),
        remarks=tuple(remarks),
        is_empty=scene.roads.complete and not scene.traffic,
        roads=scene.roads,
        types=frozenset(scene.types - scene.distributions),
        declared=scene.ids,
    )


def _read_contents(files: SceneFiles, scene: Scene) -> list[Problem]:
    """Read every file; returns why some cannot be read to their ends."""
    unreadable: list[Problem] = []
    net = NetElements(scene.findings, scene.roads)
    present = [each for each in files.inputs if each.path.is_file()]
    for each in present:
        problems = _read(each, net, scene, in_parts=files.reads_routes_in_parts)
        unreadable += problems
        if each.kind is FileKind.NET and not problems:
            net.finish()
    scene.polygons.finish()
    if unreadable or len(present) < len(files.inputs) or not scene.roads.complete:
        return unreadable  # what seems to be missing may be declared where it cannot be read
    scene.finish()
    return unreadable


def _read(each: NamedFile, net: NetElements, scene: Scene, *, in_parts: bool) -> list[Problem]:
    match each.kind:
        case FileKind.NET:
            return read(each.path, net)
        case FileKind.ROUTES:
            departures = Departures(scene.findings) if in_parts else None
            return read(each.path, DemandElements(scene, "routes", departures))
        case FileKind.ADDITIONAL:
            return read(each.path, DemandElements(scene, "additional"))
        case _:
            return read(each.path, WellFormed()) if each.path.suffix == ".xml" else []


def _place(problem: Problem) -> tuple[Location, str]:
    return problem.where, problem.what
