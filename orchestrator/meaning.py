"""What the values of a signal mean, beyond type and shape, as far as a connector declares it."""

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class Meaning:
    """What every value of a signal is to be.

    Attributes:
        minimum: inclusive bound of all elements; `None`: there is none.
        maximum: likewise.
        is_ascending: whether each element along the first axis is greater than the one before.
        numbers: what each element is the number of, such as `vehicle`; empty: of nothing.
        names: of what each element is a number that an output has given, by `numbers`; empty: of
            nothing.
        nobody: the element that names none.
        items: the only numbers that elements may be, each with its name: the items of an
            Enumeration; empty: there are others.
    """

    minimum: float | None = None
    maximum: float | None = None
    is_ascending: bool = False
    numbers: str = ""
    names: str = ""
    nobody: int = -1
    items: tuple[tuple[str, int], ...] = ()

    def violations(self, value: "np.ndarray[Any, Any]") -> list[str]:
        """How a value breaks bounds and order: at most one predicate for each.

        Args:
            value: numbers, of any shape.
        """
        found = []
        if self.minimum is not None and (value < self.minimum).any():
            found.append(_beyond(value, value < self.minimum, "below", self.minimum))
        if self.maximum is not None and (value > self.maximum).any():
            found.append(_beyond(value, value > self.maximum, "above", self.maximum))
        if self.items:
            known = np.isin(value, [number for _, number in self.items])
            if not known.all():
                found.append(f"{_at(value, ~known)}, none of {self.listed()}")
        if self.is_ascending and len(value) > 1 and not (value[1:] > value[:-1]).all():
            k = int(np.argwhere(~(value[1:] > value[:-1]))[0][0])
            found.append(f"does not ascend: {value[k]} is followed by {value[k + 1]}")
        return found

    def listed(self) -> str:
        """The items, each with its number."""
        return ", ".join(f"{number} {name}" for name, number in self.items)


def _beyond(value: "np.ndarray[Any, Any]", wrong: Any, side: str, bound: float) -> str:
    return f"{_at(value, wrong)}, {side} the declared {bound:g}"


def _at(value: "np.ndarray[Any, Any]", wrong: Any) -> str:
    """Which element is the first that is `wrong`."""
    index = tuple(map(int, np.argwhere(wrong)[0]))
    at = f" at index {list(index)}" if index else ""
    return f"is {value[index]}{at}"
