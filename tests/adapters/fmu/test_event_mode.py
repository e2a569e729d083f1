"""FMI 3.0: events are handled in event mode, at their time, in steps and between them."""

import re
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.component import RestorableFmuComponent
from adapters.fmi.errors import FmuError
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import ComponentError
from orchestrator.signal import Signal
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration

S = 1_000_000_000
EVENTS = {"fmi.event_mode": True}


def begun(path: Path, **values: object) -> RestorableFmuComponent:
    component = FmuComponentType(path).create("unit", {**EVENTS, **values})
    assert isinstance(component, RestorableFmuComponent)
    component.setup(0, np.random.default_rng(1))
    component.initialise({"level": np.array(1.0), "u": np.array(0.0)})
    return component


def found(component: RestorableFmuComponent, name: str) -> float:
    return float(np.asarray(component.outputs()[name]))


def stepped(
    component: RestorableFmuComponent,
    inputs: Sequence[Mapping[str, Signal]],
    *names: str,
    step: Duration = S,
) -> list[list[float]]:
    """The outputs `names` after each step."""
    rows = []
    for k, each in enumerate(inputs):
        component.step(each, k * step, step)
        rows.append([found(component, name) for name in names])
    component.close()
    return rows


HELD: Mapping[str, Signal] = {"level": np.array(1.0), "u": np.array(0.0)}


def constant(count: int) -> list[Mapping[str, Signal]]:
    return [HELD] * count


def without_variable_steps(path: Path, target: Path) -> Path:
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(target, "w") as new:
        for name in old.namelist():
            text = old.read(name)
            flag = b'canHandleVariableCommunicationStepSize="true"'
            new.writestr(name, text.replace(flag, b""))
    return target


@pytest.mark.parametrize("event_mode", [True, False])
@pytest.mark.parametrize(
    ("period", "ticks"), [(0.25, [4, 8, 12]), (0.3, [3, 6, 10]), (1.0, [1, 2, 3]), (2.5, [0, 0, 1])]
)
def test_time_events_within_steps(
    events3: Path,
    period: float,
    ticks: list[int],
    event_mode: bool,  # noqa: FBT001  (a parameter)
) -> None:
    """floor(t / period) of them by t; the one at a communication point is seen there."""
    component = begun(events3, period=period, **{"fmi.event_mode": event_mode})
    assert stepped(component, constant(3), "ticks", "jumps") == [[n, 0] for n in ticks]


@pytest.mark.parametrize("event_mode", [True, False])
def test_state_events_within_steps(
    events3: Path,
    event_mode: bool,  # noqa: FBT001  (a parameter)
) -> None:
    """x is a saw: t modulo the threshold, also where it falls at a communication point."""
    component = begun(events3, threshold=0.3, period=0.7, **{"fmi.event_mode": event_mode})
    rows = stepped(component, constant(6), "x", "falls", "ticks")
    for t, (x, falls, ticks) in enumerate(rows, 1):
        assert falls + x / 0.3 == pytest.approx(t / 0.3, abs=1e-9)
        assert 0 <= x < 0.3
        assert ticks == t * 10 // 7


def test_discrete_inputs_jump_in_event_mode_and_continuous_ones_do_not(events3: Path) -> None:
    """The integral has the new level from the beginning of the step on; an equal one is no jump."""
    component = begun(events3)
    two, three = np.array(2.0), np.array(3.0)
    inputs: list[Mapping[str, Signal]] = [
        HELD,
        {**HELD, "level": two},
        {**HELD, "level": np.array(2.0)},
        {"level": two, "u": three},
        {"level": np.array(0.0), "u": np.array(1.0)},
    ]
    rows = stepped(component, inputs, "x", "jumps")
    assert rows == [[1, 0], [3, 1], [5, 1], [10, 1], [11, 2]]


def test_an_event_that_is_due_at_a_communication_point_is_no_later_for_rounding(
    events3: Path,
) -> None:
    """0.1 is no double: 3 * 0.1 lies beyond 0.3, and is handled there."""
    component = begun(events3, period=0.1)
    rows = stepped(component, constant(10), "ticks", step=S // 10)
    assert rows == [[n] for n in range(1, 11)]


def test_discrete_states_are_updated_until_they_settle(events3: Path) -> None:
    assert stepped(begun(events3, period=0.5, rounds=3), constant(1), "ticks") == [[2]]
    with pytest.raises(FmuError, match="the discrete states at 0 s do not settle"):
        begun(events3, rounds=-1)


def test_an_event_at_the_beginning_of_a_step_does_not_stop_it(events3: Path) -> None:
    """Twice per call; each is handled, and the step goes on from where it was."""
    component = begun(events3, period=0.4, stuck=2)
    rows = stepped(component, constant(2), "x", "ticks", "jumps")
    assert rows == [[pytest.approx(1), 2, 6], [pytest.approx(2), 5, 12]]
    with pytest.raises(FmuError, match="1000 events followed each other at 0 s"):
        stepped(begun(events3, stuck=10_000), constant(1))


def test_the_next_event_is_part_of_the_state(events3: Path) -> None:
    component = begun(events3, period=0.6)
    state = component.save()
    component.step(HELD, 0, S)
    assert found(component, "ticks") == 1
    component.restore(state)
    component.step(HELD, 0, S // 2)
    assert found(component, "ticks") == 0
    component.step(HELD, S // 2, S // 2)
    assert found(component, "ticks") == 1
    component.close()


def test_steps_of_one_length_are_not_cut(events3: Path, tmp_path: Path) -> None:
    """The event comes at the first communication point behind its time, one at each of them."""
    path = without_variable_steps(events3, tmp_path / "fixed.fmu")
    component = begun(path, period=0.75)
    assert stepped(component, constant(4), "ticks", "x") == [[1, 1], [2, 2], [3, 3], [4, 4]]


def test_an_event_may_ask_for_the_end(events3: Path) -> None:
    """The third one is at 2.1 s, within a step; the run ends before that step, at 2 s."""
    component = FmuComponentType(events3).create("unit", {**EVENTS, "period": 0.7, "last_tick": 3})
    result = simulate(
        System({"unit": component}, {"unit": S}, []), Jacobi(), start=0, stop=9 * S, seed=1
    )
    assert result.time == 2 * S
    component = FmuComponentType(events3).create("unit", {**EVENTS, "period": 0.5, "last_tick": 4})
    result = simulate(
        System({"unit": component}, {"unit": S}, []), Jacobi(), start=0, stop=9 * S, seed=1
    )
    assert result.time == 2 * S
    assert float(result.values["unit"]["ticks"]) == 4


def test_what_belongs_to_another_mode_is_an_error_of_the_fmu(events3: Path) -> None:
    """The test FMU notices; so no other test of this file passes by chance."""
    component = begun(events3)
    instance = component._wrapped._running()  # type: ignore[attr-defined]
    with pytest.raises(FmuError, match="level jumps in step mode"):
        instance.write({"level": np.array(4.0)})
    component.close()


def test_compiled_code_leaves_it_to_python(events3: Path) -> None:
    assert begun(events3).native() is None
    assert begun(events3, **{"fmi.event_mode": False}).native() is not None


def test_errors_have_the_time_of_the_step(events3: Path) -> None:
    component = FmuComponentType(events3).create("unit", {**EVENTS, "stuck": 10_000})
    said = "`unit` at t = 0 s: 1000 events followed each other at 0 s"
    with pytest.raises(ComponentError, match=re.escape(said)):
        simulate(
            System({"unit": component}, {"unit": S}, []), Jacobi(), start=0, stop=9 * S, seed=1
        )
