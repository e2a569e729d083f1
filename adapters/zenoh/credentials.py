"""How the Zenoh sessions of hosts prove who they are: mutual TLS, from a folder of credentials."""

from typing import Any, Final

from orchestrator.hosts_file import Hosts

_TLS: Final = "transport/link/tls"


def session_settings(hosts: Hosts, name: str, *, listens: bool) -> dict[str, Any]:
    """What a Zenoh session between hosts is opened with beside the common settings.

    Args:
        hosts: of the hosts file.
        name: of the party: a host, or `orchestrator.hosts_file.RUN`.
        listens: whether others connect to it; else it connects to others.

    Returns:
        Zenoh's settings by their paths; none where there are no credentials.

    Raises:
        ScenarioError: a file of the credentials is missing.
    """
    own = hosts.credentials(name)
    if own is None:
        return {}
    side = "listen" if listens else "connect"
    return {
        f"{_TLS}/root_ca_certificate": str(own.authority),
        f"{_TLS}/enable_mtls": True,
        f"{_TLS}/{side}_certificate": str(own.certificate),
        f"{_TLS}/{side}_private_key": str(own.key),
        f"{_TLS}/verify_name_on_connect": True,
    }
