"""What a host refuses, and what of a host is refused: nobody runs code where he should not."""

import importlib
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.parameters import PythonComponentType
from orchestrator.remote.admission import Exactly, digest_of
from orchestrator.remote.block import WireError
from orchestrator.remote.declarations import connectors_from_message, connectors_to_message
from orchestrator.remote.host import ComponentHost
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.protocol import Kind, Message
from orchestrator.remote.segment import Arena, PlaceError, can_share
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Link, LoopbackTransport
from orchestrator.signal import Causality, Connector

PACKAGES = Path(__file__).parent / "packages"


@pytest.fixture
def runs(monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """The module `remote_runs`."""
    monkeypatch.syspath_prepend(PACKAGES)
    yield importlib.import_module("remote_runs")
    for module in ("remote_runs", "remote_units"):
        sys.modules.pop(module, None)


@pytest.fixture
def trap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A file that is there once the module `trap`, or the file `trap.py`, has been loaded."""
    sprung = tmp_path / "sprung"
    (tmp_path / "trap.py").write_text(f"open({str(sprung)!r}, 'w').close()\n")
    monkeypatch.syspath_prepend(tmp_path)
    yield sprung
    sys.modules.pop("trap", None)


def said(reply: bytes) -> Any:
    """The document of a failure."""
    message, _ = Message.decode(reply)
    assert message.kind is Kind.FAILED
    return message.document["failure"]


def create(document: Any, sequence: int = 1) -> bytes:
    return Message(Kind.CREATE, 0, sequence, document=document).encode()


OWN = ComponentSpec(name="b", type="remote_units:Reckless", values={"at": 7, "pause": 0.5})


@pytest.mark.parametrize("named", ["trap:Evil", "{folder}/trap.py:Evil"])
def test_a_host_loads_nothing_but_what_it_was_started_for(
    runs: ModuleType, trap: Path, named: str
) -> None:
    """Not as the type, whether installed or in a file, and not as the class of a record."""
    del runs
    own = OWN.to_document()
    record = {"record": "trap:Evil", "fields": {}}
    forged = [
        {**own, "type": named.format(folder=trap.parent)},
        {**own, "values": {**own["values"], "at": record}},
        {**own, "values": {**own["values"], "new": record}},
        {**own, "values": {**own["values"], "at": 8}},
        {**own, "name": "c"},
    ]
    host = ComponentHost(admission=Exactly(digest_of(own)))
    for document in forged:
        failure = said(host.handle(create(document)))
        assert failure["is_type_error"]
        assert failure["text"].startswith("this host was started for another component")
    assert not trap.exists()
    created, _ = Message.decode(host.handle(create(own)))
    assert created.kind is Kind.DONE
    said(ComponentHost().handle(create(forged[0])))
    assert trap.exists()  # as everything is, in the process of who tells it


def test_a_component_is_created_once(runs: ModuleType) -> None:
    del runs
    host = ComponentHost()
    assert Message.decode(host.handle(create(OWN.to_document())))[0].kind is Kind.DONE
    again = said(host.handle(create(OWN.to_document(), 2)))
    assert again["text"] == "the component was created already"


def test_the_digest_is_that_of_what_travels() -> None:
    """Order does not count, values do, and types; travelling changes nothing."""
    one = ComponentSpec(name="a", type="t", values={"x": 1.0, "y": (Path("p"), True), "z": 1e-300})
    other = ComponentSpec(name="a", type="t", values=dict(reversed(list(one.values.items()))))
    travelled, _ = Message.decode(create(one.to_document()))
    assert digest_of(one.to_document()) == digest_of(other.to_document())
    assert digest_of(one.to_document()) == digest_of(travelled.document)
    changes: list[dict[str, Any]] = [
        {"x": 2.0},
        {"x": True},
        {"y": [Path("p"), True]},
        {"y": ("p", True)},
        {"w": None},
    ]
    digests = {
        digest_of(ComponentSpec(name="a", type="t", values={**one.values, **each}).to_document())
        for each in changes
    }
    assert len(digests) == len(changes)
    assert digest_of(one.to_document()) not in digests


@pytest.mark.parametrize("text", ["O", "|O", "O,i4", "object", "V8,O", "(2,)O"])
def test_elements_that_are_addresses_are_refused(text: str) -> None:
    """Whoever could say which address would run code here: arrays in shared memory are views."""
    command = Message(Kind.CREATE, 0, 1)
    described = connectors_to_message({"y": Connector(causality=Causality.OUTPUT)}, command, {})
    message, offset = Message.decode(described)
    document = {**message.document}
    document["connectors"]["y"]["dtype"] = text
    with pytest.raises(WireError, match="is not an element type"):
        connectors_from_message(document, described, offset)


@pytest.mark.skipif(not can_share(), reason="this system has no such memory")
def test_memory_that_others_write_is_never_read_as_addresses() -> None:
    arena = Arena(1)
    place = arena.place(b"x" * 64)
    for dtype in (np.dtype(object), np.dtype([("a", "i8"), ("b", "O")])):
        with pytest.raises(PlaceError, match="are addresses, which nobody shares"):
            arena.segments[0].array(place, (1,), dtype)
    arena.close()


class Liar(LoopbackTransport):
    """Hosts in this process whose first replies say something else than was agreed."""

    def __init__(self, document: Any, kind: Kind = Kind.DONE) -> None:
        super().__init__()
        self._document, self._kind = document, kind

    @override
    def open(self, names: Any, timeout: float) -> Any:
        links = super().open(names, timeout)
        for link in links.values():
            self._lie(link)
        return links

    def _lie(self, link: Link) -> None:
        send: Any = link.send

        def sent(message: bytes) -> None:
            send(message)
            command, _ = Message.decode(message)
            reply = command.reply(self._kind, self._document)
            link._reply = reply.encode([bytes(16)])  # type: ignore[attr-defined]

        link.send = sent  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("document", "kind", "why"),
    [
        ({}, Kind.DONE, "KeyError: 'connectors'"),
        ({"connectors": 3}, Kind.DONE, "AttributeError: 'int' object has no attribute 'items'"),
        ({"connectors": {}, "capabilities": ["eval"]}, Kind.DONE, "KeyError: 'eval'"),
        ({"connectors": {}, "input_degree": "x"}, Kind.DONE, "ValueError: invalid literal"),
        ({}, Kind.FAILED, "KeyError: 'failure'"),
        ({"failure": {}}, Kind.FAILED, "KeyError: 'traceback'"),
        ({"logs": [1]}, Kind.DONE, "TypeError: cannot unpack"),
        ({}, Kind.STEP, "KeyError: 'failure'"),
    ],
)
def test_what_a_host_says_is_not_taken_for_granted(
    runs: ModuleType, document: Any, kind: Kind, why: str
) -> None:
    specs = [ComponentSpec(name="a", type=runs.RECKLESS, values={})]
    expected = f"^component `a`: its process sent something unreadable: {why}"
    with pytest.raises(ComponentError, match=expected), launch(specs, Liar(document, kind)):
        pass


@pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
def test_a_host_over_a_socket_pair_has_no_other_socket(runs: ModuleType) -> None:
    """Its process has its own two, and none of another's; nor anything else of this process."""
    names = ["a", "b", "c"]
    specs = [ComponentSpec(name=name, type=runs.RECKLESS, values={}) for name in names]
    with launch(specs, LocalTransport()) as components:
        hosted: list[Any] = [getattr(each, "_component", each) for each in components.values()]
        found = [descriptors(each._dialogue._link._process._hosting()) for each in hosted]
    for kinds in found:
        assert len(kinds["socket"]) == 2
        assert len(kinds["pipe"]) <= 2  # output, and the input that ends with this process
        assert set(kinds) <= {"socket", "pipe", "/dev/null"}
    everything = [number for kinds in found for number in kinds["socket"]]
    assert len(set(everything)) == 6


def descriptors(pid: int) -> dict[str, set[str]]:
    """The numbers of what a process has open, by kind."""
    found: dict[str, set[str]] = {}
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        kind, _, number = os.readlink(entry).partition(":")  # noqa: PTH115 - it is no path
        found.setdefault(kind, set()).add(number)
    return found


def test_a_type_is_loaded_after_it_was_admitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The parameters, too: a record of theirs names a module."""
    loaded: list[Any] = []
    monkeypatch.setattr(ComponentSpec, "from_document", loaded.append)
    monkeypatch.setattr(PythonComponentType, "create", loaded.append)
    host = ComponentHost(admission=Exactly(""))
    assert said(host.handle(create(OWN.to_document())))["is_type_error"]
    assert not loaded
    with pytest.raises(ComponentTypeError, match="started for another component"):
        Exactly("0").check(OWN.to_document())
