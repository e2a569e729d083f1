"""What a scenario may say about how an FMU is run: parameters `fmi.*` of the component."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any, Final

from adapters.fmi import starts as starts_
from adapters.fmi.description import HIGHEST_DEGREE, FmuDescription
from adapters.fmi.kind import Kind
from adapters.fmi.model_exchange.options import (
    parameters as integration_parameters,
    problems as integration_problems,
)
from adapters.fmi.variable import DTYPES, FmuVariable
from orchestrator.errors import ParameterError
from orchestrator.parameters import Parameter, ParameterProblem
from orchestrator.patterns import meant
from orchestrator.suggestion import suggestion

PREFIX: Final = "fmi."

RETRY_HINT: Final = "; `fmi.smallest_step` lets it be tried again, in shorter steps"
"""What the error of a discarded step adds, where the FMU could make it in several."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How an FMU is run.

    Attributes:
        tolerance: relative, for the solver of the FMU; `None`: its own.
        locals: names or patterns of variables that are outputs of the component, too.
        input_degree: of the polynomials that inputs follow over a step, at most; 0: they are held.
        output_slopes: whether derivatives of outputs are asked for.
        intermediate: names or patterns of variables that are logged within steps.
        smallest_step: that a discarded step may be cut down to [s]; `None`: it is not.
        event_mode: whether the events of an FMU that lets us are handled here; those of an FMU
            with clocks always are.
        kind: the interface that is used; `None`: what the FMU has.
        solver: with Model Exchange, the name of a solver.
        step: with Model Exchange, the longest step of the solver [s].
        logging: whether the FMU is asked to log all it can.
    """

    tolerance: float | None = None
    locals: tuple[str, ...] = ()
    input_degree: int = HIGHEST_DEGREE
    output_slopes: bool = True
    intermediate: tuple[str, ...] = ()
    smallest_step: float | None = None
    event_mode: bool = False
    kind: str | None = None
    solver: str | None = None
    step: float | None = None
    logging: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Said:
    """What a scenario says about one FMU, sorted.

    Attributes:
        parameters: of the FMU, by name.
        starts: start values, by variable.
        options: how it is run.
    """

    parameters: Mapping[str, Any]
    starts: Mapping[str, Any]
    options: Options

    @classmethod
    def of(cls, description: FmuDescription, values: Mapping[str, Any]) -> "Said":
        """Sort the parameters of a component; a name that the FMU has is the FMU's."""
        own = {n: v for n, v in values.items() if n in description.variables}
        others = {n: v for n, v in values.items() if n not in own}
        options = {n.removeprefix(PREFIX): v for n, v in others.items() if n.startswith(PREFIX)}
        starts = {
            n.removeprefix(starts_.PREFIX): v
            for n, v in others.items()
            if n.startswith(starts_.PREFIX)
        }
        return cls(parameters=own, starts=starts, options=Options(**options))


def _default(description: FmuDescription) -> str:
    is_integrated = Kind.MODEL_EXCHANGE in description.kinds
    return ", with model-exchange that of its default experiment, or 1e-6" if is_integrated else ""


def option_parameters(description: FmuDescription) -> dict[str, Parameter]:
    """The options that make a difference to this FMU, by name."""
    found = {
        "tolerance": Parameter(
            type=float | None,
            default=None,
            minimum=0.0,
            doc="relative tolerance for its solver; its own choice by default"
            + _default(description),
            is_optional=True,
        ),
        "logging": Parameter(
            type=bool,
            default=False,
            doc="whether it is asked to log all it can, into log.txt; some FMUs say nothing of "
            "their errors otherwise",
            is_optional=True,
        ),
    }
    if recordable(description):
        found["locals"] = Parameter(
            type=tuple[str, ...],
            default=(),
            doc="variables inside that become outputs: names, or patterns with `*` and `?`",
            is_optional=True,
        )
    if description.input_degree:
        found["input_degree"] = Parameter(
            type=int,
            default=HIGHEST_DEGREE,
            minimum=0,
            maximum=HIGHEST_DEGREE,
            doc="highest order of the derivatives of inputs that it is told; 0: none",
            is_optional=True,
        )
    if description.slopes:
        found["output_slopes"] = Parameter(
            type=bool,
            default=True,
            doc="whether it is asked for the derivatives of outputs where these are extrapolated",
            is_optional=True,
        )
    if _shown(description):
        found["intermediate"] = Parameter(
            type=tuple[str, ...],
            default=(),
            doc="variables that are logged whenever the FMU shows them within a step: names, or "
            "patterns with `*` and `?`",
            is_optional=True,
        )
    if may_retry(description):
        found["smallest_step"] = Parameter(
            type=float | None,
            unit="s",
            default=None,
            minimum=1e-9,
            doc="a step that the FMU discards is made again in shorter ones, down to this; its "
            "state is kept before each step for that, so it is not done by default",
            is_optional=True,
        )
    if description.has_event_mode and not description.has_clocks:
        found["event_mode"] = Parameter(
            type=bool,
            default=False,
            doc="its events are handled with it: discrete inputs jump in event mode, steps end at "
            "events; by default it handles them alone, which is quicker",
            is_optional=True,
        )
    found |= integration_parameters(description)
    named = {PREFIX + name: parameter for name, parameter in found.items()}
    return {n: p for n, p in named.items() if n not in description.variables}


def check_options(kind: Kind, options: Options) -> None:
    """Check what is said together with the interface that is used.

    Raises:
        ParameterError: an option does not fit it.
    """
    said = {each.name: getattr(options, each.name) for each in fields(options)}
    nothing = Options()
    said = {name: v for name, v in said.items() if v != getattr(nothing, name)}
    found = integration_problems(kind, said)
    problems = [ParameterProblem((PREFIX + name,), what) for name, what in found]
    if problems:
        raise ParameterError(problems)


def with_options(description: FmuDescription, options: Options) -> FmuDescription:
    """The FMU as it is to be run.

    Raises:
        ParameterError: an option does not fit the FMU.
    """
    shown = with_intermediate(with_locals(description, options.locals), options.intermediate)
    return replace(
        shown,
        input_degree=min(description.input_degree, options.input_degree),
        slopes=description.slopes if options.output_slopes else (),
    )


def may_retry(description: FmuDescription) -> bool:
    """Whether a step that the FMU discards can be made again in several."""
    return description.can_restore and description.has_variable_steps


def with_locals(description: FmuDescription, wanted: tuple[str, ...]) -> FmuDescription:
    """The FMU with some of its inner variables as outputs.

    Args:
        description: the FMU.
        wanted: names or patterns.

    Raises:
        ParameterError: a pattern matches nothing.
    """
    offered = recordable(description)
    chosen = _matching("locals", "no variable inside", offered, wanted)
    if not chosen:
        return description
    changed = {n: replace(offered[n], causality="output", dependencies=None) for n in chosen}
    return replace(description, variables=MappingProxyType({**description.variables, **changed}))


def with_intermediate(description: FmuDescription, wanted: tuple[str, ...]) -> FmuDescription:
    """The FMU as it shows only some of what it would show within steps.

    Args:
        description: the FMU.
        wanted: names or patterns.

    Raises:
        ParameterError: a pattern matches nothing.
    """
    offered = _shown(description)
    chosen = _matching("intermediate", "nothing that is shown within steps", offered, wanted)
    return replace(description, intermediate=tuple(n for n in offered if n in chosen))


def _matching(
    option: str, nothing: str, offered: Collection[str], wanted: tuple[str, ...]
) -> set[str]:
    """Those of the names that match a pattern at least."""
    problems, chosen = [], set[str]()
    for k, pattern in enumerate(wanted):
        found = meant(pattern, offered)
        chosen.update(found)
        if not found:
            what = f"{nothing} matches `{pattern}`; {suggestion(pattern, offered)}"
            problems.append(ParameterProblem((PREFIX + option, k), what))
    if problems:
        raise ParameterError(problems)
    return chosen


def _shown(description: FmuDescription) -> tuple[str, ...]:
    """The variables that can be logged within steps."""
    variables = description.variables
    return tuple(
        name
        for name in description.intermediate
        if variables[name].type in DTYPES and not variables[name].is_clocked
    )


def recordable(description: FmuDescription) -> dict[str, FmuVariable]:
    """The variables that can be outputs and are none, by name."""
    inner = description.of("local", "calculatedParameter", "independent")
    return {v.name: v for v in inner if v.is_signal}
