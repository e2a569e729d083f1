"""Elements of arrays as connections write them: `[2]`, `[1, 0]`, `[0:3]`; counted from 0."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array

Shape: TypeAlias = tuple[int | str, ...]
"""Lengths of axes, and names of those whose length may change."""

_BRACKETS: Final = re.compile(r"(?P<name>.*[^\s\[\]])\[(?P<inside>[^\[\]]*)\]")
_RANGE: Final = re.compile(r"\s*(-?[0-9]+)?\s*:\s*(-?[0-9]+)?\s*(?::\s*(-?[0-9]+)?\s*)?")
_INDEX: Final = re.compile(r"\s*(-?[0-9]+)\s*")


@dataclass(frozen=True, slots=True)
class Span:
    """A range of indices along one axis; what is left out is `None`, as in a slice."""

    start: int | None = None
    stop: int | None = None
    step: int | None = None

    @override
    def __str__(self) -> str:
        ends = ":".join("" if n is None else str(n) for n in (self.start, self.stop))
        return ends if self.step is None else f"{ends}:{self.step}"


@dataclass(frozen=True, slots=True)
class Elements:
    """Some elements of an array, or all of them.

    Attributes:
        axes: an index or a range for each of the first axes; further axes are taken whole.
    """

    axes: tuple[int | Span, ...] = ()

    @classmethod
    def split(cls, text: str) -> "tuple[str, Elements] | None":
        """The name and the elements in `name[...]`; `None` if there are no brackets at the end.

        Raises:
            ValueError: what is in the brackets says no elements.
        """
        match = _BRACKETS.fullmatch(text)
        if match is None:
            return None
        return match["name"], cls(tuple(_axis(part, text) for part in match["inside"].split(",")))

    @property
    def are_all(self) -> bool:
        """Whether nothing was said, so that the whole value is meant."""
        return not self.axes

    @override
    def __str__(self) -> str:
        return f"[{', '.join(map(str, self.axes))}]" if self.axes else ""

    def of(self, shape: Shape) -> Shape:
        """The shape of these elements of an array of `shape`.

        Raises:
            ValueError: the array does not have them; the end of a sentence.
        """
        if len(self.axes) > len(shape):
            axes = f"{len(shape)} {'axis' if len(shape) == 1 else 'axes'}" if shape else "no axes"
            raise ValueError(f"`{self}` says {len(self.axes)}, and it has {axes}")
        rest: list[int | str] = []
        for number, (part, length) in enumerate(zip(self.axes, shape, strict=False)):
            if isinstance(length, str):
                if part != Span():
                    raise ValueError(
                        f"`{self}`: the length of its axis `{length}` may change; write `:` for it"
                    )
                rest.append(length)
            elif isinstance(part, Span):
                rest.append(self._count(part, length, number))
            elif not -length <= part < length:
                raise ValueError(f"`{self}`: axis {number} has the indices 0 to {length - 1}")
        return (*rest, *shape[len(self.axes) :])

    def _count(self, part: Span, length: int, number: int) -> int:
        """How many elements of an axis a range has."""
        for end in (part.start, part.stop):
            if end is not None and not -length <= end <= length:
                raise ValueError(f"`{self}`: axis {number} has the length {length}")
        if part.step == 0:
            raise ValueError(f"`{self}`: a step of 0 leads nowhere")
        count = len(range(length)[slice(part.start, part.stop, part.step)])
        if count == 0:
            raise ValueError(f"`{self}`: there are no elements in this range")
        return count

    def index(self) -> tuple[Any, ...]:
        """An index of NumPy for these elements, which gives an array also for a single one."""
        parts = (
            part if isinstance(part, int) else slice(part.start, part.stop, part.step)
            for part in self.axes
        )
        return (*parts, ...)

    def places(self, shape: Sequence[int]) -> Array:
        """Where these elements are in an array of `shape` in row-major order.

        Args:
            shape: that has them.

        Returns:
            Numbers of elements, int64, of the shape of the elements.
        """
        numbers: Array = np.arange(int(np.prod(shape, dtype=np.int64)), dtype=np.int64)
        found: Array = numbers.reshape(tuple(shape))[self.index()]
        return found


WHOLE: Final = Elements()
"""The whole value."""


def named(places: Sequence[int], shape: Sequence[int]) -> str:
    """Elements by their indices, for messages: `[0], [2]`; at most three of them."""
    shown = [
        f"[{', '.join(str(int(n)) for n in np.unravel_index(place, tuple(shape)))}]"
        for place in places[:3]
    ]
    rest = f" and {len(places) - 3} more" if len(places) > 3 else ""
    return ", ".join(shown) + rest


def _axis(part: str, text: str) -> int | Span:
    if match := _INDEX.fullmatch(part):
        return int(match[1])
    if match := _RANGE.fullmatch(part):
        return Span(*(None if n is None else int(n) for n in match.groups()))
    what = f"`{part.strip()}` is no index" if part.strip() else "an index is missing"
    raise ValueError(f"`{text}`: {what}; write `[2]`, `[1, 0]` or `[0:3]`, counted from 0")
