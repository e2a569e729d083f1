"""Parameters that are shares of a whole."""

from typing import Any

from orchestrator.parameters import parameter


def share(default: float, *, doc: str) -> Any:
    """A `parameter` from 0 to 1: a probability, or the share of what is counted."""
    return parameter(default, minimum=0.0, maximum=1.0, doc=doc)
