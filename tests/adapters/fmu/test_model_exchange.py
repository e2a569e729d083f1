"""FMUs for Model Exchange as components: a ball that bounces, against closed forms.

The FMUs `ball2` and `ball3` return Error where an importer sets what cannot be set in a mode,
leaves a mode too early, turns the time back or passes the stop time.
"""

import math
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange import solvers
from adapters.fmi.model_exchange.integration import are_one, usable
from orchestrator.capabilities import (
    CourseFollowing,
    DirectionalDerivatives,
    EndRequesting,
    InitialEvaluation,
    OutputSelection,
    OutputSlopes,
    PointEvaluation,
    VariableSteps,
)
from orchestrator.component import Component, RestorableComponent
from orchestrator.course import Course
from orchestrator.errors import ComponentTypeError, CosimError, ParameterError
from orchestrator.randomness import stream
from orchestrator.signal import Signal, Signals
from orchestrator.testing import check_component
from orchestrator.timebase import CommunicationGrid

MS = 1_000_000
G = 9.81
REST: dict[str, Signal] = {"u": np.array(0.0), "kick": np.array(False)}


def started(fmu: Path, inputs: Signals = REST, start: int = 0, **values: Any) -> Component:
    named = {name.replace("__", "."): value for name, value in values.items()}
    component = FmuComponentType(fmu).create("ball", named)
    component.expect(CommunicationGrid.over(start, start + 10_000 * MS, MS))
    component.setup(start, stream(1, "ball"))
    component.initialise(inputs)
    return component


def stepped(
    component: Component,
    step: int,
    count: int,
    inputs: Callable[[int], Signals] = lambda _: REST,
    start: int = 0,
) -> list[dict[str, float]]:
    """Outputs at the start and after each of `count` steps [ns]."""
    rows = [_row(component)]
    for k in range(count):
        component.step(inputs(k), start + k * step, step)
        rows.append(_row(component))
    component.close()
    return rows


def _row(component: Component) -> dict[str, float]:
    return {name: float(np.asarray(value)) for name, value in component.outputs().items()}


def bouncing(t: float, e: float) -> tuple[float, float, int]:
    """Height, speed and number of bounces of a ball that falls from 1 m."""
    start, speed, count = math.sqrt(2 / G), 0.0, 0
    if t < start:
        return 1 - G * t**2 / 2, -G * t, 0
    speed = e * G * start
    while t >= start + 2 * speed / G:
        start += 2 * speed / G
        speed *= e
        count += 1
    since = t - start
    return speed * since - G * since**2 / 2, speed - G * since, count + 1


@pytest.mark.parametrize("solver", solvers.NAMES)
def test_it_keeps_the_contract_of_components(ball: Path, solver: str) -> None:
    """Also returning to a state in front of a bounce, and the same bits again."""
    values = {"fmi.solver": solver, "period": 0.13, "fmi.step": 0.02}
    kind = FmuComponentType(ball)
    assert isinstance(kind.create("ball", values), RestorableComponent)

    def inputs(t: int) -> Signals:
        return {"u": np.array(math.sin(t * 1e-9)), "kick": np.array(t // (300 * MS) % 2 == 1)}

    check_component(kind.create("ball", values), steps=12, inputs=inputs)


@pytest.mark.parametrize(("solver", "error"), [("cvode", 5e-6), ("dopri5", 1e-12), ("rk4", 1e-12)])
def test_bounces_are_where_they_belong(ball: Path, solver: str, error: float) -> None:
    """Until 2 s, 6 bounces, whatever the step; a parabola is exact for rk4."""
    for step in (10, 50, 400):
        rows = stepped(started(ball, fmi__solver=solver), step * MS, 2000 // step)
        for k, row in enumerate(rows):
            h, v, count = bouncing(k * step / 1000, 0.7)
            assert row["bounces"] == count
            assert row["h"] == pytest.approx(h, abs=error)
            assert row["v"] == pytest.approx(v, abs=5 * error)


def test_bounces_that_come_ever_faster_end(ball: Path) -> None:
    """The ball rests when it rebounds with less than 1 mm/s."""
    rows = stepped(started(ball, e=0.5), 1000 * MS, 3)
    assert rows[-1]["h"] == rows[-1]["v"] == 0.0
    assert rows[-1]["bounces"] == math.ceil(math.log(1e-3 / math.sqrt(2 * G)) / math.log(0.5))


def falling(t: float, drag: float) -> float:
    return -G / drag * (1 - math.exp(-drag * t))


@pytest.mark.parametrize(("solver", "order"), [("euler", 1.0), ("rk4", 4.0)])
def test_the_error_of_a_fixed_step_falls_with_its_order(
    ball: Path, solver: str, order: float
) -> None:
    steps = (0.1, 0.05, 0.025)
    errors = []
    for step in steps:
        values: dict[str, Any] = {"fmi__solver": solver, "fmi__step": step, "drag": 3.0}
        rows = stepped(started(ball, start__h=100.0, **values), 1000 * MS, 2)
        errors.append(abs(rows[-1]["v"] - falling(2.0, 3.0)))
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(order, abs=0.25)


@pytest.mark.parametrize("solver", ["cvode", "dopri5"])
def test_the_error_falls_with_the_tolerance(ball: Path, solver: str) -> None:
    tolerances = (1e-4, 1e-6, 1e-8, 1e-10)
    errors = []
    for tolerance in tolerances:
        values: dict[str, Any] = {"fmi__solver": solver, "fmi__tolerance": tolerance}
        ball_ = started(ball, start__h=100.0, drag=3.0, **values)
        rows = stepped(ball_, 500 * MS, 4)
        errors.append(max(abs(r["v"] - falling(k / 2, 3.0)) for k, r in enumerate(rows)))
        assert errors[-1] < 100 * tolerance
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(0.9, abs=0.2)


def test_the_solver_has_the_tolerance_that_the_fmu_hears(ball: Path, tmp_path: Path) -> None:
    """That of the default experiment unless the scenario says another one."""
    silent = changed(ball, tmp_path, (' tolerance="1e-8"', ""))
    cases: Any = ((ball, {}, 1e-8), (ball, {"fmi__tolerance": 1e-3}, 1e-3), (silent, {}, 1e-6))
    for fmu, said, heard in cases:
        values: dict[str, Any] = {"fmi__locals": ("tolerance", "stop"), **said}
        row = stepped(started(fmu, **values), 100 * MS, 1)[-1]
        assert (row["tolerance"], row["stop"]) == (heard, 10.0)


@pytest.mark.parametrize("solver", ["cvode", "dopri5", "rk4"])
def test_time_events_are_met_exactly(ball: Path, solver: str) -> None:
    """An event at a communication point belongs to the step that ends there."""
    values: dict[str, Any] = {"period": 0.1, "fmi__locals": ("late",), "fmi__solver": solver}
    values |= {"fmi__step": 0.05}
    rows = stepped(started(ball, **values), 50 * MS, 100)
    assert [row["ticks"] for row in rows] == [k // 2 for k in range(101)]
    assert rows[-1]["late"] == 0
    rows = stepped(started(ball, **values), 333 * MS, 9)
    assert [row["ticks"] for row in rows] == [k * 333 // 100 for k in range(10)]
    assert rows[-1]["late"] == 0


def test_late_times_are_no_less_exact(ball: Path) -> None:
    """At 1000 s two neighbouring floats are 1e-13 s apart, and sums of tenths differ by some."""
    late = started(ball, start=1_000_000 * MS, period=0.1, fmi__solver="rk4", fmi__step=0.1)
    rows = stepped(late, 100 * MS, 60, start=1_000_000 * MS)
    assert [row["ticks"] for row in rows] == list(range(61))
    assert are_one(0.1 + 0.2, 0.3)
    assert are_one(0.0, 1e-15)
    assert not are_one(1.0, 1.0 + 1e-14)
    assert not are_one(0.0, 1e-14)


def test_nominal_values_are_made_positive() -> None:
    assert list(usable(np.array([-2.0, 0.0, 3.0]))) == [2.0, 1.0, 3.0]


def test_the_fmu_hears_whether_its_states_are_kept(ball: Path) -> None:
    """FMI: `noSetFMUStatePriorToCurrentPoint`."""
    for never_returns in (False, True):
        kind = FmuComponentType(ball, never_returns=never_returns)
        component = kind.create("ball", {"fmi.locals": ("keeps",)})
        component.setup(0, stream(1, "ball"))
        component.initialise(REST)
        assert stepped(component, 100 * MS, 1)[-1]["keeps"] == never_returns


def test_time_begins_where_the_run_does(ball: Path) -> None:
    late = started(ball, start=5000 * MS, period=0.1, fmi__solver="rk4")
    rows = stepped(late, 100 * MS, 5, start=5000 * MS)
    assert [row["ticks"] for row in rows] == [0, 1, 2, 3, 4, 5]
    h, v, _ = bouncing(0.5, 0.7)
    assert (rows[-1]["h"], rows[-1]["v"]) == pytest.approx((h, v), abs=1e-12)


def test_the_fmu_hears_of_every_completed_step_and_may_ask_for_an_event(ball: Path) -> None:
    values: dict[str, Any] = {"fmi__locals": ("steps", "step_events"), "start__h": 100.0}
    row = stepped(started(ball, fmi__solver="rk4", fmi__step=0.01, **values), 100 * MS, 1)[-1]
    assert (row["steps"], row["step_events"]) == (10, 0)
    rows = stepped(started(ball, step_event_at=0.15, **values), 100 * MS, 3)
    assert [row["step_events"] for row in rows] == [0, 0, 1, 1]
    assert rows[-1]["steps"] > 3


def test_an_input_that_jumps_is_an_event(ball: Path) -> None:
    """A rising edge kicks the ball by 2 m/s, as often as there is one; held values do nothing."""
    kicks = (False, True, True, False, True, False, False)

    def inputs(k: int) -> Signals:
        return {"u": np.array(G), "kick": np.array(kicks[k])}  # it floats

    values: dict[str, Any] = {"fmi__locals": ("events",), "start__h": 1.0}
    rows = stepped(started(ball, inputs(0), **values), 100 * MS, len(kicks), inputs)
    assert [row["kicks"] for row in rows] == [0, 0, 1, 1, 1, 2, 2, 2]
    assert [row["v"] for row in rows] == pytest.approx([0, 0, 2, 2, 2, 4, 4, 4], abs=1e-9)
    assert [row["events"] for row in rows] == [1, 1, 2, 2, 3, 4, 5, 5]


def test_an_input_is_held_over_a_step(ball: Path) -> None:
    """v is the sum of the accelerations times the step."""
    forces = [3.0, -1.0, 4.0, 1.0, -5.0]

    def inputs(k: int) -> Signals:
        return REST | {"u": np.array(G + forces[k])}

    rows = stepped(started(ball, inputs(0), start__h=50.0), 100 * MS, 5, inputs)
    sums = [0.1 * sum(forces[:k]) for k in range(6)]
    assert [row["v"] for row in rows] == pytest.approx(sums, abs=1e-7)


def capability(component: Component, kind: type[Any]) -> Any:
    return component.capability(kind)


def test_it_has_the_capabilities_of_its_interface(ball: Path) -> None:
    component = FmuComponentType(ball).create("ball", {})
    for kind in (InitialEvaluation, PointEvaluation, CourseFollowing, OutputSlopes, VariableSteps):
        assert isinstance(capability(component, kind), kind)


def test_only_selected_outputs_are_read(ball: Path) -> None:
    component = started(ball)
    capability(component, OutputSelection).select({"v"})
    component.step(REST, 0, 100 * MS)
    assert set(component.outputs()) == {"v"}
    component.close()


def test_compiled_code_does_not_step_it(ball: Path) -> None:
    component = started(ball)
    assert component.native() is None
    component.close()


@pytest.mark.parametrize("solver", ["cvode", "dopri5", "rk4"])
def test_inputs_may_follow_polynomials(ball: Path, solver: str) -> None:
    """v' = u - g with u = g + 1 - 6 x + 12 x^2 over a step of 0.5 s: v grows by 0.5 (1 - 3 + 4)."""
    component = started(ball, REST | {"u": np.array(G + 1.0)}, fmi__solver=solver)
    coefficients = (np.array(G + 1.0), np.array(-6.0), np.array(12.0))
    for k in range(2):
        capability(component, CourseFollowing).follow({"u": Course(coefficients)})
        component.step(REST | {"u": np.array(G + 1.0)}, k * 500 * MS, 500 * MS)
    row = _row(component)
    assert row["v"] == pytest.approx(2.0, abs=1e-7)
    assert row["y"] - row["h"] == pytest.approx((G + 7.0) / 2, rel=1e-14)  # u at the end
    component.step(REST | {"u": np.array(G)}, 1000 * MS, 500 * MS)  # held again
    assert _row(component)["v"] == pytest.approx(2.0, abs=1e-7)
    component.close()


def test_outputs_can_be_computed_anew_for_other_inputs(ball: Path) -> None:
    """y = h + u / 2; trying inputs leaves no trace, to the bit."""
    runs = []
    for tried in (False, True):
        component = started(ball, drag=0.3, fmi__locals=("events",))
        rows = []
        for k in range(8):
            component.step(REST | {"u": np.array(float(k // 2))}, k * 100 * MS, 100 * MS)
            if tried:
                for u in (7.0, -3.0):
                    found = capability(component, PointEvaluation).evaluate(
                        REST | {"u": np.array(u)}
                    )
                    assert float(found["y"]) - float(found["h"]) == pytest.approx(u / 2, abs=1e-12)
            rows.append({n: np.asarray(v).tobytes() for n, v in component.outputs().items()})
        runs.append(rows)
        component.close()
    assert runs[0] == runs[1]


def test_an_output_that_depends_on_a_discrete_input_cannot_be_tried(
    ball: Path, tmp_path: Path
) -> None:
    """What such an input does takes an event, from which the FMU has to return."""
    leads = changed(ball, tmp_path, ('dependencies="2 9"', 'dependencies="29"'),
                    ('dependencies="1 8"', 'dependencies="200"'))  # fmt: skip
    for never_returns in (False, True):
        component = FmuComponentType(leads, never_returns=never_returns).create("ball", {})
        assert (capability(component, PointEvaluation) is None) is never_returns
        assert capability(component, InitialEvaluation) is not None


def test_an_event_is_tried_where_a_discrete_input_jumps(ball: Path) -> None:
    """v is 2 m/s more behind a kick; nobody notices that it was tried."""
    runs = []
    for tried in (False, True):
        component = started(ball, period=0.07)
        rows = []
        for k in range(8):
            component.step(REST, k * 100 * MS, 100 * MS)
            if tried:
                kicked = REST | {"kick": np.array(True), "u": np.array(4.0)}
                found = capability(component, PointEvaluation).evaluate(kicked)
                row = _row(component)
                assert float(found["v"]) == row["v"] + 2
                assert float(found["y"]) == row["h"] + 2
                assert int(found["kicks"]) == 1
            rows.append({n: np.asarray(v).tobytes() for n, v in component.outputs().items()})
        runs.append(rows)
        component.close()
    assert runs[0] == runs[1]


def test_slopes_are_those_of_outputs_that_are_states(ball: Path) -> None:
    component = started(ball, REST | {"u": np.array(2.0)}, drag=0.5)
    component.step(REST | {"u": np.array(2.0)}, 0, 100 * MS)
    row, slopes = _row(component), capability(component, OutputSlopes).slopes()
    assert set(slopes) == {"h", "v"}
    assert float(slopes["h"]) == row["v"]
    assert float(slopes["v"]) == pytest.approx(2.0 - G - 0.5 * row["v"], rel=1e-14)
    component.close()


def test_directional_derivatives_are_the_jacobian_of_the_solver(ball: Path, tmp_path: Path) -> None:
    """With the same results, and fewer evaluations of nothing else."""
    flag = "providesDirectionalDerivative"
    without = changed(ball, tmp_path, (f'{flag}="true"', ""), (f'{flag}s="true"', ""))
    values: dict[str, Any] = {"drag": 50.0, "start__h": 100.0, "fmi__locals": ("columns",)}
    rows = [stepped(started(fmu, **values), 500 * MS, 4)[-1] for fmu in (ball, without)]
    assert rows[0]["columns"] > 0
    assert rows[0]["columns"] % 2 == 0
    assert rows[1]["columns"] == 0
    assert rows[0]["v"] == pytest.approx(rows[1]["v"], abs=1e-7)
    assert rows[0]["v"] == pytest.approx(falling(2.0, 50.0), abs=1e-7)


def test_outputs_have_derivatives_by_inputs(ball: Path) -> None:
    """y = h + u / 2, and the states do not jump with u."""
    component = started(ball)
    component.step(REST, 0, 100 * MS)
    found = capability(component, DirectionalDerivatives).directional({"u": np.array(3.0)})
    assert {name: float(value) for name, value in found.items()} == {"h": 0.0, "v": 0.0, "y": 1.5}
    component.close()


def test_a_discarded_evaluation_is_tried_with_a_shorter_step(ball: Path) -> None:
    """The FMU knows nothing more than 20 ms behind the last completed step."""
    values: dict[str, Any] = {"narrow": 0.0201, "start__h": 100.0, "drag": 3.0}
    for solver in ("cvode", "dopri5"):
        row = stepped(started(ball, fmi__solver=solver, **values), 100 * MS, 5)[-1]
        assert row["v"] == pytest.approx(falling(0.5, 3.0), abs=1e-6)
    fixed = started(ball, fmi__solver="rk4", fmi__step=0.05, **values)
    with pytest.raises(FmuError, match=r"derivatives at 0.025 s \(Discard\); a shorter `fmi.step`"):
        stepped(fixed, 100 * MS, 5)
    row = stepped(started(ball, fmi__solver="rk4", fmi__step=0.02, **values), 100 * MS, 5)[-1]
    assert row["v"] == pytest.approx(falling(0.5, 3.0), abs=1e-6)


def changed(fmu: Path, folder: Path, *changes: tuple[str, str]) -> Path:
    """A copy of an FMU with another description; a change need not fit both versions."""
    path = folder / fmu.name
    with zipfile.ZipFile(fmu) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            if name == "modelDescription.xml":
                before = data
                for a, b in changes:
                    data = data.replace(a.encode(), b.encode())
                assert data != before
            new.writestr(name, data)
    return path


@pytest.mark.parametrize("indicators", [0, 1])
def test_an_fmu_without_states_has_events_only(ball: Path, tmp_path: Path, indicators: int) -> None:
    """A clockwork: no states, and perhaps an event indicator, for the importer of FMI 2.0."""
    if ball.stem == "ball3":
        pytest.skip("the instance says how many there are")
    clockwork = changed(
        ball, tmp_path,
        ("    <Derivatives>\n", ""), ("    </Derivatives>\n", ""),
        ('</Outputs>\n      <Unknown index="3"/>\n      <Unknown index="5"/>\n', "</Outputs>\n"),
        ('numberOfEventIndicators="1"', f'numberOfEventIndicators="{indicators}"'),
        (' derivative="2"', ""), (' derivative="4"', ""),
    )  # fmt: skip
    values: dict[str, Any] = {"period": 0.3, "fmi__locals": ("steps", "late")}
    rows = stepped(started(clockwork, **values), 200 * MS, 6)
    assert [row["ticks"] for row in rows] == [0, 0, 1, 2, 2, 3, 4]
    assert rows[-1]["late"] == 0
    assert rows[-1]["h"] == 1.0
    if not indicators:  # a step to each communication point, and to two events between
        assert rows[-1]["steps"] == 8
    assert capability(FmuComponentType(clockwork).create("c", {}), OutputSlopes) is None


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (3, "returned Error: told to fail"),
        (4, "returned Fatal: told to fail"),
        (2, "the solver failed at 0.25"),
    ],
)
def test_failures_of_the_fmu_are_named(ball: Path, status: int, said: str) -> None:
    component = started(ball, fail_at=0.25, fail_as=status)
    with pytest.raises(FmuError, match=said):
        stepped(component, 100 * MS, 4)
    component.close()


@pytest.mark.parametrize(("stop_at", "ticks"), [(0.3, 2), (0.25, 2), (0.0, 0)])
def test_a_request_to_end_comes_with_its_time(ball: Path, stop_at: float, ticks: int) -> None:
    """Behind the event at that time; outputs of the end of a step are those behind it."""
    component = started(ball, stop_at=stop_at, period=0.11)
    requests = capability(component, EndRequesting)
    count = 0
    while requests.end_request is None:
        component.step(REST, count * 100 * MS, 100 * MS)
        count += 1
    assert count == math.ceil(stop_at * 10)
    assert requests.end_request.time == round(stop_at * 1000) * MS
    assert "`terminateSimulation`" in requests.end_request.why
    if stop_at == 0.3:
        assert _row(component)["ticks"] == ticks
        assert _row(component)["v"] == pytest.approx(-G * 0.3, rel=1e-6)
    component.close()


def test_events_that_do_not_end_are_an_error(ball: Path) -> None:
    component = started(ball, start=1000 * MS, period=1e-17)
    with pytest.raises(FmuError, match=r"events at 1 s do not end: 1000 without any time between"):
        stepped(component, 100 * MS, 1, start=1000 * MS)
    component.close()


def test_memory_is_kept_over_steps_where_nobody_returns(ball: Path) -> None:
    """Fewer evaluations for the same result, if inputs stay as they are."""
    counts = []
    for never_returns in (False, True):
        values = {"drag": 3.0, "start.h": 100.0, "fmi.locals": ("steps",)}
        component = FmuComponentType(ball, never_returns=never_returns).create("ball", values)
        assert isinstance(component, RestorableComponent) is not never_returns
        component.setup(0, stream(1, "ball"))
        component.initialise(REST)
        rows = stepped(component, 20 * MS, 50)
        counts.append(rows[-1]["steps"])
        assert rows[-1]["v"] == pytest.approx(falling(1.0, 3.0), abs=3e-6)
    assert counts[1] < counts[0] / 4


CS = {2: '<CoSimulation modelIdentifier="ball2"/>', 3: '<CoSimulation modelIdentifier="ball3"/>'}


def with_both(ball: Path, folder: Path, flags: str = "") -> Path:
    element = CS[int(ball.stem[-1])].replace("/>", f" {flags}/>")
    return changed(ball, folder, ("  <UnitDefinitions>", f"  {element}\n  <UnitDefinitions>"))


def test_co_simulation_comes_first_where_an_fmu_has_both(ball: Path, tmp_path: Path) -> None:
    both = with_both(ball, tmp_path)
    kind = FmuComponentType(both)
    assert kind.parameters["fmi.kind"].default == "co-simulation"
    assert kind.description == "A ball on the ground (Co-Simulation, also Model Exchange)"
    stepping = kind.create("ball", {})
    assert not isinstance(stepping, RestorableComponent)
    with pytest.raises(CosimError, match=r"CoSimulation returned nothing|cannot be loaded: .*Step"):
        stepping.setup(0, stream(1, "ball"))
    values: Mapping[str, Any] = {"fmi.kind": "model-exchange"}
    assert isinstance(kind.create("ball", values), RestorableComponent)
    rows = stepped(started(both, fmi__kind="model-exchange", fmi__solver="rk4"), 100 * MS, 5)
    assert rows[-1]["h"] == pytest.approx(bouncing(0.5, 0.7)[0], abs=1e-12)


def test_options_fit_the_interface(ball: Path, lag2: Path, tmp_path: Path) -> None:
    both = FmuComponentType(with_both(ball, tmp_path))
    with pytest.raises(ParameterError) as refused:
        both.create("ball", {"fmi.solver": "rk4", "fmi.step": 0.1})
    said = [str(p.what) for p in refused.value.problems]
    assert said == ["concerns Model Exchange only; write `fmi.kind: model-exchange`, too"] * 2
    with pytest.raises(ParameterError) as refused:
        FmuComponentType(ball).create("ball", {"fmi.tolerance": 0.0, "fmi.step": 0.0})
    assert [p.what for p in refused.value.problems] == ["must be greater than 0"] * 2
    assert "fmi.kind" not in FmuComponentType(lag2).parameters


def test_the_communication_step_is_free_of_the_other_interface(ball: Path, tmp_path: Path) -> None:
    if ball.stem == "ball2":
        pytest.skip("FMI 2.0 has no fixedInternalStepSize")
    kind = FmuComponentType(with_both(ball, tmp_path, 'fixedInternalStepSize="0.1"'))
    assert kind.step_problem(50 * MS) is not None
    assert kind.step_problem(50 * MS, {"fmi.kind": "model-exchange"}) is None


def test_a_machine_without_sundials_is_told_what_else_there_is(
    ball: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def missing() -> None:
        raise ComponentTypeError("the solver `cvode` is not there")

    monkeypatch.setattr("adapters.fmi.model_exchange.making.library", missing)
    with pytest.raises(ComponentTypeError, match="`cvode` is not there"):
        FmuComponentType(ball).create("ball", {})
    FmuComponentType(ball).create("ball", {"fmi.solver": "rk4"})
