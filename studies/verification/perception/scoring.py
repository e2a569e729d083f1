"""One scene: what the units found, beside what is so."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.bytes_on_air import Demanded, Matrices, cpm_sizes, demand
from studies.verification.perception.generator import FEW, Candidates, draw_scene
from studies.verification.perception.parameter_set import ParameterSet
from studies.verification.perception.scene import Scene
from studies.verification.perception.session import Match, Scans, UnitsUnderTest
from studies.verification.perception.truth import CELLS, Interest, Truth, best_by_cells, find_truth


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneAreas:
    """Areas within the area of interest [m^2].

    Attributes:
        zones: in a blind zone.
        hidden: hidden in truth.
        both: in a blind zone, and hidden in truth.
    """

    zones: float
    hidden: float
    both: float

    def __add__(self, other: "ZoneAreas") -> "ZoneAreas":
        """The areas of two scenes together."""
        return ZoneAreas(
            zones=self.zones + other.zones,
            hidden=self.hidden + other.hidden,
            both=self.both + other.both,
        )

    @property
    def precision(self) -> float:
        """Share of the zones that is hidden; NaN without zones."""
        return self.both / self.zones if self.zones else float("nan")

    @property
    def recall(self) -> float:
        """Share of what is hidden that is in zones; NaN if nothing is hidden."""
        return self.both / self.hidden if self.hidden else float("nan")

    @property
    def iou(self) -> float:
        """Intersection of zones and hidden road over their union; NaN if both are empty."""
        union = self.zones + self.hidden - self.both
        return self.both / union if union else float("nan")


def zone_area(match: Match, heading: float) -> BaseGeometry:
    """Unite the blind zones.

    Args:
        match: has their centres and ranges.
        heading: that the ego vehicle believes to have, along which the squares are turned [rad].
    """
    if len(match.ranges) == 0:
        return Polygon()  # of a known dimension, unlike the union of nothing
    forward = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-forward[1], forward[0]])
    square = np.stack([-forward - left, forward - left, forward + left, left - forward])
    rings = match.centers[:, None] + match.ranges[:, None, None] * square
    return shapely.union_all(shapely.polygons(rings))


def compare_zones(area: BaseGeometry, truth: Truth) -> ZoneAreas:
    """Measure the areas of one scene; `area` is the union of its blind zones."""
    zones = shapely.intersection(area, truth.interest)
    return ZoneAreas(
        zones=float(zones.area),
        hidden=float(truth.hidden.area),
        both=float(shapely.intersection(zones, truth.hidden).area),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What one parameter set made of a scene.

    Attributes:
        zones: areas of blind zones.
        sharers: ids, best first; none without a trigger.
        apm_bytes: of the APMs of all equipped vehicles.
        demanded: what the first sharer is asked for, and answers; None without a trigger.
    """

    zones: ZoneAreas
    sharers: tuple[int, ...]
    apm_bytes: int
    demanded: Demanded | None

    @property
    def sharer(self) -> int | None:
        """The first of the sharers; None without a trigger."""
        return self.sharers[0] if self.sharers else None


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneResult:
    """What is so in a scene, and what every parameter set made of it.

    Attributes:
        number: of the scene.
        candidates: number of equipped vehicles, without the ego vehicle.
        areas: what each candidate reveals [m^2], by id.
        nearest: the candidate nearest to the ego vehicle.
        by_cells: whom exact matrices would choose, by the side of their cells [m].
        all_area: what all candidates together reveal [m^2].
        hidden_area, interest_area: [m^2].
        hidden_vehicles: how many there are.
        found: how many of them each candidate tells about, by id.
        all_found: how many of them all candidates together tell about.
        points: of all equipped vehicles' scans.
        cpm_bytes: of the collective perception messages of all equipped vehicles.
        choices: by the name of the parameter set.
    """

    number: int
    candidates: int
    areas: Mapping[int, float]
    nearest: int
    by_cells: Mapping[float, int]
    all_area: float
    hidden_area: float
    interest_area: float
    hidden_vehicles: int
    found: Mapping[int, int]
    all_found: int
    points: int
    cpm_bytes: int
    choices: Mapping[str, Choice]

    @property
    def best(self) -> float:
        """What the candidate that reveals most reveals [m^2]."""
        return max(self.areas.values())

    @property
    def equipped(self) -> int:
        """Vehicles that send: the candidates and the ego vehicle."""
        return self.candidates + 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """A scene with its truth and with what the units said about it.

    Attributes:
        scene: what there is.
        truth: what is so.
        matches: by the name of the parameter set.
        result: the comparison.
    """

    scene: Scene
    truth: Truth
    matches: Mapping[str, Match]
    result: SceneResult


def play(
    units: UnitsUnderTest,
    seed: int,
    number: int,
    sets: Sequence[ParameterSet],
    candidates: Candidates = FEW,
) -> Played:
    """Draw a scene, and compare what `units` find with the truth.

    Raises:
        ComponentError: a unit failed.
    """
    scene = draw_scene(seed, number, candidates)
    truth = find_truth(scene, Interest())
    scans = units.scan(scene, number)
    messages, matrices = {}, {}
    matches, choices = {}, {}
    for one in sets:
        key, believed = one.messages, scans.believed(one.accuracy, number)
        if key not in messages:
            messages[key] = units.apms(scene, believed, one.matrix)
            matrices[key] = Matrices(messages[key][0])
        match = units.match(scene, believed, messages[key][0], one)
        matches[one.name] = match
        choices[one.name] = _choice(scene, truth, scans, matrices[key], match)
    _, objects = next(iter(messages.values()))
    result = SceneResult(
        number=number,
        candidates=len(scene.candidates),
        areas=truth.areas,
        nearest=_nearest(scene),
        by_cells={cell: best_by_cells(scene, truth.interest, truth.known, cell) for cell in CELLS},
        all_area=float(shapely.union_all(list(truth.revealed.values())).area),
        hidden_area=float(truth.hidden.area),
        interest_area=float(truth.interest.area),
        hidden_vehicles=len(truth.hidden_vehicles),
        found={one: len(truth.found_by(one)) for one in scene.candidates},
        all_found=len(set().union(*(truth.found_by(one) for one in scene.candidates))),
        points=sum(scans.counts.values()),
        cpm_bytes=sum(cpm_sizes(scene, objects).values()),
        choices=choices,
    )
    return Played(scene=scene, truth=truth, matches=matches, result=result)


def _choice(scene: Scene, truth: Truth, scans: Scans, matrices: Matrices, match: Match) -> Choice:
    area = zone_area(match, matrices.heading(scene.ego))
    return Choice(
        zones=compare_zones(area, truth),
        sharers=match.sharers if match.trigger else (),
        apm_bytes=matrices.size,
        demanded=demand(scene, truth, scans, matrices, match, area=area) if match.trigger else None,
    )


def _nearest(scene: Scene) -> int:
    vehicles = scene.by_id
    own = np.array(vehicles[scene.ego].position)
    return min(
        scene.candidates,
        key=lambda one: float(np.linalg.norm(np.array(vehicles[one].position) - own)),
    )
