"""What a number is to be like: `> 3`, `<= 30 km/h`, `== true`."""

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from orchestrator.signal import Array
from orchestrator.units import Quantity, Unit, parse_quantity, parse_unit

_CONDITION: Final = re.compile(r"\s*(?P<sign>[<>]=?|[=!]=)\s*(?P<value>.*\S)\s*")
_SIGNS: Final[Mapping[str, Callable[[Any, Any], Any]]] = MappingProxyType(
    {
        "<": operator.lt,
        "<=": operator.le,
        ">": operator.gt,
        ">=": operator.ge,
        "==": operator.eq,
        "!=": operator.ne,
    }
)
_TRUTHS: Final = MappingProxyType({"true": "1", "false": "0"})


@dataclass(frozen=True, slots=True)
class Condition:
    """A comparison with a quantity.

    Attributes:
        sign: `<`, `<=`, `>`, `>=`, `==` or `!=`.
        bound: what is compared with.
        has_unit: whether it was written with a unit.
    """

    sign: str
    bound: Quantity
    has_unit: bool

    @classmethod
    def parse(cls, text: str) -> "Condition":
        """Read a condition.

        Raises:
            ValueError: it is none; a sentence.
        """
        match = _CONDITION.fullmatch(text)
        if match is None:
            raise ValueError(f"`{text}` is no condition; write `> 3`, `<= 30 km/h` or `== true`")
        bound = parse_quantity(_TRUTHS.get(match["value"].lower(), match["value"]))
        return cls(match["sign"], bound, bound.unit != parse_unit("1"))

    def holds(self, values: Array, unit: Unit | None) -> Array:
        """Where it holds, bool, shape (value,).

        Args:
            values: shape (value,).
            unit: of the values; `None` if it is none that we know.

        Raises:
            ValueError: the quantity is none of that unit.
        """
        bound = float(self.limit(unit))
        return np.asarray(_SIGNS[self.sign](values, bound), np.bool_)

    def limit(self, unit: Unit | None) -> float:
        """The number that values in `unit` are compared with; without a unit, as it is written.

        Raises:
            ValueError: the quantity is none of that unit.
        """
        if not self.has_unit:
            return float(self.bound.number)
        if unit is None:
            raise ValueError("the unit of the signal is none that we know; write a number alone")
        return float(self.bound.into(unit))
