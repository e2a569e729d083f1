"""Memory of a stretch is handed over where that is no waste: rows in it are not copied."""

from collections.abc import Collection
from pathlib import Path

import pytest
from typing_extensions import override

import orchestrator.recording.parts
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.ours import system_of
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.observer import NoProgress
from orchestrator.plan import plan
from orchestrator.recording.parts import Part
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.stretch import Stretch
from orchestrator.system import Endpoint, System

BYTES_OF_A_POINT = 32  # two Gains: a double each, and its time
NAME, OUTPUT = "c1", "Float64_out_1"


class Keeper(NoProgress):
    """Has the rows of the last stretches, if they may be kept."""

    def __init__(self, most: int) -> None:
        self._most = most
        self.are_kept: list[bool] = []
        self.rows: list[tuple[memoryview, bytes]] = []

    @override
    def wants(self, system: System) -> Collection[Endpoint]:
        return [Endpoint(name, OUTPUT) for name in system.components]

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        samples = stretch.samples[NAME]
        self.are_kept.append(samples.are_kept)
        if samples.are_kept:
            rows = memoryview(samples.rows[OUTPUT].data)
            self.rows.append((rows, bytes(rows)))
            del self.rows[: -self._most or None]


def seen(most: int, points: int, monkeypatch: pytest.MonkeyPatch, room: int = 50) -> Keeper:
    """What an observer saw that keeps the rows of so many stretches, of `room` points at most."""
    monkeypatch.setattr(plan, "_MOST_BYTES", BYTES_OF_A_POINT * room)
    keeper = Keeper(most)
    system = system_of(Chain("gain", 3, 2))
    algorithm = GaussSeidel(tuple(system.components))
    simulate(system, algorithm, start=0, stop=points * STEP_NS, seed=0, observers=[keeper])
    return keeper


def test_what_is_kept_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    keeper = seen(100, 300, monkeypatch)
    assert keeper.are_kept == [True] * 4 + [False] * 2  # four are given away at a time
    assert [len(rows) for rows, _ in keeper.rows] == [400] * 4
    assert [bytes(rows) for rows, _ in keeper.rows] == [copy for _, copy in keeper.rows]
    assert len({copy for _, copy in keeper.rows}) == 4


@pytest.mark.parametrize("most", [0, 1, 3])
def test_what_is_let_go_makes_room_for_more(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    keeper = seen(most, 1000, monkeypatch)
    assert keeper.are_kept == [True] * 20


@pytest.mark.parametrize(("rest", "is_kept"), [(24, False), (25, True)])
def test_memory_that_is_mostly_empty_is_used_again(
    rest: int, monkeypatch: pytest.MonkeyPatch, *, is_kept: bool
) -> None:
    assert seen(100, 50 + rest, monkeypatch).are_kept == [True, is_kept]


def test_memory_for_outputs_that_are_large_is_used_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single point takes more than a stretch should; so much is not left with anybody."""
    monkeypatch.setattr(plan, "_STRETCH_NS", 0)
    monkeypatch.setattr(plan, "_SPAN_NS", 0)
    assert not any(seen(100, 80, monkeypatch, room=0).are_kept)


def test_a_recorder_keeps_signals_and_times(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of a stretch that has 4096 bytes of each: 512 points of doubles, and of times."""
    kept: list[tuple[str, int]] = []
    keep = Part._keep

    def noted(part: Part, rows: bytes | memoryview, count: int) -> None:
        kept.append((part.name, count))
        keep(part, rows, count)

    monkeypatch.setattr(Part, "_keep", noted)
    monkeypatch.setattr(plan, "_MOST_BYTES", BYTES_OF_A_POINT * 512)
    system = system_of(Chain("gain", 3, 2))
    recorder = Recorder(tmp_path / "run")
    simulate(system, GaussSeidel(), start=0, stop=1023 * STEP_NS, seed=0, observers=[recorder])
    values = [name for name, _ in kept if OUTPUT in name]
    assert len(values) == 2
    assert [count for _, count in kept] == [512] * 4  # and 511 of the second stretch are copied
    assert len(dict(kept)) == 4


@pytest.mark.parametrize("small", [0, 1 << 12])
@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])
def test_recordings_are_the_same(
    algorithm: CosimulationAlgorithm, small: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numbers of one, four and eight bytes, over more stretches than are given away."""
    monkeypatch.setattr(plan, "_MOST_BYTES", 3 * 42 * 60)
    monkeypatch.setattr(orchestrator.recording.parts, "_SMALL", small)
    prints = []
    for compiled in (False, True):
        recorder = Recorder(tmp_path / str(compiled))
        simulate(
            system_of(Chain("feedthrough", 3, 3)), algorithm, start=0, stop=500 * STEP_NS, seed=0,
            observers=[recorder], compiled=compiled,
        )  # fmt: skip
        prints.append(recorder.fingerprint)
    assert prints[0] == prints[1]
