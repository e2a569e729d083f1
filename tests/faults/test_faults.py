"""The campaign draws the same cases each time, all kinds of them, and finds what is wrong."""

import sys
from dataclasses import replace
from pathlib import Path

import pytest

from orchestrator.scenario.build import load_scenario
from tests.faults.cases import FAULTS, drawn, first_of_each_kind
from tests.faults.examine import examined
from tests.faults.examine_hosts import examined_on_hosts
from tests.faults.on_hosts import FAULTS as HOST_FAULTS, drawn_on_hosts
from tests.faults.page import section
from tests.faults.starved import starved


def test_cases_follow_from_seed_and_number() -> None:
    cases = [drawn(1, number) for number in range(200)]
    assert cases == [drawn(1, number) for number in range(200)]
    assert cases[7] != drawn(2, 7)
    assert [case.fault for case in cases[:21]] == list(FAULTS)
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


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_run_that_is_not_as_it_should_be_is_found(tmp_path: Path) -> None:
    """An exception, as it is, and taken for one that ends in another way."""
    case = replace(drawn(1, 1), transport="local")
    assert case.fault.kind == "raise"
    right = examined(case, tmp_path / "right")
    assert (right.problems, right.resumed) == ((), 0.1)
    wrong = replace(case, fault=replace(case.fault, says="SIGKILL", status="crashed"))
    problems = examined(wrong, tmp_path / "wrong").problems
    assert [problem.partition(" in ")[0] for problem in problems] == [
        "`SIGKILL` is not",
        "status failed, not crashed",
    ]


def test_the_page_counts() -> None:
    row = {"kind": "kill", "what": "X", "transport": "local", "exit_code": "3", "seconds": "2"}
    row["resumed"] = "0"
    rows = [{**row, "problems": ""}, {**row, "problems": "", "seconds": "4", "resumed": "0.1"}]
    rows.append({**row, "problems": "left: x", "exit_code": "-9", "seconds": "9", "resumed": ""})
    page = section(rows)
    assert "2 of 3 were as they should be." in page
    assert "| kill | X | 3 | 3, SIGKILL | 2 | 2, 1 | 4.0 |" in page


def test_the_page_counts_runs_that_hardly_got_a_processor() -> None:
    row = {"way": "hosts", "exit_code": "0", "seconds": "20", "processor_seconds": "2.5"}
    rows = [{**row, "problems": ""}, {**row, "problems": "it fell over", "seconds": "300.0"}]
    page = section([], rows)
    assert "| on a host | 2 | 1 | 160.0 | 300.0 | 2.5 |" in page
    assert "Hardly any processor" not in section([])


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="waits for a process as Linux does")
def test_a_starved_run_is_compared_with_one_that_is_not(tmp_path: Path) -> None:
    """As any other run: with company, at nice 19, it takes a minute."""
    found = starved("local", tmp_path / "site", busy=0, nice=0)
    assert (found.exit_code, found.problems) == (0, "")
    assert found.processor_seconds > 0.1


def test_cases_on_hosts_follow_from_seed_and_number() -> None:
    cases = [drawn_on_hosts(1, number) for number in range(60)]
    assert cases == [drawn_on_hosts(1, number) for number in range(60)]
    assert cases[7] != drawn_on_hosts(2, 7)
    assert [case.fault for case in cases[:15]] == list(HOST_FAULTS)
    assert {case.coupling for case in cases} == {"jacobi", "gauss-seidel"}
    assert {case.cut for case in cases if case.fault.kind == "none"} == {0.02}
    assert {case.cut for case in cases if case.fault.kind != "none"} == {0.0}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_run_with_a_host_that_is_not_as_it_should_be_is_found(tmp_path: Path) -> None:
    """The server is stopped by Ctrl-C, as it is, and taken for one that was killed."""
    pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
    case = drawn_on_hosts(1, 14)
    assert (case.fault.what, case.fault.exit_code) == ("SIGINT of the server", 3)
    right = examined_on_hosts(case, tmp_path / "right")
    assert (right.problems, right.exit_code) == ((), 3)
    assert right.resumed is not None
    wrong = replace(case, fault=replace(case.fault, says="SIGKILL", status="crashed"))
    problems = examined_on_hosts(wrong, tmp_path / "wrong").problems
    assert [problem.partition(" in ")[0] for problem in problems] == [
        "`SIGKILL` is not",
        "status failed, not crashed",
    ]


def test_the_page_has_faults_on_hosts() -> None:
    row = {"kind": "cut", "what": "X", "transport": "host", "exit_code": "0", "seconds": "2"}
    page = section([], [], [{**row, "resumed": "", "problems": ""}])
    assert "### Hosts" in page
    assert "1 of 1 were as they should be." in page
    assert "| cut | X | 1 | 0 | 1 |  | 2.0 |" in page
