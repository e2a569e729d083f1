"""The campaign draws the same cases each time, all kinds of them, and finds what is wrong."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.scenario.build import load_scenario
from tests.faults.cases import FAULTS, drawn, first_of_each_kind
from tests.faults.examine import examined
from tests.faults.page import written


def test_cases_follow_from_seed_and_number() -> None:
    cases = [drawn(1, number) for number in range(200)]
    assert cases == [drawn(1, number) for number in range(200)]
    assert cases[7] != drawn(2, 7)
    assert [case.fault for case in cases[:20]] == list(FAULTS)
    assert {case.transport for case in cases} == {"local", "zenoh"}
    assert {case.coupling for case in cases} == {"jacobi", "gauss-seidel"}
    assert {len(case.scenario["components"]) for case in cases} == {2, 3, 4}
    assert all(0.5 <= case.pause <= 3.0 for case in cases)
    kinds = [FAULTS[number].kind for number in first_of_each_kind()]
    assert sorted(kinds) == sorted({fault.kind for fault in FAULTS})


def test_their_scenarios_are_scenarios(tmp_path: Path) -> None:
    (tmp_path / "fault_parts.py").write_text(Path(__file__).with_name("fault_parts.py").read_text())
    for number in range(0, 200, 9):
        path = tmp_path / f"case-{number}.yaml"
        path.write_text(drawn(1, number).written())
        assert len(load_scenario(path).components) in {2, 3, 4}


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_run_that_is_not_as_it_should_be_is_found(tmp_path: Path) -> None:
    """An exception, as it is, and taken for one that ends in another way."""
    case = replace(drawn(1, 1), transport="local")
    assert case.fault.kind == "raise"
    assert examined(case, tmp_path / "right").problems == ()
    wrong = replace(case, fault=replace(case.fault, says="SIGKILL", status="crashed"))
    problems = examined(wrong, tmp_path / "wrong").problems
    assert [problem.partition(" in ")[0] for problem in problems] == [
        "`SIGKILL` is not",
        "status failed, not crashed",
    ]


def test_the_page_counts() -> None:
    row = {"kind": "kill", "what": "X", "transport": "local", "exit_code": "3", "seconds": "2"}
    rows = [{**row, "problems": ""}, {**row, "problems": "", "seconds": "4"}]
    rows.append({**row, "problems": "left: x", "exit_code": "-9", "seconds": "9"})
    page = written(rows)
    assert "2 of 3 were as they should be." in page
    assert "| kill | X | 3 | 3, SIGKILL | 2 | 4.0 |" in page
