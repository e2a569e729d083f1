"""The compiled engine is used if it belongs to this release."""

import ctypes
from collections.abc import Callable
from pathlib import Path

import pytest

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.last_call import FILE, CutOff, cut_off, noting
from orchestrator.plan import layouts
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.adapters.fmu.conftest import LookAt


def test_an_engine_of_another_release_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is told from others by the sizes of its structures."""
    find = layouts.engine.__wrapped__
    assert find() is not None
    for k in range(len(layouts.STRUCTURES)):
        changed = (*layouts.STRUCTURES[:k], ctypes.c_int16, *layouts.STRUCTURES[k + 1 :])
        monkeypatch.setattr(layouts, "STRUCTURES", changed)
        assert find() is None
        monkeypatch.undo()


def test_the_note_of_the_last_call_says_whom_the_engine_calls(
    fmu: Callable[[str], Path], tmp_path: Path, look_at_plans: LookAt
) -> None:
    """Of three FMUs the second one was stepping from 7 ns, as far as anybody can read."""
    copy = tmp_path / "copy"
    copy.mkdir()
    seen = []

    def stop(plan: layouts.Plan) -> None:
        plan.failed, plan.failed_from = 1, 7
        (copy / FILE).write_bytes((tmp_path / FILE).read_bytes())
        seen.append(cut_off(copy))

    look_at_plans(stop)
    lag = FmuComponentType(fmu("lag"))
    parts = {name: lag.create(name, {}) for name in ("first", "second", "third")}
    system = System(parts, dict.fromkeys(parts, 10**6), [])
    with noting(tmp_path, list(parts)) as last_call:
        simulate(system, GaussSeidel(), start=0, stop=10**7, seed=0, last_call=last_call)
    assert set(seen) == {CutOff("second", "stepping", 7)}
