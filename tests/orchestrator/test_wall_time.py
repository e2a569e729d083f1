"""Where the time of a run went: every call of a component counts, and counts once."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.simulation import simulate
from orchestrator.system import System
from tests.orchestrator.linear_parts import EVERYTHING, Linear, Part, connections

NAP = 0.002
CALLS = ("setup", "initialise", "step", "evaluate", "slopes", "save", "restore")


def decay(start: float) -> Part:
    """x' = -x + u, y = x."""
    return Part(a=[-1], b=[1], c=[1], d=[0], start=[start], inputs=("u",), outputs=("y",))


class Nap:
    """Sleeps a while before each call, and knows how long in all."""

    def __init__(self) -> None:
        self.slept = 0.0
        self.calls: set[str] = set()

    def before(self, name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def late(*arguments: Any) -> Any:
            begin = time.perf_counter()
            time.sleep(NAP)
            self.slept += time.perf_counter() - begin
            self.calls.add(name)
            return call(*arguments)

        return late


@pytest.mark.parametrize(
    ("algorithm", "calls"),
    [
        (Jacobi(), {"setup", "step"}),
        (GaussSeidel(("one", "two")), {"setup", "step"}),
        (Jacobi(extrapolation="linear"), {"setup", "step", "slopes"}),
        (FixedPoint(), {"setup", "step", "save", "restore"}),
    ],
    ids=["jacobi", "gauss-seidel", "linear", "fixed-point"],
)
def test_the_time_of_a_component_is_that_of_its_calls(
    algorithm: CosimulationAlgorithm, calls: set[str]
) -> None:
    naps = {"one": Nap(), "two": Nap()}
    parts: dict[str, Component] = {}
    for k, (name, nap) in enumerate(naps.items()):
        part = Linear(decay(float(k)), EVERYTHING)
        for call in CALLS:
            setattr(part, call, nap.before(call, getattr(part, call)))
        parts[name] = part
    wires = connections(["one.y > two.u", "two.y > one.u"])
    begin = time.perf_counter()
    result = simulate(
        System(parts, dict.fromkeys(parts, 10**7), wires),
        algorithm,
        start=0,
        stop=4 * 10**7,
        seed=0,
    )
    took = time.perf_counter() - begin
    wall = result.wall_time
    for name, nap in naps.items():
        assert calls <= nap.calls
        assert (
            nap.slept
            <= wall.components[name]
            <= took - sum(other.slept for whose, other in naps.items() if whose != name)
        )
    assert wall.orchestrator >= 0
    assert wall.total <= took
    assert np.isclose(wall.total, sum(wall.components.values()) + wall.orchestrator, atol=0.01)
