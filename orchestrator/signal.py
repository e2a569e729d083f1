"""Connectors: what a component says about the signals it exchanges.

A signal is a NumPy array, or `bytes` for what FMI calls Binary and, in UTF-8, String. A connector
declares its causality, element type, unit, axes and variability, so that a connection can be
checked before the first step and a value at every step.
"""

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from orchestrator.absence import Undriven
from orchestrator.meaning import Meaning
from orchestrator.units import Unit

Array: TypeAlias = npt.NDArray[Any]
Signal: TypeAlias = Array | bytes
Signals: TypeAlias = Mapping[str, Signal]

TEXT: Final = "text/plain; charset=utf-8"
"""The MIME type of a Binary that is text (FMI: String)."""


class Causality(enum.Enum):
    """Who computes a signal (the causalities of FMI that travel along connections)."""

    INPUT = "input"
    OUTPUT = "output"


class Variability(enum.Enum):
    """When a signal may change (FMI 3.0.2, section 2.4.7.4)."""

    FIXED = "fixed"
    """It never changes after initialisation."""

    DISCRETE = "discrete"
    """It changes at communication points; between them it is constant. Messages are discrete."""

    CONTINUOUS = "continuous"
    """It samples a function of time and may be extrapolated."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Connector:
    """The type of one signal.

    Attributes:
        causality: whether the component reads or writes the signal.
        dtype: the NumPy element type; `None` for Binary, whose values are `bytes`.
        shape: one entry per axis; a string names an axis whose length may change during
            the run, e.g. `("vehicle", 3)`. All connectors of a component that name the
            same axis have the same length along it at every communication point. A name
            may have parts, e.g. `left.sharer` and `right.sharer`: two axes of one component,
            whose lengths may differ, both along sharers. Between components the last part
            counts, so either may be connected to an axis `sharer`.
        unit: an SI unit or `dBm`, `dB`; `"1"` for a pure number.
        definition: what the unit means, where the component says so itself (FMI: its
            UnitDefinitions); else the table of units is asked.
        is_relative: whether the signal is a difference, so that conversions leave the offset of
            its unit out (FMI: `relativeQuantity`).
        variability: when the signal may change.
        start: the value before the first communication step; `None` stands for zeros, with
            length 0 along named axes, and for empty Binary.
        mime_type: what a Binary contains, e.g. `application/x-nlosim-points; version=1`. With
            the parameter `events` each value holds the events of one communication step, and
            is lost to readers that skip it.
        feedthrough: for an output, the inputs that affect its value at the same
            communication point (FMI: its dependencies in ModelStructure).
        description: one sentence for `nlosim components`.
        undriven: for an input, what it means that nothing drives it, and whether that is an error;
            `None` where the start value is as good as any other.
        parameter: address, within the component's parameters, of what brought the connector
            about. There the error is told; where nothing drives it and that is none, a remark.
            Empty: the component as a whole.
        meaning: what every value is to be, beyond type and shape; `None`: nothing more. Values of
            outputs are checked; what an input says of it is asked of the output that drives it.
    """

    causality: Causality
    dtype: npt.DTypeLike | None = np.float64
    shape: tuple[int | str, ...] = ()
    unit: str = "1"
    definition: Unit | None = None
    is_relative: bool = False
    variability: Variability = Variability.DISCRETE
    start: Signal | np.generic | None = None
    mime_type: str = "application/octet-stream"
    feedthrough: frozenset[str] = frozenset()
    description: str = ""
    undriven: Undriven | None = None
    parameter: tuple[str | int, ...] = ()
    meaning: Meaning | None = None

    @property
    def is_binary(self) -> bool:
        """Whether values are `bytes` rather than arrays."""
        return self.dtype is None

    @property
    def is_text(self) -> bool:
        """Whether values are text in UTF-8."""
        return self.is_binary and self.mime_type == TEXT

    @property
    def carries_events(self) -> bool:
        """Whether every value must be read, because the next one replaces it."""
        return self.is_binary and "events" in (p.strip() for p in self.mime_type.split(";"))

    def start_value(self) -> Signal:
        """The value before the first communication step; arrays are read-only."""
        if self.is_binary:
            return self.start if isinstance(self.start, bytes) else b""
        if self.start is not None:
            value = np.array(self.start, dtype=self.dtype)
        else:
            lengths = tuple(0 if isinstance(n, str) else n for n in self.shape)
            value = np.zeros(lengths, dtype=self.dtype)
        value.flags.writeable = False
        return value

    def violations(self, value: Signal) -> list[str]:
        """How `value` breaks this declaration: type, rank, lengths, not finite, no text."""
        if self.is_binary or isinstance(value, bytes):
            if not (self.is_binary and isinstance(value, bytes)):
                return [f"is {type(value).__name__}, declared {self.kind()}"]
            return text_problems(value) if self.is_text else []
        if value.dtype != np.dtype(self.dtype) or value.ndim != len(self.shape):
            return [f"is {value.dtype}{list(value.shape)}, declared {self.kind()}"]
        for axis, (found, declared) in enumerate(zip(value.shape, self.shape, strict=True)):
            if not isinstance(declared, str) and found != declared:
                return [f"has length {found} along axis {axis}, declared {self.kind()}"]
        if value.dtype.kind == "f" and not np.isfinite(value).all():
            index = tuple(map(int, np.argwhere(~np.isfinite(value))[0]))
            return [f"is {value[index]} at index {list(index)}"]
        return [] if self.meaning is None else self.meaning.violations(value)

    def differences(self, target: "Connector") -> list[str]:
        """Why this output may not drive the input `target`; empty if it may."""
        found = []
        if self.causality is not Causality.OUTPUT:
            found.append("the source is an input, not an output")
        if target.causality is not Causality.INPUT:
            found.append("the target is an output, not an input")
        if self.is_binary != target.is_binary or np.dtype(self.dtype) != np.dtype(target.dtype):
            found.append(f"types differ: {self.kind()} and {target.kind()}")
        elif self.is_binary and self.mime_type != target.mime_type:
            found.append(f"contents differ: {self.mime_type} and {target.mime_type}")
        elif along(self.shape) != along(target.shape):
            found.append(f"shapes differ: {self.shape} and {target.shape}")
        if self.unit != target.unit:
            found.append(f"units differ: {self.unit} and {target.unit}")
        return found

    def kind(self) -> str:
        """The declared type as text, e.g. `float64[vehicle, 3]` or `binary`."""
        if self.is_binary:
            return "text" if self.is_text else f"binary ({self.mime_type})"
        axes = ", ".join(map(str, self.shape))
        return f"{np.dtype(self.dtype)}[{axes}]"


def text_problems(value: bytes) -> list[str]:
    """Why these bytes are no text: not UTF-8, or a NUL, which ends texts in FMI and C."""
    try:
        value.decode()
    except UnicodeDecodeError as error:
        return [f"is no text in UTF-8: {value[error.start : error.start + 4]!r} at {error.start}"]
    return [f"has a NUL character at {value.index(0)}"] if 0 in value else []


def along(shape: tuple[int | str, ...]) -> list[int | str]:
    """What connections compare of each axis: its length, or the last part of its name."""
    return [axis.rpartition(".")[2] if isinstance(axis, str) else axis for axis in shape]
