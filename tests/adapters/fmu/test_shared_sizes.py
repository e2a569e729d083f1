"""A length that parameters share with an input is chosen by the scenario."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array

STEP = 1_000_000_000


@pytest.fixture
def weights(fmu: Callable[[str], Path]) -> FmuComponentType:
    return FmuComponentType(fmu("weights"))


def outcome(weights: FmuComponentType, u: Array | None, **values: object) -> Array:
    """The output after a step with the input `u`, or with its start value."""
    component = weights.create("unit", values)
    component.setup(0, np.random.default_rng(1))
    inputs = {"u": component.connectors["u"].start_value() if u is None else u}
    component.initialise(inputs)
    component.step(inputs, 0, STEP)
    found = component.outputs()["y"]
    component.close()
    assert isinstance(found, np.ndarray)
    return found


def test_sizes_and_the_matrix_are_parameters(weights: FmuComponentType) -> None:
    assert {"n_in", "n_out", "w", "start.u"} <= set(weights.parameters)
    assert weights.parameters["n_in"].default == 2
    connectors = weights.create("unit", {"n_out": 4, "w": (1.0,)}).connectors
    assert {n: c.shape for n, c in connectors.items()} == {"u": (2,), "y": (4,)}
    w = np.arange(8.0).reshape(4, 2)
    found = outcome(weights, np.array([10.0, 1.0]), n_out=4, w=tuple(w.ravel()))
    assert np.array_equal(found, w @ [10, 1])
    assert np.array_equal(outcome(weights, np.ones(5), n_in=5, w=(3.0,)), [15, 15, 15])


def test_an_input_that_nobody_drives_has_its_start_value_in_the_chosen_length(
    weights: FmuComponentType,
) -> None:
    assert np.array_equal(outcome(weights, None), [4, 4, 4])
    assert np.array_equal(outcome(weights, None, n_in=3, w=(2.0,)), [12, 12, 12])
    started = {"n_in": 1, "n_out": 1, "w": (2.0,), "start.u": (7.0,)}
    assert np.array_equal(outcome(weights, None, **started), [14])


def test_what_does_not_fit_is_refused_with_the_size(weights: FmuComponentType) -> None:
    with pytest.raises(FmuError, match=r"`u` has length 3 .* set `n_in: 3` instead of 2"):
        outcome(weights, np.ones(3))
    with pytest.raises(ComponentTypeError, match=r"`w` has 6 values; write 12 \(n_out x n_in\)"):
        weights.create("unit", {"n_in": 4, "w": (1.0,) * 6})
