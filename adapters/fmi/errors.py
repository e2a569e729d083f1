"""Failures of an FMU during a run."""

from collections import deque
from collections.abc import Iterable

from orchestrator.errors import CosimError


class FmuError(CosimError):
    """An FMI function failed; the message names it and carries what the FMU logged."""


def failure(function: str, status: str, messages: "deque[str]", hint: str = "") -> FmuError:
    """The error for `function` that returned `status`; takes the messages."""
    text = "; ".join(messages) or "the FMU logged no reason"
    messages.clear()
    return FmuError(f"{function} returned {status}: {text}{hint}")


def listed(names: Iterable[str]) -> str:
    """Names in a sentence."""
    return ", ".join(f"`{name}`" for name in names)
