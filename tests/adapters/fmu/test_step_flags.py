"""FMI 3.0: what a step says beyond its status ends the run with the same error everywhere."""

import re
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.simulation import simulate
from orchestrator.system import System

MS = 1_000_000
EVENT, END, EARLY, DISCARD, SILENT = range(5)
SAID = {
    EARLY: "fmi3DoStep returned early, at 0.2508 s, although that was not allowed",
    DISCARD: "fmi3DoStep returned Discard (the last successful time is 0.2508 s)",
    SILENT: "fmi3DoStep returned Discard (the last successful time is {begin} s)",
}


def system(ends3: Path, kind: int, step: int) -> System:
    """`ends` says it at 0.2508 s; `before` and `behind` go on every millisecond."""
    unit = FmuComponentType(ends3)
    components: dict[str, Component] = {
        "before": unit.create("before", {}),
        "ends": unit.create("ends", {"ends_at": 0.2508, "kind": kind}),
        "behind": unit.create("behind", {}),
    }
    return System(components, {"before": MS, "ends": step * MS, "behind": MS}, [])


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])
@pytest.mark.parametrize("step", [1, 3])
@pytest.mark.parametrize("kind", SAID)
def test_what_a_step_says_ends_the_run(
    ends3: Path, tmp_path: Path, kind: int, step: int, algorithm: CosimulationAlgorithm
) -> None:
    """Nothing of that step is published; the others went on until it failed."""
    begin, end = {1: (250, 251), 3: (249, 252)}[step]
    said = SAID[kind].format(begin=begin / 1000)
    expected = f"component `ends` at t = {begin / 1000} s: {said}"
    last = begin if isinstance(algorithm, Jacobi) else end - 1
    for compiled in (False, True):
        out = tmp_path / str(compiled)
        with pytest.raises(ComponentError, match=f"^{re.escape(expected)}"):
            simulate(
                system(ends3, kind, step), algorithm, start=0, stop=600 * MS, seed=1,
                observers=[Recorder(out)], compiled=compiled,
            )  # fmt: skip
        recording = Recording(out)
        assert recording["ends.y"].times[-1] == begin * MS
        for other in ("before", "behind"):
            assert recording[f"{other}.y"].times[-1] == last * MS


@pytest.mark.parametrize("compiled", [False, True])
def test_an_event_is_no_reason_to_end(
    ends3: Path,
    compiled: bool,  # noqa: FBT001  (a parameter)
) -> None:
    """Nor are requests of a step that is not made any more: the run ends at 0.25 s itself."""
    result = simulate(
        system(ends3, EVENT, 1), Jacobi(), start=0, stop=600 * MS, seed=1, compiled=compiled
    )
    assert float(result.values["ends"]["y"]) == pytest.approx(0.6)
    result = simulate(
        system(ends3, END, 1), Jacobi(), start=0, stop=250 * MS, seed=1, compiled=compiled
    )
    assert float(result.values["ends"]["y"]) == pytest.approx(0.25)
