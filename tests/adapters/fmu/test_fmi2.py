"""FMI 2.0 FMUs as components."""

import math
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.component import FmuComponent
from adapters.fmi.errors import FmuError
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError
from orchestrator.randomness import stream
from orchestrator.signal import Signal
from orchestrator.testing import check_component
from orchestrator.timebase import CommunicationGrid

STEP = 100_000_000
INPUTS: dict[str, Signal] = {
    "u": np.array(3.0),
    "count_in": np.array(11, np.int32),
    "flag_in": np.array(True),
}


def started(path: Path, **values: Any) -> Component:
    component = FmuComponentType(path).create("lag", values)
    component.setup(0, stream(1, "lag"))
    component.initialise(INPUTS)
    return component


def test_it_keeps_the_contract_of_components(lag2: Path) -> None:
    check_component(FmuComponentType(lag2).create("lag", {}))


def test_it_follows_the_analytic_solution(lag2: Path) -> None:
    lag = started(lag2, time_constant=0.5)
    for k in range(10):
        lag.step(INPUTS, k * STEP, STEP)
    found = lag.outputs()
    assert found["x"] == pytest.approx(3.0 - 2.0 * math.exp(-2.0), rel=1e-12)
    assert int(found["count_out"]) == 11
    assert bool(found["flag_out"]) is True
    assert found["flag_out"].dtype == np.bool_  # type: ignore[union-attr]
    lag.close()


def test_connectors_and_parameters_are_those_of_the_description(lag2: Path) -> None:
    kind = FmuComponentType(lag2)
    connectors = kind.create("lag", {}).connectors
    assert {name: str(c.kind()) for name, c in connectors.items()} == {
        "u": "float64[]",
        "count_in": "int32[]",
        "flag_in": "bool[]",
        "x": "float64[]",
        "count_out": "int32[]",
        "flag_out": "bool[]",
        "rollback": "bool[]",
        "method_used": "int32[]",
        "label": "text",
    }
    assert connectors["x"].unit == "V"
    assert connectors["count_in"].start_value() == 7
    assert connectors["x"].feedthrough == frozenset()
    assert connectors["count_out"].feedthrough == {"count_in"}
    assert connectors["flag_out"].feedthrough == {"u", "count_in", "flag_in"}  # not declared
    assert set(kind.parameters) == {
        *("time_constant", "fail_at", "fail_as", "method"),
        *("start.u", "start.count_in", "start.flag_in"),
        *("fmi.tolerance", "fmi.locals", "fmi.logging", "fmi.smallest_step"),
    }
    assert "without" not in kind.description


def test_a_component_that_can_be_restored_announces_it_to_each_step(lag2: Path) -> None:
    lag = started(lag2)
    lag.step(INPUTS, 0, STEP)
    assert lag.outputs()["rollback"]  # noSetFMUStatePriorToCurrentPoint is false
    lag.close()


def test_an_enumeration_is_set_by_the_name_of_an_item(lag2: Path) -> None:
    method = FmuComponentType(lag2).parameters["method"]
    assert (method.type, method.default) == (Literal["exact", "Forward Euler"], "exact")  # max is 5
    lag = started(lag2, time_constant=2.0, method="Forward Euler")
    lag.step(INPUTS, 0, STEP)
    assert lag.outputs()["x"] == pytest.approx(3.0 - 2.0 * (1.0 - 0.05), rel=1e-12)
    assert int(lag.outputs()["method_used"]) == 5
    lag.close()
    description = lag.connectors["method_used"].description
    assert description.endswith("(1 exact, 5 Forward Euler, 9 not yet)")


@pytest.mark.parametrize("wrong", ["not yet", "euler", ""])
def test_a_wrong_item_is_refused(lag2: Path, wrong: str) -> None:
    with pytest.raises(ComponentTypeError, match=f"`method` has no item `{wrong}`; "):
        FmuComponentType(lag2).create("lag", {"method": wrong})


@pytest.mark.parametrize(
    ("status", "message"),
    [
        (2, r"Discard \(the last successful time is 0.2 s\): told to fail as 2 at once"),
        (3, "Error: told to fail as 3 at once"),
        (4, "Fatal: told to fail as 4 at once"),
        (5, "Pending: "),
    ],
)
def test_failing_steps_say_why(lag2: Path, status: int, message: str) -> None:
    lag = started(lag2, fail_at=0.25, fail_as=status)
    lag.step(INPUTS, 0, STEP)
    lag.step(INPUTS, STEP, STEP)
    with pytest.raises(FmuError, match=f"fmi2DoStep returned {message}"):
        lag.step(INPUTS, 2 * STEP, STEP)
    lag.close()


def test_messages_reach_the_instance_that_sent_them(
    lag2: Path, caplog: pytest.LogCaptureFixture
) -> None:
    kind = FmuComponentType(lag2)
    components = [kind.create(name, {"fail_at": 0.05, "fail_as": 1}) for name in ("one", "two")]
    for component in components:
        component.setup(0, stream(1, "lag"))
        component.initialise(INPUTS)
    for component in components:
        component.step(INPUTS, 0, STEP)
    names = [record.name for record in caplog.records]
    assert names == ["nlosim.fmu.one", "nlosim.fmu.two"]
    for component in components:
        component.close()


def test_steps_of_a_sixtieth_of_a_second_are_exact(lag2: Path) -> None:
    lag = FmuComponentType(lag2).create("lag", {"time_constant": 0.5})
    grid = CommunicationGrid.over(0, 1_000_000_000, Fraction(10**9, 60))
    lag.expect(grid)
    lag.setup(0, stream(1, "lag"))
    lag.initialise(INPUTS)
    for k, t in enumerate(grid):
        lag.step(INPUTS, t, grid.after(t) - t)
        exact = 3.0 - 2.0 * math.exp(-(k + 1) / 30)
        assert lag.outputs()["x"] == pytest.approx(exact, rel=1e-14)  # 6e-10 of rounded times
    lag.close()


def test_a_fmu_without_states_is_not_restorable(lag2: Path, tmp_path: Path) -> None:
    import zipfile  # noqa: PLC0415

    path = tmp_path / "lag2.fmu"
    with zipfile.ZipFile(lag2) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            new.writestr(name, data.replace(b'canGetAndSetFMUstate="true"', b""))
    component = FmuComponentType(path).create("lag", {})
    assert isinstance(component, FmuComponent)
    component.setup(0, stream(1, "lag"))
    component.initialise(INPUTS)
    component.step(INPUTS, 0, STEP)
    assert not component.outputs()["rollback"]
    component.close()


def test_stop_time_tolerance_and_start_values_arrive(lag2: Path) -> None:
    values = {"fmi.locals": ("stop", "tolerance"), "fmi.tolerance": 1e-3, "start.count_in": 5}
    lag = FmuComponentType(lag2).create("lag", values)
    assert lag.connectors["count_in"].start_value() == 5
    lag.expect(CommunicationGrid(0, STEP, 7))
    lag.setup(0, stream(1, "lag"))
    lag.initialise(INPUTS)
    assert lag.outputs()["stop"] == 0.7
    assert lag.outputs()["tolerance"] == 1e-3
    lag.close()
