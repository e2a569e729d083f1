"""Contests between the alternatives of a decision: which is tried next, and which one wins.

Every contest is a generator: it yields trials, is sent the score of each (`None` if the trial was
given up, because it could not beat what it had to), and returns its standings.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import Final, TypeAlias

FIRST_CUT: Final = 4
"""One of so many alternatives is left after the first draw."""
FINALISTS: Final = 2
"""How many are tried with all draws at least."""


@dataclass(frozen=True, slots=True)
class Trial:
    """One alternative, to be simulated to the horizon.

    Attributes:
        alternative: its index.
        draw: number of the random numbers that it is tried with; `None`: those of the run.
        to_beat: a score that does not exceed this one changes nothing.
    """

    alternative: int
    draw: int | None
    to_beat: float | None


@dataclass(frozen=True, slots=True)
class Standings:
    """How a contest ended.

    Attributes:
        winner: the best alternative, of equals the first.
        scores: of each alternative, the mean over the draws it was tried with; `None` where it was
            given up.
        trials: of each alternative, how often it was tried.
    """

    winner: int
    scores: tuple[float | None, ...]
    trials: tuple[int, ...]


Contest: TypeAlias = Generator[Trial, float | None, Standings]


def contest(alternatives: int, draws: int, highest: float) -> Contest:
    """The contest between `alternatives`.

    Args:
        alternatives: how many, at least 1.
        draws: 0 for the random numbers of the run.
        highest: what no score exceeds; infinite if that is not known.
    """
    return _with_what_comes(alternatives) if draws == 0 else _halving(alternatives, draws, highest)


def survivors(alternatives: int, draws: int) -> int:
    """How many of `alternatives` go on after they were tried with `draws` draws."""
    return max(FINALISTS, math.ceil(alternatives / (FIRST_CUT * draws)))


def _with_what_comes(alternatives: int) -> Contest:
    """Each once, with the random numbers that the run will have."""
    scores: list[float | None] = []
    best: float | None = None
    for index in range(alternatives):
        score = yield Trial(index, None, best)
        scores.append(score)
        if score is not None and (best is None or score > best):
            best = score
    return Standings(scores.index(best), tuple(scores), (1,) * alternatives)


def _halving(alternatives: int, draws: int, highest: float) -> Contest:
    """Sequential halving (Karnin, Koren, Somekh, "Almost optimal exploration", ICML 2013).

    All are tried with one draw and the best quarter goes on, to two draws in all; the better half
    of them goes on to four, and so on; those who reach the last round, two at least, have `draws`
    each. All who are left have been tried with the same draws. Of equals the first goes on.
    """
    totals: dict[int, float] = dict.fromkeys(range(alternatives), 0.0)
    scores: list[float | None] = [None] * alternatives
    trials = [0] * alternatives
    done = 0
    while True:
        until = min(draws, max(1, 2 * done))
        wanted = 1 if until == draws else survivors(alternatives, until)
        finished: dict[int, float] = {}
        for index, before in totals.items():
            total = before
            for draw in range(done, until):
                bar = _bar(finished, wanted)
                rest = highest * (until - draw - 1) if until - draw > 1 else 0.0
                trials[index] += 1
                score = yield Trial(index, draw, None if bar is None else bar - total - rest)
                if score is None:
                    break
                total += score
            else:
                finished[index] = total
        for index, total in finished.items():
            scores[index] = total / until
        for index in totals.keys() - finished.keys():
            scores[index] = None
        if until == draws:
            return Standings(max(finished, key=finished.__getitem__), tuple(scores), tuple(trials))
        best = sorted(finished, key=lambda index: (-finished[index], index))[:wanted]
        totals = {index: finished[index] for index in sorted(best)}
        done = until


def _bar(finished: dict[int, float], wanted: int) -> float | None:
    """The total that a further alternative has to beat to be among the `wanted` best."""
    if len(finished) < wanted:
        return None
    return sorted(finished.values(), reverse=True)[wanted - 1]
