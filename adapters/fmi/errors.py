"""Failures of an FMU during a run."""

from collections.abc import Iterable

from adapters.fmi.messages import MessageLog
from orchestrator.errors import CosimError


class FmuError(CosimError):
    """An FMI function failed; the message names it and carries what the FMU logged."""


def failure(function: str, status: str, log: MessageLog, hint: str = "") -> FmuError:
    """The error for `function` that returned `status`; takes the messages."""
    text = log.reason
    log.recent.clear()
    return FmuError(f"{function} returned {status}: {text}{hint}")


def listed(names: Iterable[str]) -> str:
    """Names in a sentence."""
    return ", ".join(f"`{name}`" for name in names)
