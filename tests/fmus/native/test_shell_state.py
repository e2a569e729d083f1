"""The FMU state: a restored instance goes on bit for bit, damaged bytes do no harm."""

import ctypes
import random
from collections.abc import Callable
from typing import Any

import pytest
from fmpy.fmi1 import FMICallException
from hypothesis import HealthCheck, given, settings, strategies as st


def running_lag(driver: Callable[..., Any], channels: int = 1) -> Any:
    lag = driver("lag")
    if channels != 1:
        lag.resize(n_channel=channels)
    lag.initialise(initial=4.0)
    lag.set("u", [float(k) for k in range(channels)])
    lag.step(0.0)
    return lag


def advance(lag: Any, channels: int) -> list[float]:
    lag.step(0.1)
    lag.step(0.2)
    found: list[float] = lag.get("x", channels)
    return found


def test_a_restored_instance_repeats_itself(driver: Callable[..., Any]) -> None:
    lag = running_lag(driver, 3)
    state = lag.fmu.getFMUState()
    first = advance(lag, 3)
    for _ in range(3):
        lag.fmu.setFMUState(state)
        assert advance(lag, 3) == first
    lag.fmu.freeFMUState(state)


@pytest.mark.parametrize("channels", [1, 3, 50])
def test_a_serialized_state_moves_into_an_instance_of_another_size(
    driver: Callable[..., Any], channels: int
) -> None:
    source = running_lag(driver, channels)
    state = source.fmu.getFMUState()
    data = source.fmu.serializeFMUState(state)
    expected = advance(source, channels)
    for target in (driver("lag"), running_lag(driver, 2)):
        arrived = target.fmu.deserializeFMUState(data)
        target.fmu.setFMUState(arrived)
        assert target.get("n_channel", 1, "UInt64") == [channels]
        assert advance(target, channels) == expected


def test_a_state_brings_the_parameters_that_begin_has_used(driver: Callable[..., Any]) -> None:
    source = driver("matrix")
    source.initialise(offset=10.0)
    data = source.fmu.serializeFMUState(source.fmu.getFMUState())
    target = driver("matrix")
    target.initialise(offset=1.0)
    target.fmu.setFMUState(target.fmu.deserializeFMUState(data))
    target.step(0.0)
    assert target.get("row.scaled", 8) == [10.5] * 8


def test_a_state_revives_an_instance_that_failed(driver: Callable[..., Any]) -> None:
    faulty = driver("faulty")
    faulty.set("kind", [3], "Int32")
    faulty.initialise()
    faulty.step(0.0)
    state = faulty.fmu.getFMUState()
    with pytest.raises(FMICallException):
        faulty.step(0.1, 0.3)
    faulty.fmu.setFMUState(state)
    faulty.step(0.1)
    assert faulty.get("y") == [pytest.approx(0.2)]


def test_binary_values_belong_to_the_state(driver: Callable[..., Any]) -> None:
    echo = driver("echo")
    echo.initialise()
    echo.fmu.setBinary([echo.references["payload"]], [b"before"])
    state = echo.fmu.getFMUState()
    echo.fmu.setBinary([echo.references["payload"]], [b"after and longer" * 99])
    echo.fmu.setFMUState(state)
    echo.step(0.0)
    assert echo.fmu.getBinary([echo.references["copy"]]) == [b"before"]


def test_states_of_other_fmus_are_refused(driver: Callable[..., Any]) -> None:
    echo, lag = driver("echo"), running_lag(driver)
    data = echo.fmu.serializeFMUState(echo.fmu.getFMUState())
    with pytest.raises(FMICallException):
        lag.fmu.setFMUState(lag.fmu.deserializeFMUState(data))
    assert "not a state of this FMU" in lag.last_message
    assert lag.get("x") != []
    lag.step(0.1)


def test_every_damaged_byte_is_noticed(driver: Callable[..., Any]) -> None:
    lag = running_lag(driver, 2)
    data = lag.fmu.serializeFMUState(lag.fmu.getFMUState())
    for k in range(len(data)):
        damaged = data[:k] + bytes([data[k] ^ 0x55]) + data[k + 1 :]
        with pytest.raises(FMICallException):
            lag.fmu.deserializeFMUState(damaged)
    for size in range(len(data)):
        with pytest.raises(FMICallException):
            lag.fmu.deserializeFMUState(data[:size])


class Snapshot(ctypes.Structure):
    """The head of a state in memory; the bytes follow."""

    _fields_ = (("nothing", ctypes.c_void_p), ("size", ctypes.c_size_t))


def test_damage_behind_the_checksum_never_crashes(driver: Callable[..., Any]) -> None:
    """Scribble over the state in memory, where no checksum protects it."""
    lag = running_lag(driver, 3)
    state = lag.fmu.getFMUState()
    head = Snapshot.from_address(state.value)
    body = (ctypes.c_uint8 * head.size).from_address(state.value + ctypes.sizeof(Snapshot))
    sound = bytes(body)
    expected = advance(lag, 3)
    chance = random.Random(1)  # noqa: S311  (no secret)
    for _ in range(2000):
        damaged = bytearray(sound)
        for _ in range(chance.randint(1, 4)):
            damaged[chance.randrange(len(damaged))] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
        head.size = chance.choice((len(sound), chance.randrange(len(sound))))
        body[:] = damaged
        status = lag.fmu.dll.fmi3SetFMUState(lag.fmu.component, state)
        assert status in {0, 3}
    head.size = len(sound)
    body[:] = sound
    lag.fmu.setFMUState(state)
    assert advance(lag, 3) == expected


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(before=st.integers(0, 4), after=st.integers(1, 4), rows=st.integers(0, 9))
def test_saving_and_restoring_commutes_with_resizing(
    matrix_driver: Any, before: int, after: int, rows: int
) -> None:
    matrix = matrix_driver
    matrix.fmu.reset()
    matrix.initialise()
    matrix.resize(n_row=before)
    matrix.set("row.value", [2.0] * 4 * before)
    state = matrix.fmu.getFMUState()
    matrix.resize(n_row=rows)
    for k in range(after):
        matrix.step(0.1 * k)
    matrix.fmu.setFMUState(state)
    matrix.fmu.freeFMUState(state)
    matrix.step(0.0)
    assert matrix.get("row.scaled", 4 * before) == [2.0] * 4 * before


@pytest.fixture
def matrix_driver(driver: Callable[..., Any]) -> Any:
    return driver("matrix")
