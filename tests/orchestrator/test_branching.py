"""Branches: the best alternative is taken, and nothing else can be told from a plain run."""

import logging
import math
import os
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import ConcurrentComponent
from orchestrator.errors import ComponentError, SystemStructureError
from orchestrator.signal import Connector, Signals
from orchestrator.system import Endpoint
from orchestrator.testing import check_component
from orchestrator.timebase import Duration, Time
from tests.orchestrator.deciding import (
    GOAL,
    HORIZON,
    PERIOD,
    PUSHES,
    Chooser,
    H,
    Planned,
    Point,
    run,
)

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")

ALGORITHMS = [Jacobi(), GaussSeidel(("point", "pusher")), GaussSeidel(("pusher", "point"))]
SEQUENTIAL = GaussSeidel(("point", "pusher"))


def choices_of(chooser: Chooser, algorithm: CosimulationAlgorithm, **changes: Any) -> list[int]:
    run(chooser, algorithm, **changes)
    return chooser.choices


def hits(result: Any) -> int:
    return int(result.values["pusher"]["hits"])


def best_by_separate_runs(algorithm: CosimulationAlgorithm, seed: int, steps: int) -> list[int]:
    """Greedily, each alternative in a run of its own from the very start."""
    chosen: list[int] = []
    for first in range(1, steps + 1, PERIOD):
        end = min(first + HORIZON, steps)
        reached = [
            hits(run(Planned([*chosen, k]), algorithm, steps=end, seed=seed)[0])
            for k in range(len(PUSHES))
        ]
        chosen.append(int(np.argmax(reached)))  # the first of equals
    return chosen


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=["jacobi", "before", "after"])
def test_the_choices_are_those_of_separate_runs(
    algorithm: CosimulationAlgorithm, seed: int
) -> None:
    expected = best_by_separate_runs(algorithm, seed, steps=23)
    assert choices_of(Chooser(), algorithm, seed=seed) == expected
    assert len(set(expected)) > 1


DONE = Endpoint("pusher", "done")


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=["jacobi", "before", "after"])
def test_branches_that_are_over_early_end_there_and_their_scores_are_read_then(
    algorithm: CosimulationAlgorithm, seed: int
) -> None:
    """As in separate runs that end early; nobody scores more than what ends the run."""
    ends: list[Time] = []

    def outcome(plan: list[int], steps: int) -> int:
        result, _ = run(Planned(plan), algorithm, steps=steps, seed=seed, until=DONE)
        if result.time < steps * H:
            assert hits(result) == GOAL
            ends.append(result.time)
        return hits(result)

    chosen: list[int] = []
    chooser = Chooser(prunes=False)
    result, trace = run(chooser, algorithm, steps=60, seed=seed, until=DONE)
    while len(chosen) < len(chooser.choices):
        end = len(chosen) * PERIOD + 1 + HORIZON
        chosen.append(int(np.argmax([outcome([*chosen, k], end) for k in range(len(PUSHES))])))
    assert chooser.choices == chosen
    assert ends  # some branches did end early
    assert trace.seen == run(Planned(chosen), algorithm, steps=60, seed=seed, until=DONE)[1].seen
    assert (result.time, hits(result)) == (trace.seen[-1][0], GOAL)


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=["jacobi", "before", "after"])
def test_a_run_with_branches_is_the_run_with_its_choices_given(
    algorithm: CosimulationAlgorithm,
) -> None:
    """Every signal at every communication point, random numbers included, bit by bit."""
    chooser = Chooser()
    _, branched = run(chooser, algorithm)
    _, plain = run(Planned(chooser.choices), algorithm)
    assert branched.seen == plain.seen
    assert [t for t, _ in branched.seen] == [k * H for k in range(24)]


@pytest.mark.slow
def test_pruning_changes_no_choice(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    pruned = 0
    for seed in range(6):
        caplog.clear()
        with_pruning = choices_of(Chooser(), SEQUENTIAL, seed=seed)
        pruned += caplog.text.count("pruned")
        caplog.clear()
        assert choices_of(Chooser(prunes=False), SEQUENTIAL, seed=seed) == with_pruning
        assert "pruned" not in caplog.text
    assert pruned > 20  # of 6 x 5 x 5


def test_a_branch_that_cannot_win_any_more_ends_there(tmp_path: Path) -> None:
    """Branches take 8 steps at the first decision and 3 at the second; the choices are the same."""
    choices, lengths = [], []
    for prunes in (True, False):
        note = tmp_path / str(prunes)

        def count(push: float, time: Time, note: Path = note) -> None:
            del push, time
            with note.open("a") as file:
                file.write(f"{os.getpid()}\n")

        chooser = Chooser(prunes=prunes)
        choices.append(choices_of(chooser, SEQUENTIAL, steps=9, seed=3, point=Point(count)))
        steps = Counter(note.read_text().split())
        assert steps.pop(str(os.getpid())) == 9
        lengths.append(sorted(steps.values()))
    assert choices[0] == choices[1]
    assert lengths[1] == [3] * len(PUSHES) + [HORIZON] * len(PUSHES)
    assert {1, 2} <= {*lengths[0]}  # long before the next decision


def test_of_equals_the_first_is_taken() -> None:
    assert set(choices_of(Chooser(prunes=False, value=lambda hits: -1.0), SEQUENTIAL)) == {0}
    assert set(choices_of(Chooser(pushes=(0.3, 0.3, 0.3)), SEQUENTIAL)) == {0}


def test_a_single_alternative_needs_no_branch(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    assert set(choices_of(Chooser(pushes=(0.3,)), SEQUENTIAL)) == {0}
    assert "decided" not in caplog.text


def test_the_log_says_how_every_alternative_fared(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    run(Chooser(prunes=False), SEQUENTIAL, steps=3)
    (line,) = (record.getMessage() for record in caplog.records)
    assert line.startswith("`pusher` decided at t = 0.1 s: push -0.8 ")
    assert line.count("push") == 1 + len(PUSHES)


def failing_when_pushed(fault: Any) -> Point:
    """Its `fault` is called in the branch of one alternative only, at 0.3 s."""

    def fail(push: float, t: Time) -> None:
        if push == PUSHES[2] and t == 3 * H:
            fault()

    return Point(fail)


def raising(error: BaseException) -> Any:
    def fault() -> None:
        raise error

    return fault


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        (raising(ValueError("fell over")), "component `point` at t = 0.3 s: ValueError: fell over"),
        (raising(SystemExit(3)), "component `point` at t = 0.3 s: SystemExit: 3"),
        (
            lambda: os.kill(os.getpid(), signal.SIGKILL),
            "tried by `pusher` at t = 0.1 s, was killed",
        ),
        (lambda: os._exit(7), "tried by `pusher` at t = 0.1 s, ended its process with code 7"),
    ],
)
def test_what_goes_wrong_in_a_branch_ends_the_run_and_is_explained(
    fault: Any, message: str
) -> None:
    with pytest.raises(ComponentError) as caught:
        run(Chooser(prunes=False), SEQUENTIAL, point=failing_when_pushed(fault))
    assert message in str(caught.value)
    assert "the branch of `push 0`, tried by `pusher` at t = 0.1 s" in str(caught.value)
    assert caught.value.component in {"point", "pusher"}


def test_a_score_that_is_not_a_number_is_refused() -> None:
    chooser = Chooser(prunes=False, value=lambda hits: math.nan)
    with pytest.raises(ComponentError, match=r"component `pusher` at t = 0.9 s: its score is NaN"):
        run(chooser, SEQUENTIAL)


def test_interrupting_ends_the_branch_too(tmp_path: Path) -> None:
    note = tmp_path / "pid"

    def hang() -> None:
        note.write_text(str(os.getpid()))
        time.sleep(60)

    def interrupt() -> None:
        while not (note.exists() and note.read_text()):
            time.sleep(0.01)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        run(Chooser(prunes=False), SEQUENTIAL, point=failing_when_pushed(hang))
    with pytest.raises(ProcessLookupError):
        os.kill(int(note.read_text()), 0)


def test_an_interruption_while_the_process_is_copied_is_not_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Python swallows what handlers raise then; the copy must be ended all the same."""
    copies: list[int] = []
    make = os.fork

    def fork() -> int:
        copies.append(make())
        os.kill(os.getpid(), signal.SIGINT)
        return copies[-1]

    monkeypatch.setattr(os, "fork", fork)
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        run(Chooser(prunes=False), SEQUENTIAL)
    (copy,) = copies
    with pytest.raises(ProcessLookupError):
        os.kill(copy, 0)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_branch_ends_when_its_run_was_killed(tmp_path: Path) -> None:
    """It looks for its parent at every communication point."""
    note = tmp_path / "pid"

    def slowly(push: float, t: Time) -> None:
        if push == PUSHES[2]:
            note.write_text(str(os.getpid()))
            time.sleep(0.3)

    run_of_its_own = os.fork()
    if run_of_its_own == 0:
        run(Chooser(prunes=False), SEQUENTIAL, point=Point(slowly))
        os._exit(0)
    while not (note.exists() and note.read_text()):
        time.sleep(0.01)
    os.kill(run_of_its_own, signal.SIGKILL)
    os.waitpid(run_of_its_own, 0)
    branch = int(note.read_text())
    deadline = time.monotonic() + 1.5  # the rest of the branch would take 2 s
    while _is_running(branch):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def _is_running(process: int) -> bool:
    """Zombies that nobody collects do not count."""
    try:
        return "\nState:\tZ" not in Path(f"/proc/{process}/status").read_text()
    except OSError:
        return False


def test_branches_leave_files_and_standard_output_alone(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """What is open stays where it is: nothing is written, and reading goes on where it was."""
    (tmp_path / "in").write_text("".join(f"{k:03}\n" for k in range(100)))
    log = logging.getLogger("branching.test")
    with (tmp_path / "in").open("rb", buffering=0) as source, (tmp_path / "out").open("wb") as out:

        def work(push: float, t: Time) -> None:
            number = int(source.read(4))
            out.write(b"%03d\n" % number)
            out.flush()
            os.write(1, b"x")
            log.warning("a step")
            assert number == t // H

        run(Chooser(), SEQUENTIAL, point=Point(work))
    assert (tmp_path / "out").read_text() == "".join(f"{k:03}\n" for k in range(23))
    assert capfd.readouterr().out == "x" * 23


@pytest.mark.slow
def test_a_run_in_a_thread_beside_others_branches_too() -> None:
    """As in a worker process of Dask; locks that others hold at the time do no harm."""
    stop = threading.Event()

    def be_busy() -> None:
        while not stop.is_set():
            logging.getLogger("busy").debug("%s", np.linalg.inv(np.eye(30))[0, 0])

    others = [threading.Thread(target=be_busy) for _ in range(3)]
    found: list[list[int]] = []
    mine = threading.Thread(target=lambda: found.append(choices_of(Chooser(), SEQUENTIAL)))
    for thread in (*others, mine):
        thread.start()
    mine.join(60)
    stop.set()
    for thread in others:
        thread.join()
    assert found == [choices_of(Chooser(), SEQUENTIAL)]


class Elsewhere(ConcurrentComponent):
    """Pretends to step in another process."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return Point().connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None: ...

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None: ...

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None: ...

    @override
    def finish_step(self) -> None: ...

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(0.0)}


def test_what_steps_elsewhere_cannot_be_copied() -> None:
    with pytest.raises(SystemStructureError) as caught:
        run(Chooser(), SEQUENTIAL, point=Elsewhere())
    assert str(caught.value) == (
        "component `pusher` tries its alternatives in copies of this process, but `point` steps "
        "outside of it and would not be copied; run all components in one process: "
        "`--transport in-process`"
    )


def test_the_contract_of_a_deciding_component_can_be_checked() -> None:
    check_component(Chooser(), steps=12, h=H)
