"""Plug-in of pytest: runs the tests of a list, in its order, and says how far it came.

The list and where to write come by an environment variable. Without a list all that are not slow
are run, as long as they have time. A test that takes all memory, or fills the disk, is stopped by
limits.
"""

import json
import os
import sys
from collections.abc import Generator
from pathlib import Path
from typing import Any, Final

import pytest

TRIAL: Final = "NLOSIM_MUTATION_TRIAL"
"""Environment variable: a JSON file with `progress`, a path, and `tests`, a list of node IDs.

Or in place of it `seconds` for which all tests may compute, `seconds_of_file`, those of each, and
`left_out`, a list of node IDs.
"""

_MEMORY: Final = 12 << 30
_FILE: Final = 2 << 30


def pytest_configure(config: pytest.Config) -> None:
    """Limit what a broken program can take."""
    if sys.platform != "win32":
        import resource  # noqa: PLC0415 - Windows has none

        resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
        resource.setrlimit(resource.RLIMIT_FSIZE, (_FILE, _FILE))


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave what the list names, in its order."""
    if "tests" not in _trial():
        others = _trial()["left_out"]
        quick = [each for each in items if each.get_closest_marker("slow") is None]
        items[:] = [each for each in quick if each.nodeid not in others]
        return
    order = {name: place for place, name in enumerate(_trial()["tests"])}
    kept = sorted((each for each in items if each.nodeid in order), key=lambda i: order[i.nodeid])
    config.hook.pytest_deselected(items=[each for each in items if each.nodeid not in order])
    items[:] = kept


_TAKEN: Final[dict[Path, float]] = {}


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, Any, Any]:
    """Count how long the tests of each file have computed."""
    begin = _computed()
    try:
        return (yield)
    finally:
        _TAKEN[item.path] = _TAKEN.get(item.path, 0.0) + _computed() - begin


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Run no test for which there is no time."""
    trial = _trial()
    taken = _TAKEN.get(item.path, 0.0), sum(_TAKEN.values())
    if "seconds" in trial and (taken[0] > trial["seconds_of_file"] or taken[1] > trial["seconds"]):
        pytest.skip("no time is left")


def _computed() -> float:
    """Time of processors that this process and those that it awaited have taken [s]."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def pytest_runtest_logstart(nodeid: str) -> None:
    """Say which test begins."""
    _say(start=nodeid)


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Say which test failed, and which ended."""
    if report.failed:
        _say(failed=report.nodeid)
    elif report.when == "teardown":
        _say(ended=report.nodeid)


def pytest_collectreport(report: pytest.CollectReport) -> None:
    """Say which file cannot even be read."""
    if report.failed:
        _say(failed=f"collection of {report.nodeid}")


def _trial() -> dict[str, Any]:
    trial: dict[str, Any] = json.loads(Path(os.environ[TRIAL]).read_text("utf-8"))
    return trial


def _say(**what: str) -> None:
    with Path(_trial()["progress"]).open("a", encoding="utf-8") as file:
        file.write(json.dumps(what) + "\n")
