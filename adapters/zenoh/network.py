"""Zenoh as the network between hosts."""

import errno
import re
import secrets
from collections.abc import Callable, Mapping
from typing import Final

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

_OF_THE_SYSTEM: Final = re.compile(r"([^:\[\]]+) \(os error (\d+)\)")
"""What the operating system says, somewhere in what Zenoh says."""

_ADVICE: Final = {
    errno.EADDRINUSE: "end who listens there, e.g. another `nlosim serve`, or write another port",
    errno.EADDRNOTAVAIL: "write an address that this machine has",
    errno.EACCES: "write a port from 1024 on",
}
"""What can be done about it."""


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
    """What is wrong, of all that Zenoh says, and what to do about it if that is known."""
    found = _OF_THE_SYSTEM.search(text)
    if found is None:
        return text.partition(" at /")[0].strip()  # without the places in its sources
    reason, advice = found[1].strip(), _ADVICE.get(int(found[2]), "")
    return f"{reason}; {advice}" if advice else reason
