"""The engine pauses every few milliseconds: nothing is lost, and whoever wants the end is heard."""

import itertools
from pathlib import Path

import pytest
from typing_extensions import override

from adapters.fmi import FmuComponentType
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.ours import system_of
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.last_call import LastCall
from orchestrator.observer import NoProgress, Observer
from orchestrator.plan import plan
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.stretch import Stretch
from orchestrator.system import Connection, Endpoint, System
from tests.adapters.fmu.conftest import LookAt

ALGORITHMS = pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])
POINTS = 400


class Watch(NoProgress):
    """Counts stretches and looks, and ends the run at one of the looks."""

    def __init__(self, last_look: int = 1 << 30) -> None:
        self.stretches: list[int] = []
        self.looks = 0
        self._last_look = last_look

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        self.stretches.append(stretch.count)

    @override
    def look_up(self) -> None:
        self.looks += 1
        if self.looks == self._last_look:
            raise KeyboardInterrupt


def pause_at_every_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let calls of the engine have fewer and fewer points, after the first one with 64."""
    monkeypatch.setattr(plan, "_SPAN_NS", 0)


def run(
    system: System,
    algorithm: CosimulationAlgorithm,
    out: Path,
    *watches: Observer,
    compiled: bool = True,
) -> str:
    recorder = Recorder(out)
    simulate(
        system, algorithm, start=0, stop=POINTS * STEP_NS, seed=0,
        observers=[recorder, *watches], compiled=compiled,
    )  # fmt: skip
    return recorder.fingerprint


@ALGORITHMS
@pytest.mark.parametrize("version", [2, 3])
def test_pauses_change_nothing(
    tmp_path: Path,
    version: int,
    algorithm: CosimulationAlgorithm,
    monkeypatch: pytest.MonkeyPatch,
    look_at_plans: LookAt,
) -> None:
    pause_at_every_point(monkeypatch)
    reached: list[int] = []
    look_at_plans(lambda found: reached.append(found.points))
    plain, paused = (
        run(system_of(Chain("feedthrough", version, 3)), algorithm, tmp_path / str(c), compiled=c)
        for c in (False, True)
    )
    assert plain == paused
    assert reached == [64, 96, 112, 120, 124, 126, *range(127, POINTS + 1)]  # of one stretch


@ALGORITHMS
def test_texts_and_binaries_of_all_calls_are_kept(
    words3: Path,
    tmp_path: Path,
    algorithm: CosimulationAlgorithm,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pause_at_every_point(monkeypatch)
    """Of different sizes, which an FMU hands another one."""
    words = FmuComponentType(words3)
    handed = [
        ("one", "word_out", "two", "pair[1]"),
        ("one", "bits_out[0, 0]", "two", "bits[0, 1]"),
        ("one", "pair_out[1]", "two", "word"),
    ]
    prints = []
    for compiled in (False, True):
        components = {name: words.create(name, {}) for name in ("one", "two")}
        wires = [Connection(Endpoint(a, x), Endpoint(b, y)) for a, x, b, y in handed]
        system = System(components, dict.fromkeys(components, STEP_NS), wires)
        prints.append(run(system, algorithm, tmp_path / str(compiled), compiled=compiled))
    assert prints[0] == prints[1]


def test_what_was_published_is_shown_every_forty_milliseconds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not after every call: here none is long enough, and there each is."""
    pause_at_every_point(monkeypatch)
    rare, frequent = Watch(), Watch()
    monkeypatch.setattr(plan, "_STRETCH_NS", 1 << 60)
    run(system_of(Chain("gain", 3, 2)), GaussSeidel(), tmp_path / "rare", rare)
    monkeypatch.setattr(plan, "_STRETCH_NS", 0)
    run(system_of(Chain("gain", 3, 2)), GaussSeidel(), tmp_path / "frequent", frequent)
    calls = 6 + POINTS - 126
    assert rare.stretches == [POINTS]
    assert rare.looks == calls - 1  # behind each but the last, when all is seen
    few = plan.FEWEST_POINTS - 1  # at the end, which are not worth it
    assert frequent.stretches == [64, 32, 16, 8, 4, 2, *[1] * (POINTS - 126 - few)]
    assert frequent.looks == 0


@pytest.mark.parametrize(
    "case",
    [
        (15, [192, 192, 16], [64, 128, 192, 64, 128, 192, 16]),
        (5, [POINTS], [64, 192, POINTS]),  # twice as many each time
        (50, [64, 32, 16, 8, 4, 2, *[1] * 271], []),
    ],
)
def test_wall_time_says_when_to_pause_and_when_to_show(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    look_at_plans: LookAt,
    case: tuple[int, list[int], list[int]],
) -> None:
    """Each call takes as long; after 10 ms there should be a pause, after 40 ms all is shown."""
    wall_ms, stretches, reached = case
    clock = itertools.count(0, wall_ms * 1_000_000)
    monkeypatch.setattr(plan, "perf_counter_ns", lambda: next(clock))
    found: list[int] = []
    look_at_plans(lambda looked_at: found.append(looked_at.points))
    watch = Watch()
    run(system_of(Chain("gain", 3, 2)), GaussSeidel(), tmp_path / "run", watch)
    assert watch.stretches == stretches
    assert found == (reached or stretches)


def test_who_is_called_is_noted_from_call_to_call(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, look_at_plans: LookAt
) -> None:
    """Compiled code, from the point that it begins at; and nobody while others look up."""
    pause_at_every_point(monkeypatch)
    last_call = LastCall()
    noted: list[tuple[int, int]] = []
    look_at_plans(lambda _: noted.append((last_call._cells[0] != 0, last_call._cells[1])))
    looking: list[int] = []
    watch = Watch()
    monkeypatch.setattr(watch, "look_up", lambda: looking.append(last_call._cells[0]))
    system = system_of(Chain("gain", 3, 2))
    simulate(
        system, GaussSeidel(), start=0, stop=130 * STEP_NS, seed=0,
        observers=[Recorder(tmp_path / "run"), watch], last_call=last_call,
    )  # fmt: skip
    begun = [0, 64, 96, 112, 120, 124, 126, 127, 128, 129]
    assert noted == [(True, point * STEP_NS) for point in begun]
    assert looking == [0] * (len(begun) - 1)


def test_a_stretch_has_no_more_points_than_its_memory(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two FMUs with a double and the times of both: 32 bytes for each point."""
    monkeypatch.setattr(plan, "_MOST_BYTES", 32 * 150)
    watch = Watch()
    run(system_of(Chain("gain", 3, 2)), GaussSeidel(), tmp_path / "run", watch)
    assert watch.stretches == [150, 150, 100]


def test_a_step_of_each_call_is_timed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, look_at_plans: LookAt
) -> None:
    """Of 32 points one; and of fewer, as here, the first. The clock has steps of 256 ns."""
    pause_at_every_point(monkeypatch)
    monkeypatch.setattr(plan, "_STRETCH_NS", 1 << 60)
    monkeypatch.setattr(plan, "_MOST_BYTES", 1 << 26)  # all in one stretch
    spent: list[float] = []
    look_at_plans(lambda found: spent.append(found.unit[0].spent))
    run(system_of(Chain("matrix", 3, 2, (60, 60))), GaussSeidel(), tmp_path / "run")
    assert len(spent) == 6 + POINTS - 126
    assert all(before < after for before, after in itertools.pairwise([0.0, *spent]))


@ALGORITHMS
def test_whoever_wants_the_end_is_heard_between_two_calls(
    tmp_path: Path, algorithm: CosimulationAlgorithm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What the engine has published until then is recorded."""
    pause_at_every_point(monkeypatch)
    watch = Watch(last_look=3)
    out = tmp_path / "run"
    with pytest.raises(KeyboardInterrupt):
        run(system_of(Chain("gain", 3, 2)), algorithm, out, watch)
    assert watch.stretches == [64 + 32 + 16]
    recording = Recording(out)
    assert recording.manifest["status"] == "interrupted"
    assert recording.manifest["reached_ns"] == 112 * STEP_NS
    assert len(recording["c1.Float64_out_1"]) == 113
