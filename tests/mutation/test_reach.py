"""Which tests are run for a line, and in what order."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.mutation.measuring import changed
from tests.mutation.reach import KnownTest, Reach, runs_at_import, within
from tests.mutation.reach_plugin import CONTEXT, TABLE, fixture_context


def known(name: str, seconds: float = 1.0, *, slow: bool = False, **kind: str) -> KnownTest:
    fixtures = (fixture_context("tests/test_far.py", kind["fixture"]),) if kind else ()
    return KnownTest(name=name, seconds=seconds, slow=slow, fixtures=fixtures)


TESTS = (
    known("tests/test_far.py::cheap", 0.1),
    known("tests/test_far.py::shared", 0.1, fixture="scene"),
    known("tests/test_costly.py::long", 9.0),
    known("tests/test_wire.py::own", 5.0),
    known("tests/test_wire.py::other", 5.0),
    known("tests/test_whole.py::slow", 99.0, slow=True),
)
REACH = Reach(
    tests={test.name: test for test in TESTS},
    lines={
        "remote/wire.py": {
            1: ("",),  # at import
            2: tuple(test.name for test in TESTS if "other" not in test.name),
            3: ("tests/test_whole.py::slow",),
            4: (fixture_context("tests/test_far.py", "scene"),),
            5: ("tests/test_gone.py::failed",),
        }
    },
)


def names(tests: list[KnownTest]) -> list[str]:
    return [test.name.partition("::")[2] for test in tests]


def test_tests_of_the_module_come_first_then_files_by_their_time() -> None:
    assert names(REACH.of("remote/wire.py", [2])) == ["own", "cheap", "shared", "long"]


def test_slow_tests_count_only_if_there_are_no_others() -> None:
    assert names(REACH.of("remote/wire.py", [3])) == ["slow"]


def test_what_sets_up_a_shared_fixture_is_reached_by_all_that_share_it() -> None:
    assert names(REACH.of("remote/wire.py", [4])) == ["shared"]


@pytest.mark.parametrize("line", [1, 5, 99])
def test_a_line_that_runs_in_no_test_is_tried_by_all_of_its_file(line: int) -> None:
    assert names(REACH.of("remote/wire.py", [line])) == ["own", "cheap", "shared", "long"]


def test_what_runs_at_import_concerns_all_tests_of_the_file() -> None:
    """Whoever imports it first, a process that a test starts, is not the only one to use it."""
    assert names(REACH.of("remote/wire.py", [4], at_import=True)) == [
        "own",
        "cheap",
        "shared",
        "long",
    ]
    source = (
        "A = 1\ndef f(x=2):\n    return A\nclass B:\n    c = 3\n    def d(self):\n        pass\n"
    )
    assert [runs_at_import(source, k) for k in range(1, 8)] == [
        True,
        True,
        False,
        *[True] * 3,
        False,
    ]


def test_a_file_that_no_test_reaches_has_none() -> None:
    assert REACH.of("remote/unknown.py", [1]) == []


def test_the_others_of_the_same_files_come_after_those_that_reach() -> None:
    assert names(REACH.beside(REACH.of("remote/wire.py", [2]))) == ["other"]


def test_what_does_not_fit_is_left_out_but_never_all() -> None:
    """First the shortest of each file, then the second of each."""
    assert names(within(TESTS, 5.3)) == ["cheap", "shared", "own"]
    assert names(within(TESTS, 14.1)) == ["cheap", "long", "own"]
    assert names(within(TESTS, 14.3)) == ["cheap", "shared", "long", "own"]
    assert names(within(TESTS[2:3], 5.0)) == ["long"]
    assert within([], 5.0) == []


def test_only_test_files_that_are_new_or_have_changed_are_measured(tmp_path: Path) -> None:
    for name in ("a/test_one.py", "a/b/test_two.py", "a/c/test_three.py", "a/help.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(name)
    words = ("a", "--ignore=a/c")
    first = changed(tmp_path, words, {})
    assert list(first) == ["a/b/test_two.py", "a/test_one.py"]
    assert changed(tmp_path, words, first) == {}
    (tmp_path / "a/test_one.py").write_text("other")
    (tmp_path / "a/test_new.py").touch()
    assert list(changed(tmp_path, words, first)) == ["a/test_new.py", "a/test_one.py"]
    assert list(changed(tmp_path, ("a/c/test_three.py",), first)) == ["a/c/test_three.py"]


CHECKS = """\
import os, subprocess, sys
import pytest
from sums import once, twice

@pytest.fixture(scope="module")
def shared():
    return once(3)

def test_fixture(shared):
    assert shared == 3

def test_child():
    subprocess.run([sys.executable, "-c", "from sums import twice; twice(2)"], check=True)

@pytest.mark.slow
def test_slow():
    assert twice(4) == 8

def test_fails():
    assert twice(4) == 7
"""


def test_coverage_says_what_a_test_its_fixtures_and_its_processes_reach(tmp_path: Path) -> None:
    coverage = pytest.importorskip("coverage", reason="needs the extra `mutation`")
    tree = tmp_path / "tree"
    (tree / "checks").mkdir(parents=True)
    (tree / "pytest.ini").write_text(
        "[pytest]\nmarkers = slow\naddopts = --import-mode=importlib\n"
    )
    (tree / "sums.py").write_text(
        "def once(x):\n    return x\n\n\ndef twice(x):\n    return 2 * x\n"
    )
    (tree / "checks" / "test_sums.py").write_text(CHECKS)
    settings = tmp_path / "settings"
    settings.write_text(
        f"[run]\nparallel = true\ncore = ctrace\ncontext = ${{{CONTEXT}-}}\n"
        f"data_file = {tmp_path / 'data'}\ninclude = {tree}/sums.py\n"
    )
    measured = {
        "COVERAGE_PROCESS_START": str(settings),
        CONTEXT: "",
        TABLE: str(tmp_path / "tests.jsonl"),
    }
    subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "tests.mutation.reach_plugin", "checks"],
        cwd=tree,
        env={**os.environ, "PYTHONPATH": str(tree), **measured},
        check=False,
        stdout=subprocess.DEVNULL,
    )
    files = sorted(map(str, tmp_path.glob("data.*")))
    combined = tmp_path / "reach.sqlite"
    command = [sys.executable, "-m", "coverage", "combine", "-q", f"--data-file={combined}", *files]
    subprocess.run(command, check=True)
    assert coverage.CoverageData
    reach = Reach.load(tmp_path, tree)
    assert names(reach.of("sums.py", [2])) == ["test_fixture"]
    assert names(reach.of("sums.py", [6])) == ["test_child"]
    rows = [json.loads(line) for line in (tmp_path / "tests.jsonl").read_text().splitlines()]
    assert {row["test"].partition("::")[2]: (row["outcome"], row["slow"]) for row in rows} == {
        "test_fixture": ("passed", False),
        "test_child": ("passed", False),
        "test_slow": ("passed", True),
        "test_fails": ("failed", False),
    }
