"""The state machine of the shell: what is allowed when, and what errors say."""

import ctypes
import math
from collections.abc import Callable
from typing import Any

import fmpy.fmi3
import pytest
from fmpy.fmi1 import FMICallException


def test_a_lag_follows_its_analytic_solution(driver: Callable[..., Any]) -> None:
    lag = driver("lag")
    lag.initialise(time_constant=2.0, initial=1.0)
    lag.set("u", [3.0])
    for k in range(10):
        lag.step(k * 0.1)
    exact = 3.0 + (1.0 - 3.0) * math.exp(-1.0 / 2.0)
    assert lag.get("x") == pytest.approx([exact], rel=1e-12)


def test_outputs_are_up_to_date_in_initialisation_mode(driver: Callable[..., Any]) -> None:
    matrix = driver("matrix")
    matrix.fmu.enterInitializationMode()
    matrix.set("row.value", [float(k) for k in range(8)])
    assert matrix.get("row.scaled", 8) == [float(k) for k in range(8)]
    matrix.set("gain", [2.0])
    assert matrix.get("row.scaled", 8) == [2.0 * k for k in range(8)]


def test_begin_runs_once_and_sees_parameters_that_arrive_late(driver: Callable[..., Any]) -> None:
    matrix = driver("matrix")
    matrix.fmu.enterInitializationMode()
    assert matrix.get("row.scaled", 8) == [0.5] * 8
    matrix.set("offset", [10.0])  # after `begin` has used it
    assert matrix.get("row.scaled", 8) == [10.5] * 8
    matrix.fmu.exitInitializationMode()
    matrix.step(0.0)
    assert matrix.get("begins", 1, "Int32") == [1]


def test_event_mode_evaluates_without_passing_time(driver: Callable[..., Any]) -> None:
    matrix = driver("matrix", event_mode=True)
    matrix.initialise()
    matrix.fmu.enterStepMode()
    matrix.step(0.0)
    matrix.fmu.enterEventMode()
    matrix.set("row.value", [7.0] * 8)
    assert matrix.get("row.scaled", 8) == [7.0] * 8
    assert matrix.get("time") == [pytest.approx(0.1)]
    matrix.fmu.enterStepMode()
    matrix.step(0.1)
    assert matrix.get("time") == [pytest.approx(0.2)]


def test_step_mode_shows_the_outputs_of_the_last_step(driver: Callable[..., Any]) -> None:
    matrix = driver("matrix")
    matrix.initialise()
    matrix.step(0.0)
    matrix.set("row.value", [7.0] * 8)
    assert matrix.get("row.scaled", 8) == [0.5] * 8
    matrix.step(0.1)
    assert matrix.get("row.scaled", 8) == [7.0] * 8


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: m.step(0.0), "fmi3DoStep: not allowed in the state Instantiated"),
        (lambda m: m.fmu.exitInitializationMode(), "not allowed in the state Instantiated"),
        (lambda m: m.fmu.exitConfigurationMode(), "not allowed in the state Instantiated"),
        (lambda m: m.fmu.enterEventMode(), "not allowed in the state Instantiated"),
        (lambda m: m.fmu.terminate(), "not allowed in the state Instantiated"),
        (lambda m: m.set("n_row", [3], "UInt64"), "`n_row` cannot be set in the state Inst"),
        (lambda m: m.set("row.scaled", [0.0] * 8), "`row.scaled` cannot be set"),
        (lambda m: m.set("time", [0.0]), "`time` cannot be set"),
        (lambda m: m.set("gain", [11.0]), "element 0 of `gain` is 11, allowed are -10 to 10"),
        (lambda m: m.set("gain", [math.nan]), "element 0 of `gain` is not a number"),
        (lambda m: m.set("offset", [math.nan]), "element 0 of `offset` is not a number"),
        (lambda m: m.get("row.value", 7), "nValues is 7, but the 1 variables from `row.value`"),
        (lambda m: m.fmu.getFloat64([99]), "no variable of this type has the reference 99"),
        (lambda m: m.fmu.getInt32([m.references["gain"]]), "no variable of this type"),
        (lambda m: m.fmu.enterInitializationMode(startTime=math.nan), "the start time is nan"),
        (lambda m: m.fmu.enterInitializationMode(startTime=1.0, stopTime=0.0), "before the start"),
    ],
)
def test_misuse_is_an_error_that_changes_nothing(
    driver: Callable[..., Any], call: Callable[[Any], None], message: str
) -> None:
    matrix = driver("matrix")
    with pytest.raises(FMICallException):
        call(matrix)
    status, category, text = matrix.messages[-1]
    assert (status, category) == (3, "logStatusError")  # although logging is off
    assert message in text
    matrix.initialise()
    matrix.step(0.0)
    assert matrix.get("row.scaled", 8) == [0.5] * 8


@pytest.mark.parametrize(
    ("t", "h", "message"),
    [
        (0.5, 0.1, "the communication point is 0.5, but the last step ended at 0.1"),
        (math.nan, 0.1, "the communication point is nan"),
        (0.1, 0.0, "the communication step size is 0"),
        (0.1, -0.1, "the communication step size is -0.1"),
        (0.1, math.inf, "the communication step size is inf"),
    ],
)
def test_steps_join_and_move_forward(
    driver: Callable[..., Any], t: float, h: float, message: str
) -> None:
    lag = driver("lag")
    lag.initialise()
    lag.step(0.0, 0.1)
    with pytest.raises(FMICallException):
        lag.step(t, h)
    assert message in lag.last_message
    lag.step(0.1, 0.1)


def test_tunable_parameters_change_in_step_mode_and_fixed_ones_do_not(
    driver: Callable[..., Any],
) -> None:
    matrix = driver("matrix")
    matrix.initialise()
    matrix.set("gain", [3.0])
    matrix.step(0.0)
    assert matrix.get("row.scaled", 8) == [1.5] * 8
    with pytest.raises(FMICallException):
        matrix.set("offset", [1.0])
    assert matrix.last_message == "fmi3SetFloat64: `offset` cannot be set in Step Mode"


def test_reset_repeats_the_run(driver: Callable[..., Any]) -> None:
    lag = driver("lag")
    runs = []
    for _ in range(2):
        lag.resize(n_channel=2)
        lag.initialise(initial=5.0)
        lag.set("u", [1.0, 2.0])
        lag.step(0.0)
        runs.append(lag.get("x", 2))
        lag.fmu.reset()
        assert lag.get("initial") == [1.0]
        assert lag.get("n_channel", 1, "UInt64") == [1]
    assert runs[0] == runs[1]


def test_after_an_error_of_the_model_only_reset_and_restore_remain(
    driver: Callable[..., Any],
) -> None:
    faulty = driver("faulty")
    faulty.set("kind", [3], "Int32")
    faulty.initialise()
    faulty.step(0.0)
    with pytest.raises(FMICallException):
        faulty.step(0.1, 0.3)
    assert faulty.last_message == "told to fail with status 3"
    assert faulty.get("y") == [pytest.approx(0.1)]
    with pytest.raises(FMICallException):
        faulty.step(0.1)
    assert "the state Terminated (after an error)" in faulty.last_message
    faulty.fmu.reset()
    faulty.initialise()
    faulty.step(0.0, 1.0)


def test_an_error_in_initialisation_names_its_reason(driver: Callable[..., Any]) -> None:
    faulty = driver("faulty")
    faulty.set("refuse", [True], "Boolean")
    with pytest.raises(FMICallException):
        faulty.initialise()
    assert faulty.last_message == "told to refuse at t = 0"


def test_categories_are_switched_one_by_one(driver: Callable[..., Any]) -> None:
    faulty = driver("faulty")
    faulty.initialise()
    assert faulty.messages == []
    faulty.fmu.reset()
    faulty.fmu.setDebugLogging(True, ["logEvents"])
    faulty.initialise()
    assert faulty.messages == [(0, "logEvents", "begins")]
    with pytest.raises(FMICallException):
        faulty.fmu.setDebugLogging(True, ["logEvent"])
    assert "there is no log category `logEvent`" in faulty.last_message


def test_a_wrong_token_is_refused(driver: Callable[..., Any]) -> None:
    fmu = driver("lag").fmu
    heard: list[bytes] = []
    callback = fmpy.fmi3.fmi3LogMessageCallback(lambda *a: heard.append(a[3]))
    found = fmu.fmi3InstantiateCoSimulation(
        b"x",
        b"{wrong}",
        None,
        False,
        False,
        False,
        False,
        None,
        0,
        None,
        callback,
        fmpy.fmi3.fmi3IntermediateUpdateCallback(),
    )
    assert not found
    assert b"the instantiation token is `{wrong}`" in heard[0]


def test_other_interfaces_are_refused(driver: Callable[..., Any]) -> None:
    fmu = driver("lag").fmu
    heard: list[bytes] = []
    callback = fmpy.fmi3.fmi3LogMessageCallback(lambda *a: heard.append(a[3]))
    token = fmu.guid.encode()
    assert not fmu.fmi3InstantiateModelExchange(
        b"x",
        token,
        None,
        False,
        False,
        None,
        callback,
    )
    assert b"this FMU offers Co-Simulation only" in heard[0]
    value = ctypes.c_size_t()
    assert fmu.dll.fmi3GetNumberOfContinuousStates(fmu.component, ctypes.byref(value)) == 3


def test_instances_do_not_know_each_other(driver: Callable[..., Any]) -> None:
    one, two = driver("lag"), driver("lag")
    one.initialise(initial=1.0)
    two.initialise(initial=2.0)
    one.step(0.0)
    assert two.get("x") == [2.0]
