"""Nobody takes part in a run over Zenoh but its hosts, and each host for its own component only."""

import importlib
import os
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, TypeAlias, cast

import numpy as np
import pytest

from orchestrator.component import Component
from orchestrator.errors import ComponentError
from orchestrator.remote.launching import launch
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport
from orchestrator.remote.wire import SignalEncoder
from orchestrator.signal import Causality

zenoh = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
adapter = importlib.import_module("adapters.zenoh")
intruders = importlib.import_module("tests.adapters.intruders")

Beside: TypeAlias = Callable[..., list[tuple[object, ...]]]

PACKAGES = Path(__file__).parents[1] / "orchestrator" / "packages"


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_runs`."""
    monkeypatch.syspath_prepend(PACKAGES)
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)


@pytest.fixture
def specs(runs: ModuleType, tmp_path: Path) -> list[ComponentSpec]:
    """Of the swarms `near` and `far`."""
    found: list[ComponentSpec] = runs.swarms(tmp_path)
    return found


@pytest.fixture
def beside(runs: ModuleType, specs: list[ComponentSpec]) -> Beside:
    """A run of the swarms over a transport while somebody meddles; its bits."""
    return partial(intruders.run_beside, runs, specs)


@pytest.fixture
def sound(beside: Beside) -> list[tuple[object, ...]]:
    """The bits of the run when nobody meddles."""
    return beside(LoopbackTransport(), lambda components: lambda t: None)


@pytest.fixture
def closing() -> Iterator[ExitStack]:
    """Closes the sessions of intruders."""
    with ExitStack() as stack:
        yield stack


def keys_of(transport: Any, component: str) -> Any:
    """The keys of a component, which an intruder would have to guess."""
    return importlib.import_module("adapters.zenoh.session").Keys(
        transport._links[component]._line._commands.key_expr.__str__().split("/")[2], component
    )


def forged(component: Any) -> bytes:
    """A reply to the next command, of a host that has made up the outputs."""
    dialogue = component._dialogue
    outputs = {n: c for n, c in component.connectors.items() if c.causality is Causality.OUTPUT}
    lies = {**component.outputs(), "mean": np.array(123.0)}
    block = SignalEncoder(outputs).parts(lies)
    return Message(Kind.DONE, dialogue.epoch, dialogue.sequence + 1).encode(block)


def forger(
    transport: Any, closing: ExitStack, who: str, components: Mapping[str, Component]
) -> Callable[[object], None]:
    """`who` answers for `far` before the command to it is sent."""
    session = closing.enter_context(intruders.host_of(transport, who))
    key = keys_of(transport, "far").output
    return lambda t: session.put(key, forged(components["far"]))


@pytest.mark.slow
def test_a_component_cannot_answer_for_another(
    beside: Beside, sound: list[Any], closing: ExitStack
) -> None:
    """Even if it knows the secret name of the run and the number of the next command."""
    transport = adapter.ZenohTransport()
    forging = partial(forger, transport, closing, "near")
    assert beside(transport, forging) == sound


@pytest.mark.slow
def test_without_access_control_it_could(
    beside: Beside,
    sound: list[Any],
    closing: ExitStack,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What the test above does is dangerous: the same messages are recorded then."""
    monkeypatch.setattr("adapters.zenoh.transport.access", lambda peers: {})
    transport = adapter.ZenohTransport()
    forging = partial(forger, transport, closing, "near")
    bits = beside(transport, forging)
    lie = np.array(123.0).tobytes()
    assert [bit for bit in bits if bit[1:3] == ("far", "mean") and lie in cast("Any", bit[3])]
    assert bits != sound


def test_a_component_hears_and_disturbs_nobody_else(
    beside: Beside, sound: list[Any], closing: ExitStack
) -> None:
    """It subscribes to all keys it can think of, and says commands, ends and tokens of others."""
    transport = adapter.ZenohTransport()
    heard: list[str] = []

    def meddling(components: Mapping[str, Component]) -> Callable[[object], None]:
        ear, mouth = (closing.enter_context(intruders.host_of(transport, "near")) for _ in range(2))
        keys = keys_of(transport, "far")
        everything = ("**", "cs/@v1/**", "cs/@v1/*/far/*", "cs/@v1/*/*/out", "@/**")
        listener = importlib.import_module("zenoh.handlers").Callback(
            lambda sample: heard.append(str(sample.key_expr)), indirect=False
        )
        ear.declare_subscriber(keys_of(transport, "near").command, listener)
        for key in (keys.command, keys.output, *everything):
            ear.declare_subscriber(key, listener)
            ear.liveliness().declare_subscriber(key, listener, history=True)
        mouth.liveliness().declare_token(keys.alive("0"))
        end = Message(Kind.CLOSE, 1, 10**6).encode()

        def deed(t: object) -> None:
            for key in (keys.command, "cs/@v1/*/*/cmd", "cs/@v1/**"):
                mouth.put(key, end)
            mouth.put(keys.command, b"")
            mouth.put(keys.output, b"garbage")
            mouth.delete(keys.alive("0"))

        return deed

    assert beside(transport, meddling) == sound
    assert len([key for key in heard if key.endswith("/near/cmd")]) >= intruders.STEPS
    assert not [key for key in heard if "/far/" in key], heard


@pytest.mark.slow
def test_commands_of_a_component_to_another_create_nothing(
    beside: Beside, sound: list[Any], closing: ExitStack
) -> None:
    transport = adapter.ZenohTransport()
    evil = ComponentSpec(name="far", type="antigravity:Evil", values={}).to_document()

    def meddling(components: Mapping[str, Component]) -> Callable[[object], None]:
        session = closing.enter_context(intruders.host_of(transport, "near"))
        key = keys_of(transport, "far").command
        create = Message(Kind.CREATE, 0, 1, document=evil).encode()
        return lambda t: session.put(key, create)

    assert beside(transport, meddling) == sound


@pytest.mark.slow
def test_a_reply_of_an_old_epoch_is_never_recorded(
    beside: Beside, sound: list[Any], closing: ExitStack
) -> None:
    """By who may answer: the host itself, which says again what it said in an earlier run."""
    transport = adapter.ZenohTransport()

    def meddling(components: Mapping[str, Component]) -> Callable[[object], None]:
        session = closing.enter_context(intruders.host_of(transport, "far"))
        key = keys_of(transport, "far").output
        far: Any = components["far"]

        def deed(t: object) -> None:
            message, offset = Message.decode(raw := forged(far))
            for epoch, sequence in [(0, message.sequence), (1, message.sequence - 1), (2, 10**9)]:
                old = message._replace(epoch=epoch, sequence=sequence)
                session.put(key, old.encode([raw[offset:]]))

        return deed

    assert beside(transport, meddling) == sound


@pytest.mark.slow
def test_who_does_not_know_the_password_is_not_let_in() -> None:
    """Nor who speaks TCP without one, or gives that of another user."""
    strangers = [
        {},
        {"user": "near", "password": "wrong"},
        {"user": "near", "password": ""},
        {"user": "nobody", "password": "far"},
    ]
    transport = adapter.ZenohTransport()
    with transport:
        transport.open(["near", "far"], 30)
        strangers.append({"user": "near", "password": transport._rooms["far"].passwords["far"]})
        for known in strangers:
            settings = {f"transport/auth/usrpwd/{name}": value for name, value in known.items()}
            with pytest.raises(zenoh.ZError, match="Unable to connect"):
                intruders.intruder(transport.endpoint, **settings)


GARBAGE = [b"", b"\xff", b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n", os.urandom(300)]


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["before the hosts are there", "while it runs"])
def test_400_connections_that_say_nothing_or_nonsense(
    beside: Beside,
    sound: list[Any],
    closing: ExitStack,
    moment: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    transport = adapter.ZenohTransport()
    strangers: list[socket.socket] = []
    listen = transport._listen

    def flood() -> None:
        host, port = transport.endpoint.removeprefix("tcp/").split(":")
        for number in range(400):
            stranger = socket.create_connection((host, int(port)), 10)
            strangers.append(closing.enter_context(stranger))
            stranger.sendall(GARBAGE[number % len(GARBAGE)])

    def listen_and_flood(names: list[str]) -> None:
        listen(names)
        flood()

    def meddling(components: Mapping[str, Component]) -> Callable[[int], None]:
        def deed(t: int) -> None:
            if not strangers:
                flood()
            if t == intruders.STEPS * 10_000_000:
                closing.close()  # the orchestrator takes longer to end with them

        return deed

    if moment != "while it runs":
        monkeypatch.setattr(transport, "_listen", listen_and_flood)
    assert beside(transport, meddling) == sound
    assert len(strangers) == 400


def sockets_of(pid: int) -> set[str]:
    """The numbers of the sockets of a process and its threads."""
    names = []
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        try:
            names.append(str(entry.readlink()))
        except OSError:
            continue
    return {name[len("socket:[") : -1] for name in names if name.startswith("socket:[")}


def network_sockets(kind: str, owned: set[str]) -> list[tuple[str, str]]:
    """Local address and state of those of the sockets `owned` that are of `kind`."""
    lines = Path(f"/proc/net/{kind}").read_text().splitlines()[1:]
    fields = [line.split() for line in lines]
    return [(line[1], line[3]) for line in fields if line[9] in owned]


LISTENS = "0A"
LOOPBACK = "0100007F"


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_one_socket_listens_on_the_loopback_and_nothing_is_broadcast(
    runs: ModuleType, specs: list[ComponentSpec]
) -> None:
    """Neither the orchestrator nor a host has a socket of UDP, nor listens elsewhere."""
    transport = adapter.ZenohTransport()
    here = sockets_of(os.getpid())
    with launch(specs, transport):
        hosts = {p._process._hosting() for p in transport._links.values()}
        owned = sockets_of(os.getpid()) - here | set().union(*map(sockets_of, hosts))
        port = int(transport.endpoint.rpartition(":")[2])
        found = network_sockets("tcp", owned)
        assert [address for address, state in found if state == LISTENS] == [
            f"{LOOPBACK}:{port:04X}"
        ]
        assert {address.partition(":")[0] for address, _ in found} == {LOOPBACK}
        for kind in ("tcp6", "udp", "udp6", "raw"):
            assert not network_sockets(kind, owned), kind


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_passwords_are_seen_by_nobody(specs: list[ComponentSpec]) -> None:
    """Not among arguments nor variables, nor in files; and each component has another one."""
    transport = adapter.ZenohTransport()
    with launch(specs, transport):
        words = [room.passwords[name] for name, room in transport._rooms.items()]
        assert len(set(words)) == 2
        assert min(map(len, words)) == 32
        for link in transport._links.values():
            for pid in (link._process.pid, link._process._hosting()):
                for file in ("cmdline", "environ"):
                    content = Path(f"/proc/{pid}/{file}").read_bytes()
                    assert not [word for word in words if word.encode() in content]


@pytest.mark.slow
def test_a_host_that_is_told_to_create_something_else_refuses(
    specs: list[ComponentSpec], monkeypatch: pytest.MonkeyPatch
) -> None:
    """As it would be told by somebody who took the orchestrator's place."""
    monkeypatch.setattr(adapter.ZenohTransport, "admit", lambda self, digests: None)
    other = "this host was started for another component than it is told to create"
    with pytest.raises(Exception, match=other), launch(specs, adapter.ZenohTransport()):
        pass


@pytest.mark.slow
def test_the_name_of_a_component_may_be_any_that_a_scenario_allows(runs: ModuleType) -> None:
    """Rules are made of it."""
    names = ["0-_", "cmd"]
    specs = [ComponentSpec(name=name, type=runs.RECKLESS, values={}) for name in names]
    with launch(specs, adapter.ZenohTransport()) as components:
        assert list(components) == names


@pytest.mark.slow
def test_nonsense_of_a_host_is_an_error_with_its_name(beside: Beside, closing: ExitStack) -> None:
    transport = adapter.ZenohTransport()

    def meddling(components: Mapping[str, Component]) -> Callable[[object], None]:
        session = closing.enter_context(intruders.host_of(transport, "far"))
        return lambda t: session.put(keys_of(transport, "far").output, b"nonsense" * 10)

    with pytest.raises(ComponentError, match=r"component `far` at t = .*something unreadable"):
        beside(transport, meddling)
