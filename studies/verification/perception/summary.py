"""Measures over many scenes, and why the wrong sharer was chosen."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Final

import numpy as np

from orchestrator.intervals import wilson
from studies.verification.perception.bytes_on_air import RAW_POINT, REQUEST, Demanded
from studies.verification.perception.scoring import SceneResult, ZoneAreas

DEMAND: Final = 25.0
"""A scene has demand if some candidate reveals this much [m^2]: one cell of 5 m, or 8 m of lane."""
NOTHING: Final = 5.0
"""Nobody reveals anything worth mention if nobody reveals this much [m^2]."""
RIGHT: Final = 0.95
"""A sharer is right if it reveals this share of what the best one reveals."""

Pick = Callable[[SceneResult], int | None]
"""Chooses a candidate, or nobody."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SharerScore:
    """How well sharers were chosen. Shares are of the scenes with demand; nobody is wrong.

    Attributes:
        scenes: with demand.
        strict: share in which the best candidate was chosen.
        right: share in which the chosen one reveals `RIGHT` of what the best one does.
        right_low, right_high: Wilson interval of 95 % of `right`.
        revealed: mean share of what the best one reveals that the chosen one does.
        missed: share without a trigger.
        false: share with a trigger of the scenes in which nobody reveals anything.
        idle_scenes: how many those are.
    """

    scenes: int
    strict: float
    right: float
    right_low: float
    right_high: float
    revealed: float
    missed: float
    false: float
    idle_scenes: int


def has_demand(result: SceneResult) -> bool:
    """Whether some candidate reveals enough."""
    return result.best >= DEMAND


def chosen_by(name: str) -> Pick:
    """Choose as a parameter set did."""
    return lambda result: result.choices[name].sharer


def nearest(result: SceneResult) -> int | None:
    """Choose the candidate nearest to the ego vehicle."""
    return result.nearest


def by_cells(cell: float) -> Pick:
    """Choose as exact matrices with cells of this side [m] would."""
    return lambda result: result.by_cells[cell]


def score_sharers(results: Sequence[SceneResult], pick: Pick) -> SharerScore:
    """Score one way to choose."""
    wanted = [(one, pick(one)) for one in results if has_demand(one)]
    idle = [pick(one) for one in results if one.best < NOTHING]
    shares = np.array([0.0 if who is None else one.areas[who] / one.best for one, who in wanted])
    low, high = wilson(np.array([(shares >= RIGHT).sum()]), np.array([max(len(shares), 1)]))
    return SharerScore(
        scenes=len(wanted),
        strict=_mean(list(shares == 1.0)),
        right=_mean(list(shares >= RIGHT)),
        right_low=float(low[0]),
        right_high=float(high[0]),
        revealed=_mean(list(shares)),
        missed=_mean([who is None for _, who in wanted]),
        false=_mean([who is not None for who in idle]),
        idle_scenes=len(idle),
    )


def score_random(results: Sequence[SceneResult]) -> SharerScore:
    """Score what a random candidate gives on average, exactly."""
    wanted = [np.array(list(one.areas.values())) / one.best for one in results if has_demand(one)]
    strict = _mean([float((shares == 1.0).mean()) for shares in wanted])
    right = _mean([float((shares >= RIGHT).mean()) for shares in wanted])
    revealed = _mean([float(shares.mean()) for shares in wanted])
    low, high = wilson(np.nan_to_num([right * len(wanted)]), np.array([max(len(wanted), 1)]))
    return SharerScore(
        scenes=len(wanted),
        strict=strict,
        right=right,
        right_low=float(low[0]),
        right_high=float(high[0]),
        revealed=revealed,
        missed=0.0,
        false=1.0,
        idle_scenes=sum(one.best < NOTHING for one in results),
    )


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


def zone_areas(results: Sequence[SceneResult], name: str) -> ZoneAreas:
    """Add up the areas of all scenes."""
    nothing = ZoneAreas(zones=0.0, hidden=0.0, both=0.0)
    return reduce(lambda a, b: a + b, (one.choices[name].zones for one in results), nothing)


@dataclass(frozen=True, slots=True, kw_only=True)
class Traffic:
    """What one way of sharing costs and gives, summed over scenes, one scan each.

    Attributes:
        bytes: on the air, above the lower layers.
        area: hidden road that becomes known [m^2]; None if no areas are shared.
        vehicles: hidden vehicles that become known.
    """

    bytes: int
    area: float | None
    vehicles: int


DEMANDED: Final = "APMM, demanded"
"""The request says where the ego vehicle is blind, and the answer has what is there."""
WHOLE: Final = "APMM, whole"
"""The request only says that data are wanted, and the answer is a whole scan."""
ALWAYS: Final = "always-on"
CPM: Final = "CPM"


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Bytes of demanded answers, summed over scenes.

    Attributes:
        matrices: of all equipped vehicles.
        requests: with their zones.
        answers: of the sharers.
        answers_by_points: the same, if data were sent by the share of points in the zones.
    """

    matrices: int
    requests: int
    answers: int
    answers_by_points: int

    @property
    def sum(self) -> int:
        """Matrices, requests and answers together [byte]."""
        return self.matrices + self.requests + self.answers


def parts(results: Sequence[SceneResult], name: str, data: int) -> Parts:
    """Add up what demanded answers take; the arguments are those of `traffic`."""
    asked = _asked(results, name)
    return Parts(
        matrices=sum(one.choices[name].apm_bytes for one in results),
        requests=sum(one.request for one in asked),
        answers=sum(one.answer(data) for one in asked),
        answers_by_points=sum(one.answer_by_points(data) for one in asked) if data else 0,
    )


def _asked(results: Sequence[SceneResult], name: str) -> list[Demanded]:
    return [one for result in results if (one := result.choices[name].demanded) is not None]


def traffic(results: Sequence[SceneResult], name: str, data: int) -> Mapping[str, Traffic]:
    """Add up what the ways to share take and give, by their names.

    Args:
        results: scenes.
        name: parameter set of APMM.
        data: bytes of the sensor data of one scan; 0: raw points.
    """
    apmm = [(one, one.choices[name].sharer) for one in results]
    sent = [(one, who) for one, who in apmm if who is not None]
    asked = _asked(results, name)
    return {
        DEMANDED: Traffic(
            bytes=parts(results, name, data).sum,
            area=sum(one.area for one in asked),
            vehicles=sum(one.vehicles for one in asked),
        ),
        WHOLE: Traffic(
            bytes=sum(one.choices[name].apm_bytes for one in results)
            + sum(REQUEST + _data(one, data) for one, _ in sent),
            area=sum(one.areas[who] for one, who in sent),
            vehicles=sum(one.found[who] for one, who in sent),
        ),
        ALWAYS: Traffic(
            bytes=sum(one.equipped * _data(one, data) for one in results),
            area=sum(one.all_area for one in results),
            vehicles=sum(one.all_found for one in results),
        ),
        CPM: Traffic(
            bytes=sum(one.cpm_bytes for one in results),
            area=None,
            vehicles=sum(one.all_found for one in results),
        ),
    }


def _data(result: SceneResult, data: int) -> int:
    return data or round(result.points / result.equipped) * RAW_POINT


def byte_share(results: Sequence[SceneResult], name: str, data: int, way: str = DEMANDED) -> float:
    """Divide the bytes of one way to share by those of always-on sharing."""
    found = traffic(results, name, data)
    return found[way].bytes / max(found[ALWAYS].bytes, 1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Misses:
    """Scenes with demand in which the sharer was not right.

    Attributes:
        scenes: with demand.
        count: in which it was not.
        missed: of them, without a trigger. All that follows is of the rest.
        second, third: share in which a right one was among the first two, three.
        median: of what the chosen one reveals over what the best one does.
        close: share in which that is above 80 %.
        coarse, fine: share in which exact matrices of 5 m, of 2.5 m, would be wrong, too.
        hidden: mean hidden area [m^2].
        hidden_right: the same of the scenes in which the right one was chosen [m^2].
    """

    scenes: int
    count: int
    missed: int
    second: float
    third: float
    median: float
    close: float
    coarse: float
    fine: float
    hidden: float
    hidden_right: float


def examine(results: Sequence[SceneResult], name: str) -> Misses:
    """Find what the misses of the parameter set `name` have in common."""
    wanted = [one for one in results if has_demand(one)]
    wrong = [one for one in wanted if not _is_right(one, one.choices[name].sharer)]
    chosen = [one for one in wrong if one.choices[name].sharer is not None]
    shares = [_share(one, one.choices[name].sharer) for one in chosen]
    good = [one for one in wanted if _is_right(one, one.choices[name].sharer)]
    return Misses(
        scenes=len(wanted),
        count=len(wrong),
        missed=len(wrong) - len(chosen),
        second=_mean_or_0([_is_among(one, name, 2) for one in chosen]),
        third=_mean_or_0([_is_among(one, name, 3) for one in chosen]),
        median=float(np.median(shares)) if shares else 0.0,
        close=_mean_or_0([share > 0.8 for share in shares]),
        coarse=_mean_or_0([not _is_right(one, one.by_cells[5.0]) for one in chosen]),
        fine=_mean_or_0([not _is_right(one, one.by_cells[2.5]) for one in chosen]),
        hidden=_mean_or_0([one.hidden_area for one in chosen]),
        hidden_right=_mean_or_0([one.hidden_area for one in good]),
    )


def _share(result: SceneResult, who: int | None) -> float:
    return 0.0 if who is None else result.areas[who] / result.best


def _is_right(result: SceneResult, who: int | None) -> bool:
    return _share(result, who) >= RIGHT


def _is_among(result: SceneResult, name: str, first: int) -> bool:
    return any(_is_right(result, who) for who in result.choices[name].sharers[:first])


def _mean_or_0(values: Sequence[float]) -> float:
    return _mean(values) if values else 0.0
