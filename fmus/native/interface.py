"""The interface of an FMU as data: one table from which modelDescription.xml and C are made.

Each native unit has a module `interface.py` with an `INTERFACE`; `fmus.native.build` turns it
into an FMU. Names, types, dimensions, units, start values and dependencies exist only here.
Most variables are one line each, made by the constructors `length`, `parameter`, `whole`,
`switch`, `choice`, `discrete_input` and `discrete_output`; `fmus.native.scene` has the inputs that
units share.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Final, Literal, TypeAlias, TypedDict, Unpack

from orchestrator.absence import Undriven, said_of
from orchestrator.caution import Caution

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
    "Enumeration",
    "Binary",
]
Causality: TypeAlias = Literal["structuralParameter", "parameter", "input", "output"]
Variability: TypeAlias = Literal["fixed", "tunable", "discrete", "continuous"]

BYTES_MIME: Final = "application/octet-stream"


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
        items: of an Enumeration; their values are 1, 2, ... in this order, and `start` is one of
            these values.
        undriven: of an input, what it means that nothing drives it (an annotation, which other
            importers ignore).
        caution: of a parameter, a value that biases results (an annotation, too).
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
    mime_type: str = BYTES_MIME
    items: tuple[str, ...] = ()
    undriven: Undriven | None = None
    caution: Caution | None = None

    def listed_items(self) -> str:
        """The items with their values, for people: `1 (hold), 2 (linear)`."""
        return ", ".join(f"{value} ({item})" for value, item in enumerate(self.items, start=1))


class Options(TypedDict, total=False):
    """What the constructors below hand on to `Variable`, where it is explained."""

    unit: str
    dimensions: tuple[int | str, ...]
    start: float
    minimum: float | None
    maximum: float | None
    dependencies: tuple[str, ...]
    mime_type: str
    items: tuple[str, ...]
    undriven: Undriven | None
    caution: Caution | None


def length(
    name: str,
    start: int,
    minimum: int,
    maximum: int | None,
    description: str,
    *,
    tunable: bool = True,
) -> Variable:
    """The length of an axis; if it is tunable, it may change between steps. `None` is no bound."""
    bounds = Options(start=start, minimum=minimum, maximum=maximum)
    variability: Variability = "tunable" if tunable else "fixed"
    return _variable(name, "UInt64", "structuralParameter", variability, description, **bounds)


def parameter(
    name: str,
    start: float,
    minimum: float | None,
    maximum: float | None,
    description: str,
    *,
    unit: str = "1",
    dimensions: tuple[int | str, ...] = (),
) -> Variable:
    """A number that is fixed before initialisation; `None` is no bound."""
    options = Options(
        start=start, minimum=minimum, maximum=maximum, unit=unit, dimensions=dimensions
    )
    return _variable(name, "Float64", "parameter", "fixed", description, **options)


def whole(
    name: str,
    start: int,
    minimum: int | None,
    maximum: int | None,
    description: str,
    *,
    kind: VariableType = "Int32",
    tunable: bool = False,
) -> Variable:
    """A whole number, fixed before initialisation unless tunable; `None`: the type's bound."""
    bounds = Options(start=start, minimum=minimum, maximum=maximum)
    variability: Variability = "tunable" if tunable else "fixed"
    return _variable(name, kind, "parameter", variability, description, **bounds)


def switch(name: str, description: str, *, start: bool, caution: Caution | None = None) -> Variable:
    """A Boolean that is fixed before initialisation."""
    options = Options(start=start, caution=caution)
    return _variable(name, "Boolean", "parameter", "fixed", description, **options)


def choice(name: str, items: tuple[str, ...], description: str) -> Variable:
    """One of several names, fixed before initialisation; the first one is the default."""
    options = Options(start=1, items=items)
    return _variable(name, "Enumeration", "parameter", "fixed", description, **options)


def discrete_input(
    name: str, kind: VariableType, description: str, **options: Unpack[Options]
) -> Variable:
    """An input that holds its value from one communication point to the next."""
    return _variable(name, kind, "input", "discrete", description, **options)


def discrete_output(
    name: str, kind: VariableType, description: str, **options: Unpack[Options]
) -> Variable:
    """An output that changes at communication points only."""
    return _variable(name, kind, "output", "discrete", description, **options)


def when_undriven(
    inputs: Iterable[Variable], meanings: Mapping[str, Undriven]
) -> tuple[Variable, ...]:
    """The inputs, with what it means that nothing drives them, by name or by group."""
    variables = tuple(inputs)
    said = said_of([v.name for v in variables], meanings)
    return tuple(replace(v, undriven=said.get(v.name)) for v in variables)


def _variable(
    name: str,
    kind: VariableType,
    causality: Causality,
    variability: Variability,
    description: str,
    **options: Unpack[Options],
) -> Variable:
    return Variable(
        name=name,
        type=kind,
        causality=causality,
        variability=variability,
        description=description,
        **options,
    )


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
