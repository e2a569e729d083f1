"""A component that asks for the end ends the run as `until` does, whatever it is made of."""

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, strategies as st
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import EndRequest, EndRequesting
from orchestrator.component import (
    Component,
    ConcurrentComponent,
)
from orchestrator.observer import SimulationResult
from orchestrator.parameters import parameter
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from tests.orchestrator.deciding import (
    GOAL,
    HORIZON,
    PERIOD,
    PUSHES,
    Chooser,
    H,
    Planned,
    Point,
    run as run_chooser,
)
from tests.orchestrator.summing import InOnePiece, Trace, in_two_pieces

ALGORITHMS = [Jacobi(), GaussSeidel(("a", "b")), GaussSeidel(("b", "a"))]
STEPS = st.sampled_from([1, 2, 3, 4, 5, 6, 10, 12, 15, 20, 30, 60])


class Asker(ConcurrentComponent, EndRequesting):
    """Adds what it reads to a sum, modulo 61; asks for the end once it has come to `at`.

    If it `stops`, it stops there, even within a step. `over` is true from there on.
    """

    connectors: ClassVar[Mapping[str, Connector]] = {
        "u": Connector(causality=Causality.INPUT, dtype=np.int64),
        "sum": Connector(causality=Causality.OUTPUT, dtype=np.int64),
        "over": Connector(causality=Causality.OUTPUT, dtype=np.bool_),
    }

    def __init__(self, at: Time = 10**9, *, stops: bool = False, asks: bool = True) -> None:
        self._at, self._stops, self._asks = at, stops, asks

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._sum, self._now = 0, start

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        assert self.end_request is None  # nobody steps any more behind a request
        self._next = (self._sum + int(np.asarray(inputs["u"]))) % 61 + 1, t + h

    @override
    def finish_step(self) -> None:
        self._sum, self._now = self._next

    @override
    def outputs(self) -> Signals:
        return {"sum": np.array(self._sum), "over": np.array(self._now >= self._at)}

    @property
    @override
    def end_request(self) -> EndRequest | None:
        if not self._asks or self._now < self._at:
            return None
        return EndRequest(time=self._at if self._stops else self._now, why="enough")


class HostedAsker(Asker):
    """One that a host can make."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """What an `Asker` takes."""

        at: int = parameter(doc="when it asks [ns]")
        stops: bool = parameter(doc="whether it stops there")

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters.at, stops=parameters.stops)


def run(
    algorithm: CosimulationAlgorithm,
    steps: Mapping[str, Duration],
    parts: Mapping[str, Component],
    *,
    until: Endpoint | None = None,
) -> tuple[SimulationResult, Trace]:
    """`a` and `b`, which read each other, for 60 ns."""
    links = [Connection(Endpoint(s, "sum"), Endpoint(t, "u")) for s, t in ("ab", "ba")]
    trace = Trace()
    result = simulate(
        System(parts, steps, links), algorithm, start=0, stop=60, seed=0, observers=[trace],
        until=until,
    )  # fmt: skip
    return result, trace


@given(
    st.sampled_from(ALGORITHMS), STEPS, STEPS, st.integers(0, 70),
    st.sampled_from([InOnePiece, in_two_pieces]),
)  # fmt: skip
def test_it_is_the_run_until_an_output_of_the_same_moment(
    algorithm: CosimulationAlgorithm,
    a: int,
    b: int,
    at: int,
    place: Callable[[Component], Component],
) -> None:
    steps = {"a": a, "b": b}
    silent = {"a": place(Asker(at, asks=False)), "b": place(Asker())}
    expected, before = run(algorithm, steps, silent, until=Endpoint("a", "over"))
    asking = {"a": place(Asker(at)), "b": place(Asker())}
    result, trace = run(algorithm, steps, asking)
    assert trace.seen == before.seen
    assert (result.time, result.status) == (expected.time, "done")
    for each in (result, expected):
        assert (each.early_end is None) == (each.time == 60)
    if result.early_end is not None and expected.early_end is not None:
        seconds = f"{result.time / 1e9:.9g} s"
        assert result.early_end.text == f"`a` asks for the end (enough) at t = {seconds}"
        assert expected.early_end.text == f"`a.over` is true at t = {seconds}"
        assert (result.early_end.by, expected.early_end.by) == (("a",), ("a.over",))


@given(
    st.sampled_from(ALGORITHMS), STEPS, STEPS, st.integers(1, 60),
    st.sampled_from([InOnePiece, in_two_pieces]),
)  # fmt: skip
def test_within_a_step_the_run_ends_at_the_last_point_of_anybody_before_its_end(
    algorithm: CosimulationAlgorithm,
    a: int,
    b: int,
    at: int,
    place: Callable[[Component], Component],
) -> None:
    """Unless `at` is the end of a step, which then was made."""
    steps = {"a": a, "b": b}
    _, whole = run(algorithm, steps, {"a": place(Asker(asks=False)), "b": place(Asker())})
    stopping = {"a": place(Asker(at, stops=True)), "b": place(Asker())}
    result, trace = run(algorithm, steps, stopping)
    end = -(-at // a) * a
    assert trace.seen == [seen for seen in whole.seen if seen[0] < end + (end == at)]
    assert result.time == trace.seen[-1][0]
    assert result.status == "done"
    if at < end:
        assert result.early_end is not None
        assert result.early_end.text == (
            f"`a` asks for the end (enough) at t = {at / 1e9:.9g} s; that is within its step, so "
            f"the run ends before, at t = {result.time / 1e9:.9g} s"
        )


@pytest.mark.parametrize("algorithm", ALGORITHMS)
@pytest.mark.parametrize("at", [0, 20, 27])
@pytest.mark.parametrize("stops", [False, True])
def test_it_is_the_same_over_the_loopback_transport(
    algorithm: CosimulationAlgorithm,
    at: int,
    stops: bool,  # noqa: FBT001  (a parameter)
) -> None:
    """At the start, at the end of a step, and within one."""
    found = [run(algorithm, {"a": 5, "b": 5}, {"a": Asker(at, stops=stops), "b": Asker(100)})]
    kind, values = f"{__name__}:{HostedAsker.__name__}", {"at": at, "stops": stops}
    spec = ComponentSpec(name="a", type=kind, values=values)
    with launch([spec], LoopbackTransport()) as remote:
        found.append(run(algorithm, {"a": 5, "b": 5}, {"a": remote["a"], "b": Asker(100)}))
    (here, trace), (there, other) = found
    assert trace.seen == other.seen
    assert (here.time, here.early_end) == (there.time, there.early_end)
    assert here.time == {0: 0, 20: 20, 27: 25 if stops else 30}[at]


def test_all_who_ask_at_the_same_point_are_named() -> None:
    result, _ = run(Jacobi(), {"a": 5, "b": 5}, {"a": Asker(9), "b": Asker(8)})
    assert result.early_end is not None
    assert result.early_end.by == ("a", "b")


class AskingChooser(Chooser, EndRequesting):
    """Asks for the end where `done` becomes true."""

    @property
    @override
    def end_request(self) -> EndRequest | None:
        return EndRequest(time=self._now, why="done") if self._state.hits >= GOAL else None


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")
@pytest.mark.parametrize("seed", range(2))
def test_branches_end_where_it_asks_as_with_until(seed: int) -> None:
    """The same choices, the same bytes, the same end."""
    algorithm, done = GaussSeidel(("point", "pusher")), Endpoint("pusher", "done")
    one, other = Chooser(), AskingChooser()
    until, expected = run_chooser(one, algorithm, steps=60, seed=seed, until=done)
    asked, found = run_chooser(other, algorithm, steps=60, seed=seed)
    assert found.seen == expected.seen
    assert one.choices == other.choices
    assert asked.time == until.time < 60 * 10**8
    assert asked.early_end is not None


class StoppingPoint(Point, EndRequesting):
    """Stops half a step before it would be further than 2.5 from zero."""

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        super().setup(start, rng)
        self._now = start

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        super().step(inputs, t, h)
        self._now = t + h

    @property
    @override
    def end_request(self) -> EndRequest | None:
        if abs(float(self._x)) <= 2.5:
            return None
        return EndRequest(time=self._now - H // 2, why="too far")


@pytest.mark.skipif(sys.platform == "win32", reason="Windows cannot copy a process")
@pytest.mark.parametrize("seed", range(3))
def test_branches_end_where_a_step_is_not_made(seed: int) -> None:
    """The score of each alternative is that of a run of its own that ends there."""
    algorithm, chooser = GaussSeidel(("point", "pusher")), Chooser(prunes=False)
    ended = 0

    def outcome(plan: list[int], steps: int) -> int:
        nonlocal ended
        point = StoppingPoint()
        found, _ = run_chooser(Planned(plan), algorithm, steps=steps, seed=seed, point=point)
        ended += found.time < steps * H
        return int(np.asarray(found.values["pusher"]["hits"]))

    result, _ = run_chooser(chooser, algorithm, steps=40, seed=seed, point=StoppingPoint())
    chosen: list[int] = []
    while len(chosen) < len(chooser.choices):
        end = min(len(chosen) * PERIOD + 1 + HORIZON, 40)
        chosen.append(int(np.argmax([outcome([*chosen, k], end) for k in range(len(PUSHES))])))
    assert chooser.choices == chosen
    assert ended
    assert result.status == "done"


SCENARIO = """\
schema: 1
title: Until it stands
time: {stop: 10 s}
coupling: {algorithm: gauss-seidel}
components:
  drive: {type: table-source, step: 100 ms, parameters: {file: drive.csv, interpolation: linear}}
  watch: {type: "my_parts:Standstill", step: 100 ms}
connections:
  - {from: drive.v, to: watch.speed}
"""


def test_the_example_of_the_manual_ends_a_run(tmp_path: Path) -> None:
    """Braking by 1 m/s in each second from 3.05 m/s on: seen above 0.1 m/s until 2.9 s."""
    page = Path(__file__).parents[2] / "docs" / "adding-a-component.md"
    (example,) = re.findall(r"```\n(# my_parts.py\n.*?)```", page.read_text(), re.DOTALL)
    (tmp_path / "my_parts.py").write_text(example)
    (tmp_path / "drive.csv").write_text("time,v [m/s]\n0,3.05\n3,0.05\n4,0\n10,0\n")
    scenario = tmp_path / "stop.yaml"
    scenario.write_text(SCENARIO)
    outcome = run_scenario(load_scenario(scenario), tmp_path / "run")
    assert outcome.early_end is not None
    text = "`watch` asks for the end (standing still for 2 s) at t = 4.9 s"
    assert outcome.early_end.text == text
    assert outcome.simulated == 4.9
