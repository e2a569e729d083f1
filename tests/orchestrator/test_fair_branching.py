"""Decisions that know the world to come, but not what chance will draw in the run itself."""

import logging
import sys

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.contest import contest
from orchestrator.errors import ComponentError
from orchestrator.randomness import redrawn, stream
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time
from tests.orchestrator.deciding import (
    HORIZON,
    PERIOD,
    PUSHES,
    ChancyPoint,
    Chooser,
    H,
    Planned,
    Point,
    run,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")

SEQUENTIAL = GaussSeidel(("point", "pusher"))
STEPS = 18


def best_by_separate_runs(seed: int, draws: int) -> list[int]:
    """Greedily, every trial in a run of its own, whose chance is redrawn at the decision."""
    chosen: list[int] = []
    for first in range(1, STEPS + 1, PERIOD):
        end, decided = min(first + HORIZON, STEPS), first * H
        going = contest(len(PUSHES), draws, np.inf)
        try:
            trial = next(going)
            while True:
                assert trial.draw is not None
                rng = redrawn(seed, "point", decided, trial.draw)
                plan = Planned([*chosen, trial.alternative])
                point = ChancyPoint({decided: rng})
                result, _ = run(plan, SEQUENTIAL, steps=end, seed=seed, point=point)
                trial = going.send(float(np.asarray(result.values["pusher"]["hits"])))
        except StopIteration as done:
            chosen.append(done.value.winner)
    return chosen


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_the_choices_are_those_of_separate_runs_with_chance_redrawn(seed: int) -> None:
    """Common random numbers: draw k is the same for all alternatives of a decision."""
    chooser = Chooser(draws=3)
    run(chooser, SEQUENTIAL, steps=STEPS, seed=seed, point=ChancyPoint())
    assert chooser.choices == best_by_separate_runs(seed, draws=3)
    assert len(chooser.choices) == 4


@pytest.mark.slow
def test_the_run_goes_on_with_its_own_draws() -> None:
    """Every signal at every point is that of a plain run with the same choices."""
    for seed in range(2):
        chooser = Chooser(draws=4)
        _, fair = run(chooser, SEQUENTIAL, seed=seed, point=ChancyPoint())
        _, plain = run(Planned(chooser.choices), SEQUENTIAL, seed=seed)
        assert fair.seen == plain.seen


@pytest.mark.slow
def test_who_knows_the_draws_scores_more_and_where_there_are_none_as_much() -> None:
    """Hits in 23 steps of four runs; the difference is luck."""
    hits = {0: 0.0, 2: 0.0}
    for draws in hits:
        for seed in range(4):
            result, _ = run(Chooser(draws=draws), SEQUENTIAL, seed=seed, point=ChancyPoint())
            hits[draws] += float(np.asarray(result.values["pusher"]["hits"]))
    assert hits[0] > hits[2] + 4

    class Certain(ChancyPoint):
        """Never goes astray, whatever it could draw."""

        @override
        def step(self, inputs: Signals, t: Time, h: Duration) -> None:
            self._x = np.array(self._x + float(np.asarray(inputs["push"])))

    choices = []
    for draws in (0, 1, 4):
        chooser = Chooser(draws=draws)
        run(chooser, SEQUENTIAL, steps=8, point=Certain())
        choices.append(chooser.choices)
    assert choices[0] == choices[1] == choices[2]


def test_where_nothing_can_be_redrawn_the_decision_says_so() -> None:
    with pytest.raises(ComponentError, match="wants chance redrawn, which no component here can"):
        run(Chooser(draws=2), SEQUENTIAL, point=Point())


def test_the_log_has_means_and_how_often_each_was_tried(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    run(Chooser(draws=4, prunes=False), SEQUENTIAL, steps=3, point=ChancyPoint())
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.count("(1)") == 3
    assert line.count("(4)") == 2


def test_redrawn_streams_differ_by_all_that_they_depend_on() -> None:
    """By seed, component, decision and draw; and none is the stream of the run."""
    keys = [(1, "a", 0, 0), (2, "a", 0, 0), (1, "b", 0, 0), (1, "a", H, 0), (1, "a", 0, 1)]
    keys += [(1, "a", 1 << 32, 0), (1, "a", 0, 2)]
    firsts = [redrawn(*key).random(4).tolist() for key in keys]
    firsts.append(stream(1, "a").random(4).tolist())
    assert len({tuple(first) for first in firsts}) == len(firsts)
    assert redrawn(1, "a", H, 3).random(4).tolist() == redrawn(1, "a", H, 3).random(4).tolist()
    assert redrawn(1, "channel", 3_100_000_000, 0).integers(0, 2**32, 2).tolist() == [
        1672415594,
        1070899182,
    ]
