"""Plug-in of pytest: of each line measured, the test in which it ran.

Coverage, started by `COVERAGE_PROCESS_START`, keeps a context with each line: the node ID of the
test, or what sets up a fixture that several tests share, which then belongs to each of them.
Processes that a test starts get its context by the environment. A table with a line per test says
how each ended.
"""

import json
import os
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any, Final

import pytest

CONTEXT: Final = "NLOSIM_MUTATION_CONTEXT"
"""Environment variable: the context of processes that are started."""

TABLE: Final = "NLOSIM_MUTATION_TESTS"
"""Environment variable: the file of the table, in JSON lines."""


def fixture_context(base: str, name: str) -> str:
    """Name the context of the set-up of a shared fixture, declared at node ID `base`."""
    return f"fixture:{base}:{name}"


def pytest_configure(config: pytest.Config) -> None:
    """Forked copies are not measured: there are thousands of them, and each would write a file."""
    os.register_at_fork(after_in_child=_forget)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """Count what runs for this test as its own."""
    _switch(item.nodeid)
    try:
        return (yield)
    finally:
        _switch("")


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(
    fixturedef: pytest.FixtureDef[Any], request: pytest.FixtureRequest
) -> Generator[None, Any, Any]:
    """Count the set-up of a fixture as that of all tests that share it."""
    if fixturedef.scope == "function":
        return (yield)
    before = os.environ.get(CONTEXT, "")
    _switch(fixture_context(fixturedef.baseid, fixturedef.argname))
    try:
        return (yield)
    finally:
        _switch(before)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[Any]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Write how the test ended, and how long it took [s], as a line of the table."""
    report = yield
    seconds = item.stash.get(_SECONDS, 0.0) + report.duration
    outcome = report.outcome if report.outcome != "passed" else item.stash.get(_OUTCOME, "passed")
    item.stash[_SECONDS], item.stash[_OUTCOME] = seconds, outcome
    if report.when == "teardown":
        row = {
            "test": item.nodeid,
            "outcome": outcome,
            "seconds": round(seconds, 4),
            "slow": item.get_closest_marker("slow") is not None,
            "fixtures": _shared(item),
        }
        with Path(os.environ[TABLE]).open("a", encoding="utf-8") as table:
            table.write(json.dumps(row) + "\n")
    return report


_SECONDS = pytest.StashKey[float]()
_OUTCOME = pytest.StashKey[str]()


def _shared(item: pytest.Item) -> list[str]:
    """Contexts of the fixtures that the test has in common with others."""
    info = getattr(item, "_fixtureinfo", None)
    found = info.name2fixturedefs.values() if info else ()
    last = [definitions[-1] for definitions in found if definitions]
    return sorted(
        fixture_context(each.baseid, each.argname) for each in last if each.scope != "function"
    )


def _forget() -> None:
    if measured := _measured():
        measured.stop()
        measured.save = lambda: None


def _switch(context: str) -> None:
    os.environ[CONTEXT] = context
    if measured := _measured():
        measured.switch_context(context)


def _measured() -> Any:
    """What measures this process: coverage has started itself before anything else."""
    coverage = sys.modules.get("coverage")
    return None if coverage is None else coverage.Coverage.current()
