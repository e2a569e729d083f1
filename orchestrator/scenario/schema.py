"""The shape of a scenario file; pydantic is used for it and for experiment files only.

The docstrings of the fields are the text of the JSON Schema that editors show.
"""

import re
from typing import Annotated, Any, Final, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    WithJsonSchema,
)

from orchestrator.limits import OnFailure
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.process_schema import (
    Deadline,
    DeadlineEntry,
    Failure,
    HostName,
    Memory,
    Process,
)
from orchestrator.scenario.time_schema import (
    Moment,
    StepSize,
    not_negative,
    positive,
    time_schema,
)

VERSION: Final = 1
"""The version of the form of scenario files; a change that breaks them has another number."""

_NAME: Final = r"^[A-Za-z0-9_][A-Za-z0-9_-]*$"
_FAMILY: Final = r"^[A-Za-z][A-Za-z0-9_-]*$"

Name = Annotated[str, Field(pattern=_NAME)]
_PORT: Final = r"^[A-Za-z0-9_{][A-Za-z0-9_{}-]*\.[^.\s].*$"
Port = Annotated[
    str,
    Field(pattern=_PORT, examples=["traffic.vehicle"]),
]
Text = Annotated[str, Field(min_length=1)]


def is_family(text: str) -> bool:
    """Whether a family may have this name."""
    return re.fullmatch(_FAMILY, text) is not None


def is_member(text: str) -> bool:
    """Whether a member of a family may have this name."""
    return re.fullmatch(_NAME, text) is not None


def _family(text: str) -> str:
    if not is_family(text):
        rest = "write a letter, then letters, digits, `_` and `-`"
        raise ValueError(f"`{text}` cannot be the name of a family; {rest}")
    return text


def _member(text: str) -> str:
    if not is_member(text):
        rest = "write letters, digits, `_` and `-` (not first)"
        raise ValueError(f"`{text}` cannot be the name of a member; {rest}")
    return text


Family = Annotated[str, AfterValidator(_family), WithJsonSchema({"pattern": _FAMILY})]
Member = Annotated[
    str, AfterValidator(_member), WithJsonSchema({"type": "string", "pattern": _NAME})
]
Members = Annotated[list[Member], Field(min_length=1, json_schema_extra={"uniqueItems": True})]


class _Mapping(BaseModel):
    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, use_attribute_docstrings=True
    )


class TimeSpan(_Mapping):
    """When the simulation starts and stops."""

    start: Moment = 0
    """The first communication point, as a time with its unit or a number of seconds."""

    stop: Moment
    """The last communication point. Every step size must fit between start and stop a whole
    number of times."""

    until: Annotated[Port | None, Field(examples=["traffic.encounter.over"])] = None
    """A scalar Boolean output, `component.connector`: the run ends at the first communication
    point at which it is true, and at `stop` at the latest. `null`: only at `stop`."""


class Coupling(_Mapping):
    """Who steps when, and which outputs it sees (the co-simulation algorithm).

    Further keys are parameters of the algorithm; `nlosim components NAME` lists them.
    """

    model_config = ConfigDict(extra="allow")

    algorithm: Annotated[
        Text, Field(examples=["gauss-seidel", "jacobi", "fixed-point", "quasi-newton", "adaptive"])
    ] = "gauss-seidel"
    """The name of an installed algorithm. `gauss-seidel`: components take turns, in the given
    `order` or that of direct feedthrough, and see the newest outputs of those before them.
    `jacobi`: all see the outputs of the previous communication point, so the order is irrelevant
    and processes work at the same time. `fixed-point`: those that depend on each other repeat
    their steps until they agree; `quasi-newton`: the same, also where that does not contract.
    `adaptive`: those that depend on each other make as many steps as a tolerance asks for."""


class ComponentEntry(_Mapping):
    """One component: what it is, its communication step size and its parameters."""

    model_config = ConfigDict(json_schema_extra={"not": {"required": ["type", "fmu"]}})

    type: Annotated[Text | None, Field(examples=["sumo-traffic", "my_parts:Wheel"])] = None
    """The name of an installed component type; `nlosim components` lists them. Or `module:Class`:
    a subclass of `Component` in `module.py` beside this file."""

    fmu: Annotated[Text | None, Field(examples=["units/channel.fmu"])] = None
    """Instead of `type`: an FMU for co-simulation (FMI 2.0 or 3.0), relative to this file."""

    each: Annotated[Text | None, Field(examples=["ego"])] = None
    """A family: the component stands for one component, `NAME-MEMBER`, for each member. In what
    it says, `{ego}` is the member."""

    step: StepSize
    """The communication step size."""

    process: Process = Isolation.NEVER
    """Whether the component runs in a process of its own: `true`, `false`, or `on-request`, which
    means: where `nlosim run --transport` names a transport. The results are the same bytes."""

    host: Annotated[HostName | None, Field(examples=["gpu"])] = None
    """The host on which `nlosim serve` has the component, where `nlosim run --hosts` names a hosts
    file; without one the component runs here. The results are the same bytes."""

    deadline: Deadline = DeadlineEntry()
    """How long a component in a process of its own, or on a host, may take, in wall time: a mapping
    of `create`, `setup` and `step`, or a time, which is that of `step`. What takes longer is ended,
    and so is the run, with a message."""

    memory: Memory = None
    """How much memory a component in a process of its own may have for itself. What has more is
    ended, and so is the run, with a message (Linux)."""

    on_failure: Failure = OnFailure.ABORT
    """What is done when the process of a component is lost. `restart` starts another one, which
    goes on from the last checkpoint to the same results; the component must be able to hand its
    state over. An error that the component reports ends the run all the same."""

    without: Annotated[list[Text], Field(examples=[["building", "road"]])] = []
    """Inputs, or groups of them, that nothing shall drive. An input that the component needs must
    be connected or named here; `nlosim graph` says what its absence means."""

    parameters: dict[str, Any] = {}
    """Parameters by name; `nlosim components TYPE` lists them. A number is in the unit of the
    parameter; text such as `26 dBm` or `400 mW` is converted."""


_PORT_SCHEMA: Final = WithJsonSchema({"type": "string", "pattern": _PORT})


def _ends_first(schema: dict[str, Any]) -> None:
    """One of the sources is required, and stands before what happens on the way."""
    keys = schema["properties"]
    sources = ("from", "sum", "value")
    schema["properties"] = {key: keys[key] for key in (*sources, "to")} | keys
    schema["oneOf"] = [{"required": [key]} for key in sources]


class Way(_Mapping):
    """What happens to a value on its way."""

    gain: float = 1.0
    """Factor on the value, which has been converted to the unit of the input."""

    offset: float = 0.0
    """Added after the gain, in the unit of the input."""

    convert: bool = True
    """Whether the unit of the output is converted to that of the input. If not, numbers are taken
    as they are, whatever the units say."""

    delay: Annotated[int, BeforeValidator(not_negative), time_schema("20 ms")] = 0
    """How old a value is at least when it is read. Before the first such value the input keeps its
    start value."""

    sample: Annotated[int, BeforeValidator(positive), time_schema("100 ms")] = 0
    """Values are read at multiples of this time since the start, and held in between. A multiple of
    the step of the target. Without it values are read in every step."""


class Term(Way):
    """An output that is added to others."""

    source: Annotated[Port, Field(alias="from", examples=["a.x"])]
    """`component.connector`, or elements of it."""


def _term(value: object) -> object:
    return {"from": value} if isinstance(value, str) else value


class ConnectionEntry(Way):
    """An output that drives an input, or all outputs of a group that drive its inputs.

    In place of `from`: `sum` of several outputs, or a constant `value`.
    """

    model_config = ConfigDict(json_schema_extra=_ends_first)

    source: Annotated[Port | None, Field(alias="from"), _PORT_SCHEMA] = None
    """`component.connector`, elements of it such as `a.x[2]`, `a.x[0:3]`, or a group such as
    `traffic.vehicle`."""

    terms: Annotated[
        list[Annotated[Term, BeforeValidator(_term, json_schema_input_type=Port | Term)]] | None,
        Field(alias="sum", min_length=1, examples=[["a.x", {"from": "b.y", "gain": -1}]]),
    ] = None
    """Outputs that are added; each may have a `gain`, an `offset`, a `delay` and a `sample`."""

    value: Annotated[Any, Field(examples=[3.0, "30 km/h", [1, 0]])] = None
    """A constant: a number, text with a unit, `true` or `false`, or a list of them."""

    target: Annotated[Port, Field(alias="to")]
    """`component.connector`, elements of it, or a group: every input beneath it is connected to the
    output of the same name beneath `from`. Elements without a connection keep their start value."""


class Recording(_Mapping):
    """Which outputs are recorded, by patterns of `component.connector` (`*`, `?`, `[...]`)."""

    include: Annotated[list[Text], Field(examples=[["*"]])] = ["*"]
    """What matches one of these patterns is recorded, unless `exclude` names it."""

    exclude: Annotated[list[Text], Field(examples=[["lidar.points"]])] = []
    """What matches one of these patterns is not recorded."""


class ReportEntry(_Mapping):
    """A report and its parameters."""

    type: Text
    """The name of an installed report."""

    parameters: dict[str, Any] = {}
    """Which there are depends on the report."""


def _report(value: object) -> object:
    return {"type": value} if isinstance(value, str) else value


Report = Annotated[
    ReportEntry | None,
    BeforeValidator(_report, json_schema_input_type=Text | ReportEntry | None),
    Field(examples=["red-light"]),
]


class ScenarioFile(_Mapping):
    """A co-simulation: components, their parameters and connections, and what is recorded."""

    version: Annotated[Literal[1], Field(alias="schema")]
    """The version of the form of this file."""

    extends: Annotated[
        Text | None,
        Field(examples=["red_light.yaml", "red_light"]),
        WithJsonSchema({"type": "string", "minLength": 1}),
    ] = None
    """Another scenario file, relative to this one, or an installed scenario by its name, that says
    what this one leaves open."""

    title: Annotated[Text, Field(examples=["Red light"])]
    """One line for people."""

    description: str = ""
    """What the scenario is about."""

    time: TimeSpan

    seed: Annotated[int, Field(ge=0)] = 1
    """Every component draws from a random stream of its own, made from this number and its
    name. `nlosim run --seed` overrides it."""

    coupling: Coupling = Coupling()

    each: Annotated[dict[Family, Members], Field(examples=[{"ego": ["first", "second"]}])] = {}
    """Families: by name, the members in order, e.g. the ego vehicles. What names a family is
    written out for each member."""

    components: Annotated[dict[Name, ComponentEntry], Field(min_length=1)]
    """The components by name. Their order breaks ties in the order of stepping."""

    connections: list[ConnectionEntry] = []
    """Inputs without a connection keep their start value."""

    recording: Recording = Recording()

    measures: Annotated[
        dict[Name, dict[str, Any] | None] | None,
        Field(examples=[{"longest-gap": {"signal": "a.y"}}]),
    ] = None
    """Installed measures by name, each with its parameters: numbers about the run in
    `metrics.json`. `type` among the parameters names the measure if that is not the name, so that
    one can be asked twice. Without this key `nlosim run` asks all whose signals are recorded; `{}`
    asks none."""

    tables: Annotated[
        list[Literal["csv", "parquet"]] | None, Field(examples=[["csv", "parquet"]])
    ] = None
    """The formats of the tables of measures. Without this key: CSV, and Parquet if pyarrow is
    installed."""

    report: Report = None
    """The installed report that makes metrics and a figure of the recording: its name, or `type`
    and `parameters`."""


def json_schema() -> dict[str, Any]:
    """The JSON Schema of scenario files (draft 2020-12), for editors.

    What a file must say is asked of files that extend no other one; the rest is in both.
    """
    generated = whole_schema()
    entry, span = (generated["$defs"][name] for name in ("ComponentEntry", "TimeSpan"))
    whole = {
        "required": generated.pop("required"),
        "properties": {
            "time": {"required": span.pop("required")},
            "components": {
                "additionalProperties": {
                    "required": entry.pop("required"),
                    "anyOf": [{"required": ["type"]}, {"required": ["fmu"]}],
                }
            },
        },
    }
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **generated,
        "title": "nlosim scenario",
        "required": ["schema"],
        "if": {"not": {"required": ["extends"]}},
        "then": whole,
    }


def whole_schema() -> dict[str, Any]:
    """The JSON Schema as pydantic has it: of a scenario file that extends no other one."""
    return ScenarioFile.model_json_schema(by_alias=True)
