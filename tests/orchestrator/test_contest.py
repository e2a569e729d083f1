"""Contests: who is tried with which draws, and who wins."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.contest import Standings, Trial, contest, survivors

Score = Callable[[int, int | None], float]


def held(
    score: Score, alternatives: int, draws: int, highest: float = math.inf, *, prunes: bool = True
) -> tuple[Standings, list[Trial]]:
    """The contest in which alternatives score so; a score that beats nothing is not told."""
    trials = []
    going = contest(alternatives, draws, highest)
    answer: float | None = None
    try:
        trial = next(going)
        while True:
            trials.append(trial)
            answer = score(trial.alternative, trial.draw)
            if prunes and trial.to_beat is not None and answer <= trial.to_beat:
                answer = None
            trial = going.send(answer)
    except StopIteration as end:
        standings: Standings = end.value
        return standings, trials


def test_without_draws_each_is_tried_once_and_has_to_beat_the_best_before_it() -> None:
    scores = [3.0, 5.0, 5.0, 4.0, 6.0]
    standings, trials = held(lambda a, d: scores[a], 5, 0)
    assert trials == [
        Trial(0, None, None), Trial(1, None, 3.0), Trial(2, None, 5.0), Trial(3, None, 5.0),
        Trial(4, None, 5.0),
    ]  # fmt: skip
    assert standings == Standings(4, (3.0, 5.0, None, None, 6.0), (1,) * 5)


def test_all_are_tried_once_a_quarter_twice_and_each_half_of_those_twice_as_often() -> None:
    """The later an alternative, the better: 40 once, the last 10 twice, 5 four times, 3 eight."""
    standings, trials = held(lambda a, d: float(a), 40, 8)
    assert [survivors(40, draws) for draws in (1, 2, 4)] == [10, 5, 3]
    assert standings.trials == (1,) * 30 + (2,) * 5 + (4,) * 2 + (8,) * 3
    assert len(trials) == 30 + 10 + 8 + 24
    assert standings.winner == 39
    assert standings.scores[35:] == (35.0, 36.0, 37.0, 38.0, 39.0)


def test_two_at_least_are_tried_with_all_draws() -> None:
    standings, _ = held(lambda a, d: -float(a), 3, 8, prunes=False)
    assert standings.trials == (8, 8, 1)
    assert held(lambda a, d: 1.0, 1, 8)[0].trials == (8,)


def test_everybody_meets_the_same_draws_in_their_order() -> None:
    _, trials = held(lambda a, d: 1.0, 12, 8, prunes=False)
    for alternative in range(12):
        draws = [trial.draw for trial in trials if trial.alternative == alternative]
        assert draws == list(range(len(draws)))


def test_of_equals_the_first_wins() -> None:
    for draws in (0, 1, 2, 7, 8):
        for prunes in (True, False):
            assert held(lambda a, d: 1.0, 9, draws, prunes=prunes)[0].winner == 0


def test_what_is_to_beat_is_the_worst_that_would_go_on() -> None:
    """Of twelve three go on, so the third best counts; then the best, less what one has."""
    scores = [5.0, 2.0, 4.0, 3.0, 6.0, *[1.0] * 7]
    _, trials = held(lambda a, d: scores[a], 12, 2)
    assert [trial.to_beat for trial in trials[:6]] == [None, None, None, 2.0, 3.0, 4.0]
    assert [(t.alternative, t.to_beat) for t in trials[12:]] == [(0, None), (2, 6.0), (4, 4.0)]
    _, once = held(lambda a, d: scores[a], 5, 1)
    assert [trial.to_beat for trial in once] == [None, 5.0, 5.0, 5.0, 5.0]


@pytest.mark.parametrize("draws", [1, 3, 8])
def test_where_draws_change_nothing_the_best_is_the_best_by_what_comes(draws: int) -> None:
    rng = np.random.default_rng(3)
    for _ in range(50):
        scores = rng.integers(0, 6, 17).astype(float)
        knowing, _ = held(lambda a, d, scores=scores: scores[a], 17, 0)  # type: ignore[misc]
        fair, _ = held(lambda a, d, scores=scores: scores[a], 17, draws)  # type: ignore[misc]
        assert fair.winner == knowing.winner == int(np.argmax(scores))


def test_the_mean_decides_and_not_the_best_single_draw() -> None:
    table = {0: [5.0, 5.0, 5.0, 5.0], 1: [9.0, 1.0, 1.0, 1.0]}
    standings, _ = held(lambda a, d: table[a][d or 0], 2, 4)
    assert (standings.winner, standings.scores[0]) == (0, 5.0)


@given(
    st.lists(st.lists(st.integers(0, 22), min_size=8, max_size=8), min_size=1, max_size=30),
    st.integers(1, 8),
)
def test_giving_up_early_changes_no_winner(table: list[list[int]], draws: int) -> None:
    """Who cannot come among those that go on, with 22 in each draw to come, does not matter."""

    def score(alternative: int, draw: int | None) -> float:
        return float(table[alternative][draw or 0])

    pruned, _ = held(score, len(table), draws, highest=22.0)
    full, trials = held(score, len(table), draws, highest=22.0, prunes=False)
    assert pruned.winner == full.winner
    assert pruned.scores[pruned.winner] == full.scores[full.winner]
    assert len(trials) <= len(table) * draws
