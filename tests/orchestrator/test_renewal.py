"""Jacobi: outputs with direct feedthrough are those of the inputs at the end of a step."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise, permutations

import numpy as np
import pytest

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import CourseFollowing, InitialEvaluation, PointEvaluation
from orchestrator.component import Component
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.system import System
from orchestrator.timebase import nanoseconds
from orchestrator.transformation import Transformation
from tests.orchestrator.linear_parts import Linear, Part, connections, largest_error, order, traced
from tests.orchestrator.mechanics import three_masses, two_masses
from tests.orchestrator.packages.remote_units import Anew

STEPS = tuple(nanoseconds(text) for text in ("0.05", "0.025", "0.0125", "0.00625"))
H = nanoseconds("0.1")
OLD = frozenset({InitialEvaluation})
ANEW = frozenset({InitialEvaluation, PointEvaluation})


def test_a_force_belongs_to_the_displacement_that_is_published_with_it() -> None:
    """Without, it is that of one step before."""
    rows = traced(two_masses().system(H, ANEW)[0], Jacobi(), 20 * H).rows
    old = traced(two_masses().system(H, OLD)[0], Jacobi(), 20 * H).rows

    def force(of: Mapping[str, float], by: Mapping[str, float]) -> float:
        return 2.0 * (of["right.y"] - by["left.x"]) + 0.1 * (of["right.w"] - by["left.v"])

    for row in rows:
        assert row["right.f"] == pytest.approx(force(row, row), abs=1e-14)
    for before, row in pairwise(old):
        assert row["right.f"] == pytest.approx(force(row, before), abs=1e-14)


@pytest.mark.parametrize("name", ["two", "three"])
def test_the_error_is_about_half_and_still_of_first_order(name: str) -> None:
    network, outputs = {
        "two": (two_masses(), ("left.x", "right.y")),
        "three": (three_masses(), ("left.y", "middle.x")),
    }[name]
    stop = nanoseconds("10")
    old, anew = (
        [largest_error(network, Jacobi(), h, stop, outputs=outputs, kinds=kinds) for h in STEPS]
        for kinds in (OLD, ANEW)
    )
    assert all(1.9 * b < a for a, b in zip(old, anew, strict=True))
    assert order(anew, STEPS) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("names", list(permutations("abcd")))
def test_a_chain_follows_to_its_end_whatever_the_order(names: tuple[str, ...]) -> None:
    """d = 2 c = 4 b = 8 a at all times, where a is the time."""
    clock = Part(
        a=[[0.0, 1.0], [0.0, 0.0]],
        b=[],
        c=[[1.0, 0.0]],
        d=[],
        start=(0.0, 1.0),
        inputs=(),
        outputs=("y",),
    )
    double = Part(a=[], b=[], c=[], d=[[2.0]], start=(), inputs=("u",), outputs=("y",))
    parts = {name: Linear(clock if name == "a" else double, ANEW) for name in names}
    system = System(
        parts, dict.fromkeys(parts, H), connections(["a.y > b.u", "b.y > c.u", "c.y > d.u"])
    )
    trace = traced(system, Jacobi(), 5 * H)
    for t, row in zip(trace.times, trace.rows, strict=True):
        found = [row[f"{name}.y"] for name in "abcd"]
        np.testing.assert_allclose(found, [t, 2 * t, 4 * t, 8 * t], atol=1e-14)


def test_who_does_not_step_at_a_point_publishes_nothing_there() -> None:
    """`slow` steps every 0.2 s and keeps in between what it published."""
    clock = Part(
        a=[[0.0, 1.0], [0.0, 0.0]],
        b=[],
        c=[[1.0, 0.0]],
        d=[],
        start=(0.0, 1.0),
        inputs=(),
        outputs=("y",),
    )
    copy = Part(a=[], b=[], c=[], d=[[1.0]], start=(), inputs=("u",), outputs=("y",))
    parts = {"slow": Linear(copy, ANEW), "clock": Linear(clock, ANEW)}
    system = System(parts, {"slow": 2 * H, "clock": H}, connections(["clock.y > slow.u"]))
    rows = traced(system, Jacobi(), 4 * H).rows
    assert [row["slow.y"] for row in rows] == pytest.approx([0.0, 0.0, 0.2, 0.2, 0.4], abs=1e-14)


def test_it_is_the_same_over_the_loopback_transport() -> None:
    home = "tests.orchestrator.packages.remote_units:Anew"
    specs = [ComponentSpec(name=name, type=home, values={}) for name in ("a", "b")]

    def run(parts: Mapping[str, Component]) -> list[dict[str, float]]:
        system = System(parts, dict.fromkeys(parts, H), connections(["a.y > b.u", "b.x > a.u"]))
        return traced(system, Jacobi(), 5 * H).rows

    here = run({"a": Anew(), "b": Anew()})
    with launch(specs, LoopbackTransport()) as components:
        assert run(components) == here
    for row in here:
        assert row["b.y"] == row["b.x"] - row["a.y"] / 2


def test_an_input_that_is_made_of_others_is_read_anew_as_well() -> None:
    """An offset of next to nothing on both ways to the right mass."""
    system, _ = two_masses().system(H, ANEW)
    way = Transformation(offset=1e-300)
    links = [
        replace(link, way=way) if link.target.component == "right" else link
        for link in system.connections
    ]
    whole = System(system.components, system.step_sizes, links)
    for row in traced(whole, Jacobi(), 10 * H).rows:
        force = 2.0 * (row["right.y"] - row["left.x"]) + 0.1 * (row["right.w"] - row["left.v"])
        assert row["right.f"] == pytest.approx(force, abs=1e-14)


@pytest.mark.parametrize(
    ("algorithm", "kinds", "lag"),
    [
        (Jacobi(), OLD, H),
        (Jacobi(), OLD | {CourseFollowing}, H),
        (Jacobi(), ANEW, 0),
        (Jacobi(extrapolation="linear"), OLD, H // 2),
        (Jacobi(extrapolation="linear"), OLD | {CourseFollowing}, 0),
        (GaussSeidel(), OLD, 0),
        (GaussSeidel(extrapolation="linear"), OLD, H // 2),
        (GaussSeidel(extrapolation="linear"), ANEW, 0),
        (FixedPoint(), OLD, 0),
    ],
    ids=lambda value: (
        "+".join(sorted(k.__name__ for k in value)) if isinstance(value, frozenset) else str(value)
    ),
)
def test_it_is_known_how_old_the_inputs_of_an_output_are(
    algorithm: CosimulationAlgorithm, kinds: frozenset[type], lag: int
) -> None:
    """Of the force of the right mass; the left one has no direct feedthrough."""
    system, _ = two_masses().system(H, kinds)
    assert algorithm.lags(system) == ({"right": lag} if lag else {})
