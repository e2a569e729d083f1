"""Start values that a scenario chooses: parameters `start.NAME` of the component."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from adapters.fmi.connectors import (
    default_of,
    element_type,
    is_offered,
    own_definition,
    size_note,
)
from adapters.fmi.description import FmuDescription
from adapters.fmi.variable import FmuVariable
from orchestrator.parameters import REQUIRED, Parameter

PREFIX: Final = "start."


def startable(description: FmuDescription) -> tuple[FmuVariable, ...]:
    """The variables whose start value the importer may choose; parameters are set as such.

    Inputs, and of states, other locals and outputs those that are not calculated (FMI 3.0.2,
    section 2.4.7.5: `initial` is exact or approx).
    """
    return tuple(
        v
        for v in description.of("input", "output", "local", "calculatedParameter")
        if v.variability != "constant"
        and (v.causality == "input" or v.initial in {"exact", "approx"})
    )


def start_parameters(description: FmuDescription, chosen: frozenset[str]) -> dict[str, Parameter]:
    """The parameters that choose start values, by name.

    Args:
        description: the FMU.
        chosen: the structural parameters that are not the length of any input.
    """
    derived = {v.derivative_of for v in description.variables.values()}
    return {
        PREFIX + v.name: _parameter(v, is_state=v.name in derived)
        for v in startable(description)
        if is_offered(v, chosen) and PREFIX + v.name not in description.variables
    }


def _parameter(variable: FmuVariable, *, is_state: bool) -> Parameter:
    element: Any = element_type(variable)
    type_: Any = tuple[element, ...] if variable.axes else element
    default = default_of(variable)
    is_number = element in {int, float}
    what = "state" if is_state else variable.causality
    guess = ", a first guess" if variable.initial == "approx" else ""
    told = f": {variable.description}" if variable.description else ""
    return Parameter(
        type=type_ | None if default is REQUIRED else type_,
        unit=variable.unit if is_number else "1",
        definition=own_definition(variable) if is_number else None,
        is_relative=variable.is_relative,
        default=None if default is REQUIRED else default,
        minimum=variable.minimum if is_number else None,
        maximum=variable.maximum if is_number else None,
        doc=f"start value of this {what}{guess}{told}{size_note(variable)}",
        is_optional=True,
    )


def started(description: FmuDescription, starts: Mapping[str, Any]) -> FmuDescription:
    """An FMU whose inputs start at other values, which unconnected ones keep.

    Args:
        description: the FMU.
        starts: by variable, as FMI has them.
    """
    changed = {
        name: replace(description.variables[name], start=_elements(value))
        for name, value in starts.items()
        if description.variables[name].causality == "input"
    }
    if not changed:
        return description
    return replace(description, variables=MappingProxyType({**description.variables, **changed}))


def _elements(value: Any) -> tuple[Any, ...]:
    return tuple(value) if isinstance(value, tuple | list) else (value,)
