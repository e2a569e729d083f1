"""`building_shadowing.json`, `vehicle_shadowing.json` and `knife_edge_profile.json`: obstacles.

In a golden file each building has its own loss per wall and per metre; in the channel there is
one of each. The buildings of one kind are therefore given to an instance of their own, without the
others, and the losses of all kinds are added: that is exact, for losses of buildings add up.

Cases in which Veins stops on an assertion have no golden result, and cases of the category
`degenerate` (a link exactly through a corner, along a wall, or with an end exactly on it) are luck
of rounding there. From the channel they ask for a finite loss only.
"""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from fmus.messages.records import NO_VEHICLE
from orchestrator.signal import Array
from studies.verification.channel.check import Case, ProbedLinks, ValueCheck
from studies.verification.channel.golden_files import Node, read_json
from studies.verification.channel.session import building_inputs, link_inputs, vehicle_inputs
from studies.verification.channel.tolerances import LOSS

BUILDINGS: Final = "building_shadowing.json"
VEHICLES: Final = "vehicle_shadowing.json"
KNIFE_EDGES: Final = "knife_edge_profile.json"
DEGENERATE: Final = "degenerate"
_ASSERT: Final = "veins_assert"
_THICKNESS: Final = 1e-3
"""Length of a body that stands for an edge [m]. Veins' edge is at the face nearest to the
transmitter, whatever is behind."""


@dataclass(frozen=True, slots=True)
class _Kind:
    """What a building costs."""

    wall_loss: float  # [dB]
    indoor_loss: float  # [dB/m]


@dataclass(frozen=True, slots=True)
class _Houses:
    """Links through a scene of buildings; `first` is the index of the first link's case."""

    rings: Mapping[_Kind, Sequence[Sequence[Sequence[float]]]]
    links: Mapping[str, Array]
    first: int
    count: int


def read_buildings(path: Path) -> ValueCheck:
    """Read losses by buildings, of links through scenes of polygons.

    Raises:
        GoldenError: the file is malformed.
    """
    cases: list[Case] = []
    scenes = []
    for node in read_json(path, BUILDINGS).filled():
        scenes.append(_houses(node, first=len(cases)))
        cases += _building_cases(node)
    kinds = dict.fromkeys(kind for one in scenes for kind in one.rings)
    return ValueCheck(
        tolerance=LOSS,
        cases=cases,
        questions=[_about_kind(kind, [s for s in scenes if kind in s.rings]) for kind in kinds],
        has_exceptions=True,
    )


def _about_kind(kind: _Kind, scenes: Sequence[_Houses]) -> ProbedLinks:
    """What buildings of this kind cost, in the scenes that have any."""
    return ProbedLinks(
        cases=[one.first + k for one in scenes for k in range(one.count)],
        probe="building_loss",
        parameters={"wall_loss": kind.wall_loss, "indoor_loss": kind.indoor_loss},
        scenes=[{**building_inputs(one.rings[kind]), **one.links} for one in scenes],
    )


def _houses(node: Node, first: int) -> _Houses:
    rings: dict[_Kind, list[Sequence[Sequence[float]]]] = defaultdict(list)
    for obstacle in node["obstacles"]:
        kind = _Kind(obstacle["db_per_cut"].number(), obstacle["db_per_meter"].number())
        rings[kind].append(obstacle["shape"].ring())
    queries = list(node["queries"])
    links = link_inputs(
        [query["tx"].numbers(3) for query in queries],
        [query["rx"].numbers(3) for query in queries],
    )
    return _Houses(rings, links, first, len(queries))


def _building_cases(node: Node) -> Iterator[Case]:
    category = node["category"].text()
    for query in node["queries"]:
        golden = _building_loss(query)
        yield Case(
            place=query.case,
            golden=golden,
            series=category,
            is_excepted=math.isnan(golden) or category == DEGENERATE,
        )


def _building_loss(query: Node) -> float:
    status = query["status"].text()
    if status == _ASSERT:
        return float("nan")
    if status != "ok":
        raise query["status"].problem(f"`{status}` is not known; there are: ok, {_ASSERT}")
    return query["loss_db"].number()


@dataclass(frozen=True, slots=True)
class _Link:
    """A link over vehicles or edges, as inputs of the channel."""

    frequency: float
    scene: Mapping[str, Array]
    ends: Mapping[str, Array]
    case: Case


def read_vehicles(path: Path) -> ValueCheck:
    """Read losses by vehicle bodies, of links over scenes of vehicles.

    The number of a vehicle is its place in the list, which is the order of registration in Veins:
    of two edges at exactly the same distance only the first counts.

    Raises:
        GoldenError: the file is malformed.
    """
    return _over_bodies([list(_links(node)) for node in read_json(path, VEHICLES).filled()])


def read_knife_edges(path: Path) -> ValueCheck:
    """Read losses over given heights at given distances along a link.

    Each edge becomes the front of a thin body across the link. Distances are meant along the line
    between the antennas, in space, and both antennas have their own heights: the bodies stand where
    that line has covered the distance.

    Raises:
        GoldenError: the file is malformed.
    """
    return _over_bodies([[_profile(node)] for node in read_json(path, KNIFE_EDGES).filled()])


def _over_bodies(scenes: Sequence[Sequence[_Link]]) -> ValueCheck:
    """Losses over the bodies of scenes; an instance answers the links of one frequency."""
    cases: list[Case] = []
    questions = []
    for frequency in sorted({link.frequency for links in scenes for link in links}):
        own = [[link for link in links if link.frequency == frequency] for links in scenes]
        first = len(cases)
        cases += [link.case for links in own for link in links]
        questions.append(
            ProbedLinks(
                cases=range(first, len(cases)),
                probe="vehicle_loss",
                parameters={"carrier_frequency": frequency},
                scenes=[{**links[0].scene, **_together(links)} for links in own if links],
            )
        )
    return ValueCheck(tolerance=LOSS, cases=cases, questions=questions)


def _together(links: Sequence[_Link]) -> dict[str, Array]:
    return {name: np.concatenate([link.ends[name] for link in links]) for name in links[0].ends}


def _links(node: Node) -> Iterator[_Link]:
    bodies = list(node["vehicles"])
    owners: dict[int, int] = {}
    for k, body in enumerate(bodies):
        antenna = body["antenna_id"].whole()
        if antenna in owners:
            raise body["antenna_id"].problem(
                f"{antenna} is the antenna of vehicle {owners[antenna]}"
            )
        owners[antenna] = k
    vehicles = vehicle_inputs(
        range(len(bodies)),
        [(body["x"].number(), body["y"].number()) for body in bodies],
        [body["heading_rad"].number() for body in bodies],
        [[body[name].positive() for name in ("length", "width", "height")] for body in bodies],
        np.array([body["host_offset"].number() for body in bodies]),
    )
    category = node["category"].text()
    for query in node["queries"]:
        antennas = [query[name].whole() for name in ("tx_antenna_id", "rx_antenna_id")]
        carriers = [owners.get(antenna, NO_VEHICLE) for antenna in antennas]
        ends = link_inputs(query["tx"].numbers(3), query["rx"].numbers(3), carriers)
        yield _link(query, category, vehicles, ends)


def _link(query: Node, series: str, scene: Mapping[str, Array], ends: Mapping[str, Array]) -> _Link:
    case = Case(place=query.case, golden=query["loss_db"].number(), series=series)
    return _Link(query["freq_hz"].positive(), scene, ends, case)


def _profile(node: Node) -> _Link:
    points = np.array([point.numbers(2) for point in node["profile"]])
    if len(points) < 2:
        raise node["profile"].problem("needs two points at least, the antennas")
    distance, height = points[:, 0], points[:, 1]
    if distance[0] != 0 or (np.diff(distance) <= 0).any():
        raise node["profile"].problem("distances must start at 0 and ascend")
    if abs(height[-1] - height[0]) >= distance[-1]:
        raise node["profile"].problem("the antennas are closer than their heights differ")
    length = distance[-1]  # in space
    ground = np.sqrt(length**2 - (height[-1] - height[0]) ** 2)
    bodies = _edges(distance[1:-1] * (ground / length), height[1:-1])
    ends = link_inputs([0.0, 0.0, height[0]], [ground, 0.0, height[-1]])
    return _link(node, "given profiles", bodies, ends)


def _edges(front: Array, height: Array) -> Mapping[str, Array]:
    """Thin bodies across the x axis."""
    n = len(front)
    return vehicle_inputs(
        range(n),
        np.stack([front, np.zeros(n)], axis=-1),
        np.full(n, np.pi),  # towards the transmitter, so that the front is the near face
        np.stack([np.full(n, _THICKNESS), np.full(n, 2.0), height], axis=-1),
    )
