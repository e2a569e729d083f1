"""What a scenario may say about how an FMU is run: parameters `fmi.*` of the component."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from types import MappingProxyType
from typing import Any, Final

from adapters.fmi import starts as starts_
from adapters.fmi.description import FmuDescription
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
    """

    tolerance: float | None = None
    locals: tuple[str, ...] = ()


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


def option_parameters(description: FmuDescription) -> dict[str, Parameter]:
    """The options that make a difference to this FMU, by name."""
    found = {
        "tolerance": Parameter(
            type=float | None,
            default=None,
            minimum=0.0,
            doc="relative tolerance for its solver; its own choice by default",
            is_optional=True,
        )
    }
    if recordable(description):
        found["locals"] = Parameter(
            type=tuple[str, ...],
            default=(),
            doc="variables inside that become outputs: names, or patterns with `*` and `?`",
            is_optional=True,
        )
    named = {PREFIX + name: parameter for name, parameter in found.items()}
    return {n: p for n, p in named.items() if n not in description.variables}


def with_locals(description: FmuDescription, wanted: tuple[str, ...]) -> FmuDescription:
    """The FMU with some of its inner variables as outputs.

    Args:
        description: the FMU.
        wanted: names or patterns.

    Raises:
        ParameterError: a pattern matches nothing.
    """
    offered = recordable(description)
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


def recordable(description: FmuDescription) -> dict[str, FmuVariable]:
    """The variables that can be outputs and are none, by name."""
    inner = description.of("local", "calculatedParameter", "independent")
    return {v.name: v for v in inner if v.is_signal}
