"""Values of the types String and Binary on their way into an FMU and out of it.

They travel as bytes, each element by itself: an array `tag` of two texts is `tag[0]` and `tag[1]`.
"""

from collections.abc import Iterable, Mapping, Sequence
from ctypes import c_uint32
from dataclasses import dataclass
from typing import Any

from adapters.fmi.variable import FmuVariable
from orchestrator.signal import Signal, Signals


@dataclass(frozen=True, slots=True)
class Parcel:
    """What one call moves.

    Attributes:
        kind: `String` or `Binary`.
        names: of the elements, those of a variable one after the other.
        references: of the variables.
    """

    kind: str
    names: tuple[str, ...]
    references: Any

    @classmethod
    def of(cls, kind: str, variables: Sequence[FmuVariable]) -> "Parcel":
        """One that moves these variables."""
        names = tuple(name for v in variables for name in v.elements)
        return cls(kind, names, (c_uint32 * len(variables))(*(v.reference for v in variables)))


def parcels(variables: Iterable[FmuVariable]) -> list[Parcel]:
    """Those that move the bytes among `variables` together."""
    groups: dict[str, list[FmuVariable]] = {}
    for variable in variables:
        if variable.is_signal and variable.is_bytes:
            groups.setdefault(variable.type, []).append(variable)
    return [Parcel.of(kind, found) for kind, found in groups.items()]


def packed(
    variables: Mapping[str, FmuVariable], values: Signals
) -> tuple[list[tuple[Parcel, list[bytes]]], dict[str, Signal]]:
    """What moves the bytes among `values`, and the rest.

    Args:
        variables: by the names of their elements.
        values: by name; all elements of an array together.
    """
    numbers: dict[str, Signal] = {n: v for n, v in values.items() if not isinstance(v, bytes)}
    if len(numbers) == len(values):
        return [], numbers
    found = {id(variables[name]): variables[name] for name in values if name not in numbers}
    moved = []
    for parcel in parcels(found.values()):
        elements = [value for n in parcel.names if isinstance(value := values[n], bytes)]
        moved.append((parcel, elements))
    return moved, numbers
