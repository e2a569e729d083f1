"""Variables of one type in one contiguous block of memory, so that one FMI call moves them all."""

import ctypes
import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from adapters.fmi.variable import FmuVariable
from orchestrator.signal import Array


def shape_of(variable: FmuVariable, lengths: Mapping[str, int]) -> tuple[int, ...]:
    """The shape of `variable` while structural parameters have the values `lengths`."""
    return tuple(
        axis.length if axis.structural is None else lengths[axis.structural]
        for axis in variable.axes
    )


def size_text(variable: FmuVariable) -> str:
    """The number of elements of an array, for people: `2 x n_sample`."""
    return " x ".join(str(axis.structural or axis.length) for axis in variable.axes)


def address_of(elements: Array) -> Any:
    """Where new `elements` are, as an argument of a C function; quicker than `ctypes.data`.

    Args:
        elements: contiguous and writable, any shape.

    Returns:
        A reference to the first element; `None` if there is none.
    """
    memory: Any = elements  # NumPy's stubs do not say that arrays are buffers
    return ctypes.byref(ctypes.c_char.from_buffer(memory)) if elements.size else None


class Block:
    """The values of `variables`, one after the other, and where they are in memory.

    Attributes:
        kind: the FMI type of its variables.
        variables: in a fixed order.
        dtype: of the elements in memory, as the FMI function wants them.
        references: address of the value references (uint32).
        size: number of elements.
        address: of the first element, once allocated.
        views: the part of each variable, in its shape, once allocated.
    """

    def __init__(self, kind: str, variables: Sequence[FmuVariable], dtype: npt.DTypeLike) -> None:
        self.kind = kind
        self.variables = tuple(variables)
        self.dtype = np.dtype(dtype)
        self._references = np.array([v.reference for v in variables], dtype=np.uint32)
        self.references: int = self._references.ctypes.data
        self._places: dict[str, tuple[int, int, int]] = {}
        self.views: dict[str, Array] = {}
        self._slices: list[tuple[str, int, int, tuple[int, ...]]] = []
        self._elements: Array = np.empty(0, self.dtype)
        self.address = 0
        self.size = 0

    def resize(self, lengths: Mapping[str, int]) -> None:
        """Let the arrays have these lengths."""
        self._slices = []
        stop = 0
        for variable in self.variables:
            shape = shape_of(variable, lengths)
            start, stop = stop, stop + math.prod(shape)
            self._slices.append((variable.name, start, stop, shape))
        self.size = stop

    def allocate(self) -> None:
        """Make room for values that are to be written; the old ones are lost."""
        self._elements = np.zeros(self.size, self.dtype)
        self.address = self._elements.ctypes.data
        self.views = self._split(self._elements)
        self._places = {
            name: (self.references + 4 * k, self.address + start * self.dtype.itemsize, end - start)
            for k, (name, start, end, _) in enumerate(self._slices)
        }

    def calls(self, names: Sequence[str]) -> list[tuple[int, int, int, int]]:
        """The fewest calls that set these variables: the block at once, or one by one.

        Each has the addresses of the references and of the elements, and how many there are of
        either: references, their number, elements, their number.
        """
        if len(names) == len(self.variables):
            return [(self.references, len(names), self.address, self.size)]
        return [(at, 1, where, size) for at, where, size in map(self._places.__getitem__, names)]

    def fresh(self) -> Array:
        """New memory for all elements, shape (size,), of type `dtype`; its values are arbitrary."""
        return np.empty(self.size, self.dtype)

    def split(self, elements: Array) -> dict[str, Array]:
        """The variables in `elements`, each a view in the shape of the variable.

        Args:
            elements: of all variables, one after the other, shape (size,); becomes read-only.
        """
        elements.flags.writeable = False
        return self._split(elements)

    def _split(self, elements: Array) -> dict[str, Array]:
        return {
            name: elements[start:stop].reshape(shape) for name, start, stop, shape in self._slices
        }


def blocks(variables: Iterable[FmuVariable], dtypes: Mapping[str, npt.DTypeLike]) -> list[Block]:
    """One block for each type in `dtypes` that occurs among `variables`."""
    groups: defaultdict[str, list[FmuVariable]] = defaultdict(list)
    for variable in variables:
        if variable.is_signal and variable.type in dtypes:
            groups[variable.type].append(variable)
    return [Block(kind, group, dtypes[kind]) for kind, group in groups.items()]
