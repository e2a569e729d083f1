"""Across hosts, certificates decide: who has none of the authority's is not let in, and of those
who have one each may do what it is there for only."""

import importlib
import json
from collections.abc import Iterator
from contextlib import ExitStack
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic, sleep
from typing import Any

import pytest

from orchestrator.hosts_file import RUN, Hosts, read_hosts

zenoh = pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
pytest.importorskip("cryptography", reason="cryptography is not installed")
make_credentials = importlib.import_module("adapters.keys").make_credentials
access = importlib.import_module("adapters.zenoh.access")
session = importlib.import_module("adapters.zenoh.session")
session_settings = importlib.import_module("adapters.zenoh.credentials").session_settings
transport = importlib.import_module("adapters.zenoh.transport")
intruder = importlib.import_module("tests.adapters.intruders").intruder

KEYS = session.Keys("r1", "plant")


def made(folder: Path, port: int) -> Hosts:
    """A hosts file with two hosts, and the credentials of all."""
    folder.mkdir()
    file = folder / "hosts.yaml"
    file.write_text(
        "credentials: keys\nhosts:\n"
        f'  gpu: {{endpoint: "tls/127.0.0.1:{port}"}}\n'
        f'  partner: {{endpoint: "tls/127.0.0.1:{port}"}}\n'
        f'  elsewhere: {{endpoint: "tls/127.0.0.2:{port}"}}\n'
    )
    hosts = read_hosts(file)
    make_credentials(hosts, datetime.now(UTC), 2)
    return hosts


@pytest.fixture
def hosts(tmp_path: Path) -> Hosts:
    return made(tmp_path / "ours", transport._free_port())


@pytest.fixture
def opened() -> Iterator[ExitStack]:
    """Closes all sessions."""
    with ExitStack() as stack:
        yield stack


def listening(hosts: Hosts, opened: ExitStack, name: str = "gpu") -> Any:
    """A session that listens as a host does, for commands of runs to `plant`."""
    settings = {
        "mode": "peer",
        "listen/endpoints": [str(hosts.endpoint(name))],
        **access.access_of_runs(RUN),
        **session_settings(hosts, name, listens=True),
    }
    return opened.enter_context(session.open_session(settings))


def connecting(hosts: Hosts, opened: ExitStack, name: str, peer: str = "gpu") -> Any:
    """A session that connects as `name` to `peer`, whose component is `plant`."""
    peers = [access.Peer(components=["plant"], certificate=peer)]
    settings = {
        "connect/timeout_ms": 20000,
        **access.access(peers),
        **session_settings(hosts, name, listens=False),
    }
    return opened.enter_context(intruder(str(hosts.endpoint(peer)), **settings))


def heard(opened: ExitStack, at: Any, key: str) -> list[bytes]:
    """What `at` hears of `key` from now on."""
    found: list[bytes] = []
    callback = importlib.import_module("zenoh.handlers").Callback
    at.declare_subscriber(
        key, callback(lambda sample: found.append(sample.payload.to_bytes()), indirect=False)
    )
    return found


def publisher(at: Any, key: str) -> Any:
    """A publisher of `at`, once somebody listens."""
    found = at.declare_publisher(key)
    deadline = monotonic() + 20
    while not session.is_matched(found):
        assert monotonic() < deadline, f"nobody listens to {key}"
        sleep(0.002)
    return found


def arrived(found: list[bytes], last: bytes) -> list[bytes]:
    """All that was heard until `last`."""
    deadline = monotonic() + 20
    while not found or found[-1] != last:
        assert monotonic() < deadline, found
        sleep(0.002)
    return found


def test_a_run_and_a_host_hear_each_other(hosts: Hosts, opened: ExitStack) -> None:
    """What belongs to the component arrives in both directions, and nothing else does."""
    host = listening(hosts, opened)
    run = connecting(hosts, opened, RUN)
    commands, replies = heard(opened, host, KEYS.command), heard(opened, run, KEYS.output)
    others = [heard(opened, host, "cs/@v1/r1/other/cmd"), heard(opened, run, "cs/@v1/r1/other/out")]
    run.put("cs/@v1/r1/other/cmd", b"no")
    host.put("cs/@v1/r1/other/out", b"no")
    run.put(KEYS.output, b"no")  # it says nothing for the component
    host.put(KEYS.command, b"no")
    publisher(run, KEYS.command).put(b"command")
    publisher(host, KEYS.output).put(b"reply")
    assert arrived(commands, b"command")[-1:] == [b"command"]
    assert arrived(replies, b"reply")[-1:] == [b"reply"]
    assert [each for each in replies if each == b"no"] == [
        b"no"
    ]  # its own, which nobody else hears
    assert [each for each in commands if each == b"no"] == [b"no"]
    assert others == [[], []]


def refused(endpoint: str, settings: dict[str, Any]) -> None:
    with pytest.raises(zenoh.ZError, match="Unable to connect"):
        intruder(endpoint, **settings)


def test_who_has_no_certificate_of_this_authority_is_not_let_in(
    hosts: Hosts, opened: ExitStack, tmp_path: Path
) -> None:
    """Neither over plain TCP, nor without a certificate, nor with one of another authority."""
    listening(hosts, opened)
    endpoint = str(hosts.endpoint("gpu"))
    refused(endpoint.replace("tls/", "tcp/"), {})
    ours = session_settings(hosts, RUN, listens=False)
    root = "transport/link/tls/root_ca_certificate"
    refused(endpoint, {root: ours[root]})
    foreign = session_settings(made(tmp_path / "theirs", 7447), RUN, listens=False)
    refused(endpoint, {**foreign, root: ours[root]})
    opened.enter_context(intruder(endpoint, **{**ours, "connect/timeout_ms": 20000}))


def test_a_host_is_believed_at_its_own_address_only(hosts: Hosts, opened: ExitStack) -> None:
    """Whoever has the credentials of another host cannot take its place, nor can a run."""
    port = hosts.endpoint("gpu").port
    ours = session_settings(hosts, RUN, listens=False)
    for name in ("elsewhere", RUN):
        settings = {
            "mode": "peer",
            "listen/endpoints": [f"tls/127.0.0.1:{port}"],
            **session_settings(hosts, name, listens=True),
        }
        with session.open_session(settings):
            refused(f"tls/127.0.0.1:{port}", ours)


def test_the_certificate_of_a_host_is_not_that_of_a_run(hosts: Hosts, opened: ExitStack) -> None:
    """It is let in, and neither says nor hears anything."""
    host = listening(hosts, opened)
    partner = connecting(hosts, opened, "partner")
    run = connecting(hosts, opened, RUN)
    commands, replies = heard(opened, host, KEYS.command), heard(opened, partner, "cs/@v1/**")
    outs = heard(opened, run, KEYS.output)
    for key in (KEYS.command, KEYS.output, "cs/@v1/**"):
        partner.put(key, b"forged")
    del replies[:]  # its own
    publisher(run, KEYS.command).put(b"command")
    publisher(host, KEYS.output).put(b"reply")
    assert arrived(commands, b"command") == [b"command"]
    assert arrived(outs, b"reply") == [b"reply"]
    sleep(0.05)
    assert replies == []


def test_a_peer_has_one_proof() -> None:
    for proofs in ({}, {"user": "a", "certificate": "b"}):
        with pytest.raises(ValueError, match="either a user or a certificate"):
            access.Peer(components=["plant"], **proofs)


def test_nobody_but_the_peers_is_allowed_anything() -> None:
    """Every rule allows, belongs to one peer, and names one key that no other peer has."""
    peers = [access.Peer(components=["a", "b"], user="one"),
             access.Peer(components=["c"], certificate="two"),
             access.Peer(components=[], certificate="none")]  # fmt: skip
    control = access.access(peers)["access_control"]
    json.dumps(control)
    assert control["enabled"]
    assert control["default_permission"] == "deny"
    owners = {
        rule: policy["subjects"] for policy in control["policies"] for rule in policy["rules"]
    }
    assert set(owners) == {rule["id"] for rule in control["rules"]}
    keys = {
        (key.split("/")[3], *owners[rule["id"]])
        for rule in control["rules"]
        for key in rule["key_exprs"]
    }
    assert keys == {("a", "peer-0"), ("b", "peer-0"), ("c", "peer-1")}
