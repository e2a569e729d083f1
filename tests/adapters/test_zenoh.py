"""What Zenoh promises beyond the transport: connections that come back, and no strangers."""

import importlib
import logging
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from orchestrator.component import Component, ConcurrentComponent
from orchestrator.errors import ComponentError
from orchestrator.limits import Deadlines
from orchestrator.randomness import stream
from orchestrator.remote.component import launch
from orchestrator.remote.protocol import ComponentSpec

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


def test_a_frozen_process_ends_the_run_at_the_deadline(runs: ModuleType) -> None:
    """The connection is lost by then, which the message says."""
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(
            adapter.ZenohTransport(lease=0.3), deadlines=Deadlines(step=1.5), deed="freeze"
        )
    told = "did not answer within 1.5 s (to `step`); its `deadline` allows no more"
    lost = "the connection to its process is lost"
    assert str(caught.value) == f"component `b` at t = 0.02 s: {told}; {lost}"


@pytest.fixture
def stepped(runs: ModuleType) -> Iterator[Callable[[], ConcurrentComponent]]:
    """A component that has made a step, and counts them; connections are lost after 0.3 s."""
    with ExitStack() as stack:

        def made() -> ConcurrentComponent:
            specs = [ComponentSpec(name="a", type=runs.RECKLESS, values={})]
            launching = launch(specs, adapter.ZenohTransport(lease=0.3))
            component = stack.enter_context(launching)["a"]
            component.setup(0, stream(1, "a"))
            component.initialise({})
            component.step({}, 0, 1)
            return component

        yield made


def count(component: Component) -> int:
    return int(np.asarray(component.outputs()["count"]))


@pytest.mark.skipif(sys.platform == "win32", reason="processes cannot be stopped there")
def test_a_process_that_is_stopped_for_a_while_goes_on(
    stepped: Callable[[], ConcurrentComponent], caplog: pytest.LogCaptureFixture
) -> None:
    """For 1.5 s, five times what a connection survives. It takes each step once."""
    component = stepped()
    pid = int(np.asarray(component.outputs()["pid"]))
    os.kill(pid, signal.SIGSTOP)
    going_on = threading.Timer(1.5, os.kill, (pid, signal.SIGCONT))
    going_on.start()
    with caplog.at_level(logging.WARNING):
        for t in range(1, 5):
            component.step({}, t, 1)
            assert count(component) == t + 1
    said = [record.getMessage() for record in caplog.records]
    lost = "`a`: lost the connection to its process; it is waited for until its deadline"
    assert said == [lost, "`a`: its process is there again"]


def test_a_command_that_is_said_twice_is_carried_out_once(
    stepped: Callable[[], ConcurrentComponent],
) -> None:
    component: Any = stepped()
    link = component._dialogue._link
    for t in range(1, 4):
        link._commands.put(link._message)
        component.step({}, t, 1)
        assert count(component) == t + 1


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
