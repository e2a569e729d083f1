"""The interface of an FMU as data: one table from which modelDescription.xml and C are made.

Each native unit has a module `interface.py` with an `INTERFACE`; `fmus.common.build` turns it
into an FMU. Names, types, dimensions, units, start values and dependencies exist only here.
"""

from dataclasses import dataclass
from typing import Literal, TypeAlias

VariableType: TypeAlias = Literal[
    "Float32",
    "Float64",
    "Int8",
    "UInt8",
    "Int16",
    "UInt16",
    "Int32",
    "UInt32",
    "Int64",
    "UInt64",
    "Boolean",
    "Binary",
]
Causality: TypeAlias = Literal["structuralParameter", "parameter", "input", "output"]
Variability: TypeAlias = Literal["fixed", "tunable", "discrete", "continuous"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """One FMI variable.

    Attributes:
        name: structured name, e.g. `vehicle.position`.
        dimensions: one entry per axis, a fixed length or the name of a structural parameter;
            the orchestrator calls the axis sized by `n_vehicle` `vehicle`.
        start: one number for all elements; ignored for Binary, which starts empty.
        minimum, maximum: inclusive bounds, checked by the shell when a value is set.
        dependencies: for an output, the inputs that it depends on at the same time.
        mime_type: contents of a Binary.
    """

    name: str
    type: VariableType
    causality: Causality
    variability: Variability
    description: str
    unit: str = "1"
    dimensions: tuple[int | str, ...] = ()
    start: float = 0
    minimum: float | None = None
    maximum: float | None = None
    dependencies: tuple[str, ...] = ()
    mime_type: str = "application/octet-stream"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface:
    """The interface and the sources of one FMU.

    Attributes:
        name: modelName and modelIdentifier; the archive is `<name>.fmu`.
        variables: in the order of their value references, after `time` (reference 0).
        sources: C files beside `interface.py` (the shell is added by the build).
        headers: C headers beside `interface.py`.
    """

    name: str
    description: str
    variables: tuple[Variable, ...]
    sources: tuple[str, ...]
    headers: tuple[str, ...] = ()
