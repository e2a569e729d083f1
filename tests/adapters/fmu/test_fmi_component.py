"""FMI 3.0 FMUs as components."""

import gc
import logging
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import ComponentTypeError
from orchestrator.randomness import stream
from orchestrator.signal import Causality, Connector, Signal, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import check_component
from orchestrator.units import parse_unit

STEP = 100_000_000
Fmu = Callable[[str], Path]


def component(path: Path, **values: Any) -> Component:
    return FmuComponentType(path).create("test", values)


def start_values(component: Component) -> dict[str, Signal]:
    return {
        name: connector.start_value()
        for name, connector in component.connectors.items()
        if connector.causality is Causality.INPUT
    }


def started(path: Path, inputs: Mapping[str, Signal] | None = None, **values: Any) -> Component:
    made = component(path, **values)
    made.setup(0, stream(1, "test"))
    made.initialise(start_values(made) | dict(inputs or {}))
    return made


@pytest.mark.parametrize("name", ["matrix", "echo", "lag", "faulty"])
def test_fmus_keep_the_contract_of_components(fmu: Fmu, name: str) -> None:
    check_component(component(fmu(name)))


def test_inputs_that_change_their_length_keep_the_contract(fmu: Fmu) -> None:
    def inputs(t: int) -> Signals:
        return {"row.value": np.full((t // STEP % 3, 4), float(t))}

    check_component(component(fmu("matrix")), steps=6, inputs=inputs)


def test_a_lag_follows_its_analytic_solution(fmu: Fmu) -> None:
    lag = started(fmu("lag"), time_constant=2.0, initial=1.0)
    u = {"u": np.array([3.0])}
    for k in range(10):
        lag.step(u, k * STEP, STEP)
    assert lag.outputs()["x"] == pytest.approx([3.0 - 2.0 * math.exp(-0.5)], rel=1e-12)
    lag.close()


def test_connectors_are_those_of_the_description(fmu: Fmu) -> None:
    connectors = component(fmu("matrix")).connectors
    rows = Connector(
        causality=Causality.OUTPUT,
        dtype=np.float64,
        shape=("row", 4),
        unit="m",
        definition=parse_unit("m"),
        feedthrough=frozenset({"row.value"}),
        description="gain * row + offset",
    )
    assert connectors["row.scaled"] == rows
    assert connectors["product"].shape == ("row", "row")
    assert connectors["spare"].shape == ("spare",)
    assert connectors["spare"].feedthrough == frozenset()
    assert component(fmu("lag")).connectors["u"].variability is Variability.CONTINUOUS
    payload = component(fmu("echo")).connectors["payload"]
    assert (payload.dtype, payload.mime_type) == (None, "application/x-test; version=1")


def test_parameters_are_those_of_the_description(fmu: Fmu) -> None:
    offered = FmuComponentType(fmu("matrix")).parameters
    own = {name for name in offered if not name.startswith(("start.", "fmi."))}
    assert own == {"gain", "offset", "n_spare"}  # `n_row` follows the input
    gain, spare = offered["gain"], offered["n_spare"]
    assert (gain.type, gain.unit, gain.default) == (float, "m", 1.0)
    assert (gain.minimum, gain.maximum) == (-10, 10)
    assert (spare.type, spare.default, spare.minimum, spare.maximum) == (int, 3, 1, 10)
    assert FmuComponentType(fmu("faulty")).parameters["refuse"].type is bool


@pytest.mark.slow
@given(st.lists(st.integers(0, 7), min_size=1, max_size=6))
def test_outputs_follow_the_number_of_rows(fmu: Fmu, lengths: list[int]) -> None:
    matrix = started(fmu("matrix"), gain=2.0, n_spare=5)
    for k, rows in enumerate(lengths):
        value = np.random.default_rng(k).random((rows, 4))
        matrix.step({"row.value": value}, k * STEP, STEP)
        found = matrix.outputs()
        np.testing.assert_array_equal(found["row.scaled"], 2 * value)
        np.testing.assert_allclose(np.asarray(found["product"]), np.asarray(value @ value.T))
        np.testing.assert_array_equal(found["spare"], np.arange(5))
    matrix.close()


def test_inputs_that_nobody_drives_are_set_again_when_their_axis_is_resized(
    fmu: Fmu, monkeypatch: Any
) -> None:
    """In the new length, though they are the same objects: FMI leaves open what is there."""
    from adapters.fmi.fmi3 import Fmi3Instance  # noqa: PLC0415

    written: list[dict[str, Any]] = []
    original = Fmi3Instance.write

    def spy(self: Fmi3Instance, values: Mapping[str, Signal]) -> None:
        written.append({name: np.asarray(value).tolist() for name, value in values.items()})
        original(self, values)

    echo = started(fmu("echo"))
    inputs = start_values(echo)
    echo.step(inputs | {"int8.in": np.array([4, 5], np.int8)}, 0, STEP)
    monkeypatch.setattr(Fmi3Instance, "write", spy)
    echo.step(inputs | {"int8.in": np.array([6, 7, 8], np.int8)}, STEP, STEP)
    echo.step(inputs | {"int8.in": np.array([9, 7, 8], np.int8)}, 2 * STEP, STEP)
    sizes, resized, changed = written
    assert sizes == {"n_element": 3}
    arrays = {name for name, value in inputs.items() if not isinstance(value, bytes)}
    assert set(resized) == arrays
    assert resized["int8.in"] == [6, 7, 8]
    assert resized["float64.in"] == [1.0] * 3
    assert changed == {"int8.in": [9, 7, 8]}
    echo.close()


def test_inputs_that_did_not_change_are_not_set_again(fmu: Fmu, monkeypatch: Any) -> None:
    written: list[set[str]] = []
    from adapters.fmi.fmi3 import Fmi3Instance  # noqa: PLC0415

    original = Fmi3Instance.write

    def spy(self: Fmi3Instance, values: Mapping[str, Signal]) -> None:
        written.append(set(values))
        original(self, values)

    echo = started(fmu("echo"))
    inputs = start_values(echo)
    echo.step(inputs, 0, STEP)
    monkeypatch.setattr(Fmi3Instance, "write", spy)
    echo.step(inputs, STEP, STEP)
    assert written == []
    written.clear()
    echo.step(inputs | {"payload": b"new"}, 2 * STEP, STEP)
    assert written == [{"payload"}]
    assert echo.outputs()["copy"] == b"new"
    echo.close()


def test_an_input_that_nobody_drives_takes_its_start_value(fmu: Fmu) -> None:
    echo = started(fmu("echo"))
    inputs = start_values(echo) | {"int8.in": np.array([4, 5], np.int8)}
    echo.step(inputs, 0, STEP)
    np.testing.assert_array_equal(echo.outputs()["float64.out"], [1.0, 1.0])
    np.testing.assert_array_equal(echo.outputs()["int8.out"], [4, 5])
    echo.close()


def test_inputs_of_different_lengths_are_refused(fmu: Fmu) -> None:
    echo = started(fmu("echo"))
    inputs = start_values(echo)
    inputs |= {"int8.in": np.zeros(2, np.int8), "int16.in": np.zeros(3, np.int16)}
    with pytest.raises(FmuError, match=r"`element` has two lengths: 2 for `int8.in` and 3 for"):
        echo.step(inputs, 0, STEP)
    echo.close()


def test_too_many_elements_are_refused(fmu: Fmu) -> None:
    echo = started(fmu("echo"))
    inputs = start_values(echo) | {"int8.in": np.zeros(1_000_001, np.int8)}
    with pytest.raises(FmuError, match=r"`int8.in` has length 1000001 .* takes 0 to 1000000"):
        echo.step(inputs, 0, STEP)
    echo.close()


def test_a_fixed_axis_says_which_parameter_to_set(fmu: Fmu) -> None:
    lag = component(fmu("lag"))
    lag.setup(0, stream(1, "test"))
    with pytest.raises(FmuError, match=r"set `n_channel: 2` instead of 1"):
        lag.initialise({"u": np.zeros(2)})
    lag.close()
    fitting = started(fmu("lag"), {"u": np.zeros(2)}, n_channel=2)
    assert fitting.outputs()["x"].shape == (2,)  # type: ignore[union-attr]
    fitting.close()


def test_outputs_are_new_read_only_arrays(fmu: Fmu) -> None:
    lag = started(fmu("lag"))
    inputs = {"u": np.zeros(1)}
    before = lag.outputs()["x"]
    copy = np.array(before)
    lag.step(inputs, 0, STEP)
    np.testing.assert_array_equal(before, copy)
    with pytest.raises(ValueError, match="read-only"):
        lag.outputs()["x"][...] = 0  # type: ignore[index]
    lag.close()


def test_inputs_need_not_be_contiguous(fmu: Fmu) -> None:
    matrix = started(fmu("matrix"))
    value = np.arange(32.0).reshape(8, 4)[::2]
    matrix.step({"row.value": value}, 0, STEP)
    np.testing.assert_array_equal(matrix.outputs()["row.scaled"], value)
    matrix.close()


def test_a_saved_state_survives_resizing_and_remembers_inputs(fmu: Fmu) -> None:
    matrix = started(fmu("matrix"))
    assert isinstance(matrix, RestorableComponent)
    three, five = np.full((3, 4), 2.0), np.full((5, 4), 3.0)
    matrix.step({"row.value": three}, 0, STEP)
    state = matrix.save()
    matrix.step({"row.value": five}, STEP, STEP)
    matrix.restore(state)
    np.testing.assert_array_equal(matrix.outputs()["row.scaled"], three)
    matrix.step({"row.value": three}, STEP, STEP)
    np.testing.assert_array_equal(matrix.outputs()["row.scaled"], three)
    matrix.step({"row.value": five}, 2 * STEP, STEP)
    np.testing.assert_array_equal(matrix.outputs()["row.scaled"], five)
    matrix.close()


def test_a_state_of_an_earlier_run_is_refused(fmu: Fmu) -> None:
    lag = started(fmu("lag"))
    assert isinstance(lag, RestorableComponent)
    state = lag.save()
    lag.setup(0, stream(1, "test"))
    with pytest.raises(FmuError, match="belongs to an instance that was closed"):
        lag.restore(state)
    lag.close()


def test_two_fmus_in_a_cycle_are_stepped_until_they_agree(fmu: Fmu) -> None:
    """Each lag follows the other one's new value: both are the solution of two linear equations."""
    parts = {"a": component(fmu("lag"), initial=1.0), "b": component(fmu("lag"), initial=-3.0)}
    wires = [("a.x", "b.u"), ("b.x", "a.u")]
    links = [Connection(Endpoint.parse(a), Endpoint.parse(b)) for a, b in wires]
    system = System(parts, dict.fromkeys(parts, STEP), links)
    result = simulate(system, FixedPoint(), start=0, stop=3 * STEP, seed=0)
    decay = math.exp(-0.1 / 2)
    matrix = np.array([[1, decay - 1], [decay - 1, 1]])
    wanted = np.array([1.0, -3.0])
    for _ in range(3):
        wanted = np.linalg.solve(matrix, decay * wanted)
    found = [np.asarray(result.values[name]["x"]) for name in "ab"]
    np.testing.assert_allclose(np.ravel(found), wanted, rtol=1e-8)


def test_the_seed_is_drawn_unless_it_is_set(fmu: Fmu) -> None:
    drawn = [int(started(fmu("lag")).outputs()["seed_used"]) for _ in range(2)]
    assert drawn[0] == drawn[1] > 0
    assert started(fmu("lag"), seed=42).outputs()["seed_used"] == 42


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (2, r"fmi3DoStep returned Discard \(the last successful time is 0.2 s\): told to fail"),
        (3, r"fmi3DoStep returned Error: told to fail with status 3"),
        (4, r"fmi3DoStep returned Fatal: told to fail with status 4"),
    ],
)
def test_failing_steps_say_why(fmu: Fmu, kind: int, message: str) -> None:
    faulty = started(fmu("faulty"), kind=kind)
    faulty.step({}, 0, 2 * STEP)
    with pytest.raises(FmuError, match=message):
        faulty.step({}, 2 * STEP, STEP)
    faulty.close()


def test_after_fatal_nothing_is_called_any_more(fmu: Fmu, monkeypatch: Any) -> None:
    import fmpy  # noqa: PLC0415

    faulty = started(fmu("faulty"), kind=4)
    with pytest.raises(FmuError, match="Fatal"):
        faulty.step({}, 0, 3 * STEP)

    def unload(_: int) -> None:
        pytest.fail("the library was unloaded")

    monkeypatch.setattr(fmpy, "freeLibrary", unload)
    faulty.close()


def test_warnings_go_to_the_log_and_the_run_goes_on(
    fmu: Fmu, caplog: pytest.LogCaptureFixture
) -> None:
    faulty = started(fmu("faulty"), kind=1)
    with caplog.at_level(logging.WARNING, "nlosim.fmu.test"):
        faulty.step({}, 0, 3 * STEP)
    assert caplog.record_tuples == [
        ("nlosim.fmu.test", logging.WARNING, "logStatusWarning: told to fail with status 1")
    ]
    assert faulty.outputs()["y"] == pytest.approx(0.3)
    faulty.close()


def test_initialisation_errors_say_why(fmu: Fmu) -> None:
    faulty = component(fmu("faulty"), refuse=True)
    faulty.setup(0, stream(1, "test"))
    with pytest.raises(FmuError, match="fmi3ExitInitializationMode returned Error: told to refuse"):
        faulty.initialise({})
    faulty.close()


def test_a_value_the_type_cannot_hold_is_refused(fmu: Fmu) -> None:
    faulty = component(fmu("faulty"), kind=2**40)
    faulty.setup(0, stream(1, "test"))
    with pytest.raises(FmuError, match="`kind` cannot be 1099511627776"):
        faulty.initialise({})
    faulty.close()


def test_an_unknown_parameter_is_refused(fmu: Fmu) -> None:
    with pytest.raises(ComponentTypeError, match="there is no parameter `gian`"):
        FmuComponentType(fmu("matrix")).create("m", {"gian": 1.0})


def folders() -> set[Path]:
    return set(Path(tempfile.gettempdir()).glob("nlosim-*/lag-*"))


def test_temporary_folders_vanish_with_close_and_with_the_component(
    fmu: Fmu, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = fmu("lag")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # other tests have theirs elsewhere
    before = folders()
    lag = started(path)
    assert len(folders() - before) == 1
    lag.close()
    lag.close()
    assert folders() == before
    forgotten = started(path)
    del forgotten, lag
    gc.collect()
    assert folders() == before


def test_temporary_folders_vanish_with_the_interpreter(fmu: Fmu, tmp_path: Path) -> None:
    program = (
        "import sys, numpy as np\n"
        "from pathlib import Path\n"
        "from adapters.fmi import FmuComponentType\n"
        "lag = FmuComponentType(Path(sys.argv[1])).create('lag', {})\n"
        "lag.setup(0, np.random.default_rng(1))\n"
        "lag.initialise({'u': np.zeros(1)})\n"
        "state = lag.save()\n"
    )
    environment = os.environ | {"TMPDIR": str(tmp_path), "PYTHONPATH": str(Path.cwd())}
    subprocess.run([sys.executable, "-c", program, fmu("lag")], check=True, env=environment)
    assert list(tmp_path.iterdir()) == []


def test_loading_leaves_the_working_directory(fmu: Fmu) -> None:
    here = Path.cwd()
    started(fmu("lag")).close()
    assert Path.cwd() == here
