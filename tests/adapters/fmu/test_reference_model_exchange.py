"""The Reference FMUs of the Modelica Association by their interface Model Exchange.

See `test_reference_fmus`. Their reference results are those of explicit Euler inside of them.
"""

import math
import os
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from orchestrator.component import Component
from orchestrator.randomness import stream
from orchestrator.signal import Array, Causality
from tests.adapters.fmu.test_model_exchange import bouncing, changed
from tests.adapters.fmu.test_reference_fmus import FOLDER, results

pytestmark = [
    pytest.mark.skipif(
        FOLDER is None,
        reason="set NLOSIM_REFERENCE_FMUS to a folder with the built Reference FMUs and results",
    ),
    pytest.mark.parametrize("version", ["2.0", "3.0"]),
]
SECOND = 10**9


def path_of(name: str, version: str) -> Path:
    path = Path(os.environ["NLOSIM_REFERENCE_FMUS"]) / version / f"{name}.fmu"
    if not path.exists():
        pytest.skip(f"there is no {path}")
    return path


def traced(name: str, version: str, step: float, count: int, **values: Any) -> dict[str, Array]:
    """Outputs of `count` steps [s], with inputs at their start values."""
    return traced_at(path_of(name, version), step, count, **values)


def traced_at(path: Path, step: float, count: int, **values: Any) -> dict[str, Array]:
    """As `traced`."""
    named = {n.replace("__", "."): v for n, v in values.items()}
    options = {"fmi.kind": "model-exchange", **named}
    component: Component = FmuComponentType(path).create("unit", options)
    inputs = {
        n: c.start_value()
        for n, c in component.connectors.items()
        if c.causality is Causality.INPUT
    }
    h = round(step * SECOND)
    component.setup(0, stream(0, "unit"))
    component.initialise(inputs)
    rows = [component.outputs()]
    for k in range(count):
        component.step(inputs, k * h, h)
        rows.append(component.outputs())
    component.close()
    return {n: np.array([row[n] for row in rows]) for n in rows[0]}


@pytest.mark.parametrize(
    ("name", "outputs"), [("VanDerPol", ("x0", "x1")), ("Dahlquist", ("x",)), ("Resource", ("y",))]
)
def test_euler_gives_the_reference_results(
    version: str, name: str, outputs: tuple[str, ...]
) -> None:
    expected = results(path_of(name, version).parent / f"{name}_out.csv")
    times = [float(t) for t in expected["time"]]
    step = round(times[1] - times[0], 9)
    found = traced(name, version, step, len(times) - 1, fmi__solver="euler", fmi__step=step)
    for output in outputs:
        wanted = [float(value) for value in expected[output]]
        np.testing.assert_allclose(found[output], wanted, rtol=0, atol=5e-12)


def test_time_events_are_those_of_the_reference(version: str) -> None:
    """`Stair` asks to end the simulation at its tenth step."""
    expected = results(path_of("Stair", version).parent / "Stair_out.csv")
    wanted = [
        float(value)
        for t, value in zip(expected["time"], expected["counter"], strict=True)
        if float(t) < 9 - 1e-9
    ]
    assert list(traced("Stair", version, 0.2, len(wanted) - 1)["counter"]) == wanted


@pytest.mark.parametrize(("solver", "error"), [("cvode", 1e-6), ("rk4", 1e-12)])
def test_the_ball_bounces_where_it_belongs(version: str, solver: str, error: float) -> None:
    found = traced("BouncingBall", version, 0.01, 150, fmi__solver=solver, fmi__tolerance=1e-9)
    for k in range(151):
        h, v, _ = bouncing(k * 0.01, 0.7)
        assert found["h"][k] == pytest.approx(h, abs=error)
        assert found["v"][k] == pytest.approx(v, abs=10 * error)


def test_the_error_falls_with_the_tolerance(version: str) -> None:
    tolerances = (1e-4, 1e-6, 1e-8, 1e-10)
    exact = np.exp(-np.arange(11.0))
    errors = [
        abs(traced("Dahlquist", version, 1.0, 10, fmi__tolerance=t)["x"] - exact).max()
        for t in tolerances
    ]
    assert all(error < 20 * t for error, t in zip(errors, tolerances, strict=True))
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(0.85, abs=0.2)


def test_it_is_what_fmpy_integrates(version: str) -> None:
    """The van der Pol oscillator, of which the Jacobian is known to us and not to FMPy's solver."""
    found = traced("VanDerPol", version, 0.1, 200, fmi__tolerance=1e-10)
    theirs: Any = fmpy.simulate_fmu(
        str(path_of("VanDerPol", version)), stop_time=20.0, output_interval=0.1,
        relative_tolerance=1e-10, output=["x0", "x1"], fmi_type="ModelExchange",
    )  # fmt: skip
    for name in ("x0", "x1"):
        np.testing.assert_allclose(found[name], theirs[name], rtol=0, atol=2e-6)


def test_states_may_be_an_array(version: str, tmp_path: Path) -> None:
    """x' = x + u with y = x + u: y = u exp t; three of each, unlike where 0 is allowed."""
    if version == "2.0":
        pytest.skip("FMI 2.0 has no arrays")
    path = path_of("StateSpace", version)
    some = changed(path, tmp_path, ('min="0"', 'min="1"'))
    found = traced_at(some, 0.5, 4, fmi__tolerance=1e-9)["y"]
    wanted = np.outer(np.exp(0.5 * np.arange(5)), (1.0, 2.0, 3.0))
    np.testing.assert_allclose(found, wanted, rtol=1e-6)


def test_what_goes_in_comes_out(version: str) -> None:
    """Every type that connectors have; discrete ones by events."""
    path = path_of("Feedthrough", version)
    component = FmuComponentType(path).create("unit", {"fmi.kind": "model-exchange"})
    connectors = component.connectors
    inputs: dict[str, Any] = {
        n: c.start_value() for n, c in connectors.items() if c.causality is Causality.INPUT
    }
    component.setup(0, stream(0, "unit"))
    component.initialise(inputs)
    changed = {
        name: value + type(value.flat[0])(1) if value.dtype != np.bool_ else ~value
        for name, value in inputs.items()
        if isinstance(value, np.ndarray) and "Enumeration" not in name
    }
    component.step(inputs | changed, 0, SECOND)
    found = component.outputs()
    for name, value in changed.items():
        output = name.replace("input", "output")
        assert math.isclose(float(np.asarray(found[output])), float(value)), output
    assert len(changed) >= 4
    component.close()
