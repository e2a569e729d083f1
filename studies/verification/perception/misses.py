"""Why the wrong sharer was chosen."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from studies.verification.perception.scoring import SceneResult
from studies.verification.perception.summary import RIGHT, has_demand


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
    """What the misses of the parameter set `name` have in common."""
    wanted = [one for one in results if has_demand(one)]
    wrong = [one for one in wanted if not _is_right(one, one.choices[name].sharer)]
    chosen = [one for one in wrong if one.choices[name].sharer is not None]
    shares = [_share(one, one.choices[name].sharer) for one in chosen]
    good = [one for one in wanted if _is_right(one, one.choices[name].sharer)]
    return Misses(
        scenes=len(wanted),
        count=len(wrong),
        missed=len(wrong) - len(chosen),
        second=_mean([_is_among(one, name, 2) for one in chosen]),
        third=_mean([_is_among(one, name, 3) for one in chosen]),
        median=float(np.median(shares)) if shares else 0.0,
        close=_mean([share > 0.8 for share in shares]),
        coarse=_mean([not _is_right(one, one.by_cells[5.0]) for one in chosen]),
        fine=_mean([not _is_right(one, one.by_cells[2.5]) for one in chosen]),
        hidden=_mean([one.hidden_area for one in chosen]),
        hidden_right=_mean([one.hidden_area for one in good]),
    )


def _share(result: SceneResult, who: int | None) -> float:
    return 0.0 if who is None else result.areas[who] / result.best


def _is_right(result: SceneResult, who: int | None) -> bool:
    return _share(result, who) >= RIGHT


def _is_among(result: SceneResult, name: str, first: int) -> bool:
    return any(_is_right(result, who) for who in result.choices[name].sharers[:first])


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else 0.0
