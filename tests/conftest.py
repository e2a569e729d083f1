"""Settings of all tests, and FMUs as the sources make them."""

import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import settings

from adapters.sumo.headless import stand_in
from fmus.native.build import build_fmu
from fmus.native.targets import select_targets
from fmus.native.unit import load_unit
from orchestrator.plan.plan import RunPlan

UNITS = Path(__file__).parent / "fmus" / "units"

# No deadlines: CI machines are noisy. Derandomised: a failure in CI is a failure here.
settings.register_profile("ci", deadline=None, derandomize=True, max_examples=50)
settings.load_profile("ci")

# Shells start jobs in the background with SIGINT ignored, and `nohup` with SIGHUP ignored, which
# processes inherit; tests of requests to stop need both whoever started them.
signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files with slow tests first, so that the last one to be taken is short."""
    slow = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in slow)


stand_in()  # for tests that import libsumo themselves


@pytest.fixture(scope="session")
def built(
    pytestconfig: pytest.Config, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[str], Path]:
    """Build the FMU of a unit, by its name or folder, for this host; kept while nothing changes."""
    cache = pytestconfig.cache if pytestconfig.pluginmanager.hasplugin("cacheprovider") else None
    out = Path(cache.mkdir("nlosim-test-units")) if cache else tmp_path_factory.mktemp("units")
    return lambda unit: build_fmu(load_unit(unit), out, targets=select_targets(["host"])).path


@pytest.fixture(scope="session")
def fmu(built: Callable[[str], Path]) -> Callable[[str], Path]:
    """Build the test unit of that name."""
    return lambda name: built(str(UNITS / name))


@pytest.fixture
def stretches(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How many points the engine worked through, stretch by stretch."""
    found: list[int] = []
    run = RunPlan.run

    def counted(self: RunPlan, *args: Any) -> Any:
        stretch = run(self, *args)
        found.append(stretch.count)
        return stretch

    monkeypatch.setattr(RunPlan, "run", counted)
    return found
