"""Arithmetic on the way from an output to an input: one operation after the other, in float64."""

import enum
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array


class Kind(enum.IntEnum):
    """What an operation does with its number; `engine.c` has the same numbers."""

    MULTIPLY = 0
    DIVIDE = 1
    ADD = 2


@dataclass(frozen=True, slots=True)
class Operation:
    """One operation with a constant number."""

    kind: Kind
    number: float

    @override
    def __str__(self) -> str:
        if self.kind is Kind.ADD:
            return f"{'-' if self.number < 0 else '+'} {abs(self.number):.12g}"
        return f"{'*' if self.kind is Kind.MULTIPLY else '/'} {self.number:.12g}"


def multiply(number: float) -> Operation:
    """Multiply by `number`."""
    return Operation(Kind.MULTIPLY, number)


def divide(number: float) -> Operation:
    """Divide by `number`."""
    return Operation(Kind.DIVIDE, number)


def add(number: float) -> Operation:
    """Add `number`."""
    return Operation(Kind.ADD, number)


def applied(operations: Iterable[Operation], values: Array) -> Array:
    """What the operations make of `values`, one after the other.

    Args:
        operations: each of which is rounded.
        values: float64, any shape.

    Returns:
        float64, of the shape of `values`; infinite where a number becomes too large.
    """
    for operation in operations:
        match operation.kind:
            case Kind.MULTIPLY:
                values = values * operation.number
            case Kind.DIVIDE:
                values = values / operation.number
            case Kind.ADD:
                values = values + operation.number
    return np.asarray(values)


def spelled(operations: Sequence[Operation]) -> str:
    """The operations as text, e.g. `* 5 / 18`."""
    return " ".join(map(str, operations))
