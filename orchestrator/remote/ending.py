"""Requests for the end of a run, as documents."""

from collections.abc import Mapping
from typing import Any

from orchestrator.capabilities import EndRequest


def request_to_document(request: EndRequest | None) -> dict[str, Any]:
    """What a reply says of a request for the end of the run; nothing, if there is none."""
    return {} if request is None else {"end": {"time": request.time, "why": request.why}}


def request_from_document(document: Mapping[str, Any]) -> EndRequest | None:
    """What `request_to_document` described."""
    return EndRequest(**document["end"]) if "end" in document else None
