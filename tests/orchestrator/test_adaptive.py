"""Adaptive steps: as fine as the signals between components need, and no finer."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.adaptive import Adaptive
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.step_control import StepControl
from orchestrator.capabilities import CourseFollowing, PointEvaluation, VariableSteps
from orchestrator.cli.main import main
from orchestrator.component import Component, RestorableComponent
from orchestrator.course import Course
from orchestrator.errors import SystemStructureError
from orchestrator.observer import SimulationResult
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration, Time, nanoseconds
from tests.orchestrator.linear_parts import (
    Linear,
    Network,
    Part,
    Trace,
    connections,
    largest_error,
    traced,
)
from tests.orchestrator.mechanics import moved
from tests.orchestrator.test_extrapolation import FOLLOWS, NETWORKS

H = nanoseconds("0.1")
ABLE = FOLLOWS | {VariableSteps, PointEvaluation}


def adapted(
    network: Network, algorithm: Adaptive, h: Duration, stop: Time, outputs: tuple[str, ...]
) -> tuple[float, Mapping[str, int]]:
    """The largest error at communication points, and what was counted."""
    trace = Trace()
    system, _ = network.system(h, ABLE)
    result = simulate(system, algorithm, start=0, stop=stop, seed=0, observers=[trace])
    exact = network.exact(trace.times)
    found = [np.array([row[y] for row in trace.rows]) - exact[y] for y in outputs]
    return float(np.max(np.abs(found))), result.coupling


@pytest.mark.parametrize(
    ("extrapolation", "name"),
    [
        *(("linear", each) for each in ("two masses", "stiff", "three masses", "quarter car")),
        ("linear", "clutch"),
        ("quadratic", "two masses"),
        ("quadratic", "quarter car"),
    ],
)
def test_the_error_is_proportional_to_the_tolerance(extrapolation: Any, name: str) -> None:
    """A tenth of the tolerance, about a tenth of the error, which is smaller than both."""
    network, outputs, scale = NETWORKS[name]
    h = H // scale
    found = [
        adapted(
            network,
            Adaptive(relative_tolerance=e, extrapolation=extrapolation),
            h,
            20 * h,
            outputs,
        )
        for e in (1e-3, 1e-4)
    ]
    errors = [error for error, _ in found]
    print(name, extrapolation, errors[0] / errors[1], errors, [c for _, c in found])


class Ground(RestorableComponent[float], PointEvaluation, CourseFollowing, VariableSteps):
    """A spring below zero: f = -k min(x, 0)."""

    connectors: Mapping[str, Connector] = {  # type: ignore[assignment]
        "x": Connector(causality=Causality.INPUT, variability=Variability.CONTINUOUS),
        "f": Connector(
            causality=Causality.OUTPUT,
            variability=Variability.CONTINUOUS,
            feedthrough=frozenset({"x"}),
        ),
    }

    def __init__(self, stiffness: float) -> None:
        self._stiffness = stiffness
        self._x = 0.0
        self._course: Course | None = None

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = 0.0

    @override
    def initialise(self, inputs: Signals) -> None:
        self._x = float(np.asarray(inputs["x"]))

    @property
    @override
    def input_degree(self) -> int:
        return 2

    @override
    def follow(self, courses: Mapping[str, Course]) -> None:
        self._course = courses["x"]

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        course, self._course = self._course, None
        self._x = float(np.asarray(inputs["x"]) if course is None else course.at(1.0))

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return {"f": np.array(-self._stiffness * min(float(np.asarray(inputs["x"])), 0.0))}

    @override
    def outputs(self) -> Signals:
        return self.evaluate({"x": np.array(self._x)})

    @override
    def save(self) -> float:
        return self._x

    @override
    def restore(self, state: float) -> None:
        self._x = state


GRAVITY, STIFFNESS = 10.0, 1e4


def bouncing(h: Duration) -> System:
    """A ball of 1 kg that falls from 1 m onto a spring, and the spring."""
    ball = Part(
        a=[[0, 1, 0], [0, 0, 1], [0, 0, 0]],
        b=[[0], [1], [0]],
        c=[[1, 0, 0], [0, 1, 0]],
        d=[[0], [0]],
        start=(1.0, 0.0, -GRAVITY),
        inputs=("f",),
        outputs=("x", "v"),
    )
    parts: dict[str, Component] = {"ball": Linear(ball, ABLE), "ground": Ground(STIFFNESS)}
    wires = connections(["ball.x > ground.x", "ground.f > ball.f"])
    return System(parts, dict.fromkeys(parts, h), wires)


def height(t: float) -> float:
    """Of the ball: free fall, and half an oscillation about -g/w^2 in between."""
    w = math.sqrt(STIFFNESS)
    fall = math.sqrt(2.0 / GRAVITY)
    deep = GRAVITY / w**2
    speed = GRAVITY * fall
    angle = math.atan2(speed / w, deep)  # how far from the turning point contact begins and ends
    contact = 2.0 * (math.pi - angle) / w
    s = (t + fall) % (2.0 * fall + contact)  # since the ball left the ground
    if s < 2.0 * fall:
        return speed * s - 0.5 * GRAVITY * s**2
    phase = w * (s - 2.0 * fall)
    return -deep + deep * math.cos(phase) - speed / w * math.sin(phase)


def test_a_bouncing_ball_needs_small_steps_only_where_it_bounces() -> None:
    stop = 30 * H

    def run(algorithm: CosimulationAlgorithm, h: Duration) -> tuple[float, SimulationResult]:
        trace = Trace()
        result = simulate(bouncing(h), algorithm, start=0, stop=stop, seed=0, observers=[trace])
        pairs = zip(trace.times, trace.rows, strict=True)
        return max(abs(row["ball.x"] - height(t)) for t, row in pairs), result

    for e in (1e-2, 1e-3, 1e-4):
        for ex in ("linear", "quadratic"):
            err, r = run(Adaptive(relative_tolerance=e, extrapolation=ex), H)
            print(e, ex, err, dict(r.coupling))
    for n in (100, 400, 1000, 4000):
        err, r = run(GaussSeidel(extrapolation="linear"), H // n)
        print(n * 30, err)
