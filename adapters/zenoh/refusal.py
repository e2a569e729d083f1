"""Why a host that listens does not talk to this run, which Zenoh keeps to itself."""

import socket
import ssl
from typing import Final

from orchestrator.hosts_file import RUN, Hosts

_PATIENCE: Final = 1.0
"""How long to wait for a connection, and for what the other side objects to [s]."""
_ADVICE: Final = "; both sides need credentials of one authority that are valid (`nlosim keys`)"


def refusal(hosts: Hosts, host: str) -> str:
    """Whose certificate is not accepted, and why; empty if that is not why nobody answers.

    Args:
        hosts: of the hosts file.
        host: that does not answer.

    Raises:
        ScenarioError: a file of the credentials is missing.
    """
    endpoint, own = hosts.endpoint(host), hosts.credentials(RUN)
    if endpoint.protocol != "tls" or own is None:
        return ""
    address = endpoint.address.strip("[]")
    try:
        context = ssl.create_default_context(cafile=own.authority)
        context.load_cert_chain(own.certificate, own.key)
        with (
            socket.create_connection((address, endpoint.port), _PATIENCE) as plain,
            context.wrap_socket(plain, server_hostname=address) as encrypted,
        ):
            encrypted.settimeout(_PATIENCE)
            encrypted.recv(1)  # the other side looks at certificates after this side is content
    except ssl.SSLCertVerificationError as error:
        return f"its certificate is not accepted here: {error.verify_message}{_ADVICE}"
    except ssl.SSLError as error:
        if "ALERT" in str(error.reason):
            why = error.reason.partition("ALERT_")[2].replace("_", " ").lower()
            return f"it does not accept `{own.certificate}`: {why}{_ADVICE}"
    except OSError:  # nobody listens; or there is nothing to object to, and it waits
        pass
    return ""
