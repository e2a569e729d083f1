"""Components that do not fit are problems of a line; those that fit are connected as drawn."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given, strategies as st
from typing_extensions import override

import orchestrator.placement
from orchestrator.algorithm.age import Age
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.cli import main
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import ComponentError, ComponentTypeError, CosimError, ScenarioError
from orchestrator.placement import placement, placing
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.graph import graph_of, grouped
from orchestrator.scenario.model import ComponentUse
from orchestrator.scenario.wiring import assemble, in_process, refusals
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time


def test_a_group_connects_every_input_beneath_it(scenario_file: Path) -> None:
    assembly = assemble(load_scenario(scenario_file))
    assert [str(c) for c in assembly.system.connections] == [
        "`car.vehicle.x` to `base.vehicle.x`",
        "`car.vehicle.y` to `base.vehicle.y`",
    ]
    assert assembly.turns == ("car", "base")


@pytest.mark.parametrize(
    ("connections", "message"),
    [
        (
            ["{from: car.vehicel, to: base.vehicle}"],
            "19:5: connections[0]: cannot connect `car.vehicel.x` to `base.vehicle.x`: `car` has",
        ),
        (
            ["{from: car.vehicle, to: base.vehicel}"],
            "`base` has no input `vehicel`, nor any beneath it; did you mean `vehicle`?",
        ),
        (
            ["{from: car.vehicle, to: base.vehicle}", "{from: car.power, to: base.u}"],
            "20:5: cannot connect `car.power` to `base.u`: units differ: dBm and m",
        ),
        (
            ["{from: car.vehicle, to: base.vehicle}", "{from: car.vehicle.x, to: base.vehicle.y}"],
            "20:5: cannot connect `car.vehicle.x` to `base.vehicle.y`: `car.vehicle.y` drives it",
        ),
        (
            ["{from: car.vehicle, to: base.vehicle}", "{from: car.vehicle.x, to: base.vehicle.x}"],
            "20:5: connections[1]: `car.vehicle.x` to `base.vehicle.x` is connected in line 19",
        ),
        (
            ["{from: base.y, to: base.u}"],
            "5:1: coupling: algebraic loop: `base.u` -> `base.y` -> `base.u`",
        ),
    ],
)
def test_connections_that_do_not_fit_are_located(
    scenario_file: Path, connections: Sequence[str], message: str
) -> None:
    head = scenario_file.read_text().partition("connections:\n")[0]
    rows = "".join(f"  - {connection}\n" for connection in connections)
    scenario_file.write_text(f"{head}connections:\n{rows}")
    with pytest.raises(ScenarioError) as error:
        assemble(load_scenario(scenario_file))
    assert message in str(error.value.problems[0])


def test_a_pattern_that_records_nothing_is_a_problem(scenario_file: Path) -> None:
    scenario = load_scenario(scenario_file, ["recording.include=[car.powr]"])
    with pytest.raises(
        ScenarioError, match=r"cannot record `car\.powr`.*did you mean `car\.power`"
    ):
        assemble(scenario)


def test_parameters_that_a_type_refuses_are_problems_of_the_scenario(scenario_file: Path) -> None:
    scenario = load_scenario(
        scenario_file, ["components.car.parameters.mode=slow", "components.car.parameters.count=9"]
    )
    with pytest.raises(ScenarioError, match=r"yaml:11:5: components\.car: `slow` allows for 5"):
        assemble(scenario)


def test_each_line_of_what_a_type_says_is_a_problem_of_its_own(scenario_file: Path) -> None:
    scenario = load_scenario(scenario_file)
    use = scenario.components["car"]
    several = refusals(scenario.document, use, ComponentTypeError("a is wrong\n`count` is odd"))
    assert [problem.what for problem in several] == [
        "components.car: a is wrong",
        "components.car: `count` is odd",
    ]
    (one,) = refusals(scenario.document, use, ValueError("no\nnumber"))
    assert str(one).endswith(r"components.car: no\nnumber")


def test_what_only_components_can_tell_is_reported_with_everything_else(
    scenario_file: Path,
) -> None:
    """A mistake in one component hides nothing that the others have to say."""
    with pytest.raises(ScenarioError) as error:
        load_scenario(
            scenario_file,
            [
                "components.base.parameters.gian=2",
                "components.car.parameters.mode=slow",
                "components.car.parameters.count=9",
                "components.bell={type: alarm, step: 50 ms}",
                "connections=[{from: bell.rnig, to: bell.u}, {from: car.x, to: base.u}]",
            ],
        )
    found = [problem.what for problem in error.value.problems]
    assert len(found) == 3, found
    wanted = [
        "there is no parameter `gian`",
        "`slow` allows for 5",
        "cannot connect `bell.rnig` to `bell.u`",
    ]
    for text in wanted:
        assert any(text in what for what in found), (text, found)


CARTS = """\
  carts:
    type: carts
    step: 100 ms
    process: on-request
    parameters:
      names:
        - red
        - blue
connections:
  - {from: car.vehicle.x, to: carts.red.wheel}
"""


def test_an_input_that_needs_a_source_and_has_none_is_remarked_upon(
    scenario_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Where it was asked for, and the run goes on; wherever the component runs."""
    scenario_file.write_text(scenario_file.read_text().replace("connections:\n", CARTS))
    address = "components.carts.parameters.names[1]"
    remark = f"{scenario_file}:25:11: {address}: nothing drives `carts.blue.wheel`: `blue` rolls on"
    assert main(["check", str(scenario_file), "--json"]) == 0
    (found,) = json.loads(capsys.readouterr().out)["remarks"]
    assert (found["line"], found["column"]) == (25, 11)
    assert main(["check", str(scenario_file)]) == 0
    assert capsys.readouterr().out.splitlines()[0] == f"{remark} (a remark)"
    for transport in ("in-process", "loopback"):
        out = tmp_path / transport
        run = ["run", str(scenario_file), "--out", str(out), "--transport", transport]
        assert main(run) == 0
        assert capsys.readouterr().err.count(remark) == 1
        assert (out / "log.txt").read_text().count(remark) == 1
    both = "connections=[{from: car.vehicle.x, to: carts.red.wheel}"
    both += ", {from: car.vehicle.x, to: carts.blue.wheel}, {from: car.vehicle, to: base.vehicle}]"
    assert assemble(load_scenario(scenario_file, [both])).remarks == ()


def test_a_component_that_is_broken_hides_no_mistake_of_the_scenario(scenario_file: Path) -> None:
    broken = "components.bad={type: broken, step: 1 s}"
    with pytest.raises(ScenarioError, match="there is no parameter `gian`"):
        load_scenario(scenario_file, [broken, "components.base.parameters.gian=2"])


def test_a_component_that_cannot_be_created_is_a_component_error(scenario_file: Path) -> None:
    scenario = load_scenario(scenario_file, ["components.bad={type: broken, step: 1 s}"])
    with pytest.raises(ComponentError, match="`bad`: cannot be created: ZeroDivisionError: oops"):
        assemble(scenario)


@pytest.mark.parametrize(
    "wrong",
    [
        "components.zzz={type: broken, step: 1 s}",  # the last of them cannot be created
        "connections=[{from: car.nothing, to: base.vehicle}]",
        "",
    ],
    ids=["component", "connection", "directory"],
)
def test_components_of_a_run_that_cannot_begin_are_closed(
    scenario_file: Path, wrong: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """They may have started programs, and hold files."""
    created: list[str] = []
    closed: list[str] = []

    def place(use: ComponentUse) -> Component:
        component = in_process(use)
        created.append(use.name)
        monkeypatch.setattr(component, "close", lambda: closed.append(use.name))
        return component

    monkeypatch.setattr(orchestrator.placement, "in_process", place)
    scenario = load_scenario(scenario_file, [wrong] if wrong else [])
    (tmp_path / "full" / "of").mkdir(parents=True)
    with pytest.raises(CosimError):
        run_scenario(scenario, tmp_path / "full")
    assert closed == created == ["car", "base"]


def test_an_unknown_transport_is_an_error_that_lists_those_installed(scenario_file: Path) -> None:
    scenario = load_scenario(scenario_file)
    with (
        pytest.raises(Exception, match=r"no transport `lopback`.*did you mean `loopback`"),
        placing(placement("lopback", scenario)),
    ):
        pass


class Clock(RestorableComponent[Time]):
    """Writes the simulated time; records how old the time is that it reads."""

    connectors: ClassVar[Mapping[str, Connector]] = {
        "u": Connector(causality=Causality.INPUT, dtype=np.int64),
        "y": Connector(causality=Causality.OUTPUT, dtype=np.int64),
    }

    def __init__(self) -> None:
        self.ages: dict[Time, Duration] = {}
        self._time = 0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._time = start

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._time = t + h
        self.ages[self._time] = self._time - int(np.asarray(inputs["u"]))

    @override
    def outputs(self) -> Signals:
        return {"y": np.asarray(self._time)}

    @override
    def save(self) -> Time:
        return self._time

    @override
    def restore(self, state: Time) -> None:
        self._time = state


@given(
    st.integers(1, 12),
    st.integers(1, 12),
    st.sampled_from([Jacobi(), GaussSeidel(("a", "b")), FixedPoint()]),
)
def test_the_predicted_ages_are_those_of_a_simulation(
    a: int, b: int, algorithm: CosimulationAlgorithm
) -> None:
    clocks = {"a": Clock(), "b": Clock()}
    wires = [Connection(Endpoint(x, "y"), Endpoint(z, "u")) for x, z in ("ab", "ba")]
    system = System(clocks, {"a": a, "b": b}, wires)
    simulate(system, algorithm, start=0, stop=a * b, seed=0)
    for (_, target), age in algorithm.ages(system).items():
        found = clocks[target].ages.values()
        assert (min(found), max(found)) == (age.youngest, age.oldest)


def test_what_a_component_tells_itself_is_a_step_old_unless_it_is_solved() -> None:
    wire = Connection(Endpoint("a", "y"), Endpoint("a", "u"))
    system = System({"a": Clock()}, {"a": 7}, [wire])
    assert GaussSeidel(("a",)).ages(system) == {("a", "a"): Age(youngest=7, oldest=7)}
    assert FixedPoint().ages(system) == {("a", "a"): Age(youngest=0, oldest=0)}


def test_the_graph_has_layers_and_feedback(scenario_file: Path) -> None:
    scenario = load_scenario(
        scenario_file,
        ["connections=[{from: car.vehicle, to: base.vehicle}, {from: base.y, to: base.u}]",
         "coupling.order=[car, base]"],
    )  # fmt: skip
    graph = graph_of(scenario, assemble(scenario))
    assert [(node.name, node.layer) for node in graph.nodes] == [("car", 0), ("base", 1)]
    assert [(e.source, e.target, e.is_forward) for e in graph.edges] == [
        ("car", "base", True),
        ("base", "base", False),
    ]
    assert dict(graph.nodes[1].feedthrough) == {"y": ("u", "vehicle.x")}
    (loop,) = graph.loops
    assert loop.startswith("algebraic loop: `base.u` -> `base.y` -> `base.u`")


def test_signals_of_a_group_become_one_entry() -> None:
    signals = [("vehicle.x", "vehicle.x"), ("vehicle.y", "vehicle.y"), ("a", "b"), ("c.d", "c.d")]
    assert grouped(signals) == ["vehicle.* (2)", "a -> b", "c.d"]
