"""Times in scenario files: what may be written, and what it means in nanoseconds."""

from typing import Annotated, Final

from pydantic import BeforeValidator, PlainValidator, WithJsonSchema

from orchestrator.scenario import units
from orchestrator.timebase import Duration, StepSize as Span

_DECIMAL: Final = r"^\s*[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][-+]?[0-9]{1,3})?\s*[a-zA-Zµμ]+\s*$"

_FRACTION: Final = r"^\s*[0-9]{1,18}\s*/\s*[0-9]{1,18}\s*[a-zµμ]+\s*$"


def _time(value: object) -> str | float:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise ValueError(f"expected a time such as `50 ms`, got {value!r}")  # noqa: TRY004
    return value


def duration(value: object) -> Duration:
    """The time that `value` says [ns].

    Raises:
        ValueError: it says none.
    """
    return units.duration(_time(value))


def positive(value: object) -> Span:
    """The time that `value` says [ns], as an exact fraction where it is no whole number.

    Raises:
        ValueError: it says none, or one that is not above 0.
    """
    time = units.span(_time(value))
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
    """The JSON Schema of a time of whole nanoseconds."""
    return WithJsonSchema(
        {
            "anyOf": [{"type": "number"}, {"type": "string", "pattern": _DECIMAL}],
            "examples": list(examples),
        }
    )


def span_schema(*examples: str) -> WithJsonSchema:
    """The JSON Schema of a time that may be a fraction."""
    patterns = [{"type": "string", "pattern": p} for p in (_DECIMAL, _FRACTION)]
    return WithJsonSchema({"anyOf": [{"type": "number"}, *patterns], "examples": list(examples)})


Moment = Annotated[int, BeforeValidator(duration), time_schema("0 s", "20 s")]
StepSize = Annotated[Span, PlainValidator(positive), span_schema("50 ms", "0.1 s", "1/60 s")]
