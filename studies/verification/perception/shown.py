"""What the figures of a verification show, apart from how: few enough numbers to keep in a file.

Pictures are drawn from this alone, so that they can be drawn again without playing scenes.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import shapely
from pydantic import TypeAdapter
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from studies.verification.perception.parameter_set import (
    RECOMMENDED,
    SHARER_CURVES,
    ZONE_CURVES,
    Curve,
)
from studies.verification.perception.scoring import Played, zone_area
from studies.verification.perception.summary import (
    ALWAYS,
    DEMANDED,
    WHOLE,
    byte_share,
    traffic,
    zone_areas,
)
from studies.verification.perception.verification import DATA_SIZES, TARGET_BYTES, Verification

FILE: Final = "figures.json"
"""The name of the file beside the pictures."""

EGO: Final = "ego"
SHARER: Final = "chosen sharer"
BEST: Final = "best sharer"
CANDIDATE: Final = "other candidate"
OTHER: Final = "without radio"
"""What vehicles are in a scene."""

_SEAM: Final = 0.01
"""Gaps between blind zones that are not shown [m]."""

Numbers = tuple[float, ...]
Ring = tuple[tuple[float, float], ...]
"""Corners [m]; the first one is the last, too."""

Area = tuple[tuple[Ring, ...], ...]
"""Polygons: each an outline, and its holes the other way round."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A vehicle: what it is in the scene, and its footprint."""

    role: str
    area: Area


@dataclass(frozen=True, slots=True, kw_only=True)
class Example:
    """A scene, with the recommended parameters.

    Attributes:
        number: of the scene.
        told: what the chosen sharer reveals [m^2]; 0 without one.
        best: what the best one does [m^2].
        road, buildings: what there is.
        hidden: road that the ego vehicle does not see, in truth.
        zones: its blind zones.
        route: of the ego vehicle [m]; it begins at its position.
        bodies: vehicles.
    """

    number: int
    told: float
    best: float
    road: Area
    buildings: Area
    hidden: Area
    zones: Area
    route: Ring
    bodies: tuple[Body, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneCurve:
    """How good blind zones are over T1 [`panel` says of what], for one range of windows."""

    panel: str
    windows: str
    threshold: Numbers
    precision: Numbers
    recall: Numbers
    iou: Numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class SharerCurve:
    """Shares of scenes over a parameter: right sharers with an interval of 95 %, and none."""

    parameter: str
    values: Numbers
    right: Numbers
    low: Numbers
    high: Numbers
    missed: Numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Cost:
    """What one way of sharing takes, with sensor data of one size.

    Attributes:
        way: of sharing.
        size: of the sensor data, in words.
        candidates: how many there are, in words.
        shares: bytes over those of always-on sharing, by `candidates`; none of that one itself.
        bytes: per scan, over all scenes but those with many candidates.
        revealed: hidden road that becomes known per scene [m^2].
    """

    way: str
    size: str
    candidates: tuple[str, ...]
    shares: Numbers
    bytes: float
    revealed: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Shown:
    """All of it.

    Attributes:
        scenes: how many were played.
        wanted: of them, those in which there is something to reveal.
        target: largest share of the bytes of always-on sharing.
        examples, zones, sharers, costs: what is drawn.
    """

    scenes: int
    wanted: int
    target: float
    examples: tuple[Example, ...]
    zones: tuple[ZoneCurve, ...]
    sharers: tuple[SharerCurve, ...]
    costs: tuple[Cost, ...]

    @classmethod
    def of(cls, found: Verification) -> Self:
        """What is to be shown of a verification."""
        return cls(
            scenes=len(found.results),
            wanted=found.recommended.scenes,
            target=TARGET_BYTES,
            examples=tuple(_example(one) for one in found.examples),
            zones=tuple(_zones(found, curve) for curve in ZONE_CURVES),
            sharers=tuple(_sharers(found, curve) for curve in SHARER_CURVES),
            costs=tuple(_costs(found)),
        )

    @classmethod
    def read(cls, folder: Path) -> Self:
        """What `write` wrote into `folder`.

        Raises:
            FileNotFoundError: nothing.
            ValueError: it is something else.
        """
        return TypeAdapter(cls).validate_json((folder / FILE).read_bytes())

    def write(self, folder: Path) -> None:
        """Keep it in `folder`, so that pictures can be drawn again."""
        text = json.dumps(_without_nan(asdict(self)), separators=(",", ":"))
        (folder / FILE).write_text(text.replace("],", "],\n") + "\n", encoding="utf-8")


def _without_nan(value: Any) -> Any:
    """JSON has no word for what is not known, e.g. shares of nothing; `"NaN"` is read as that."""
    if isinstance(value, Mapping):
        return {key: _without_nan(member) for key, member in value.items()}
    if isinstance(value, tuple):
        return [_without_nan(member) for member in value]
    return "NaN" if isinstance(value, float) and np.isnan(value) else value


def _numbers(values: Iterable[float]) -> Numbers:
    return tuple(float(f"{value:.6g}") for value in values)


def _example(played: Played) -> Example:
    scene, truth = played.scene, played.truth
    match = played.matches[RECOMMENDED.name]
    best = max(truth.areas, key=lambda one: truth.areas[one])
    roles = dict.fromkeys(scene.candidates, CANDIDATE) | {best: BEST, scene.ego: EGO}
    if match.sharers:
        roles[match.sharers[0]] = SHARER
    zones = zone_area(match, scene.by_id[scene.ego].heading).buffer(_SEAM, join_style="mitre")
    told = truth.areas[match.sharers[0]] if match.sharers else 0.0
    return Example(
        number=played.result.number,
        told=round(told, 2),
        best=round(truth.best, 2),
        road=_area(scene.road),
        buildings=tuple(part for one in scene.buildings for part in _area(Polygon(one.ring))),
        hidden=_area(truth.hidden),
        zones=_area(zones),
        route=_ring(scene.route),
        bodies=tuple(
            Body(role=roles.get(one.id, OTHER), area=_area(one.footprint)) for one in scene.vehicles
        ),
    )


def _area(area: BaseGeometry) -> Area:
    parts = [orient(one) for one in shapely.get_parts(area) if isinstance(one, Polygon)]
    return tuple(
        tuple(_ring(np.array(ring.coords)) for ring in (part.exterior, *part.interiors))
        for part in parts
    )


def _ring(corners: np.ndarray[Any, Any]) -> Ring:
    return tuple((round(float(x), 2), round(float(y), 2)) for x, y in corners)


def _zones(found: Verification, curve: Curve) -> ZoneCurve:
    areas = [zone_areas(found.results, one.name) for one in curve.sets.values()]
    return ZoneCurve(
        panel=curve.panel,
        windows=curve.label,
        threshold=_numbers(curve.sets),
        precision=_numbers(one.precision for one in areas),
        recall=_numbers(one.recall for one in areas),
        iou=_numbers(one.iou for one in areas),
    )


def _sharers(found: Verification, curve: Curve) -> SharerCurve:
    scores = [found.score(one) for one in curve.sets.values()]
    return SharerCurve(
        parameter=curve.panel,
        values=_numbers(curve.sets),
        right=_numbers(one.right for one in scores),
        low=_numbers(one.right_low for one in scores),
        high=_numbers(one.right_high for one in scores),
        missed=_numbers(one.missed for one in scores),
    )


def _costs(found: Verification) -> Sequence[Cost]:
    groups = found.by_candidates()
    count = max(len(found.results), 1)
    return [
        Cost(
            way=way,
            size=size,
            candidates=tuple(groups),
            shares=_numbers(
                byte_share(group, RECOMMENDED.name, data, way)
                for group in groups.values()
                if way != ALWAYS
            ),
            bytes=round(ways[way].bytes / count, 2),
            revealed=round((ways[way].area or 0.0) / count, 2),
        )
        for size, data in DATA_SIZES.items()
        for ways in [traffic(found.results, RECOMMENDED.name, data)]
        for way in (DEMANDED, WHOLE, ALWAYS)
    ]
