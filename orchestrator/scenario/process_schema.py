"""What scenario files say of processes and hosts: who has one, and what it may take."""

import re
from typing import Annotated, Any, Final

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    JsonValue,
    PlainValidator,
    WithJsonSchema,
)

from orchestrator.byte_size import PATTERN, parse_size
from orchestrator.limits import OnFailure
from orchestrator.scenario.isolation import ISOLATIONS, Isolation
from orchestrator.scenario.time_schema import duration, time_schema
from orchestrator.timebase import Duration, format_duration


def _wall_time(value: object) -> Duration:
    time = duration(value)
    if time <= 0:
        raise ValueError(f"must be longer than 0 s, got {format_duration(time)}")
    return time


_WallTime = Annotated[int, BeforeValidator(_wall_time), time_schema("5 s", "2 min")]


def _isolation(value: object) -> Isolation:
    if isinstance(value, Isolation):
        return value
    if not isinstance(value, bool | str) or value not in ISOLATIONS:
        raise ValueError(f"expected `true`, `false` or `on-request`, got {value!r}")
    return ISOLATIONS[value]


_HOST: Final = r"^[A-Za-z0-9_{][A-Za-z0-9_{}-]*$"


def _host(text: str) -> str:
    if re.fullmatch(_HOST, text) is None:
        rest = "write letters, digits, `_` and `-` (not first)"
        raise ValueError(f"`{text}` cannot be the name of a host; {rest}")
    return text


HostName = Annotated[
    str, AfterValidator(_host), WithJsonSchema({"type": "string", "pattern": _HOST})
]


def _shown(default: JsonValue) -> Any:
    """What the JSON Schema calls the default: as a file writes it."""
    return Field(json_schema_extra={"default": default})


class DeadlineEntry(BaseModel):
    """How long a component in a process of its own may take, in wall time."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True
    )

    create: Annotated[_WallTime | None, Field(examples=["2 min"])] = None
    """The time to start the process and to create the component; that of `setup`, unless it is
    said."""

    setup: Annotated[_WallTime, _shown("60 s")] = 60_000_000_000
    """The time to set the component up, and to initialise it."""

    step: Annotated[_WallTime, _shown("30 s")] = 30_000_000_000
    """The time for one step."""


def _deadline(value: object) -> object:
    return value if isinstance(value, dict | DeadlineEntry) else {"step": value}


def _memory(value: object) -> int | None:
    if value is None:
        return None
    if not isinstance(value, str):
        raise ValueError(f"expected an amount of memory such as `512 MB`, got {value!r}")  # noqa: TRY004
    return parse_size(value)


Process = Annotated[
    Isolation,
    PlainValidator(_isolation),
    WithJsonSchema({"enum": [True, False, "on-request"]}),
]

Deadline = Annotated[
    DeadlineEntry,
    BeforeValidator(_deadline, json_schema_input_type=_WallTime | DeadlineEntry),
    _shown({"setup": "60 s", "step": "30 s"}),
]


def _on_failure(value: object) -> OnFailure:
    if isinstance(value, OnFailure):
        return value
    try:
        return OnFailure(value)
    except ValueError:
        raise ValueError(f"expected `abort` or `restart`, got {value!r}") from None


Failure = Annotated[
    OnFailure,
    PlainValidator(_on_failure),
    WithJsonSchema({"enum": [each.value for each in OnFailure]}),
    _shown(OnFailure.ABORT.value),
]

Memory = Annotated[
    int | None,
    PlainValidator(_memory),
    WithJsonSchema({"type": "string", "pattern": PATTERN, "examples": ["512 MB", "2 GiB"]}),
]
