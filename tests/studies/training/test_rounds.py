"""When a round ends, and which epoch is kept."""

from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from studies.training.journal import Epoch
from studies.training.learner import EpochResult
from studies.training.rounds import LearningError, States, best, is_over

_LOSSES = st.lists(st.sampled_from([0.1, 0.2, 0.3, 0.4, 0.5]), min_size=1, max_size=30)


def epochs(losses: list[float]) -> list[Epoch]:
    return [
        Epoch(round=0, epoch=k, result=EpochResult(training=9.0, validation=loss), seconds=1.0)
        for k, loss in enumerate(losses, start=1)
    ]


@given(losses=_LOSSES, limit=st.integers(1, 20), patience=st.integers(1, 8))
def test_a_round_ends_once_nothing_better_came_for_long_enough(
    losses: list[float], limit: int, patience: int
) -> None:
    """It has seen the limit, or the last `patience` losses are all no better than one before."""
    for count in range(1, len(losses) + 1):
        seen = losses[:count]
        before, last = seen[:-patience], seen[-patience:]
        stalled = bool(before) and min(before) <= min(last)
        assert is_over(epochs(seen), limit, patience) == (stalled or count >= limit)


@given(losses=_LOSSES)
def test_the_first_of_the_lowest_losses_is_the_best(losses: list[float]) -> None:
    assert best(epochs(losses)) == 1 + losses.index(min(losses))


def test_a_round_does_not_end_before_it_begins() -> None:
    assert not is_over([], limit=1, patience=1)


def test_states_of_other_rounds_are_kept(tmp_path: Path) -> None:
    """Rounds 1 and 11 begin alike."""
    states = States(tmp_path)
    for number in (1, 11):
        for epoch in (1, 2, 12):
            states.write(number, epoch, b"%d-%d" % (number, epoch))
    states.keep(1, {2, 12})
    assert [states.read(1, epoch) for epoch in (2, 12)] == [b"1-2", b"1-12"]
    assert [states.read(11, epoch) for epoch in (1, 2, 12)] == [b"11-1", b"11-2", b"11-12"]
    with pytest.raises(LearningError, match="round-1-epoch-1 cannot be read: No such file"):
        states.read(1, 1)
