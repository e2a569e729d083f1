"""Connectors and parameters of an FMU, from its description."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final, Literal

import numpy as np
import numpy.typing as npt

from adapters.fmi.block import shape_of, size_text
from adapters.fmi.description import FmuDescription
from adapters.fmi.variable import DTYPES, FmuVariable
from orchestrator.meaning import Meaning
from orchestrator.parameters import DRAWN, REQUIRED, Parameter
from orchestrator.signal import TEXT, Causality, Connector, Signal, Variability
from orchestrator.units import Unit, UnitError, parse_unit

SEED: Final = "seed"
"""An integer parameter of this name that the scenario does not set is drawn from the
component's random stream."""

_PYTHON_TYPES: Final[Mapping[str, type]] = {
    "Boolean": bool,
    "String": str,
    "Float32": float,
    "Float64": float,
    "Real": float,
}


def connectors(
    description: FmuDescription,
    lengths: Mapping[str, int],
    settled: frozenset[str] = frozenset(),
) -> dict[str, Connector]:
    """The connectors by name.

    Args:
        description: the FMU.
        lengths: of the structural parameters, before the first inputs arrive.
        settled: structural parameters whose axes have a number in place of a name.
    """
    inputs = {v.name: v.elements for v in description.of("input") if v.is_signal}
    return {
        name: replace(
            _connector(variable, name, inputs, lengths),
            shape=() if variable.is_bytes else _shape(variable, lengths, settled),
        )
        for variable in description.of("input", "output")
        if variable.is_signal
        for name in variable.elements
    }


def not_set(description: FmuDescription) -> list[str]:
    """Parameters that no scenario can set, with the reason."""
    return [f"`{v.name}` (Binary)" for v in description.of("parameter") if v.type == "Binary"]


def left_out(description: FmuDescription) -> list[str]:
    """Inputs and outputs that cannot be connected, with the reason."""
    silent = [v for v in description.of("input", "output") if not v.is_signal]
    return [
        *(f"`{v.name}` ({_reason(v)})" for v in silent if v.clock is None or v.axes),
        *(f"`{name}` (clocks need `hasEventMode`)" for name in description.lost),
    ]


def _shape(
    variable: FmuVariable, lengths: Mapping[str, int], settled: frozenset[str]
) -> tuple[int | str, ...]:
    return tuple(
        lengths[axis.structural]
        if axis.structural in settled and axis.structural is not None
        else axis.name or axis.length
        for axis in variable.axes
    )


def _dtype(variable: FmuVariable) -> npt.DTypeLike:
    """A clock is a truth: it ticks."""
    return np.bool_ if variable.clock is not None else DTYPES[variable.type]


def _reason(variable: FmuVariable) -> str:
    return f"{variable.type} of variable size" if variable.is_bytes else variable.type


def _connector(
    variable: FmuVariable,
    name: str,
    inputs: Mapping[str, tuple[str, ...]],
    lengths: Mapping[str, int],
) -> Connector:
    """One connector of a variable.

    Args:
        variable: of the FMU.
        name: of the connector.
        inputs: the connectors of each input.
        lengths: of the structural parameters.
    """
    is_input = variable.causality == "input"
    known = variable.dependencies
    feedthrough = frozenset(
        e for n, es in inputs.items() if known is None or n in known for e in es
    )
    variability = {"continuous": Variability.CONTINUOUS, "constant": Variability.FIXED}
    return Connector(
        causality=Causality.INPUT if is_input else Causality.OUTPUT,
        dtype=None if variable.is_bytes else _dtype(variable),
        unit=variable.unit,
        definition=variable.definition,
        is_relative=variable.is_relative,
        variability=variability.get(variable.variability, Variability.DISCRETE),
        start=start_value(variable, lengths, variable.elements.index(name)) if is_input else None,
        mime_type=TEXT if variable.type == "String" else variable.mime_type,
        feedthrough=frozenset() if is_input else feedthrough,
        description=variable.description + _legend(variable),
        undriven=variable.undriven,
        meaning=_range(variable) if is_input else None,
    )


def _range(variable: FmuVariable) -> Meaning | None:
    """What a constant of an input may be, as the FMU says; what drives it is not asked."""
    if variable.items:  # those within the bounds
        return Meaning(items=tuple(variable.items.items()))
    low, high = variable.minimum, variable.maximum
    if variable.is_bytes or variable.clock is not None or (low is None and high is None):
        return None
    return Meaning(minimum=low, maximum=high)


def _legend(variable: FmuVariable) -> str:
    """What the numbers of an Enumeration mean."""
    listed = ", ".join(f"{value} {name}" for name, value in variable.items.items())
    return f" ({listed})" if listed else ""


def start_value(variable: FmuVariable, lengths: Mapping[str, int], element: int = 0) -> Signal:
    """The start value of `variable` in the shape it has for `lengths`, or of one text or Binary."""
    if variable.is_bytes:
        start = variable.start or ("",)
        value = start[element if len(start) > 1 else 0]
        return value.encode() if isinstance(value, str) else bytes(value)
    shape = shape_of(variable, lengths)
    values = np.array(variable.start or (0,), dtype=_dtype(variable))
    if values.size == 1:
        return np.full(shape, values[0], dtype=values.dtype)
    if values.size == math.prod(shape):
        return values.reshape(shape)
    return np.zeros(shape, values.dtype)  # values for other sizes than these


def parameters(description: FmuDescription, chosen: frozenset[str]) -> dict[str, Parameter]:
    """The parameters by name.

    Args:
        description: the FMU.
        chosen: the structural parameters that are not the length of any input.
    """
    own = [v for v in description.of("parameter") if v.variability != "constant"]
    found = {v.name: _parameter(v) for v in own if is_offered(v, chosen)}
    structural = (v for v in description.of("structuralParameter") if v.name in chosen)
    return found | {v.name: _parameter(v) for v in structural}


def is_seed(variable: FmuVariable) -> bool:
    """Whether this is the parameter that is drawn when the scenario does not set it."""
    is_integer = variable.type in DTYPES and np.dtype(DTYPES[variable.type]).kind in "iu"
    is_scalar_parameter = variable.causality == "parameter" and not variable.axes
    return variable.name == SEED and is_integer and is_scalar_parameter and not variable.items


def is_offered(variable: FmuVariable, chosen: frozenset[str]) -> bool:
    """Whether a scenario can set it; not if its length follows the inputs during the run."""
    structural = {axis.structural for axis in variable.axes} - {None}
    return (
        (variable.type in DTYPES or variable.type == "String")
        and not variable.is_clocked
        and structural <= chosen
    )


def _parameter(variable: FmuVariable) -> Parameter:
    element = element_type(variable)
    is_number = element in {int, float}
    return Parameter(
        type=tuple[element, ...] if variable.axes else element,  # type: ignore[valid-type]
        unit=variable.unit if is_number else "1",
        definition=own_definition(variable) if is_number else None,
        is_relative=variable.is_relative,
        default=default_of(variable),
        minimum=variable.minimum if is_number else None,
        maximum=variable.maximum if is_number else None,
        doc=variable.description + size_note(variable),
        caution=variable.caution,
    )


def own_definition(variable: FmuVariable) -> Unit | None:
    """What the unit is by the FMU, unless the table of units says the same."""
    try:
        known = parse_unit(variable.unit)
    except UnitError:
        return variable.definition
    return None if variable.definition == known else variable.definition


def element_type(variable: FmuVariable) -> Any:
    """The type of an element in a scenario."""
    if variable.items:
        return Literal[tuple(variable.items)]
    return _PYTHON_TYPES.get(variable.type, int)


def default_of(variable: FmuVariable) -> Any:
    """The start value for people; arrays may have one for all elements, in any size."""
    if is_seed(variable):
        return DRAWN
    start = variable.start
    if variable.items:
        names = {value: name for name, value in variable.items.items()}
        start = tuple(names[value] for value in start if value in names)
    if not start or len(start) != len(variable.start):
        return REQUIRED
    return start if variable.axes else start[0]


def size_note(variable: FmuVariable) -> str:
    """How many values an array takes; empty for a scalar."""
    if not variable.axes:
        return ""
    order = " row by row" if len(variable.axes) > 1 else ""
    return f"; {size_text(variable)} values{order}, or one for all"
