"""A component whose process is lost goes on in another one, to the same bits, if that is wanted."""

import importlib
import logging
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from orchestrator.cli import main
from orchestrator.errors import ComponentError
from orchestrator.limits import Limits, OnFailure
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport, Transport
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System

PACKAGES = Path(__file__).parent / "packages"
RESTART = Limits(on_failure=OnFailure.RESTART)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_runs`."""
    monkeypatch.syspath_prepend(PACKAGES)
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)


def trace(
    runs: ModuleType,
    transport: Transport,
    folder: Path,
    at: Sequence[int] = (),
    *,
    always: bool = False,
    forgets: bool = False,
    limits: Limits = RESTART,
) -> Any:
    """The trace of two components that drive each other for 250 steps; `a` may die."""
    values = {"marks": folder, "at": tuple(at), "always": always, "forgets": forgets}
    specs = [
        ComponentSpec(name="a", type="remote_units:Lasting", values=values),
        ComponentSpec(name="b", type="remote_units:Lasting", values={}),
    ]
    wires = [Connection(Endpoint(x, "y"), Endpoint(y, "u")) for x, y in ("ab", "ba")]
    seen = runs.Trace()
    with launch(specs, transport, limits={"a": limits}) as components:
        system = System(components, dict.fromkeys(components, runs.STEP), wires)
        algorithm = runs.Jacobi()
        simulate(system, algorithm, start=0, stop=250 * runs.STEP, seed=1, observers=[seen])
    return seen


@pytest.mark.slow
@pytest.mark.parametrize("name", ["local", "zenoh"])
def test_a_restarted_component_gives_the_same_bits(
    runs: ModuleType, tmp_path: Path, name: str, caplog: pytest.LogCaptureFixture
) -> None:
    """It dies in its first step, between checkpoints, and right behind one (every 100 steps)."""
    transport: Any = LocalTransport()
    if name == "zenoh":
        pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
        transport = importlib.import_module("adapters.zenoh").ZenohTransport()
    whole = trace(runs, LoopbackTransport(), tmp_path)
    with caplog.at_level(logging.WARNING):
        found = trace(runs, transport, tmp_path, at=(1, 70, 101, 230))
    assert len(whole.bits) == 2 * 251
    assert found.bits == whole.bits
    told = [r.getMessage() for r in caplog.records if "started again" in r.getMessage()]
    anew = [text.rpartition("to make ")[2] for text in told]
    assert anew == [f"{count} steps anew" for count in (0, 69, 0, 29)]


def test_a_step_that_kills_again_ends_the_run(runs: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(ComponentError, match=r"`a` at t = 0\.04 s: its process was killed by SIG"):
        trace(runs, LocalTransport(), tmp_path, at=(5,), always=True)


@pytest.mark.parametrize("forgets", [False, True])
def test_a_component_that_comes_back_as_another_is_named(
    runs: ModuleType, tmp_path: Path, caplog: pytest.LogCaptureFixture, *, forgets: bool
) -> None:
    """Step 103 is lost, two behind the checkpoint; if it forgets, they begin at another sum."""
    with caplog.at_level(logging.WARNING):
        trace(runs, LocalTransport(), tmp_path, at=(103,), forgets=forgets)
    what = "component `a` was started again and came to another `y` than before: its state is more"
    assert any(r.getMessage().startswith(what) for r in caplog.records) is forgets


def test_without_the_wish_it_ends_the_run(runs: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(ComponentError, match=r"`a` at t = 0\.04 s: its process was killed by SIG"):
        trace(runs, LocalTransport(), tmp_path, at=(5,), limits=Limits())


SCENARIO = """\
schema: 1
title: Two
time: {stop: 1 s}
components:
  a: {type: "remote_units:Lasting", step: 100 ms, process: true, on_failure: restart}
  b: {type: "remote_units:Anew", step: 100 ms, process: true}
"""


def test_who_cannot_hand_its_state_over_is_refused_at_its_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "remote_units.py").write_text((PACKAGES / "remote_units.py").read_text())
    path = tmp_path / "two.yaml"
    path.write_text(SCENARIO)
    assert main(["check", str(path)]) == 0
    capsys.readouterr()
    assert main(["check", str(path), "--set", "components.b.on_failure=restart"]) == 2
    what = "the state of `b` cannot leave its process, so it cannot be started again"
    assert f"components.b.on_failure: {what}" in capsys.readouterr().out
    assert main(["check", str(path), "--set", "components.a.on_failure=perhaps"]) == 2
    assert "expected `abort` or `restart`, got 'perhaps'" in capsys.readouterr().out
    apart = ["--set", "components.a.process=false"]
    assert main(["check", str(path), *apart]) == 2
    assert "components.a.on_failure: is for components in a process" in capsys.readouterr().out
