"""Inputs that change over a step: orders two and three, where held ones give order one."""

import math
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.fmi import FmuComponentType
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.algorithm.quasi_newton import InterfaceQuasiNewton
from orchestrator.capabilities import (
    CourseFollowing,
    InitialEvaluation,
    OutputSlopes,
    PointEvaluation,
    VariableSteps,
)
from orchestrator.component import Component
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration, nanoseconds
from tests.orchestrator.linear_parts import (
    EVERYTHING,
    Network,
    Part,
    connections,
    largest_error,
    order,
    traced,
)
from tests.orchestrator.mechanics import clutches, quarter_car, rigid, three_masses, two_masses
from tests.orchestrator.packages.remote_units import Follower

STEPS = tuple(nanoseconds(text) for text in ("0.05", "0.025", "0.0125", "0.00625"))
H = nanoseconds("0.1")
FOLLOWS = frozenset({InitialEvaluation, CourseFollowing})
SLOPES = FOLLOWS | {OutputSlopes}
POINTS = frozenset({InitialEvaluation, PointEvaluation})
CUTS = POINTS | {VariableSteps}
NOTHING: frozenset[type] = frozenset()

NETWORKS: dict[str, tuple[Network, tuple[str, ...], int]] = {
    "two masses": (two_masses(), ("left.x", "right.y"), 1),
    "stiff": (two_masses(spring=(30.0, 0.3)), ("left.x", "right.y"), 4),
    "loose": (two_masses(spring=(0.05, 0.01)), ("left.x", "right.y"), 1),
    "three masses": (three_masses(), ("left.y", "middle.x"), 1),
    "quarter car": (quarter_car(), ("wheel.x", "chassis.y"), 16),
    "clutch": (clutches(), ("engine.w", "load.w"), 4),
    "rigid": (rigid(0.5), ("left.x",), 1),
}
"""Each with the outputs that are compared, and by how much its steps are shorter."""


def lags() -> Network:
    """x' = -x + y, y' = -2 y + x: no output depends on an input at the same time."""

    def lag(rate: float, start: float) -> Part:
        return Part(
            a=[[-rate]],
            b=[[1.0]],
            c=[[1.0]],
            d=[[0.0]],
            start=(start,),
            inputs=("u",),
            outputs=("x",),
        )

    return Network({"a": lag(1.0, 1.0), "b": lag(2.0, 0.0)}, ("a.x > b.u", "b.x > a.u"))


def errors_of(
    name: str, algorithm: CosimulationAlgorithm, kinds: frozenset[type]
) -> tuple[list[float], list[Duration]]:
    network, outputs, scale = NETWORKS[name]
    steps = [h // scale for h in STEPS]
    stop = 8 * nanoseconds("1") // (4 * scale)
    return [
        largest_error(network, algorithm, h, stop, outputs=outputs, kinds=kinds) for h in steps
    ], steps


@pytest.mark.parametrize("kinds", [FOLLOWS, POINTS], ids=["followed", "means"])
@pytest.mark.parametrize("name", ["two masses", "stiff", "loose", "three masses", "quarter car"])
@pytest.mark.parametrize("kind", ["jacobi", "gauss-seidel"])
def test_linear_extrapolation_is_of_second_order(
    kind: str, name: str, kinds: frozenset[type]
) -> None:
    names = tuple(NETWORKS[name][0].parts)
    algorithm: CosimulationAlgorithm = (
        Jacobi(extrapolation="linear")
        if kind == "jacobi"
        else GaussSeidel(names, extrapolation="linear")
    )
    errors, steps = errors_of(name, algorithm, kinds)
    assert order(errors, steps) == pytest.approx(2.0, abs=0.1)


@pytest.mark.parametrize("algorithm", [Jacobi, GaussSeidel])
def test_quadratic_extrapolation_has_a_smaller_error(algorithm: Any) -> None:
    """Of second order all the same: the first step has one value to go by."""
    linear, _ = errors_of("two masses", algorithm(extrapolation="linear"), FOLLOWS)
    quadratic, steps = errors_of("two masses", algorithm(extrapolation="quadratic"), FOLLOWS)
    assert all(3 * q < e for q, e in zip(quadratic, linear, strict=True))
    assert 2.0 < order(quadratic, steps) < 3.0


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("kinds", [FOLLOWS, CUTS, POINTS], ids=["followed", "cut", "means"])
def test_a_polynomial_is_integrated_exactly_once_it_is_known(
    degree: int, kinds: frozenset[type]
) -> None:
    """x'' = t^degree of a chain of integrators; exact from the step on that has enough values.

    With means only the first integral is.
    """
    chain = np.eye(degree, k=1)
    clock = Part(
        a=[[*row, 0.0] if k < degree - 1 else [*row, 1.0] for k, row in enumerate(chain)]
        + [[0.0] * (degree + 1)],
        b=[],
        c=[[1.0] + [0.0] * degree],
        d=[],
        start=(0.0,) * degree + (float(math.factorial(degree)),),
        inputs=(),
        outputs=("u",),
    )
    twice = Part(
        a=[[0.0, 1.0], [0.0, 0.0]],
        b=[[0.0], [1.0]],
        c=[[1.0, 0.0], [0.0, 1.0]],
        d=[[0.0], [0.0]],
        start=(0.0, 0.0),
        inputs=("u",),
        outputs=("x", "v"),
    )
    network = Network({"clock": clock, "twice": twice}, ("clock.u > twice.u",))
    algorithm = Jacobi(extrapolation={1: "linear", 2: "quadratic"}[degree])  # type: ignore[arg-type]
    system, _ = network.system(H, kinds)
    trace = traced(system, algorithm, 8 * H)
    v = np.array([row["twice.v"] for row in trace.rows])
    t = np.array(trace.times)
    gained = np.diff(v)
    wanted = np.diff(t ** (degree + 1) / (degree + 1))
    np.testing.assert_allclose(gained[degree:], wanted[degree:], atol=1e-13)
    assert abs(gained[0] - wanted[0]) > 1e-5


@pytest.mark.parametrize("algorithm", [Jacobi, GaussSeidel])
def test_states_without_feedthrough_need_no_capability(algorithm: Any) -> None:
    """The mean of the polynomial over the step is enough for second order."""
    errors = [
        largest_error(
            lags(),
            algorithm(extrapolation="linear"),
            h,
            nanoseconds("1"),
            outputs=("a.x", "b.x"),
            kinds=NOTHING,
        )
        for h in STEPS
    ]
    assert order(errors, STEPS) == pytest.approx(2.0, abs=0.05)


def test_smooth_inputs_do_not_jump() -> None:
    """Each step begins with the value that the last one ended with; the others jump."""
    jumps = {}
    for is_smooth in (False, True):
        system, parts = two_masses().system(H, FOLLOWS)
        traced(system, Jacobi(extrapolation="linear", smooth=is_smooth), 20 * H)
        courses = [each["f"] for each in parts["left"].followed]
        jumps[is_smooth] = max(abs(float(b.at(0.0) - a.at(1.0))) for a, b in pairwise(courses))
    assert jumps[True] < 1e-14
    assert jumps[False] > 0.01
    errors, steps = errors_of("two masses", Jacobi(extrapolation="linear", smooth=True), FOLLOWS)
    assert order(errors, steps) == pytest.approx(2.0, abs=0.1)


def test_known_slopes_are_used_from_the_first_step_on() -> None:
    """With them linear extrapolation needs one value only."""
    without, known = (
        largest_error(lags(), Jacobi(extrapolation="linear"), H, H, outputs=("b.x",), kinds=kinds)
        for kinds in (FOLLOWS, SLOPES)
    )
    assert 5 * known < without


@pytest.mark.slow
@pytest.mark.parametrize("name", list(NETWORKS))
@pytest.mark.parametrize(
    ("interpolation", "wanted", "kinds"),
    [
        ("linear", 2.0, FOLLOWS),
        ("linear", 2.0, POINTS),
        ("quadratic", 3.0, FOLLOWS),
        ("quadratic", 3.0, CUTS),
        ("quadratic", 3.0, EVERYTHING),
    ],
)
def test_iteration_with_interpolated_inputs_is_of_higher_order(
    interpolation: Any, wanted: float, kinds: frozenset[type], name: str
) -> None:
    algorithm = InterfaceQuasiNewton(interpolation=interpolation)
    errors, steps = errors_of(name, algorithm, kinds)
    assert order(errors, steps) == pytest.approx(wanted, abs=0.15)


@pytest.mark.slow
def test_two_masses_are_nearer_to_the_solution_than_with_the_best_of_the_others() -> None:
    """At 0.1, 0.025 and 0.00625 s; what OMSimulator reaches with extrapolation."""
    others = {"0.1": 9.8e-3, "0.025": 6.7e-4, "0.00625": 4.3e-5}
    for text, theirs in others.items():
        for interpolation, share in (("linear", 0.8), ("quadratic", 0.1)):
            algorithm = FixedPoint(interpolation=interpolation)  # type: ignore[arg-type]
            ours = largest_error(
                two_masses(),
                algorithm,
                nanoseconds(text),
                nanoseconds("10"),
                outputs=("left.x", "right.y"),
                kinds=EVERYTHING,
            )
            assert ours < share * theirs


@pytest.mark.parametrize(
    ("algorithm", "wanted"),
    [
        (Jacobi(), 1.0),
        (GaussSeidel(), 1.0),
        (Jacobi(extrapolation="linear"), 2.0),
        (GaussSeidel(extrapolation="linear"), 2.0),
        (FixedPoint(), 1.0),
        (InterfaceQuasiNewton(interpolation="linear"), 2.0),
        (InterfaceQuasiNewton(interpolation="quadratic"), 3.0),
    ],
    ids=lambda value: str(value)[:40],
)
def test_the_energy_of_two_masses_without_damping_is_kept_with_that_order(
    algorithm: CosimulationAlgorithm, wanted: float
) -> None:
    """What the coupling adds to or takes from 4 J until 2 s, at worst."""
    steps = STEPS[1:]
    residuals = []
    for h in steps:
        system, _ = two_masses(spring=(2.0, 0.0)).system(h, FOLLOWS)
        rows = traced(system, algorithm, nanoseconds("2")).rows
        energy = np.array(
            [
                0.5 * (r["left.v"] ** 2 + r["left.x"] ** 2 + r["right.w"] ** 2)
                + 2.5 * r["right.y"] ** 2
                + (r["left.x"] - r["right.y"]) ** 2
                for r in rows
            ]
        )
        assert energy[0] == pytest.approx(0.5 + 2.5 + 4.0)
        residuals.append(float(np.max(np.abs(energy - energy[0]))))
    assert order(residuals, steps) == pytest.approx(wanted, abs=0.1)


def test_held_inputs_are_the_default_and_are_stepped_by_compiled_code() -> None:
    for algorithm in (Jacobi, GaussSeidel):
        assert algorithm().pattern is not None
        assert algorithm(extrapolation="linear").pattern is None
        assert algorithm().extrapolation == "hold"


def test_fmus_are_extrapolated(fmu: Callable[[str], Path]) -> None:
    """Two lags with T = 2 s: of second order by their means, of first where held."""

    def error(h: Duration, extrapolation: Any) -> float:
        lag = FmuComponentType(fmu("lag"))
        parts = {
            "a": lag.create("a", {"initial": 1.0}),
            "b": lag.create("b", {"initial": -3.0}),
        }
        wires = connections(["a.x > b.u", "b.x > a.u"])
        system = System(parts, dict.fromkeys(parts, h), wires)
        result = traced_result(system, Jacobi(extrapolation=extrapolation), nanoseconds("2"))
        last = {name: float(np.ravel(values["x"])[0]) for name, values in result.items()}
        mean, difference = -1.0, 2.0 * math.exp(-2.0)
        return max(abs(last["a"] - mean - difference), abs(last["b"] - mean + difference))

    for extrapolation, wanted in (("hold", 1.0), ("linear", 2.0)):
        errors = [error(h, extrapolation) for h in STEPS]
        assert order(errors, STEPS) == pytest.approx(wanted, abs=0.05)


def traced_result(
    system: System, algorithm: CosimulationAlgorithm, stop: Duration
) -> Mapping[str, Mapping[str, Any]]:
    return simulate(system, algorithm, start=0, stop=stop, seed=0).values


@pytest.mark.parametrize(
    "algorithm", [Jacobi(extrapolation="quadratic"), InterfaceQuasiNewton(interpolation="linear")]
)
def test_it_is_the_same_over_the_loopback_transport(algorithm: CosimulationAlgorithm) -> None:
    specs = [
        ComponentSpec(
            name=name, type="tests.orchestrator.packages.remote_units:Follower", values={}
        )
        for name in ("a", "b")
    ]

    def run(parts: Mapping[str, Component]) -> list[dict[str, float]]:
        wires = connections(["a.y > b.u", "b.y > a.u"])
        return traced(System(parts, dict.fromkeys(parts, H), wires), algorithm, 10 * H).rows

    here = run({"a": Follower(), "b": Follower()})
    with launch(specs, LoopbackTransport()) as components:
        assert run(components) == here
    assert here[-1] != run_held()[-1]


def run_held() -> list[dict[str, float]]:
    parts: dict[str, Component] = {"a": Follower(), "b": Follower()}
    wires = connections(["a.y > b.u", "b.y > a.u"])
    return traced(System(parts, dict.fromkeys(parts, H), wires), Jacobi(), 10 * H).rows
