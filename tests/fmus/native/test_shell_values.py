"""Values and sizes: every type, resizing, and the promises about Binary."""

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

EXTREMES = {
    "Float32": [float(np.finfo(np.float32).max), -0.0, 1.5],
    "Float64": [float(np.finfo(np.float64).max), 5e-324, -1.5],
    **{
        f"{sign}Int{bits}".replace("SInt", "Int"): [
            int(np.iinfo(f"{'u' if sign == 'U' else ''}int{bits}").min),
            int(np.iinfo(f"{'u' if sign == 'U' else ''}int{bits}").max),
            1,
        ]
        for sign in ("", "U")
        for bits in (8, 16, 32, 64)
    },
    "Boolean": [True, False, True],
}


@pytest.mark.parametrize("kind", EXTREMES)
def test_every_type_passes_bit_for_bit(driver: Callable[..., Any], kind: str) -> None:
    echo = driver("echo")
    echo.initialise()
    echo.set(f"{kind.lower()}.in", EXTREMES[kind], kind)
    echo.step(0.0)
    assert echo.get(f"{kind.lower()}.out", 3, kind) == EXTREMES[kind]


def test_enumerations_pass_as_int64(driver: Callable[..., Any]) -> None:
    """FMI 3.0.2, 2.2.6.2: there are no functions for Enumeration of its own."""
    echo = driver("echo")
    echo.initialise()
    echo.set("enumeration.in", [3, 1, 2], "Int64")
    echo.step(0.0)
    assert echo.get("enumeration.out", 3, "Int64") == [3, 1, 2]


def test_an_enumeration_chooses_among_its_items(driver: Callable[..., Any]) -> None:
    for item, expected in ((1, 1.0), (2, 2.5)):
        table = driver("table")
        assert table.get("interpolation", 1, "Int64") == [1]
        table.set("interpolation", [item], "Int64")
        table.set("sample.gain", [1.0, 4.0])
        table.initialise()
        table.set("position", [0.5])
        table.step(0.0)
        assert table.get("gain") == [expected]


@pytest.mark.parametrize("value", [0, 3, -1, 2**62])
def test_a_value_that_is_no_item_is_an_error_that_names_the_items(
    driver: Callable[..., Any], value: int
) -> None:
    table = driver("table")
    with pytest.raises(FMICallException):
        table.set("interpolation", [value], "Int64")
    assert table.last_message == (
        f"fmi3SetInt64: element 0 of `interpolation` is {value:.9g}, allowed are 1 (hold), "
        "2 (linear)"
    )
    assert table.get("interpolation", 1, "Int64") == [1]


def test_enumerations_that_are_inputs_or_arrays_are_checked_as_well(
    driver: Callable[..., Any],
) -> None:
    table, echo = driver("table"), driver("echo")
    with pytest.raises(FMICallException):
        table.set("sample.colour", [3, 4], "Int64")
    assert "element 1 of `sample.colour` is 4, allowed are 1 (red), 2 (" in table.last_message
    echo.initialise()
    with pytest.raises(FMICallException):
        echo.set("enumeration.in", [1, 0, 1], "Int64")
    assert "element 1 of `enumeration.in` is 0" in echo.last_message
    assert echo.get("enumeration.in", 3, "Int64") == [1, 1, 1]


def test_array_parameters_take_the_size_that_was_chosen(driver: Callable[..., Any]) -> None:
    table = driver("table")
    table.resize(n_sample=4)
    assert table.get("sample.gain", 4) == [1.0] * 4  # the start value of every element
    assert table.get("sample.colour", 4, "Int64") == [2] * 4
    gains = [0.0, 3.0, 0.0, -3.0]
    with pytest.raises(FMICallException):
        table.set("sample.gain", gains[:3])
    assert "have 4 elements" in table.last_message
    table.set("sample.gain", gains)
    table.set("sample.corner", [float(k) for k in range(8)])
    table.initialise()
    table.step(0.0)
    assert table.get("sample.gain", 4) == gains
    assert table.get("corner", 8) == [float(k) for k in range(8)]


@pytest.mark.parametrize("data", [b"", b"\0", b"a\0b", bytes(range(256)) * 4096])
def test_binary_passes_byte_for_byte(driver: Callable[..., Any], data: bytes) -> None:
    echo = driver("echo")
    echo.initialise()
    for k, sent in enumerate((data, b"", data)):
        echo.fmu.setBinary([echo.references["payload"]], [sent])
        echo.step(0.1 * k)
        assert echo.fmu.getBinary([echo.references["copy"]]) == [sent]


def test_an_empty_binary_has_an_address(driver: Callable[..., Any]) -> None:
    echo = driver("echo")
    echo.initialise()
    sizes, values = (ctypes.c_size_t * 1)(), (ctypes.POINTER(ctypes.c_uint8) * 1)()
    reference = (ctypes.c_uint32 * 1)(echo.references["copy"])
    status = echo.fmu.fmi3GetBinary(echo.fmu.component, reference, 1, sizes, values, 1)
    assert (status, sizes[0], bool(values[0])) == (0, 0, True)


@pytest.mark.parametrize("rows", [0, 1, 2, 3, 100])
def test_arrays_follow_the_structural_parameter(driver: Callable[..., Any], rows: int) -> None:
    matrix = driver("matrix")
    matrix.initialise()
    matrix.resize(n_row=rows)
    matrix.set("row.value", [1.0] * 4 * rows)
    matrix.step(0.0)
    assert matrix.get("row.scaled", 4 * rows) == [1.0] * 4 * rows
    assert matrix.get("product", rows * rows) == [4.0] * rows * rows


def test_resized_arrays_start_again_and_others_keep_their_values(
    driver: Callable[..., Any],
) -> None:
    echo = driver("echo")
    echo.initialise()
    echo.set("int8.in", [5, 6, 7], "Int8")
    echo.resize(n_element=3)  # the same length
    assert echo.get("int8.in", 3, "Int8") == [5, 6, 7]
    echo.resize(n_element=2)
    assert echo.get("int8.in", 2, "Int8") == [1, 1]


def test_fixed_structural_parameters_change_before_initialisation_only(
    driver: Callable[..., Any],
) -> None:
    matrix = driver("matrix")
    matrix.resize(n_spare=5)
    matrix.initialise()
    assert matrix.get("spare", 5, "Int32") == [0, 1, 2, 3, 4]
    matrix.fmu.enterConfigurationMode()
    with pytest.raises(FMICallException):
        matrix.set("n_spare", [4], "UInt64")
    assert "`n_spare` cannot be set in Reconfiguration Mode" in matrix.last_message
    matrix.fmu.exitConfigurationMode()
    matrix.step(0.0)


@pytest.mark.parametrize("length", [100_001, 2**64 - 1])
def test_lengths_out_of_bounds_are_refused(driver: Callable[..., Any], length: int) -> None:
    matrix = driver("matrix")
    matrix.fmu.enterConfigurationMode()
    with pytest.raises(FMICallException):
        matrix.set("n_row", [length], "UInt64")
    assert "allowed are 0 to 100000" in matrix.last_message


def test_too_little_memory_leaves_everything_as_it_was(driver: Callable[..., Any]) -> None:
    matrix = driver("matrix")
    matrix.initialise()
    matrix.fmu.enterConfigurationMode()
    matrix.set("n_row", [100_000], "UInt64")  # the products need 80 GB
    resource = pytest.importorskip("resource")
    limits = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (8 << 30, limits[1]))
    try:
        with pytest.raises(FMICallException):
            matrix.fmu.exitConfigurationMode()
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)
    assert "out of memory" in matrix.last_message
    matrix.fmu.exitConfigurationMode()
    matrix.step(0.0)
    assert matrix.get("row.scaled", 8) == [0.5] * 8


def test_a_call_with_one_bad_value_sets_nothing(driver: Callable[..., Any]) -> None:
    matrix = driver("matrix")
    references = [matrix.references["offset"], matrix.references["gain"]]
    with pytest.raises(FMICallException):
        matrix.fmu.setFloat64(references, [1.0, 11.0])
    assert matrix.fmu.getFloat64(references) == [0.0, 1.0]


def test_any_byte_but_zero_is_true(driver: Callable[..., Any]) -> None:
    echo = driver("echo")
    echo.initialise()
    reference = (ctypes.c_uint32 * 1)(echo.references["boolean.in"])
    raw = (ctypes.c_uint8 * 3)(0, 1, 255)
    values = ctypes.cast(raw, ctypes.POINTER(ctypes.c_bool))
    assert echo.fmu.fmi3SetBoolean(echo.fmu.component, reference, 1, values, 3) == 0
    echo.step(0.0)
    back = (ctypes.c_uint8 * 3)()
    reference[0] = echo.references["boolean.out"]
    echo.fmu.fmi3GetBoolean(
        echo.fmu.component, reference, 1, ctypes.cast(back, ctypes.POINTER(ctypes.c_bool)), 3
    )
    assert list(back) == [0, 1, 1]
