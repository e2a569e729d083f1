"""Which points belong to one curve over the packet error rate."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from studies.collision.condition import (
    CONSTANT,
    COOPERATIVE,
    USUAL_AGE,
    USUAL_POWER,
    Condition,
)
from studies.collision.runs import Point

PROBE: Final = "probe"
FRAME: Final = "frame"
DIRECT: Final = "direct"


@dataclass(frozen=True, slots=True, kw_only=True)
class CurveName:
    """What the points of a curve have in common.

    Attributes:
        channel: `constant`: over rates that are set; `simulated`: over relay methods.
        compression: of the features.
        speed_kmh: of the ego [km/h].
        maximum_age: up to which the policy uses features [s].
    """

    channel: str
    compression: int | None
    speed_kmh: float
    maximum_age: float | None = USUAL_AGE

    def columns(self) -> dict[str, Any]:
        """For tables."""
        return {
            "channel": self.channel,
            "compression": self.compression,
            "speed_kmh": self.speed_kmh,
            "maximum_age": self.maximum_age,
        }


def distinct(points: Sequence[Point]) -> list[Point]:
    """One point per condition: what several experiments have is taken from that of most runs."""
    chosen: dict[Condition, Point] = {}
    for point in points:
        if len(point.runs) > len(_runs(chosen.get(point.condition))):
            chosen[point.condition] = point
    return list(chosen.values())


def curves(points: Sequence[Point]) -> dict[CurveName, list[Point]]:
    """Of the cooperative policy, with the load of a probe and losses of whole messages.

    Only curves of two points or more, and only points whose packet error rate is known; those over
    constant rates are of the direct link.
    """
    found: dict[CurveName, list[Point]] = {}
    for point in distinct(points):
        if _belongs(point):
            found.setdefault(name_of(point.condition), []).append(point)
    return {name: each for name, each in found.items() if len(each) > 1}


def name_of(condition: Condition) -> CurveName:
    """The curve that a condition belongs to, if its load and granularity do."""
    return CurveName(
        channel=condition.channel,
        compression=condition.compression,
        speed_kmh=condition.speed_kmh,
        maximum_age=condition.maximum_age,
    )


def constant_curve(curves_: dict[CurveName, list[Point]], like: Condition) -> list[Point] | None:
    """The curve over constant rates of what else is like `like`."""
    return curves_.get(replace(name_of(like), channel=CONSTANT))


def is_usual(condition: Condition) -> bool:
    """Whether one packet stands for a message, as in the paper (load `probe`), at its power."""
    return (
        condition.load == PROBE
        and condition.granularity in (FRAME, "")
        and condition.transmit_power in (None, USUAL_POWER)
    )


def _belongs(point: Point) -> bool:
    """Over a relay two losses make one: there the rate that is set is not the one end to end."""
    condition = point.condition
    if condition.policy != COOPERATIVE or not is_usual(condition):
        return False
    if condition.channel == CONSTANT:
        return condition.relay == DIRECT
    return any(run.per is not None for run in point.runs.values())


def _runs(point: Point | None) -> tuple[int, ...]:
    return () if point is None else tuple(point.runs)
