"""Times in scenario files: what may be written, and what it means in nanoseconds."""

from typing import Annotated, Final

from pydantic import BeforeValidator, WithJsonSchema

from orchestrator.scenario import units
from orchestrator.timebase import Duration

PATTERN: Final = r"^\s*[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?\s*[a-zA-Zµμ]+\s*$"


def duration(value: object) -> Duration:
    """The time that `value` says [ns].

    Raises:
        ValueError: it says none.
    """
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"expected a time such as `50 ms`, got {value!r}")  # noqa: TRY004
    return units.duration(value)


def positive(value: object) -> Duration:
    """The time that `value` says [ns].

    Raises:
        ValueError: it says none, or one that is not above 0.
    """
    time = duration(value)
    if time <= 0:
        raise ValueError(f"must be longer than 0 s, got {units.format_duration(time)}")
    return time


def not_negative(value: object) -> Duration:
    """The time that `value` says [ns].

    Raises:
        ValueError: it says none, or one below 0.
    """
    time = duration(value)
    if time < 0:
        raise ValueError(f"must not be negative, got {units.format_duration(time)}")
    return time


def time_schema(*examples: str) -> WithJsonSchema:
    """The JSON Schema of a time."""
    return WithJsonSchema(
        {
            "anyOf": [{"type": "number"}, {"type": "string", "pattern": PATTERN}],
            "examples": list(examples),
        }
    )


Moment = Annotated[int, BeforeValidator(duration), time_schema("0 s", "20 s")]
StepSize = Annotated[int, BeforeValidator(positive), time_schema("50 ms", "0.1 s")]
