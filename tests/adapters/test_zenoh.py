"""What Zenoh promises beyond the transport: quick news of frozen hosts, and no strangers."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from orchestrator.errors import ComponentError

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
adapter = importlib.import_module("adapters.zenoh")

PACKAGES = Path(__file__).parents[1] / "orchestrator" / "packages"


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_runs`."""
    monkeypatch.syspath_prepend(PACKAGES)
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)


def test_a_frozen_process_is_noticed_before_the_deadline(runs: ModuleType) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(adapter.ZenohTransport(), deed="freeze")
    assert str(caught.value).startswith(
        "component `b` at t = 0.02 s: lost the connection to its process"
    )


def test_strangers_are_not_let_in() -> None:
    zenoh = importlib.import_module("zenoh")
    transport = adapter.ZenohTransport()
    with transport:
        transport.open(["a"], 30)
        config = zenoh.Config()
        for key, value in {
            "mode": '"client"',
            "scouting/multicast/enabled": "false",
            "connect/endpoints": f'["{transport.endpoint}"]',
            "connect/timeout_ms": "300",
        }.items():
            config.insert_json5(key, value)
        with pytest.raises(zenoh.ZError, match="Unable to connect"):
            zenoh.open(config)
