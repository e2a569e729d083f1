"""A step that an FMU cannot make in one call is made in several, and that is said."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from adapters.fmi.handle import Handle
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.randomness import stream
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Signal
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.adapters.fmu.descriptions import changed

MS = 1_000_000
STEP = 100 * MS
PAUSES, ONLY_SHORT = 15, 16  # of `lag2`: comes as far as `fail_at`; no longer than 30 ms behind it
PAUSE, PAUSE_BY_DISCARD, ONLY_SHORT_3 = 7, 8, 9  # of `ends3`; no longer than 0.3 ms
INPUTS: dict[str, Signal] = {
    "u": np.array(3.0),
    "count_in": np.array(11, np.int32),
    "flag_in": np.array(True),
}


def started(path: Path, values: dict[str, Any], inputs: dict[str, Signal] = INPUTS) -> Component:
    component = FmuComponentType(path).create("unit", values)
    component.setup(0, stream(1, "unit"))
    component.initialise(inputs)
    return component


def euler(parts: Sequence[float]) -> float:
    """Of the lag from 1, behind so many parts [s], by forward Euler with T = 0.5 s and u = 3."""
    x = 1.0
    for h in parts:
        x = 3.0 + (x - 3.0) * (1.0 - h / 0.5)
    return x


@pytest.mark.parametrize(
    ("values", "parts", "remark"),
    [
        # discarded at 100, 50; made: 25, then 50 is too long again, 25, again 50, 25, 25
        (
            {"fail_as": ONLY_SHORT, "fail_at": 0.0, "fmi.smallest_step": 0.01},
            [0.025] * 4,
            "4 calls of its step: 4 tried again, shorter; the shortest took 0.025 s",
        ),
        # it comes to 0.07 s; with its state at hand, exactly that is made again
        (
            {"fail_as": PAUSES, "fail_at": 0.07, "fmi.smallest_step": 0.01},
            [0.07, 0.03],
            "1 call of its step: 1 tried again, shorter; the shortest took 0.03 s",
        ),
        (
            {"fail_as": PAUSES, "fail_at": 0.02},
            [0.02, 0.08],
            "1 call of its step: 1 continued from where they had come; the shortest took 0.02 s",
        ),
        ({"fmi.smallest_step": 0.01}, [0.1], ""),
    ],
    ids=["bisected", "as far as it came", "continued", "whole"],
)
def test_the_parts_of_a_step_are_those(
    lag2: Path,
    values: dict[str, Any],
    parts: list[float],
    remark: str,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """Forward Euler tells what they were; behind a call that went well comes one twice as long."""
    settings = {"time_constant": 0.5, "method": "Forward Euler", **values}
    lag = started(lag2, settings)
    assert (lag.native() is None) == ("fmi.smallest_step" in values)  # left to Python
    lag.step(INPUTS, 0, STEP)
    assert float(np.asarray(lag.outputs()["x"])) == pytest.approx(euler(parts), rel=1e-12)
    lag.close()
    lag.close()  # says nothing twice
    said = [(record.levelname, record.getMessage()) for record in caplog.records]
    assert said == ([("WARNING", f"discarded {remark}")] if remark else [])


def test_states_that_were_kept_for_a_step_are_freed_with_it(
    lag2: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One at a time is there."""
    there: list[int] = []
    counts: list[int] = []
    save, forget = Handle.save, Handle.forget

    def kept(handle: Handle) -> int:
        there.append(save(handle))
        counts.append(len(there))
        return there[-1]

    def freed(handle: Handle, state: int) -> None:
        there.remove(state)
        forget(handle, state)

    monkeypatch.setattr(Handle, "save", kept)
    monkeypatch.setattr(Handle, "forget", freed)
    lag = started(lag2, {"fail_as": ONLY_SHORT, "fail_at": 0.0, "fmi.smallest_step": 0.01})
    for k in range(3):
        lag.step(INPUTS, k * STEP, STEP)
        assert there == []
    assert counts
    assert set(counts) == {1}
    lag.close()


def test_what_is_too_short_ends_the_run_as_before(lag2: Path) -> None:
    lag = started(lag2, {"fail_as": ONLY_SHORT, "fail_at": 0.1, "fmi.smallest_step": 0.03})
    lag.step(INPUTS, 0, STEP)
    message = (
        r"fmi2DoStep returned Discard \(the last successful time is 0.1 s\): the FMU logged no "
        r"reason.*; it does so in calls of 0.05 s \(`fmi.smallest_step`\)"
    )
    with pytest.raises(FmuError, match=f"^{message}$"):
        lag.step(INPUTS, STEP, STEP)
    lag.close()


def test_without_states_the_error_says_what_would_help(lag2: Path, tmp_path: Path) -> None:
    """Only where it would: the FMU must be able to return, and to make shorter steps."""
    hint = "; `fmi.smallest_step` lets it be tried again, in shorter steps"
    flags = (b'canGetAndSetFMUstate="true"', b'canHandleVariableCommunicationStepSize="true"')
    for path in (lag2, *(changed(lag2, tmp_path, (flag, b"")) for flag in flags)):
        lag = started(path, {"fail_as": ONLY_SHORT, "fail_at": 0.0})
        with pytest.raises(FmuError) as error:
            lag.step(INPUTS, 0, STEP)
        assert str(error.value).endswith(hint) == (path == lag2)
        assert ("fmi.smallest_step" in FmuComponentType(path).parameters) == (path == lag2)
        lag.close()


def test_a_fixed_step_is_not_continued(lag2: Path, tmp_path: Path) -> None:
    flag = b'canHandleVariableCommunicationStepSize="true"'
    lag = started(changed(lag2, tmp_path, (flag, b"")), {"fail_as": PAUSES, "fail_at": 0.07})
    message = r"fmi2DoStep returned Discard \(the last successful time is 0.07 s\)"
    with pytest.raises(FmuError, match=message):
        lag.step(INPUTS, 0, STEP)
    lag.close()


class Expected(NamedTuple):
    """What comes of four steps of 1 ms."""

    values: dict[str, Any]
    calls: int
    said: str


@pytest.fixture
def early3(ends3: Path, tmp_path: Path) -> Path:
    """`ends3`, saying that it can return early and can be restored."""
    old = b'modelIdentifier="ends3"'
    new = old + b' canReturnEarlyAfterIntermediateUpdate="true" canGetAndSetFMUState="true"'
    return changed(ends3, tmp_path, (old, new))


@pytest.mark.parametrize(
    "expected",
    [
        Expected({"kind": PAUSE}, 5, "returned early from 1 call of its step"),
        Expected(
            {"kind": PAUSE_BY_DISCARD}, 5, "discarded 1 call of its step: 1 continued from where"
        ),
        Expected(
            {"kind": ONLY_SHORT_3, "fmi.smallest_step": 1e-4},
            2 + 2 * 4,
            "discarded 8 calls of its step: 8 tried again, shorter; the shortest took 0.00025 s",
        ),
        Expected(
            {"kind": PAUSE, "fmi.smallest_step": 1e-4}, 5, "returned early from 1 call of its step"
        ),
    ],
    ids=["early", "discarded", "bisected", "early with states"],
)
@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()], ids=["jacobi", "gauss-seidel"])
def test_fmi_3_goes_on_from_where_it_came(
    early3: Path,
    algorithm: CosimulationAlgorithm,
    expected: Expected,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """4 steps of 1 ms, and 2.2 ms within the third: equal bytes from both ways of stepping."""
    caplog.set_level("INFO", "nlosim.fmu")
    values, calls, said = expected
    fingerprints = []
    for compiled in (False, True):
        unit = FmuComponentType(early3)
        at = 0.002 if values["kind"] == ONLY_SHORT_3 else 0.0022
        components = {
            "unit": unit.create("unit", {"ends_at": at, **values}),
            "other": unit.create("other", {}),
        }
        recorder = Recorder(tmp_path / str(compiled))
        result = simulate(
            System(components, dict.fromkeys(components, MS), []), algorithm, start=0, stop=4 * MS,
            seed=1, observers=[recorder], compiled=compiled,
        )  # fmt: skip
        fingerprints.append(recorder.fingerprint)
        assert int(np.asarray(result.values["unit"]["calls"])) == calls
        assert int(np.asarray(result.values["other"]["calls"])) == 4
        assert float(np.asarray(result.values["unit"]["y"])) == pytest.approx(0.004, abs=1e-15)
        assert result.early_end is None
    assert fingerprints[0] == fingerprints[1]
    records = [r.getMessage() for r in caplog.records if r.name == "nlosim.fmu.unit"]
    assert [text.startswith(said) for text in records] == [True, True]


@pytest.mark.parametrize("values", [{}, {"fmi.smallest_step": 1e-6}], ids=["", "states"])
def test_an_early_return_without_any_progress_ends_the_run(
    early3: Path, values: dict[str, Any]
) -> None:
    """It would return for ever."""
    unit = FmuComponentType(early3).create("unit", {"ends_at": 0.0022, "kind": 2, **values})
    system = System({"unit": unit}, {"unit": MS}, [])
    message = "fmi3DoStep returned early at 0.0022 s, where it had begun"
    with pytest.raises(ComponentError, match=message):
        simulate(system, Jacobi(), start=0, stop=5 * MS, seed=1)


def test_repeated_steps_count_as_calls_and_change_no_result(lag2: Path, tmp_path: Path) -> None:
    """The exact lag has the same value whatever its parts are."""
    found = []
    for values in ({}, {"fail_as": PAUSES, "fail_at": 0.07}):
        lag = started(lag2, {"time_constant": 0.5, **values})
        for k in range(5):
            lag.step(INPUTS, k * STEP, STEP)
        found.append(float(np.asarray(lag.outputs()["x"])))
        lag.close()
    assert found == [pytest.approx(3.0 - 2.0 * math.exp(-1.0), rel=1e-12)] * 2
