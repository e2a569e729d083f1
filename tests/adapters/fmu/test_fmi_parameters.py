"""Parameters that are names or arrays, as a component type offers and takes them."""

import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from orchestrator.component import Component
from orchestrator.connection import Endpoint
from orchestrator.constant import Constant, with_constant
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import REQUIRED
from orchestrator.randomness import stream
from orchestrator.remote.declarations import _connector, _describe
from orchestrator.signal import Signal
from orchestrator.testing import check_component

Fmu = Callable[[str], Path]
INPUTS: dict[str, Signal] = {"position": np.array(0.5)}


def started(path: Path, **values: Any) -> Component:
    values = {name.replace("__", "."): value for name, value in values.items()}
    component = FmuComponentType(path).create("table", values)
    component.setup(0, stream(1, "table"))
    component.initialise(INPUTS)
    return component


def described(source: Path, path: Path, *changes: tuple[str, str]) -> Path:
    """The FMU at `source` with another description."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = old.read(name)
            for before, after in changes if name == "modelDescription.xml" else ():
                assert data.count(before.encode()) == 1, before
                data = data.replace(before.encode(), after.encode())
            new.writestr(name, data)
    return path


def test_an_enumeration_is_a_choice_of_names(fmu: Fmu) -> None:
    offered = FmuComponentType(fmu("table")).parameters
    interpolation, colour = offered["interpolation"], offered["sample.colour"]
    assert (interpolation.type, interpolation.default) == (Literal["hold", "linear"], "hold")
    assert (interpolation.unit, interpolation.minimum, interpolation.maximum) == ("1", None, None)
    assert colour.type == tuple[Literal["red", "green", "blue"], ...]
    assert colour.default == ("green",)


@pytest.mark.parametrize(("item", "gain"), [("hold", 1.0), ("linear", 2.5)])
def test_a_name_chooses(fmu: Fmu, item: str, gain: float) -> None:
    table = started(fmu("table"), interpolation=item, sample__gain=(1.0, 4.0))
    assert table.outputs()["gain"] == gain
    table.close()


def test_an_enumeration_that_is_a_signal_is_its_number(fmu: Fmu) -> None:
    echo = FmuComponentType(fmu("echo")).create("echo", {})
    connector = echo.connectors["enumeration.in"]
    assert connector.kind() == "int64[element]"
    assert connector.description == "Enumeration values (1 red, 2 green, 3 blue)"


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("enumeration.in", ["red", 3, "blue"], [1, 3, 3]),
        ("enumeration.in", "green", [2, 2, 2]),
        ("enumeration.in", 9, "the value is 9, none of 1 red, 2 green, 3 blue"),
        ("enumeration.in", [1, 0, 9], "the value is 0 at index [1], none of 1 red, 2 green, 3 b"),
        ("enumeration.in", "pink", "there is no item `pink`; there are: blue, green, red"),
        ("float32.in", 2.5, 2.5),
        ("float32.in", -1.5, "the value is -1.5, below the declared -1"),
        ("float32.in", 3, "the value is 3.0, above the declared 2.5"),
    ],
)
def test_constants_keep_to_the_items_and_bounds_of_an_input(
    name: str, value: Any, expected: Any, fmu: Fmu, tmp_path: Path
) -> None:
    bounded = ('name="float32.in"', 'min="-1" max="2.5" name="float32.in"')
    path = described(fmu("mirror"), tmp_path / "mirror.fmu", bounded)
    connector = FmuComponentType(path).create("mirror", {}).connectors[name]
    constant = Constant(Endpoint("mirror", name), value)
    if isinstance(expected, str):
        with pytest.raises(ValueError, match=re.escape(expected)):
            with_constant(connector, constant)
        return
    start = with_constant(connector, constant).start_value()
    assert isinstance(start, np.ndarray)
    assert start.dtype == connector.dtype
    np.testing.assert_array_equal(start, expected)


def test_what_drives_an_input_is_not_held_to_its_bounds(fmu: Fmu) -> None:
    """FMI 3.0.2, 2.4.7.2: they say for what an FMU is made; it answers for what comes of others."""
    mirror = FmuComponentType(fmu("mirror")).create("mirror", {})
    assert mirror.connectors["enumeration.out"].meaning is None
    given = mirror.connectors["enumeration.in"]
    assert given.meaning is not None
    assert _connector(_describe(given)).meaning == given.meaning


def test_arrays_take_the_size_that_is_chosen(fmu: Fmu) -> None:
    corner = tuple(float(k) for k in range(6))
    table = started(
        fmu("table"), n_sample=3, sample__corner=corner, sample__colour=("blue", "red", "green")
    )
    np.testing.assert_array_equal(table.outputs()["corner"], np.reshape(corner, (2, 3)))
    np.testing.assert_array_equal(table.outputs()["colour"], [3, 1, 2])
    table.close()
    check_component(FmuComponentType(fmu("table")).create("table", {"n_sample": 3}))


def test_wrong_items_and_lengths_are_refused(fmu: Fmu) -> None:
    kind = FmuComponentType(fmu("table"))
    with pytest.raises(ComponentTypeError, match=r"no item `lin`; did you mean `linear`\?"):
        kind.create("table", {"interpolation": "lin"})
    with pytest.raises(ComponentTypeError, match=r"has no item `pink`; there are: blue, green"):
        kind.create("table", {"sample.colour": ("red", "pink")})
    with pytest.raises(ComponentTypeError, match=r"has 3 values; write 2 \(n_sample\), one for"):
        kind.create("table", {"sample.gain": (1.0, 2.0, 3.0)})


def test_items_outside_the_bounds_are_not_offered(fmu: Fmu, tmp_path: Path) -> None:
    path = described(
        fmu("table"),
        tmp_path / "a.fmu",
        ('declaredType="interpolation.item" min="1"', 'declaredType="interpolation.item" min="2"'),
    )
    interpolation = FmuComponentType(path).parameters["interpolation"]
    assert interpolation.type == Literal["linear"]
    assert interpolation.default is REQUIRED  # the start value 1 is no item within the bounds


def test_start_values_that_do_not_fit_the_size_must_be_set(fmu: Fmu, tmp_path: Path) -> None:
    path = described(
        fmu("table"),
        tmp_path / "a.fmu",
        ('min="-100.0" max="100.0" start="1.0"', 'min="-100.0" max="100.0" start="1.0 4.0"'),
    )
    kind = FmuComponentType(path)
    assert kind.parameters["sample.gain"].default == (1.0, 4.0)
    kind.create("table", {})
    kind.create("table", {"n_sample": 2})
    with pytest.raises(ComponentTypeError, match=r"`sample.gain` has 2 start values, .* 3 values"):
        kind.create("table", {"n_sample": 3})
    kind.create("table", {"n_sample": 3, "sample.gain": (1.0,)})


def test_a_length_of_an_input_and_of_parameters_is_chosen(fmu: Fmu, tmp_path: Path) -> None:
    """They would lose their values if it followed the input."""
    inputs = ("n_sample", 'variability="fixed"', 'causality="input"')
    with zipfile.ZipFile(fmu("table")) as archive:
        text = archive.read("modelDescription.xml").decode()
    sample = next(line for line in text.splitlines() if f'name="{inputs[0]}"' in line)
    position = next(line for line in text.splitlines() if 'name="position"' in line)
    longer = position.replace("/>", '><Dimension valueReference="1"/></Float64>')
    path = described(
        fmu("table"),
        tmp_path / "a.fmu",
        (sample, sample.replace(inputs[1], 'variability="tunable"')),
        (position, longer),
    )
    offered = {n for n in FmuComponentType(path).parameters if not n.startswith("fmi.")}
    assert offered == {
        *("interpolation", "n_sample", "start.position"),
        *("sample.gain", "sample.corner", "sample.colour"),
    }
