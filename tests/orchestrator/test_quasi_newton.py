"""Interface quasi-Newton iteration: loops that do not contract, in a few repetitions."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from orchestrator.algorithm.acceleration import QuasiNewton
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Time, nanoseconds
from tests.orchestrator.linear_parts import Network, largest_error, order, traced
from tests.orchestrator.mechanics import clutches, quarter_car, rigid, three_masses, two_masses
from tests.orchestrator.packages.remote_units import Drawing

H = nanoseconds("0.1")
STEPS = tuple(nanoseconds(text) for text in ("0.05", "0.025", "0.0125", "0.00625"))


def waves(count: int, factor: float, counted: list[int]) -> System:
    """Components in a ring, y_k = k + factor u + 0.3 sin u, but 0 at 0 s."""

    def function(k: int) -> FunctionComponent:
        connectors = {
            "u": Connector(causality=Causality.INPUT),
            "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
        }

        def value(state: Any, inputs: Signals, t: Time) -> tuple[Any, Signals]:
            counted.append(k)
            u = float(np.asarray(inputs["u"]))
            return state, {"y": np.array(0.0 if t == 0 else k + factor * u + 0.3 * np.sin(u))}

        return FunctionComponent(connectors, value)

    parts: dict[str, Component] = {f"c{k}": function(k) for k in range(count)}
    wires = [
        Connection(Endpoint(f"c{k}", "y"), Endpoint(f"c{(k + 1) % count}", "u"))
        for k in range(count)
    ]
    return System(parts, dict.fromkeys(parts, H), wires)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 6), st.integers(0, 2**32 - 1))
def test_a_linear_map_of_n_numbers_is_solved_by_n_plus_two_repetitions(n: int, seed: int) -> None:
    """Whatever its gain: g(x) = M x + b, with random M of any spectral radius."""
    rng = np.random.default_rng(seed)
    matrix, offset = rng.normal(scale=3.0, size=(n, n)), rng.normal(size=n)
    if np.linalg.cond(np.eye(n) - matrix) > 1e3:
        return
    wanted = np.linalg.solve(np.eye(n) - matrix, offset)
    method = QuasiNewton()
    x = np.zeros(n)
    for _ in range(n + 1):
        x = method.following(x, matrix @ x + offset, np.ones(n))
    np.testing.assert_allclose(x, wanted, rtol=1e-7, atol=1e-7)


@pytest.mark.parametrize("factor", [-3.0, -1.5, 0.4, 2.5])
def test_a_ring_that_does_not_contract_is_solved_in_a_few_repetitions(factor: float) -> None:
    counted: list[int] = []
    system = waves(2, factor, counted)
    trace = traced(system, InterfaceQuasiNewton(), H)
    y = trace.rows[-1]
    for k in range(2):
        u = y[f"c{1 - k}.y"]
        assert y[f"c{k}.y"] == pytest.approx(k + factor * u + 0.3 * np.sin(u), abs=1e-7)
    assert counted.count(0) <= 2 + 12
    if abs(factor) > 1:
        with pytest.raises(ComponentError, match="algorithm: quasi-newton"):
            traced(waves(2, factor, []), FixedPoint(), H)


def test_a_loop_without_a_solution_is_an_error_with_advice() -> None:
    """y = u + 1 has none."""
    feedthrough = frozenset({"u"})
    connectors = {
        "u": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=feedthrough),
    }
    part = FunctionComponent(
        connectors,
        lambda s, i, t: (s, {"y": np.array(0.0 if t == 0 else np.asarray(i["u"]) + 1.0)}),
    )
    system = System({"a": part}, {"a": H}, [Connection(Endpoint("a", "y"), Endpoint("a", "u"))])
    with pytest.raises(ComponentError) as error:
        simulate(system, InterfaceQuasiNewton(maximum_iterations=7), start=0, stop=H, seed=0)
    assert "after 7 iterations `y` still changes by" in error.value.message
    assert "no solution here, or more than one" in error.value.message


@pytest.mark.parametrize("ratio", [0.5, 3.0, 30.0])
def test_the_inertia_of_a_rigid_coupling_may_be_any_share(ratio: float) -> None:
    """Loop gain -`ratio`: fixed-point iteration fails from 1 on; this is of first order at all."""
    network = rigid(ratio)
    stop = nanoseconds("1")
    errors = [
        largest_error(network, InterfaceQuasiNewton(), h, stop, outputs=("left.x",)) for h in STEPS
    ]
    assert order(errors, STEPS) == pytest.approx(1.0, abs=0.05)
    if ratio > 1:
        with pytest.raises(ComponentError, match="the loop may not contract"):
            largest_error(network, FixedPoint(), H, stop, outputs=("left.x",))


@pytest.mark.parametrize(
    ("network", "outputs", "scale"),
    [
        (two_masses(), ("left.x", "right.y"), 1),
        (three_masses(), ("left.y", "middle.x", "right.y"), 1),
        (quarter_car(), ("wheel.x", "chassis.y"), 10),
        (clutches(), ("engine.w", "load.w"), 1),
    ],
    ids=["two masses", "three masses", "quarter car", "clutch"],
)
def test_mechanical_networks_are_of_first_order_and_as_with_fixed_point_iteration(
    network: Network, outputs: tuple[str, ...], scale: int
) -> None:
    steps = [h // scale for h in STEPS]
    stop = nanoseconds("2") // scale
    errors = [
        largest_error(network, InterfaceQuasiNewton(), h, stop, outputs=outputs) for h in steps
    ]
    assert order(errors, steps) == pytest.approx(1.0, abs=0.1)
    other = largest_error(network, FixedPoint(), steps[0], stop, outputs=outputs)
    assert errors[0] == pytest.approx(other, rel=1e-6)


def test_a_stiff_coupling_needs_fewer_steps_than_fixed_point_iteration() -> None:
    """A spring of 30 N/m at steps of 0.1 s."""
    counts = []
    for algorithm in (FixedPoint(), InterfaceQuasiNewton()):
        system, parts = two_masses(spring=(30.0, 0.3)).system(H)
        traced(system, algorithm, nanoseconds("2"))
        counts.append(len(parts["left"].steps) / 20)
    assert counts[0] > 12
    assert counts[1] < 6


def test_steps_are_repeated_elsewhere_as_they_are_here() -> None:
    """Over the loopback transport: the same numbers to the last bit."""
    home = "tests.orchestrator.packages.remote_units:Drawing"
    specs = [ComponentSpec(name=name, type=home, values={}) for name in ("a", "b")]

    def run(components: Mapping[str, Component]) -> list[dict[str, float]]:
        wires = [
            Connection(Endpoint("a", "y"), Endpoint("b", "u")),
            Connection(Endpoint("b", "y"), Endpoint("a", "u")),
        ]
        system = System(components, dict.fromkeys(components, H), wires)
        return traced(system, InterfaceQuasiNewton(), 5 * H).rows

    here = run({"a": Drawing(), "b": Drawing()})
    with launch(specs, LoopbackTransport()) as components:
        assert run(components) == here
