"""What the socket pair of the transport `local` promises beyond what every transport does."""

import importlib
import os
import signal
import socket
import struct
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import TypeAlias

import numpy as np
import pytest

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.limits import Deadlines
from orchestrator.placement import transport_type
from orchestrator.randomness import stream
from orchestrator.remote import local
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.memory import Exchange, HostMemory
from orchestrator.remote.segment import PlaceError, can_share
from orchestrator.remote.socket_messages import SocketMessages
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LinkLostError
from orchestrator.simulation import simulate
from orchestrator.system import System

pytestmark = pytest.mark.skipif(
    not Path("/proc/self/fd").exists(), reason="counts descriptors in /proc"
)


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_runs`; afterwards no descriptor may be left."""
    monkeypatch.syspath_prepend(Path(__file__).parent / "packages")
    before = descriptors()
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)
    assert descriptors() - before == set()  # some of earlier tests may go meanwhile


def descriptors() -> set[str]:
    """The open descriptors of this process, and what they are."""
    found = set()
    for entry in Path("/proc/self/fd").iterdir():
        if entry.exists() or entry.is_symlink():
            found.add(f"{entry.name} {str(entry.readlink()).partition(':')[0]}")
    return found


Pair: TypeAlias = tuple[socket.socket, socket.socket]


@pytest.fixture
def pair() -> Iterator[Pair]:
    """Both ends of a socket pair."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        yield ours, theirs


def test_it_is_built_in() -> None:
    assert transport_type("local") is LocalTransport
    with pytest.raises(ComponentTypeError, match="did you mean `local`"):
        transport_type("locale")


@pytest.mark.parametrize(
    ("deadlines", "values", "doing"),
    [
        (Deadlines(create=0.4), {"creating": 20.0}, "create"),
        (Deadlines(setup=0.4), {"setting_up": 20.0}, "setup"),
    ],
)
def test_creating_and_setting_up_have_deadlines_of_their_own(
    runs: ModuleType, deadlines: Deadlines, values: dict[str, float], doing: str
) -> None:
    specs = [ComponentSpec(name="b", type="remote_units:Slow", values=values)]

    def run() -> None:
        with launch(specs, LocalTransport(), deadlines=deadlines) as components:
            system = System(components, {"b": runs.STEP}, [])
            simulate(system, Jacobi(), start=0, stop=runs.STEP, seed=1)

    with pytest.raises(ComponentError, match=rf"did not answer within 0\.4 s \(to `{doing}`\)"):
        run()


def test_a_frozen_process_ends_the_run_at_the_deadline(runs: ModuleType) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(LocalTransport(), deadlines=Deadlines(step=0.5), deed="freeze")
    message = "component `b` at t = 0.02 s: did not answer within 0.5 s (to `step`)"
    assert str(caught.value) == f"{message}; its `deadline` allows no more"


def test_a_host_that_a_child_outlives_is_noticed_at_once(runs: ModuleType) -> None:
    """A forked child has the socket as well, so that its end is not the end of the host."""
    before = time.monotonic()
    with pytest.raises(ComponentError, match="its process exited with code 3"):
        runs.run_reckless(LocalTransport(), deed="fork_and_quit")
    assert time.monotonic() - before < 10  # the child takes 15 s, the deadline of a step is 30 s


def test_a_component_that_closes_the_socket_is_reported(runs: ModuleType) -> None:
    with pytest.raises(ComponentError) as caught:
        runs.run_reckless(LocalTransport(), deed="close_all")
    assert str(caught.value).startswith("component `b` at t = 0.02 s: ")
    assert "its process exited with code 1; it wrote last:" in str(caught.value)


def test_what_a_component_starts_does_not_get_the_socket(runs: ModuleType) -> None:
    assert runs.run_reckless(LocalTransport(), deed="hand_down").times[-1] == 60_000_000


def test_a_message_that_comes_in_pieces_survives_the_end_of_the_waiting(pair: Pair) -> None:
    messages, theirs = SocketMessages(pair[0]), pair[1]
    body = bytes(range(256)) * 40_000  # more than a socket keeps
    frame = struct.pack("<Q", len(body)) + body

    def send(piece: bytes) -> None:
        thread = threading.Thread(target=theirs.sendall, args=(piece,))
        thread.start()
        with pytest.raises(TimeoutError):
            messages.receive(time.monotonic() + 0.3)
        thread.join()

    for start, end in ((0, 3), (3, 8), (8, 5_000_000)):
        send(frame[start:end])
    sender = threading.Thread(target=theirs.sendall, args=(frame[5_000_000:],))
    sender.start()
    assert messages.receive(time.monotonic() + 10) == body
    sender.join()


def test_a_length_that_is_a_lie_takes_no_memory(pair: Pair) -> None:
    messages, theirs = SocketMessages(pair[0]), pair[1]
    theirs.sendall(struct.pack("<Q", 2**64 - 1) + b"x")
    theirs.close()
    with pytest.raises(EOFError):
        messages.receive(time.monotonic() + 5)


@pytest.mark.parametrize("length", [0, 1, 2**20 - 8, 2**20, 3 * 2**20 + 1])
def test_messages_of_every_length_come_whole(pair: Pair, length: int) -> None:
    sent = stream(1, "message").bytes(length)
    ours, theirs = map(SocketMessages, pair)

    def send() -> None:
        for _ in range(2):
            ours.send(sent)

    sender = threading.Thread(target=send)
    sender.start()
    assert [theirs.receive(time.monotonic() + 10) for _ in range(2)] == [sent] * 2
    sender.join()


@pytest.mark.skipif(not can_share(), reason="this system has no memory without a name")
def test_large_values_from_host_to_host_take_few_descriptors(runs: ModuleType) -> None:
    """Of 1 MB each: they are seen where they were made, and memory does not grow with the steps."""
    specs = [ComponentSpec(name=name, type="remote_units:Echo", values={}) for name in "ab"]
    value = stream(1, "big").normal(size=131_072)
    counts = []
    others = children()
    with launch(specs, LocalTransport()) as components:
        first, second = components.values()
        for echo in (first, second):
            echo.setup(0, stream(1, "big"))
            echo.initialise({"u": value})
        hosts = children() - others
        for t in range(30):
            first.step({"u": value + t}, t, 1)
            made = first.outputs()["y"]
            second.step({"u": made}, t, 1)
            assert np.asarray(second.outputs()["y"]).tobytes() == (value + t).tobytes()
            assert not np.asarray(made).flags.writeable
            counts.append([len(descriptors()), *(len(list((h / "fd").iterdir())) for h in hosts)])
        first.close()
        second.close()
    assert len(hosts) == 2
    assert counts[5:] == [counts[5]] * 25


def children() -> set[Path]:
    """The folders in /proc of the processes that are ours."""
    return {folder for folder in Path("/proc").glob("[0-9]*") if is_child(folder)}


def is_child(folder: Path) -> bool:
    """Whether the process is one of ours."""
    try:
        return int((folder / "stat").read_text().rpartition(")")[2].split()[1]) == os.getpid()
    except OSError:
        return False


def test_messages_that_come_together_are_told_apart(pair: Pair) -> None:
    ours, theirs = map(SocketMessages, pair)
    sent = [b"", b"one", b"", b"another"]
    for message in sent:
        ours.send(message)
    assert [theirs.receive(time.monotonic() + 10) for _ in sent] == sent


def test_descriptors_that_were_announced_and_do_not_come_are_not_waited_for(pair: Pair) -> None:
    """Whether the other end sends another number of them, or none, or has no way to."""
    announced = struct.pack("<QQQQ", 1 << 63 | 2, 4096, 1, 4097) + struct.pack("<QQ", 1, 0)
    beside, theirs_beside = socket.socketpair()
    with beside, theirs_beside:
        for way, others in ((None, 0), (beside, 0), (beside, 1)):
            messages = SocketMessages(pair[0], HostMemory(1), way)
            pair[1].sendall(announced)
            if others:
                socket.send_fds(theirs_beside, [b"\0"], [0] * others)
            before = time.monotonic()
            with pytest.raises(PlaceError, match=r"no descriptors came|2 segments, but [01] desc"):
                messages.receive(before + 30)
            assert time.monotonic() - before < 10


def test_a_process_that_takes_no_command_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(local, "_SEND_TIMEOUT", 0.2)
    link = local.LocalLink("b", 0, Exchange(), "")
    os.killpg(link._process.pid, signal.SIGSTOP)
    said = "its process did not take a command within 0.2 s"
    with pytest.raises(LinkLostError, match=f"^{said}$"):
        link.send(bytes(64 << 20))
    link.abandon()
    with pytest.raises(LinkLostError, match=f"^{said}$"):
        link.send(b"")


def test_a_link_that_was_given_up_says_so() -> None:
    link = local.LocalLink("b", 0, Exchange(), "")
    link.abandon()
    with pytest.raises(LinkLostError, match=r"^its process was ended by the orchestrator$"):
        link.send(b"")
