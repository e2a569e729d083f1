"""What a command came to, for people and for programs; and the meaning of exit codes."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


class Exit(enum.IntEnum):
    """Exit codes; scripts rely on them."""

    DONE = 0
    NOT_PASSED = 1  # a check ran to its end, and what it checks did not pass
    WRONG_INPUT = 2
    COMPONENT_FAILED = 3
    INTERRUPTED = 4
    INTERNAL_ERROR = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """The end of a command.

    Attributes:
        text: for standard output, or for standard error if something went wrong.
        data: the one JSON object of `--json`.
    """

    text: str
    data: Mapping[str, Any]
    exit_code: Exit = Exit.DONE


def failure(
    kind: str, exit_code: Exit, message: str, *, text: str | None = None, **details: Any
) -> Outcome:
    """The outcome of a command that failed.

    Args:
        kind: a word for programs, e.g. `scenario`.
        exit_code: its number.
        message: what went wrong.
        text: what people read, if it is more than `message`.
        details: further fields of the JSON object's `error`.
    """
    error = {"kind": kind, "exit_code": int(exit_code), "message": message, **details}
    return Outcome(
        text=f"error: {message}" if text is None else text,
        data={"error": error},
        exit_code=exit_code,
    )
