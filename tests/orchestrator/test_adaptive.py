"""Adaptive steps: as fine as the signals between components need, and no finer."""

import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.adaptive import Adaptive
from orchestrator.algorithm.age import Age
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.step_control import StepControl
from orchestrator.capabilities import (
    CourseFollowing,
    EndRequest,
    EndRequesting,
    PointEvaluation,
    VariableSteps,
)
from orchestrator.cli import main
from orchestrator.component import Component, RestorableComponent
from orchestrator.course import Course
from orchestrator.errors import SystemStructureError
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Duration, Time, nanoseconds
from orchestrator.transformation import PLAIN, Transformation
from tests.orchestrator.linear_parts import (
    Linear,
    Network,
    Part,
    Trace,
    connections,
    largest_error,
    traced,
)
from tests.orchestrator.packages.remote_units import Drawing, Follower, Untried
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
    assert errors[0] < 1e-3
    assert 5 < errors[0] / errors[1] < 12
    assert [counts["rejected"] + counts["forced"] for _, counts in found] == [0, 0]
    assert found[1][1]["steps"] > 1.5 * found[0][1]["steps"]


class Ground(RestorableComponent[float], PointEvaluation, CourseFollowing, VariableSteps):
    """A spring below zero: f = -k min(x, 0)."""

    connectors: Mapping[str, Connector] = {
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


def run_of_ball(algorithm: CosimulationAlgorithm, h: Duration) -> tuple[float, Mapping[str, int]]:
    """The largest error of the height until 3 s, at multiples of 0.1 s, and what was counted."""
    trace = Trace()
    result = simulate(bouncing(h), algorithm, start=0, stop=30 * H, seed=0, observers=[trace])
    rows = [(t, row) for t, row in zip(trace.times, trace.rows, strict=True) if is_seen(t)]
    assert len(rows) == 31
    return max(abs(row["ball.x"] - height(t)) for t, row in rows), result.coupling


def is_seen(t: float) -> bool:
    return abs(10 * t - round(10 * t)) < 1e-9


def test_a_bouncing_ball_takes_small_steps_only_where_it_bounces() -> None:
    """Contact is 31 ms of every 926 ms; fixed steps have to be as short all the time."""
    error, counts = run_of_ball(Adaptive(relative_tolerance=1e-3), H)
    fixed, _ = run_of_ball(GaussSeidel(extrapolation="linear"), H // 250)
    assert error < fixed
    assert counts["rejected"] > 10
    assert 5 * (counts["steps"] + counts["rejected"]) < 30 * 250
    assert counts["shortest_ns"] < H // 250 < H == nanoseconds("0.1")


def test_a_quarter_car_takes_small_steps_only_until_its_wheel_is_at_rest() -> None:
    """Over 0.63 s; fixed steps with more error are 1.4 times as many."""
    network, outputs, scale = NETWORKS["quarter car"]
    h = H // scale
    error, counts = adapted(network, Adaptive(relative_tolerance=1e-3), h, 100 * h, outputs)
    names = tuple(network.parts)
    algorithm = GaussSeidel(names, extrapolation="linear")
    fixed = largest_error(network, algorithm, h // 10, 100 * h, outputs=outputs, kinds=ABLE)
    assert error < fixed
    assert 1.4 * (counts["steps"] + counts["rejected"]) < 100 * 10
    assert 60 * error < largest_error(network, algorithm, h, 100 * h, outputs=outputs, kinds=ABLE)


def test_a_jump_is_passed_by_the_smallest_step() -> None:
    """However short the step is, a jump is no polynomial: two steps until it is behind."""
    system = System(
        {"a": Switching(), "b": Linear(clock(), ABLE)},
        {"a": H, "b": H},
        connections(["b.y > a.u", "a.y > b.u"]),
    )
    trace = Trace()
    algorithm = Adaptive(maximum_steps=100)
    counts = simulate(system, algorithm, start=0, stop=20 * H, seed=0, observers=[trace]).coupling
    assert counts["forced"] == 2
    assert 3 <= counts["rejected"] <= 6
    assert counts["shortest_ns"] == H // 100
    # it jumps at 1.03 s
    assert [row["a.y"] for row in trace.rows] == [float(t > 1.03) for t in trace.times]


def clock() -> Part:
    """y is the time; u changes nothing."""
    return Part(
        a=[[0, 1], [0, 0]],
        b=[[0], [0]],
        c=[[1, 0]],
        d=[[0]],
        start=(0.0, 1.0),
        inputs=("u",),
        outputs=("y",),
    )


class Switching(RestorableComponent[float], VariableSteps):
    """y is 1 from where u is more than 1.03; a continuous output, it says."""

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=Causality.INPUT, variability=Variability.CONTINUOUS),
        "y": Connector(causality=Causality.OUTPUT, variability=Variability.CONTINUOUS),
    }

    def __init__(self) -> None:
        self._u = 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._u = 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._u = float(np.asarray(inputs["u"]))

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(float(self._u > 1.03))}

    @override
    def save(self) -> float:
        return self._u

    @override
    def restore(self, state: float) -> None:
        self._u = state


class Quitting(RestorableComponent[Time], EndRequesting, VariableSteps):
    """y is 0; asks for the end of the run behind 0.25 s."""

    connectors: Mapping[str, Connector] = Switching.connectors

    def __init__(self) -> None:
        self._now: Time = 0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._now = start

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        assert self.end_request is None  # nobody steps any more behind a request
        self._now = t + h

    @property
    @override
    def end_request(self) -> EndRequest | None:
        return EndRequest(time=self._now, why="enough") if 4 * self._now > 10 * H else None

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(0.0)}

    @override
    def save(self) -> Time:
        return self._now

    @override
    def restore(self, state: Time) -> None:
        self._now = state


def test_who_asks_for_the_end_within_a_communication_step_is_not_stepped_further() -> None:
    swinging = replace(clock(), a=[[0, 1], [-400, 0]])
    system = System(
        {"a": Quitting(), "b": Linear(swinging, ABLE)},
        {"a": H, "b": H},
        connections(["b.y > a.u", "a.y > b.u"]),
    )
    result = simulate(system, Adaptive(relative_tolerance=1e-3), start=0, stop=20 * H, seed=0)
    assert result.time == 2 * H
    assert result.early_end is not None
    assert result.early_end.by == ("a",)


def test_all_others_step_as_they_always_do() -> None:
    """A reader of the group has its own step, longer or shorter, and sees communication points."""
    network, _, _ = NETWORKS["two masses"]
    system, parts = network.system(H, ABLE)
    readers = {"slow": Linear(clock(), ABLE), "fast": Linear(clock(), ABLE)}
    whole = System(
        {**system.components, **readers},
        {"left": H, "right": H, "slow": 2 * H, "fast": H // 2},
        [*system.connections, *connections(["left.x > slow.u", "right.y > fast.u"])],
    )
    traced(whole, Adaptive(), 4 * H)
    assert readers["slow"].steps == [(0, 2 * H), (2 * H, 2 * H)]
    assert readers["fast"].steps == [(k * H // 2, H // 2) for k in range(8)]
    assert len(parts["left"].steps) > 20
    starts = [t for t, _ in parts["left"].steps]
    ends = [t + h for t, h in parts["left"].steps]
    assert starts[1:] == ends[:-1]
    assert {H, 2 * H, 3 * H} < set(starts)
    assert parts["right"].steps == parts["left"].steps


def test_inputs_that_are_made_of_others_are_held_and_judged_so() -> None:
    """An offset of next to nothing: the same force, but held, so that steps are many more."""
    network, outputs, _ = NETWORKS["two masses"]
    algorithm = Adaptive(relative_tolerance=1e-2)
    counts, errors = [], []
    for way in (PLAIN, Transformation(offset=1e-300)):
        system, _ = network.system(H, ABLE)
        links = [
            replace(link, way=way) if link.source.component == "right" else link
            for link in system.connections
        ]
        whole = System(system.components, system.step_sizes, links)
        trace = Trace()
        result = simulate(whole, algorithm, start=0, stop=5 * H, seed=0, observers=[trace])
        exact = network.exact(trace.times)
        found = [np.array([row[y] for row in trace.rows]) - exact[y] for y in outputs]
        errors.append(float(np.max(np.abs(found))))
        counts.append(result.coupling["steps"])
    assert counts[1] > 3 * counts[0]
    assert max(errors) < 1e-2


def test_graph_tells_that_values_are_at_most_a_communication_step_old() -> None:
    system, _ = NETWORKS["two masses"][0].system(H, ABLE)
    ages = Adaptive(maximum_steps=50).ages(system)
    assert ages["left", "right"] == Age(youngest=0, oldest=0)
    assert ages["right", "left"] == Age(youngest=H // 50, oldest=H)


@pytest.mark.parametrize("extrapolation", ["hold", "linear", "quadratic"])
def test_it_is_the_same_over_the_loopback_transport(extrapolation: Any) -> None:
    home = "tests.orchestrator.packages.remote_units:Follower"
    specs = [ComponentSpec(name=name, type=home, values={}) for name in ("a", "b", "c")]
    algorithm = Adaptive(relative_tolerance=1e-2, extrapolation=extrapolation, maximum_steps=20)

    def run(parts: Mapping[str, Component]) -> list[dict[str, float]]:
        wires = connections(["a.y > b.u", "b.y > a.u", "b.y > c.u"])
        return traced(System(parts, dict.fromkeys(parts, H), wires), algorithm, 5 * H).rows

    here = run({"a": Follower(), "b": Follower(), "c": Follower()})
    with launch(specs, LoopbackTransport()) as components:
        assert run(components) == here


SCENARIO = """\
schema: 1
title: Two that follow each other
time: {stop: 1 s}
coupling:
  algorithm: adaptive
  relative_tolerance: 1e-3
components:
  a: {type: "parts:A", step: 100 ms}
  b: {type: "parts:B", step: 100 ms}
connections:
  - {from: a.y, to: b.u}
  - {from: b.y, to: a.u}
"""
PARTS = """\
from tests.orchestrator.packages.remote_units import Drawing, Follower
class A(A_HERE):
    pass
class B(B_HERE):
    pass
"""


def scenario(folder: Path, a: str = "Follower", b: str = "Follower", text: str = SCENARIO) -> Path:
    (folder / "parts.py").write_text(PARTS.replace("A_HERE", a).replace("B_HERE", b))
    path = folder / "two.yaml"
    path.write_text(text)
    return path


def test_check_names_who_cannot_and_where(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scenario(tmp_path, b="Drawing")
    assert main(["check", str(path)]) == 2
    assert (
        "two.yaml:4:1: coupling: `b` depends on itself through `a`, so adaptive steps have to vary "
        "its steps and take them back, but its steps cannot differ in length; use "
        in capsys.readouterr().out
    )


def test_all_reasons_are_told_at_once() -> None:
    parts: dict[str, Component] = {"a": Untried(), "b": Drawing()}
    system = System(parts, {"a": H, "b": 3 * H}, connections(["a.y > b.u", "b.y > a.u"]))
    with pytest.raises(SystemStructureError) as caught:
        Adaptive().turns(system)
    first, second, third = caught.value.problems
    assert first.startswith("`a` depends on itself through `b`, so adaptive steps")
    assert "it cannot return to an earlier state and its steps cannot differ in length;" in first
    assert "`b` depends on itself through `a`" in second
    assert third.endswith("these have several: `a` 100 ms, `b` 300 ms")


def test_what_was_counted_is_said_and_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = scenario(tmp_path)
    assert main(["run", str(path), "--out", str(tmp_path / "run"), "--quiet"]) == 0
    manifest = json.loads((tmp_path / "run" / "manifest.json").read_text())
    counts = manifest["coupling"]
    assert counts["steps"] > 10
    assert counts["rejected"] == 0
    line = ", ".join(f"{name} {count}" for name, count in counts.items())
    assert f"coupling     {line}\n" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "before", "wanted"),
    [(1.0, 1.0, 900), (0.1, 1.0, 2014), (1e-9, 1.0, 5000), (0.1, 0.1, 1271), (0.25, 0.5, 1272)],
)
def test_the_next_step_follows_from_the_last_two_errors(
    error: float, before: float, wanted: int
) -> None:
    """By the formula for order 2, from 1000 ns, five times as long at most."""
    control = StepControl(100_000, 1, 2)
    control.judge(1, before)  # the first counts whatever its error
    control.judge(1000, error)
    assert control.next(10**9) == wanted


def test_a_step_with_too_large_an_error_is_made_again() -> None:
    control = StepControl(100_000, 100, 2)
    assert control.next(10**9) == 100
    assert control.judge(100, 50.0)  # the first
    assert not control.judge(1000, 4.0)
    assert control.next(10**9) == 450  # 0.9 / 2
    assert control.judge(450, 0.01)
    assert control.next(10**9) == 450  # behind a repetition not longer
    assert not control.judge(450, 1e9)
    assert control.next(10**9) == 100  # a fifth, but not less than the smallest
    assert control.judge(100, 1e9)
    assert (control.accepted, control.rejected, control.forced) == (3, 2, 1)
    assert control.shortest == 100


def test_steps_end_where_the_communication_step_ends() -> None:
    control = StepControl(1000, 10, 1)
    control.judge(400, 1.0)
    h = control.next(10**9)
    assert h == 360
    assert control.next(h) == h
    assert control.next(h - 1) == h - 1
    assert control.next(h + 1) == (h + 2) // 2  # two of a length, no splinter
    assert control.next(2 * h) == h


def test_a_step_that_was_cut_short_does_not_hold_up_the_next() -> None:
    control = StepControl(10_000, 10, 2)
    control.judge(4000, 1.0)
    assert control.next(40) == 40
    control.judge(40, 1e-4)
    assert control.next(10**9) == pytest.approx(40 * 0.9 * 1e4**0.35, abs=1)
    assert control.next(10**9) > 20 * 40
