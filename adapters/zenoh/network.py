"""Zenoh as the network between hosts."""

import secrets
from collections.abc import Callable, Mapping

import zenoh
from typing_extensions import override

from adapters.zenoh.access import access_of_runs
from adapters.zenoh.credentials import session_settings
from adapters.zenoh.hosts import ZenohHosts
from adapters.zenoh.lobby import ZenohLobby
from adapters.zenoh.session import LEASE
from orchestrator.errors import Problem, ScenarioError
from orchestrator.hosts_file import RUN, Hosts
from orchestrator.network import HostsTransport, Lobby, Network, Reception, Wanted


class ZenohNetwork(Network):
    """Whoever serves listens at the endpoint of its host; the run connects to each of them.

    Nobody is looked for and nobody is forwarded: two hosts of one run know nothing of each other.
    """

    @override
    def transport(
        self, hosts: Hosts, wanted: Mapping[str, Wanted], run: str, tell: Callable[[str], None]
    ) -> HostsTransport:
        return ZenohHosts(hosts, wanted, run, tell)

    @override
    def lobby(self, hosts: Hosts, host: str, reception: Reception) -> Lobby:
        endpoint = hosts.endpoint(host)
        settings = {
            "mode": "peer",
            "listen/endpoints": [str(endpoint)],
            "transport/link/tx/lease": int(1000 * LEASE),
            **session_settings(hosts, host, listens=True),
            **(access_of_runs(RUN) if endpoint.protocol == "tls" else {}),
        }
        try:
            return ZenohLobby(settings, reception, secrets.token_hex(8))
        except zenoh.ZError as error:
            where = hosts.document.value(("hosts", host, "endpoint"))
            what = f"hosts.{host}.endpoint: cannot listen there: {_brief(str(error))}"
            raise ScenarioError([Problem(where, what)]) from None


def _brief(text: str) -> str:
    """What Zenoh says, without the places in its sources."""
    return text.partition(" at /")[0].strip()
