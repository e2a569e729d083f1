"""What a scenario may say about how an FMU is run: parameters `fmi.*` of the component."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import Any, Final

from adapters.fmi import starts as starts_
from adapters.fmi.description import FmuDescription
from adapters.fmi.kind import Kind
from adapters.fmi.model_exchange.options import (
    parameters as integration_parameters,
    problems as integration_problems,
)
from adapters.fmi.variable import FmuVariable
from orchestrator.errors import ParameterError
from orchestrator.parameters import Parameter, ParameterProblem
from orchestrator.suggestion import suggestion

PREFIX: Final = "fmi."


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """How an FMU is run.

    Attributes:
        tolerance: relative, for the solver of the FMU; `None`: its own.
        locals: names or patterns of variables that are outputs of the component, too.
        kind: the interface that is used; `None`: what the FMU has.
        solver: with Model Exchange, the name of a solver.
        step: with Model Exchange, the longest step of the solver [s].
    """

    tolerance: float | None = None
    locals: tuple[str, ...] = ()
    kind: str | None = None
    solver: str | None = None
    step: float | None = None


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
        )
    }
    if _recordable(description):
        found["locals"] = Parameter(
            type=tuple[str, ...],
            default=(),
            doc="variables inside that become outputs: names, or patterns with `*` and `?`",
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
    found = integration_problems(
        kind, solver=options.solver, step=options.step, tolerance=options.tolerance
    )
    problems = [ParameterProblem((PREFIX + name,), what) for name, what in found]
    if problems:
        raise ParameterError(problems)


def with_locals(description: FmuDescription, wanted: tuple[str, ...]) -> FmuDescription:
    """The FMU with some of its inner variables as outputs.

    Args:
        description: the FMU.
        wanted: names or patterns.

    Raises:
        ParameterError: a pattern matches nothing.
    """
    offered = _recordable(description)
    problems, chosen = [], set()
    for k, pattern in enumerate(wanted):
        found = {n for n in offered if n == pattern or fnmatchcase(n, pattern)}
        chosen |= found
        if not found:
            what = f"no variable inside matches `{pattern}`; {suggestion(pattern, offered)}"
            problems.append(ParameterProblem((PREFIX + "locals", k), what))
    if problems:
        raise ParameterError(problems)
    if not chosen:
        return description
    changed = {n: replace(offered[n], causality="output", dependencies=None) for n in chosen}
    return replace(description, variables=MappingProxyType({**description.variables, **changed}))


def _recordable(description: FmuDescription) -> dict[str, FmuVariable]:
    """The variables that can be outputs and are none."""
    inner = description.of("local", "calculatedParameter", "independent")
    return {v.name: v for v in inner if v.is_signal}
