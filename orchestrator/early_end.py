"""Why a run ended before its stop time without failing."""

from collections.abc import Mapping
from dataclasses import dataclass

from orchestrator.capabilities import EndRequest
from orchestrator.timebase import Time, seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class EarlyEnd:
    """Why a run ended before its stop time.

    Attributes:
        by: the output that is true, or the names of the components that asked for it.
        text: a sentence, with the time.
    """

    by: tuple[str, ...]
    text: str

    @classmethod
    def behind_steps(cls, requests: Mapping[str, EndRequest]) -> "EarlyEnd":
        """Components asked for it, at least one, at the end of their steps."""
        return cls(
            by=tuple(requests),
            text="; ".join(_sentence(name, request) for name, request in requests.items()),
        )

    @classmethod
    def within_step(cls, name: str, request: EndRequest, reached: Time) -> "EarlyEnd":
        """A component asked for it that did not come to the end of its step.

        Args:
            name: of the component.
            request: what it asked for.
            reached: where the run ended [ns].
        """
        last = f"t = {seconds(reached):.9g} s"
        what = f"that is within its step, so the run ends before, at {last}"
        return cls(by=(name,), text=f"{_sentence(name, request)}; {what}")


def _sentence(name: str, request: EndRequest) -> str:
    return f"`{name}` asks for the end ({request.why}) at t = {seconds(request.time):.9g} s"
