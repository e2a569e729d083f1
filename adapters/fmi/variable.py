"""One variable of an FMU, as modelDescription.xml declares it."""

import enum
import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from orchestrator.absence import Undriven
from orchestrator.caution import Caution
from orchestrator.units import Unit

DTYPES: Final[Mapping[str, npt.DTypeLike]] = {
    "Float32": np.float32,
    "Float64": np.float64,
    "Int8": np.int8,
    "UInt8": np.uint8,
    "Int16": np.int16,
    "UInt16": np.uint16,
    "Int32": np.int32,
    "UInt32": np.uint32,
    "Int64": np.int64,
    "UInt64": np.uint64,
    "Boolean": np.bool_,
    # FMI 2.0
    "Real": np.float64,
    "Integer": np.int32,
}
"""Element types of the variables whose signals are arrays."""

BYTES: Final = frozenset({"Binary", "String"})
"""Types of the variables whose signals are bytes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Axis:
    """One dimension of an array: a fixed length, or a structural parameter.

    Attributes:
        length: of the axis when nothing is set.
        structural: name of the structural parameter; `None` for a fixed length.
    """

    length: int
    structural: str | None

    @property
    def name(self) -> str | None:
        """What connectors call the axis: the structural parameter without a leading `n_`."""
        return None if self.structural is None else self.structural.removeprefix("n_")


class ClockKind(enum.Enum):
    """What decides when a clock ticks (`intervalVariability`; FMI 3.0.2, section 2.2.8.2)."""

    PERIODIC = "periodic"
    """The importer, at equal intervals: `constant`, `fixed`, `tunable`."""

    CHANGING = "changing"
    """The importer; each tick says when the next one comes."""

    COUNTDOWN = "countdown"
    """The importer; any event may say when the next one comes."""

    TRIGGERED = "triggered"
    """Somebody else."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Clock:
    """What a Clock has that other variables have not.

    Attributes:
        kind: what decides when it ticks.
        interval: of a periodic one [s], exactly; `None`: the FMU is asked for it.
        shift: of the first tick [s], exactly.
        priority: of several that tick at once, the lowest goes first.
        is_fraction: whether the FMU tells times as fractions (`supportsFraction`).
    """

    kind: ClockKind
    interval: Fraction | None
    shift: Fraction
    priority: int
    is_fraction: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class FmuVariable:
    """One variable of the FMU.

    Attributes:
        name: as in the file.
        reference: its value reference.
        type: of the functions that access it, e.g. `Float64`, `Real`, `Binary`, `String`.
        causality, variability, initial: as in the file, defaults filled in.
        unit: `"1"` if the file is silent.
        definition: of the unit, if the file has one.
        is_relative: whether it is a difference of quantities (`relativeQuantity`).
        start: the start values in row-major order, one value for all elements, or none.
        minimum, maximum: inclusive bounds.
        items: of an Enumeration, the values within the bounds by their names, in the order of
            the file.
        axes: the dimensions; empty for a scalar.
        dependencies: of an output, the names of the inputs it depends on at the same time;
            `None` stands for all.
        mime_type: contents of a Binary.
        clocks: the value references of the clocks while which tick it can be used; none: always.
        clock: what it is besides, if it is a Clock.
        derivative_of: the variable whose derivative it is, or none.
        description: one sentence.
        undriven: of an input, what it means that nothing drives it, if an annotation says so.
        caution: of a parameter, a value that biases results, if an annotation says so.
    """

    name: str
    reference: int
    type: str
    causality: str
    variability: str
    initial: str
    unit: str
    definition: Unit | None
    is_relative: bool
    start: tuple[Any, ...]
    minimum: float | None
    maximum: float | None
    items: Mapping[str, int]
    axes: tuple[Axis, ...]
    dependencies: frozenset[str] | None
    mime_type: str
    clocks: tuple[int, ...]
    clock: Clock | None
    derivative_of: str | None
    description: str
    undriven: Undriven | None = None
    caution: Caution | None = None

    @property
    def is_clocked(self) -> bool:
        """Whether it can be used only while a clock ticks."""
        return bool(self.clocks)

    @property
    def has_rate(self) -> bool:
        """Whether an FMU that tells derivatives of outputs tells that of this one."""
        is_real = self.type in {"Real", "Float64", "Float32"} and self.is_signal
        return is_real and (self.causality, self.variability) == ("output", "continuous")

    @property
    def is_bytes(self) -> bool:
        """Whether its signals are bytes, one for each element."""
        return self.type in BYTES

    @property
    def is_signal(self) -> bool:
        """Whether connectors can carry it."""
        if self.clock is not None:
            return self.clock.kind is ClockKind.TRIGGERED and not self.axes
        is_fixed = all(axis.structural is None for axis in self.axes)
        return self.type in DTYPES or (self.is_bytes and is_fixed)

    @property
    def elements(self) -> tuple[str, ...]:
        """The names of its connectors: one for an array of numbers, one for each text or Binary.

        Indices count from 0, as those of connections do.
        """
        if not self.axes or not self.is_bytes:
            return (self.name,)
        indices = itertools.product(*(range(axis.length) for axis in self.axes))
        return tuple(f"{self.name}[{', '.join(map(str, index))}]" for index in indices)
