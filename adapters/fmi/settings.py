"""What a scenario says about parameters, as the FMU takes it."""

import math
from collections.abc import Mapping
from typing import Any

from adapters.fmi.block import shape_of, size_text
from adapters.fmi.description import FmuDescription
from adapters.fmi.sizes import Sizes
from adapters.fmi.starts import PREFIX
from adapters.fmi.variable import FmuVariable
from orchestrator.errors import ComponentTypeError
from orchestrator.suggestion import suggestion


def settings(description: FmuDescription, values: Mapping[str, Any]) -> dict[str, Any]:
    """The parameters to be set: names of items as their numbers, arrays of fitting lengths.

    Arrays that `values` resizes and does not set are included, because FMUs need not keep the
    start values of these (FMI 3.0.2, 2.4.7).

    Args:
        description: the FMU.
        values: by parameter, as the scenario sets them. An array may have one value, which
            stands for all elements, as in modelDescription.xml.

    Raises:
        ComponentTypeError: an array has the wrong length, or an Enumeration no such item.
    """
    lengths = Sizes(description, values).start
    found = {
        name: _setting(description.variables[name], name, value, lengths)
        for name, value in values.items()
    }
    return found | {
        variable.name: _start(variable, lengths)
        for variable in description.of("parameter")
        if variable.name not in values and _is_resized(description, variable, lengths)
    }


def start_settings(
    description: FmuDescription, values: Mapping[str, Any], starts: Mapping[str, Any]
) -> dict[str, Any]:
    """The start values to be set, by variable; as `settings`.

    Args:
        description: the FMU.
        values: of parameters, by name.
        starts: of other variables, by name; `None`: what the FMU says itself.

    Raises:
        ComponentTypeError: see `settings`.
    """
    lengths = Sizes(description, values).start
    return {
        name: _setting(description.variables[name], PREFIX + name, value, lengths)
        for name, value in starts.items()
        if value is not None
    }


def _setting(variable: FmuVariable, called: str, value: Any, lengths: Mapping[str, int]) -> Any:
    """`value` as FMI takes it."""
    if variable.axes:
        _check_length(variable, called, lengths, len(value))
    return _numbers(variable, called, value)


def _check_length(
    variable: FmuVariable, called: str, lengths: Mapping[str, int], given: int
) -> None:
    count = math.prod(shape_of(variable, lengths))
    if given in {1, count}:
        return
    structural = {axis.structural for axis in variable.axes if axis.structural is not None}
    why = f" ({size_text(variable)})" if structural else ""
    hint = ", or one for all"
    if len(variable.axes) == len(structural) == 1 and given:
        hint = f", one for all, or `{structural.pop()}: {given}`"
    raise ComponentTypeError(f"`{called}` has {given} values; write {count}{why}{hint}")


def _numbers(variable: FmuVariable, called: str, value: Any) -> Any:
    """`value` with the numbers of items in the place of their names."""
    if not variable.items:
        return value
    if isinstance(value, tuple | list):
        return tuple(_numbers(variable, called, item) for item in value)
    if value not in variable.items:
        hint = suggestion(str(value), variable.items)
        raise ComponentTypeError(f"`{called}` has no item `{value}`; {hint}")
    return variable.items[value]


def _is_resized(
    description: FmuDescription, variable: FmuVariable, lengths: Mapping[str, int]
) -> bool:
    structural = [axis.structural for axis in variable.axes if axis.structural is not None]
    return any(lengths[name] != description.variables[name].start[0] for name in structural)


def _start(variable: FmuVariable, lengths: Mapping[str, int]) -> tuple[Any, ...]:
    if len(variable.start) == 1:
        return variable.start
    count = math.prod(shape_of(variable, lengths))
    raise ComponentTypeError(
        f"`{variable.name}` has {len(variable.start)} start values, which do not fit the size "
        f"that was chosen; set it, too: {count} values ({size_text(variable)}), or one for all"
    )
