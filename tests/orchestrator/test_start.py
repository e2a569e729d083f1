"""Initialisation as a system of equations: a cycle of feedthrough agrees at the start."""

import logging
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.signal import Causality, Connector
from orchestrator.system import System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import nanoseconds
from tests.orchestrator.linear_parts import connections, traced
from tests.orchestrator.mechanics import rigid
from tests.orchestrator.packages.remote_units import Evaluated, Untried

H = nanoseconds("0.1")
DOTTIE = 0.7390851332151607
"""The solution of x = cos x."""


def algebraic(function: Callable[[float], float], start: float = 0.0) -> FunctionComponent:
    connectors = {
        "u": Connector(causality=Causality.INPUT, start=np.array(start)),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
    }
    return FunctionComponent(
        connectors, lambda s, i, t: (s, {"y": np.array(function(float(np.asarray(i["u"]))))})
    )


def ring(parts: dict[str, Component]) -> System:
    names = list(parts)
    wires = [f"{name}.y > {names[k - len(names) + 1]}.u" for k, name in enumerate(names)]
    return System(parts, dict.fromkeys(parts, H), connections(wires))


def started(system: System, algorithm: CosimulationAlgorithm | None = None) -> dict[str, float]:
    return traced(system, algorithm or Jacobi(), H).rows[0]


@pytest.mark.parametrize(
    "algorithm", [Jacobi(), GaussSeidel(("a", "b")), GaussSeidel(("b", "a")), FixedPoint()]
)
def test_cos_of_cos_starts_at_its_fixed_point(algorithm: CosimulationAlgorithm) -> None:
    """Whatever the algorithm; without the equations it would be 1 and 0.540."""
    found = started(ring({"a": algebraic(math.cos), "b": algebraic(math.cos)}), algorithm)
    assert found["a.y"] == pytest.approx(DOTTIE, abs=1e-11)
    assert found["b.y"] == pytest.approx(DOTTIE, abs=1e-11)


@settings(max_examples=40, deadline=None)
@given(
    gains=st.lists(st.floats(-4, 4), min_size=1, max_size=5),
    offsets=st.lists(st.floats(-5, 5), min_size=5, max_size=5),
)
def test_a_linear_ring_starts_at_its_solution_whatever_its_gain(
    gains: list[float], offsets: list[float]
) -> None:
    if abs(1 - math.prod(gains)) < 0.01:
        return
    parts: dict[str, Component] = {
        f"c{k}": algebraic(lambda u, g=g, c=offsets[k]: g * u + c)  # type: ignore[misc]
        for k, g in enumerate(gains)
    }
    count = len(gains)
    matrix = np.eye(count)
    for k in range(count):
        matrix[k, k - 1] -= gains[k]
    wanted = np.linalg.solve(matrix, offsets[:count])
    found = started(ring(parts))
    np.testing.assert_allclose(
        [found[f"c{k}.y"] for k in range(count)], wanted, rtol=1e-7, atol=1e-7
    )


def test_what_is_solved_is_initialised_with_its_solution() -> None:
    """A rigid coupling of gain -3 starts at what the matrices say, state and all."""
    network = rigid(3.0)
    system, _ = network.system(H)
    row = traced(system, Jacobi(), H).rows[0]
    for name, values in network.exact([0.0]).items():
        assert row[name] == pytest.approx(float(values[0]), abs=1e-11)


def test_a_source_in_front_and_a_sink_behind_are_evaluated_once() -> None:
    calls: list[str] = []

    def counted(name: str, gain: float) -> FunctionComponent:
        def function(u: float) -> float:
            calls.append(name)
            return gain * u + 1

        return algebraic(function)

    both = {
        "u": Connector(causality=Causality.INPUT),
        "v": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u", "v"})),
    }
    parts = {
        "sink": counted("sink", 1.0),
        "b": counted("b", 0.5),
        "a": FunctionComponent(
            both, lambda s, i, t: (s, {"y": np.asarray(np.add(i["u"], i["v"]))})
        ),
        "source": counted("source", 0.0),
    }
    wires = ["source.y > a.u", "a.y > b.u", "b.y > a.v", "b.y > sink.u"]
    found = started(System(parts, dict.fromkeys(parts, H), connections(wires)))
    assert (found["a.y"], found["b.y"], found["sink.y"]) == pytest.approx((4, 3, 4), abs=1e-10)
    # once at the start, once in the step
    assert calls.count("sink") == calls.count("source") == 2
    assert calls.count("b") > 4


def test_without_a_solution_the_loop_is_cut_and_the_log_says_where(
    caplog: pytest.LogCaptureFixture,
) -> None:
    parts: dict[str, Component] = {
        "a": algebraic(lambda u: u + 1, start=5.0),
        "b": algebraic(lambda u: u),
    }
    with caplog.at_level(logging.WARNING):
        found = started(ring(parts))
    assert (found["a.y"], found["b.y"]) == (6.0, 6.0)
    (message,) = [record.getMessage() for record in caplog.records]
    assert "does not agree with what it reads at the start: after 100 evaluations `y`" in message
    assert "`a.u` -> `a.y` -> `b.u` -> `b.y` -> `a.u`" in message
    with pytest.raises(ComponentError, match="does not agree with what it reads at the start"):
        started(ring(parts), FixedPoint())


def test_who_cannot_be_evaluated_is_initialised_once_with_start_values() -> None:
    parts: dict[str, Component] = {"a": algebraic(math.cos, start=0.5), "b": Untried()}
    found = started(ring(parts))
    assert (found["a.y"], found["b.y"]) == (math.cos(0.5), 0.5 * math.cos(0.5))


def test_a_component_elsewhere_is_evaluated_there() -> None:
    """Over the loopback transport, to the last bit; y = 1 - u / 2 of both: 2 / 3."""
    home = "tests.orchestrator.packages.remote_units"
    specs = [
        ComponentSpec(name="a", type=f"{home}:Evaluated", values={}),
        ComponentSpec(name="b", type=f"{home}:Untried", values={}),
    ]
    here = started(ring({"a": Evaluated(), "c": Evaluated()}))
    assert here["a.y"] == pytest.approx(2 / 3, abs=1e-12)
    cut = started(ring({"a": Evaluated(), "b": Untried()}))
    with launch(specs, LoopbackTransport()) as components:
        assert started(ring({"a": components["a"], "c": Evaluated()})) == here
        assert started(ring(dict(components))) == cut
    assert cut["a.y"] == 1.0
