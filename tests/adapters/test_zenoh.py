"""What Zenoh promises beyond the transport: connections that come back."""

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
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from tests.adapters.hosting import until

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


@pytest.mark.slow
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
    """A component that has made a step, and counts them; connections are lost after 1 s."""
    with ExitStack() as stack:

        def made() -> ConcurrentComponent:
            specs = [ComponentSpec(name="a", type=runs.RECKLESS, values={})]
            launching = launch(specs, adapter.ZenohTransport(lease=1.0))
            component = stack.enter_context(launching)["a"]
            component.setup(0, stream(1, "a"))
            component.initialise({})
            component.step({}, 0, 1)
            return component

        yield made


def count(component: Component) -> int:
    return int(np.asarray(component.outputs()["count"]))


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="processes cannot be stopped there")
def test_a_process_that_is_stopped_for_a_while_goes_on(
    stepped: Callable[[], ConcurrentComponent], caplog: pytest.LogCaptureFixture
) -> None:
    """Until its connection is lost, which is said. It takes each step once."""
    component = stepped()
    pid = int(np.asarray(component.outputs()["pid"]))

    def go_on() -> None:
        until(lambda: bool(caplog.records))
        os.kill(pid, signal.SIGCONT)

    os.kill(pid, signal.SIGSTOP)
    going_on = threading.Thread(target=go_on)
    going_on.start()
    with caplog.at_level(logging.WARNING):
        for t in range(1, 5):
            component.step({}, t, 1)
            assert count(component) == t + 1
    going_on.join()
    said = [record.getMessage() for record in caplog.records]
    lost = "`a`: lost the connection to its process; it is waited for until its deadline"
    assert said == [lost, "`a`: its process is there again"]


@pytest.mark.slow
def test_a_command_that_is_said_twice_is_carried_out_once(
    stepped: Callable[[], ConcurrentComponent],
) -> None:
    component: Any = stepped()
    link = component._dialogue._link
    for t in range(1, 4):
        link._line.say()
        component.step({}, t, 1)
        assert count(component) == t + 1


def test_who_has_nobody_to_host_listens_nowhere() -> None:
    with adapter.ZenohTransport() as transport:
        assert transport.open([], 1.0) == {}
        assert transport.endpoint == ""
