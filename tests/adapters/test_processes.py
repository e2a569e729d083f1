"""Components in processes of their own: the same bytes, and every way in which one can fail."""

import importlib
import logging
import os
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.limits import Deadlines
from orchestrator.parameters import PythonComponentType
from orchestrator.randomness import stream
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport, Transport

PACKAGES = Path(__file__).parents[1] / "orchestrator" / "packages"
pytestmark = pytest.mark.skipif(
    not Path("/proc/self").exists(), reason="looks for processes in /proc"
)


@dataclass(frozen=True)
class Kind:
    """Transports to processes of their own."""

    module: str
    name: str
    library: str

    def __call__(self) -> Transport:
        transport: Transport = getattr(importlib.import_module(self.module), self.name)()
        return transport


LOCAL = Kind("orchestrator.remote.local", "LocalTransport", "numpy")
ZENOH = Kind("adapters.zenoh", "ZenohTransport", "zenoh")


@pytest.fixture(params=[LOCAL, ZENOH], ids=["local", "zenoh"])
def connect(request: pytest.FixtureRequest) -> Kind:
    """Makes a transport; tests ask for each of them."""
    kind: Kind = request.param
    pytest.importorskip(kind.library, reason=f"{kind.library} is not installed")
    return kind


def children() -> set[int]:
    """The processes that host components of this one, zombies included."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            status = (folder / "stat").read_text()
            command = (folder / "cmdline").read_text()
        except OSError:
            continue
        parent = int(status.rpartition(")")[2].split()[1])
        if parent == os.getpid() and ("orchestrator.remote.host_main" in command or not command):
            found.add(int(folder.name))
    return found


def is_gone(pid: int, within: float = 5.0) -> bool:
    """Whether the process `pid` ends within so many seconds."""
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            return True
        if state == "Z":
            return True
        time.sleep(0.01)
    return False


@pytest.fixture
def runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[ModuleType]:
    """The module `remote_runs`; afterwards no process may be left, nor anything of Zenoh."""
    monkeypatch.syspath_prepend(PACKAGES)
    temporary = tmp_path_factory.mktemp("temporary")  # of these runs alone
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    before, shared = children(), segments()
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)
    assert children() <= before
    assert segments() <= shared
    assert not list(temporary.glob("nlosim-*/users"))


def segments() -> set[str]:
    """Zenoh's shared memory that this process has; it would outlive it."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    return {line.split()[-1] for line in lines if ".zenoh" in line}


@pytest.mark.slow
def test_in_process_loopback_and_processes_give_the_same_bits(
    connect: Kind, runs: ModuleType, tmp_path: Path
) -> None:
    specs = runs.swarms(tmp_path)
    kind = PythonComponentType(importlib.import_module("remote_units").Swarm)
    local = runs.run_swarms({spec.name: kind.create(spec.name, spec.values) for spec in specs})
    traces = []
    for transport in (LoopbackTransport(), connect()):
        with launch(specs, transport) as components:
            traces.append(runs.run_swarms(components).bits)
    assert len(local.bits) == 101 * 2 * 7
    assert traces == [local.bits] * 2


@pytest.mark.slow
def test_large_arrays_arrive(connect: Kind, runs: ModuleType) -> None:
    spec = ComponentSpec(name="big", type="remote_units:Echo", values={})
    value = stream(1, "big").normal(size=6_000_000)
    with launch([spec], connect()) as components:
        echo = components["big"]
        echo.setup(0, stream(1, "big"))
        echo.initialise({"u": value})
        for t, count in enumerate((6_000_000, 8_192, 100_000, 8_191, 0)):
            echo.step({"u": value[:count]}, t, 1)
            found = np.asarray(echo.outputs()["y"])
            assert found.tobytes() == value[:count].tobytes()
        echo.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("deed", "how"),
    [
        ("kill_itself", "its process was killed by SIGKILL; it wrote last:\n    goodbye"),
        ("quit", "its process exited with code 3"),
        ("exit", "SystemExit: 3"),
        ("raise", "ValueError: the moon is too bright"),
    ],
)
def test_how_a_component_ended_is_reported(
    connect: Kind, runs: ModuleType, deed: str, how: str
) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(connect(), deed=deed)
    assert str(caught.value) == f"component `b` at t = 0.02 s: {how}"
    assert (caught.value.component, caught.value.time) == ("b", 20_000_000)


@pytest.mark.slow
def test_a_crash_is_reported_with_its_signal_and_python_stack(
    connect: Kind, runs: ModuleType
) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(connect(), deed="crash")
    text = str(caught.value)
    assert text.startswith("component `b` at t = 0.02 s: its process was killed by SIGSEGV")
    assert "in _crash" in text


@pytest.mark.slow
@pytest.mark.parametrize("deed", ["sleep", "hold_the_gil"])
def test_a_hang_is_reported_and_ended(connect: Kind, runs: ModuleType, deed: str) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(connect(), deadlines=Deadlines(step=1.5), deed=deed)
    message = "component `b` at t = 0.02 s: did not answer within 1.5 s (to `step`)"
    assert str(caught.value) == f"{message}; its `deadline` allows no more"


def test_a_process_killed_from_outside_ends_the_run(connect: Kind, runs: ModuleType) -> None:
    spec = ComponentSpec(name="victim", type=runs.RECKLESS, values={"pause": 20.0})
    with launch([spec], connect()) as components:
        victim = components["victim"]
        victim.setup(0, stream(1, "victim"))
        victim.initialise({"trigger": np.zeros(())})
        pid = int(np.asarray(victim.outputs()["pid"]))
        threading.Timer(0.1, os.kill, (pid, signal.SIGKILL)).start()
        before = time.monotonic()
        with pytest.raises(ComponentError) as caught:
            victim.step({"trigger": np.zeros(())}, 30_000_000, 1)
        assert time.monotonic() - before < 5  # the deadline is 30 s
        assert str(caught.value) == (
            "component `victim` at t = 0.03 s: its process was killed by SIGKILL"
        )
        with pytest.raises(ComponentError, match="its process has ended"):
            victim.step({"trigger": np.zeros(())}, 30_000_000, 1)
        victim.close()


@pytest.mark.slow
def test_types_that_cannot_be_created_are_reported_at_once(connect: Kind, runs: ModuleType) -> None:
    specs = [
        ComponentSpec(name="x", type="no_such_module:X", values={}),
        ComponentSpec(name="y", type=runs.RECKLESS, values={"deed": "refuse", "where": "create"}),
        ComponentSpec(name="z", type=runs.RECKLESS, values={}),
    ]
    with pytest.raises(ComponentTypeError) as caught, launch(specs, connect()):
        pass
    assert str(caught.value).splitlines() == [
        (
            "component `x`: cannot load `no_such_module:X`: ModuleNotFoundError: "
            "No module named 'no_such_module'"
        ),
        "component `y`: `most` and `least` contradict each other",
    ]


def test_a_host_that_cannot_start_is_reported_with_what_it_said(
    connect: Kind, runs: ModuleType, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / f"{connect.library}.py").write_text("raise ImportError('no transport today')\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(ComponentError) as caught, launch(runs.swarms(tmp_path), connect()):
        pass
    text = str(caught.value)
    assert text.startswith("component `near`: its process exited with code 1; it wrote last:")
    assert text.endswith("ImportError: no transport today")


@pytest.mark.slow
def test_what_a_component_prints_and_logs_goes_to_the_log(
    connect: Kind,
    runs: ModuleType,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> None:
    with caplog.at_level(logging.INFO):
        runs.run_reckless(connect(), deed="print")
        runs.run_reckless(connect(), deed="log")
    records = [(r.name, r.levelno, r.getMessage()) for r in caplog.records]
    assert ("orchestrator.remote.output", logging.INFO, "`b`: hello from the unit") in records
    assert ("reckless", logging.WARNING, "fuel is low") in records
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_no_process_has_memory_that_outlives_it(connect: Kind, runs: ModuleType) -> None:
    """Zenoh's shared memory would: it is found among what the host of a component has mapped."""
    assert runs.run_reckless(connect(), deed="have_no_segments").times[-1] == 60_000_000


def test_a_component_that_reads_standard_input_gets_nothing(
    connect: Kind, runs: ModuleType
) -> None:
    assert runs.run_reckless(connect(), deed="read_input").times[-1] == 60_000_000


@pytest.mark.slow
def test_what_a_component_started_ends_with_it(
    connect: Kind, runs: ModuleType, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level(logging.INFO):
        runs.run_reckless(connect(), deed="leave_a_child")
    said = next(r.getMessage() for r in caplog.records if "child" in r.getMessage())
    assert is_gone(int(said.rpartition(" ")[2]))


SCRIPT = """
    import sys, time
    from pathlib import Path
    sys.path.insert(0, {packages!r})
    import remote_runs, numpy as np
    from {module} import {name}
    from orchestrator.remote.specification import ComponentSpec
    from orchestrator.randomness import stream
    from orchestrator.remote.launching import launch
    specs = [ComponentSpec(name=f"c{{i}}", type=remote_runs.RECKLESS, values={{"pause": {pause}}})
             for i in range(3)]
    class Announce(remote_runs.Trace):
        def begin(self, system, start, stop):
            pass
        def observe(self, t, published, values):
            print(*(int(v["pid"]) for v in values.values()), flush=True)
    with launch(specs, {name}()) as components:
        system = remote_runs.System(components, dict.fromkeys(components, 10), [])
        remote_runs.simulate(system, remote_runs.Jacobi(), start=0, stop=10000, seed=1,
                             observers=[Announce()])
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "pause"),
    [(signal.SIGINT, 0.02), (signal.SIGINT, 30.0), (signal.SIGTERM, 0.02), (signal.SIGKILL, 30.0)],
)
def test_no_process_outlives_the_orchestrator(
    connect: Kind, number: signal.Signals, pause: float
) -> None:
    # SIGINT to the whole process group is what a terminal does on Ctrl-C
    script = textwrap.dedent(SCRIPT).format(
        packages=str(PACKAGES), pause=pause, module=connect.module, name=connect.name
    )
    orchestrator = subprocess.Popen(
        [sys.executable, "-c", script],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    try:
        assert orchestrator.stdout is not None
        pids = [int(word) for word in orchestrator.stdout.readline().split()]
        assert len(pids) == 3
        time.sleep(0.1)
        os.killpg(orchestrator.pid, number)
        _, errors = orchestrator.communicate(timeout=20)
    finally:
        orchestrator.kill()
    assert [pid for pid in pids if not is_gone(pid)] == []
    if number == signal.SIGINT:
        assert errors.rstrip().endswith("KeyboardInterrupt")
        assert "Error" not in errors
