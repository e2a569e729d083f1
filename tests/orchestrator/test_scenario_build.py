"""Every problem of a scenario, at its line and column, with what to write instead."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import Scenario
from tests.orchestrator.files import problems_after


def problems_of(path: Path, *changes: tuple[str, str]) -> list[str]:
    """The problems after replacing text in the file, which is named without its folder."""
    found = problems_after(path, *changes)
    return [str(problem).removeprefix(f"{path.parent}/") for problem in found]


def test_a_scenario_is_resolved(scenario_file: Path) -> None:
    scenario = load_scenario(scenario_file)
    assert (scenario.start, scenario.stop, scenario.seed) == (0, 10**9, 7)
    assert scenario.coupling.made == GaussSeidel(None)
    assert scenario.components["car"].step == 50 * 10**6
    assert scenario.components["base"].process is Isolation.ON_REQUEST
    assert scenario.components["car"].values == {
        "power": pytest.approx(26.0206, abs=1e-4),
        "count": 2,
        "noisy": True,
    }


def mistakes() -> Iterator[tuple[str, str, str]]:
    """Old text, new text and message of each entry of `scenario_problems.txt`."""
    text = (Path(__file__).parent / "scenario_problems.txt").read_text()
    for block in text.strip().split("\n\n")[1:]:
        *change, message = block.split("\n")
        old, new = ("\n".join(row[2:] for row in change if row[0] == sign) for sign in "-+")
        yield old, new, message


@pytest.mark.parametrize(("old", "new", "message"), list(mistakes()))
def test_a_problem_is_located_and_says_what_to_write(
    scenario_file: Path, old: str, new: str, message: str
) -> None:
    found = problems_of(scenario_file, (old, new))
    assert any(message in problem for problem in found), found


def test_all_problems_are_reported_at_once_in_the_order_of_the_file(scenario_file: Path) -> None:
    found = problems_of(
        scenario_file,
        ("title: Two units", "titel: Two units"),
        ("stop: 1 s", "stop: soon"),
        ("count: 2", "cuont: 2"),
        ("type: receiver", "type: reciever"),
        ("from: car.vehicle", "frm: car.vehicle"),
    )
    lines = [problem.split(": ", 1)[0] for problem in found]
    assert lines == [
        "two.yaml:1:1", "two.yaml:2:1", "two.yaml:3:26", "two.yaml:11:33", "two.yaml:13:11",
        "two.yaml:19:5", "two.yaml:19:6",
    ]  # fmt: skip


def test_a_wrong_key_of_a_component_hides_no_other_problem(scenario_file: Path) -> None:
    found = problems_of(
        scenario_file,
        ("    step: 50 ms\n", ""),
        ("count: 2", "cuont: 2"),
        ("type: receiver", "type: reciever"),
        ("step: 100 ms", "step: soon"),
    )
    missing, parameter, kind, step = found
    assert missing == "two.yaml:8:3: components.car: `step` is missing"
    assert parameter.startswith("two.yaml:10:33: components.car.parameters.cuont: there is no")
    assert kind.startswith("two.yaml:12:11: components.base.type: no component type `reciever`")
    assert step.startswith("two.yaml:13:11: components.base.step: ")


def test_a_wrong_key_within_a_key_says_nothing_of_those_beside_it(scenario_file: Path) -> None:
    """`hosts` is no key of a deadline; of `host` of the component that says nothing."""
    kind, deadline = problems_of(
        scenario_file,
        ("type: receiver", "type: reciever"),
        ("process: on-request", "process: on-request\n    deadline: {hosts: 1 s}"),
    )
    assert kind.startswith("two.yaml:13:11: components.base.type: no component type `reciever`")
    assert deadline.startswith("two.yaml:16:16: components.base.deadline: `hosts` is not a key")


@pytest.mark.parametrize(
    "change",
    [
        ("type: receiver", "tpye: receiver"),
        ("type: receiver", "type: 3"),
        ("process: on-request", "process: sometimes\n    deadline: 1 s"),
        ("process: on-request", "proces: on-request\n    deadline: 1 s"),
        ("    parameters:\n      gain: 2", "    paramters:\n      gian: 2"),
    ],
)
def test_a_key_that_decides_is_reported_alone(scenario_file: Path, change: tuple[str, str]) -> None:
    (found,) = problems_of(scenario_file, change)
    assert found.split(": ")[1].startswith("components.base")


def test_a_file_that_is_no_fmu_is_refused_at_its_line(scenario_file: Path) -> None:
    (scenario_file.parent / "a.fmu").write_text("not a zip")
    (found,) = problems_of(scenario_file, ("type: sender", "fmu: a.fmu"))
    assert found.startswith("two.yaml:9:10: components.car.fmu: cannot open `")


def test_paths_are_relative_to_the_file(
    scenario_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (scenario_file.parent / "trace.csv").write_text("")
    monkeypatch.chdir("/")
    scenario = load_scenario(scenario_file, ["components.car.parameters.trace=trace.csv"])
    assert scenario.components["car"].values["trace"] == scenario_file.parent / "trace.csv"


def without_places(scenario: Scenario) -> dict[str, Any]:
    return {
        "resolved": scenario.resolved(),
        "values": {n: dict(c.all_values()) for n, c in scenario.components.items()},
        "times": (scenario.start, scenario.stop, [c.step for c in scenario.components.values()]),
    }


def test_a_resolved_scenario_means_the_same_when_read_again(
    scenario_file: Path, tmp_path: Path
) -> None:
    first = load_scenario(scenario_file, ["components.car.parameters.offsets=[0.1 m, 1 cm]"])
    again = tmp_path / "elsewhere" / "resolved.yaml"
    again.parent.mkdir()
    again.write_text(json.dumps(first.resolved()))
    assert without_places(load_scenario(again)) == without_places(first)


def test_an_algorithm_is_chosen_by_name_with_its_parameters(scenario_file: Path) -> None:
    jacobi = load_scenario(scenario_file, ["coupling.algorithm=jacobi"])
    assert jacobi.coupling.made == Jacobi()
    changes = ["coupling.algorithm=fixed-point", "coupling.relaxation=0.5"]
    iterated = load_scenario(scenario_file, changes)
    assert iterated.coupling.made == FixedPoint(relaxation=0.5)
    assert iterated.resolved()["coupling"] == {"algorithm": "fixed-point", "relaxation": 0.5}


def test_the_order_of_another_algorithm_is_left_out_with_a_remark(scenario_file: Path) -> None:
    text = scenario_file.read_text()
    assert "gauss-seidel" in text
    scenario_file.write_text(text.replace("gauss-seidel", "gauss-seidel\n  order: [car, base]"))
    scenario = load_scenario(scenario_file, ["coupling.algorithm=jacobi"])
    assert scenario.coupling.made == Jacobi()
    (remark,) = scenario.remarks
    assert "coupling.order: ignored, the algorithm that was set has no `order`" in str(remark)
    taken_back = load_scenario(scenario_file, ["coupling.order=null", "coupling.algorithm=jacobi"])
    assert taken_back.remarks == ()
