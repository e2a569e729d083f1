"""Systems, components and what is between them, as the files of SSP say it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Final, TypeAlias

from orchestrator.errors import Location
from orchestrator.units import Unit

SOURCES: Final = frozenset({"output", "calculatedParameter", "constant", "local"})
"""Kinds of connectors of an element that values come from; of those of the system around, they
are what values go to."""

TARGETS: Final = frozenset({"input", "parameter", "structuralParameter"})
"""The other way round."""


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitUse:
    """A unit as a file names it.

    Attributes:
        definition: what it is; `None` if nobody says.
    """

    name: str
    definition: Unit | None
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Port:
    """One connector.

    Attributes:
        kind: `input`, `output`, ...
        type: `Real`, `Float64`, ...; `None` if the file does not say.
        unit: of its values, or `None`.
        is_array: whether it has dimensions.
        is_relative: whether it is a difference of quantities.
    """

    name: str
    kind: str
    type: str | None
    unit: UnitUse | None
    is_array: bool
    where: Location
    is_relative: bool = False


@dataclass(frozen=True, slots=True)
class Linear:
    """`factor * value + offset`, exactly."""

    factor: Fraction = Fraction(1)
    offset: Fraction = Fraction(0)

    def after(self, first: "Linear") -> "Linear":
        """`first`, and then this."""
        return Linear(self.factor * first.factor, self.factor * first.offset + self.offset)

    def of(self, value: Fraction) -> Fraction:
        """What it makes of a value."""
        return self.factor * value + self.offset


@dataclass(frozen=True, slots=True)
class Table:
    """Values by values, all as they are written; Booleans are `true` and `false`.

    Attributes:
        kind: `Boolean`, `Integer` or `Enumeration`.
    """

    kind: str
    entries: Mapping[str, str]
    where: Location

    @property
    def changes(self) -> bool:
        """Whether it makes another value of any."""
        return any(source != target for source, target in self.entries.items())


Change: TypeAlias = Linear | Table
"""What happens to a value besides the conversion of its unit."""

AS_IT_IS: Final = Linear()


@dataclass(frozen=True, slots=True)
class End:
    """One end of a connection: a connector of an element, or of the system itself (`None`)."""

    element: str | None
    connector: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """One connection within a system; the order of its ends does not say where values go.

    Attributes:
        converts: whether units are converted.
        said: what nlosim has noted down about it: `delay`, `sample`.
    """

    start: End
    end: End
    change: Change
    converts: bool
    said: Mapping[str, str]
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """One value of a parameter set.

    Attributes:
        type: `Real`, `Float64`, ...
        texts: as written, one for each element.
        unit: of a number, or `None`.
    """

    name: str
    type: str
    texts: tuple[str, ...]
    unit: UnitUse | None
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One line of a parameter mapping."""

    source: str
    target: str
    change: Change
    converts: bool
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Binding:
    """Values for a component or a system.

    Attributes:
        values: with the prefix in front of their names.
        mapping: `None` if names are taken as they are.
    """

    values: tuple[Value, ...]
    mapping: tuple[Entry, ...] | None
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """A signal dictionary, where it is used.

    Attributes:
        dictionary: its name.
    """

    name: str
    dictionary: str
    ports: Mapping[str, Port]
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Component:
    """An FMU in a system.

    Attributes:
        source: in the package.
        implementation: the interface of the FMU that is used, or `any`.
        said: what nlosim has noted down about it: `step`, `process`, `options`.
    """

    name: str
    description: str
    source: str
    implementation: str
    ports: Mapping[str, Port]
    bindings: tuple[Binding, ...]
    said: Mapping[str, str]
    where: Location


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """A system: elements, and connections between their connectors and its own.

    Attributes:
        dictionaries: the entries of its signal dictionaries, by name.
    """

    name: str
    ports: Mapping[str, Port]
    bindings: tuple[Binding, ...]
    elements: Mapping[str, "Element"]
    links: tuple[Link, ...]
    dictionaries: Mapping[str, Mapping[str, Port]] = field(default_factory=dict)
    where: Location


Element: TypeAlias = Component | Group | Reference


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """One variant of a package.

    Attributes:
        file: `car.ssp/SystemStructure.ssd`.
        version: 1.0 or 2.0.
        credits: author, license and the like, by name.
        start, stop: of the default experiment [s], or `None`.
        step: a communication step size that a tool has noted down [s], with its place, or `None`.
        said: what nlosim has noted down about the scenario.
    """

    file: str
    name: str
    version: str
    description: str
    credits: Mapping[str, str]
    system: Group
    start: Fraction | None
    stop: Fraction | None
    step: tuple[Fraction, Location] | None
    said: Mapping[str, str]
    where: Location
