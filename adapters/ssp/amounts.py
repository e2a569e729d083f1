"""Values of parameters on their way to a variable: numbers with units, truths, text, items."""

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Final

from adapters.fmi.variable import FmuVariable
from adapters.ssp.carrying import UnlikeUnits, conversion
from adapters.ssp.grammar import REALS, WHOLES
from adapters.ssp.model import AS_IT_IS, Change, Linear, Table, UnitUse, Value
from orchestrator.errors import Location
from orchestrator.exact import exact
from orchestrator.suggestion import suggestion

_TRUTHS: Final = {"true": True, "1": True, "false": False, "0": False}


class AmountError(ValueError):
    """A value that cannot be what it should be; a sentence.

    Attributes:
        where: what is wrong, if it is not the value.
    """

    def __init__(self, what: str, where: Location | None = None) -> None:
        super().__init__(what)
        self.where = where


@dataclass(frozen=True, slots=True)
class Amount:
    """The elements of a value.

    Attributes:
        type: `Real`, `Integer`, `Boolean`, `String`, `Enumeration` or `Binary`.
        elements: numbers, truths or text.
        unit: of numbers, or `None`.
    """

    type: str
    elements: tuple[Any, ...]
    unit: UnitUse | None

    @property
    def is_number(self) -> bool:
        """Whether its elements are numbers."""
        return self.type in {"Real", "Integer"}

    def become(self, unit: UnitUse | None, *, is_relative: bool) -> "Amount":
        """Convert it to another unit, if both are known.

        Raises:
            AmountError: they measure different quantities.
        """
        try:
            linear = conversion(self.unit, unit, is_relative=is_relative)
        except UnlikeUnits as error:
            raise AmountError(str(error)) from None
        return self._linear(linear)

    def of_unit(self, unit: UnitUse | None) -> "Amount":
        """Call its numbers those of a unit, if that is known."""
        return self if unit is None else replace(self, unit=unit)

    def changed(self, change: Change) -> "Amount":
        """What a transformation makes of it.

        Raises:
            AmountError: it is for values of another kind.
        """
        if isinstance(change, Linear):
            return self._linear(change)
        return self._mapped(change)

    def _linear(self, linear: Linear) -> "Amount":
        if linear == AS_IT_IS:
            return self
        if not self.is_number:
            raise AmountError(f"a linear transformation takes a number, not a {self.type}")
        return replace(self, type="Real", elements=tuple(map(linear.of, self.elements)))

    def _mapped(self, table: Table) -> "Amount":
        if table.kind != self.type:
            what = f"the table is for values of the type {table.kind}, not {self.type}"
            raise AmountError(what, table.where)
        return replace(self, elements=tuple(self._entry(table, each) for each in self.elements))

    def _entry(self, table: Table, element: Any) -> Any:
        key = str(element).lower() if self.type == "Boolean" else str(element)
        found = table.entries.get(key)
        if found is None:
            raise AmountError(f"the table has no entry for `{key}`", table.where)
        if self.type == "Integer":
            return Fraction(int(found))
        return _TRUTHS[found] if self.type == "Boolean" else found


def amount(value: Value) -> Amount:
    """What a parameter set says.

    Raises:
        AmountError: it is not of the type that it says.
    """
    try:
        if value.type in REALS:
            return Amount("Real", tuple(map(exact, value.texts)), value.unit)
        if value.type in WHOLES:
            return Amount("Integer", tuple(Fraction(int(t)) for t in value.texts), None)
    except ValueError as error:
        raise AmountError(str(error)) from None
    if value.type == "Boolean":
        wrong = next((t for t in value.texts if t.strip() not in _TRUTHS), None)
        if wrong is not None:
            raise AmountError(f"expected true or false, got `{wrong}`")
        return Amount("Boolean", tuple(_TRUTHS[t.strip()] for t in value.texts), None)
    return Amount(value.type, value.texts, None)


def set_as(variable: FmuVariable, found: Amount) -> Any:
    """A value as a scenario sets a parameter.

    Args:
        variable: of the FMU.
        found: in its unit.

    Returns:
        A number, a truth, text, the name of an item; a list of them for an array.

    Raises:
        AmountError: the variable cannot have it.
    """
    elements = [_element(variable, found, each) for each in found.elements]
    if variable.axes:
        return elements
    if len(elements) != 1:
        raise AmountError(f"it is a scalar, the value has {len(elements)} elements")
    return elements[0]


def _element(variable: FmuVariable, found: Amount, element: Any) -> Any:
    if variable.items:
        return _item(variable, found, element)
    kind = variable.type
    if kind in REALS and found.is_number:
        return float(element)
    if kind in WHOLES and found.is_number:
        if element.denominator != 1:
            raise AmountError(f"expected a whole number, got {float(element)!r}")
        return int(element)
    if kind in {"Boolean", "String"} and found.type == kind:
        return element
    raise AmountError(f"its type is {kind}, the value is of the type {found.type}")


def _item(variable: FmuVariable, found: Amount, element: Any) -> str:
    """The name of an item of an Enumeration, which may be given by its number."""
    if found.type == "Enumeration":
        if element not in variable.items:
            raise AmountError(f"no item `{element}`; {suggestion(element, variable.items)}")
        return str(element)
    names = {number: name for name, number in variable.items.items()}
    if not found.is_number or element not in names:
        raise AmountError(f"expected one of {', '.join(variable.items)}")
    return names[int(element)]
