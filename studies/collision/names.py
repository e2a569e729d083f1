"""What policies are called in figures and tables."""

from collections.abc import Mapping
from typing import Any, Final

from studies.collision.condition import COOPERATIVE
from studies.method.style import LOOKS

_POLICIES: Final = {
    "expert": "expert, sees everything",
    "blind": "blind, network",
    "blind-rule": "blind, rules",
    "rule-based": "rules, shared objects",
    "object-list": "rules, CPMs",
    "early-fusion": "early fusion",
    COOPERATIVE: "cooperative",
}


def policy_key(row: Mapping[str, Any]) -> str:
    """As its level is called: `cooperative-16`."""
    compression = row["compression"]
    return str(row["policy"]) if not compression else f"{row['policy']}-{compression}"


def policy_name(row: Mapping[str, Any]) -> str:
    """For readers."""
    name = _POLICIES.get(row["policy"], row["policy"])
    return f"{name}, compression {row['compression']}" if row["compression"] else name


def relay_name(relay: str) -> str:
    """For readers."""
    return LOOKS[relay].name if relay in LOOKS else relay
