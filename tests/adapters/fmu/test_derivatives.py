"""Directional and adjoint derivatives of FMUs are those of their formulas."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from adapters.fmi.errors import FmuError
from orchestrator.capabilities import AdjointDerivatives, DirectionalDerivatives
from orchestrator.component import Component
from orchestrator.signal import Array, Causality, Signal

U, P = np.array([2.0, 3.0]), np.array(5.0)
JACOBIAN = np.array([[5, 0, 2], [0, 5, 3], [3, 2, 0]])
"""Of y by u[0], u[1] and p."""


def begun(path: Path, **inputs: Array) -> Component:
    """The component after initialisation with its start values and these inputs."""
    component = FmuComponentType(path).create("unit", {})
    component.setup(0, np.random.default_rng(1))
    values: dict[str, Signal] = {
        n: c.start_value()
        for n, c in component.connectors.items()
        if c.causality is Causality.INPUT
    }
    component.initialise({**values, **inputs})
    return component


@pytest.fixture
def bilinear(bilinear3: Path) -> Iterator[Component]:
    component = begun(bilinear3)
    yield component
    component.close()


def test_a_directional_derivative_is_the_jacobian_times_the_change(bilinear: Component) -> None:
    known = bilinear.capability(DirectionalDerivatives)  # type: ignore[type-abstract]
    assert known is not None
    found = known.directional({"p": np.array(10.0), "u": np.array([1.0, -1.0])})
    assert found.keys() == {"y", "z", "sum"}  # `stage` is discrete
    assert np.array_equal(found["y"], JACOBIAN @ [1, -1, 10])
    assert np.array_equal(found["z"], 30)
    assert np.array_equal(found["sum"], 0)
    found = known.directional({"u": np.array([1.0, 0.0])})
    assert np.array_equal(found["y"], [5, 0, 3])
    assert np.array_equal(found["z"], 0)
    assert np.array_equal(known.directional({})["y"], [0, 0, 0])


def test_an_adjoint_derivative_is_the_weights_times_the_jacobian(bilinear: Component) -> None:
    known = bilinear.capability(AdjointDerivatives)  # type: ignore[type-abstract]
    assert known is not None
    weight = np.array([1.0, 10.0, 100.0])
    found = known.adjoint({"z": np.array(7.0), "y": weight})
    assert found.keys() == {"u", "p"}  # `q` is discrete
    assert np.array_equal(found["u"], (weight @ JACOBIAN)[:2])
    assert np.array_equal(found["p"], (weight @ JACOBIAN)[2] + 21)
    found = known.adjoint({"z": np.array(1.0), "sum": np.array(1.0)})
    assert np.array_equal(found["u"], [0, 0])
    assert np.array_equal(found["p"], 3)


def test_what_has_no_derivative_is_refused(bilinear: Component) -> None:
    directional = bilinear.capability(DirectionalDerivatives)  # type: ignore[type-abstract]
    adjoint = bilinear.capability(AdjointDerivatives)  # type: ignore[type-abstract]
    assert directional is not None
    assert adjoint is not None
    with pytest.raises(FmuError, match="`q` is no continuous input"):
        directional.directional({"q": np.array(1.0)})
    with pytest.raises(FmuError, match="`stage` is no continuous output"):
        adjoint.adjoint({"stage": np.array(1.0)})
    with pytest.raises(FmuError, match=r"`u` has the shape \(2,\), not \(3,\)"):
        directional.directional({"u": np.zeros(3)})


def test_derivatives_of_fmi_2(product2: Path) -> None:
    """y = a b; they hold for the inputs that were given last. FMI 2.0 has no adjoint ones."""
    component = begun(product2, a=np.array(11.0))
    known = component.capability(DirectionalDerivatives)  # type: ignore[type-abstract]
    assert known is not None
    found = known.directional({"b": np.array(100.0), "a": np.array(1.0)})
    assert np.array_equal(found["y"], 1103)
    assert component.capability(AdjointDerivatives) is None  # type: ignore[type-abstract]
    component.close()


def test_an_fmu_that_knows_none_offers_none(ends3: Path, lag2: Path) -> None:
    for path in (ends3, lag2):
        component = FmuComponentType(path).create("unit", {})
        assert component.capability(DirectionalDerivatives) is None  # type: ignore[type-abstract]
        assert component.capability(AdjointDerivatives) is None  # type: ignore[type-abstract]
