"""Whether anybody listens: refused several times in a row, and nothing less."""

import socket
from unittest.mock import patch

import pytest

from orchestrator.hosts_file import HostEndpoint
from tests.adapters.hosting import free_port, until

pytest.importorskip("zenoh", reason="eclipse-zenoh is not installed")
knock = pytest.importorskip("adapters.zenoh.knock")


@pytest.fixture(autouse=True)
def soon() -> object:
    with patch.object(knock, "_PAUSE", 0.02):
        yield


def test_a_port_at_which_nobody_listens_is_refused_after_four_attempts() -> None:
    found = knock.Knock(HostEndpoint("tcp", "127.0.0.1", free_port()))
    said: list[tuple[bool, int]] = []

    def knocking() -> bool:
        said.append((found.is_refused, found._refusals))
        return said[-1][0]

    assert until(knocking, 5)
    assert all(is_refused == (refusals >= 4) for is_refused, refusals in said)
    assert said[0][1] <= 1
    found.forget()
    assert not found.is_refused


def test_a_port_at_which_somebody_listens_is_not_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        endpoint = HostEndpoint("tls", "127.0.0.1", listening.getsockname()[1])
        found = knock.Knock(endpoint)
        assert not until(lambda: bool(found.is_refused), 0.5)
        found.forget()


def test_who_listens_again_is_not_refused() -> None:
    """Refusals count in a row."""
    port = free_port()
    found = knock.Knock(HostEndpoint("tcp", "127.0.0.1", port))
    with patch.object(knock, "_REFUSALS", 1000):  # not yet, however often this machine stumbles
        assert until(lambda: not found.is_refused and found._refusals >= 2, 5)
        with socket.create_server(("127.0.0.1", port)):
            assert until(lambda: not found.is_refused and found._refusals == 0, 5)
            found.forget()
    assert not found.is_refused


def test_a_name_that_nobody_knows_refuses_nothing() -> None:
    found = knock.Knock(HostEndpoint("tcp", "no-such-host.invalid", 7447))
    assert not until(lambda: bool(found.is_refused), 0.2)
