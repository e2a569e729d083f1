"""What each peer may say and hear at the orchestrator's session; everything else is refused there.

A peer is told apart by what it proved when it connected: it knows the password of a user, or has
the key of a certificate. Zenoh's access control then looks at every message and declaration of that
connection, in both directions. So a component that subscribes to others hears nothing of them, and
what it publishes for them goes nowhere.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from adapters.zenoh.session import Keys, meeting_key, served_key

ANY: Final = "*"
"""All of them. In the place of a run's name: a process that takes another's place has a new one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Peer:
    """Who may connect, and for which components. It has either a user or a certificate.

    Attributes:
        components: hosted by this peer, by name.
        user: whose password it knows.
        certificate: the common name of its certificate.
    """

    components: Sequence[str]
    user: str = ""
    certificate: str = ""

    def __post_init__(self) -> None:
        if bool(self.user) == bool(self.certificate):
            raise ValueError("a peer has either a user or a certificate")


def access(peers: Sequence[Peer]) -> Mapping[str, Any]:
    """Settings of a run's session: each of `peers` has its own keys, and nobody anything else.

    Args:
        peers: processes or hosts that may connect. They have no component in common.
    """
    return _control(peers, lambda component: _commanded(component, "ingress", "egress"))


def access_of_runs(certificate: str) -> Mapping[str, Any]:
    """Settings of a session that serves components: only runs may ask for them and command them.

    Args:
        certificate: the common name of the certificate of runs.
    """
    peer = Peer(components=[ANY], certificate=certificate)
    return _control([peer], lambda component: _served(component, "egress", "ingress"))


_Rule: TypeAlias = tuple[str, Sequence[str], str]
"""A flow, the messages that it may carry, and their key."""


def _control(
    peers: Sequence[Peer], rules_of: Callable[[str], Iterator[_Rule]]
) -> Mapping[str, Any]:
    rules: list[Mapping[str, Any]] = []
    subjects: list[Mapping[str, Any]] = []
    policies: list[Mapping[str, Any]] = []
    for number, peer in enumerate(peers):
        subject = f"peer-{number}"
        if peer.user:
            subjects.append({"id": subject, "usernames": [peer.user]})
        else:
            subjects.append({"id": subject, "cert_common_names": [peer.certificate]})
        own = [
            {
                "id": f"{subject}-{component}-{index}",
                "permission": "allow",
                "flows": [flow],
                "messages": list(messages),
                "key_exprs": [key],
            }
            for component in peer.components
            for index, (flow, messages, key) in enumerate(rules_of(component))
        ]
        rules += own
        if own:
            policies.append({"subjects": [subject], "rules": [rule["id"] for rule in own]})
    control = {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }
    return {"access_control": control}


_LOOKS: Final = ("declare_liveliness_subscriber", "liveliness_query")
"""What it takes to look after tokens."""


def _commanded(component: str, out: str, back: str) -> Iterator[_Rule]:
    """Commands and replies; a host's own messages flow `out`, as this session sees it."""
    keys = Keys(ANY, component)
    yield out, ["put"], keys.output
    yield out, ["declare_subscriber"], keys.command
    yield out, ["liveliness_token"], keys.alive(ANY)
    yield back, ["put"], keys.command
    yield back, ["declare_subscriber"], keys.output
    yield back, _LOOKS, keys.alive(ANY)


def _served(component: str, out: str, back: str) -> Iterator[_Rule]:
    """All of `_commanded`, and how a run meets a component and hears of its end and its log."""
    keys = Keys(ANY, component)
    yield from _commanded(component, out, back)
    yield out, ["put"], keys.end
    yield out, ["put"], keys.log
    yield out, ["liveliness_token"], served_key(component, ANY)
    yield out, ["declare_queryable", "reply"], meeting_key(component)
    yield out, _LOOKS, keys.run_alive(ANY)
    yield back, ["declare_subscriber"], keys.end
    yield back, ["declare_subscriber"], keys.log
    yield back, _LOOKS, served_key(component, ANY)
    yield back, ["query"], meeting_key(component)
    yield back, ["liveliness_token"], keys.run_alive(ANY)
