"""Quantities such as `100 ms` or `26 dBm`, and exact conversions between units.

A unit is a product of powers of symbols, written as FMI and Modelica write it: `m/s2`, `m/s^2`,
`kg.m2`, `W/(m2.K)` (Modelica Language Specification 3.6, chapter 19, plus `^` and `*`).
Linear conversions are exact rational arithmetic, rounded once, when a float is asked for.
"""

import difflib
import functools
import math
import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from orchestrator.unit_table import (
    BASE_UNITS,
    FREQUENT,
    OFTEN_WRITTEN,
    PREFIXES,
    PURE,
    QUANTITIES,
    SYMBOLS,
    Exponents,
    Symbol,
)

NUMBER: Final = r"[-+]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][-+]?[0-9]{1,3})?"
_QUANTITY: Final = re.compile(rf"(?P<number>{NUMBER})\s*(?P<unit>.*)", re.DOTALL)
_FACTOR: Final = re.compile(r"(?P<symbol>[A-Za-zµμ°%]+)(?:\^?(?P<power>-?[0-9]))?|(?P<one>1)")
_LONGEST: Final = 100
"""Characters of a quantity; longer ones are not worth reading."""

_LARGEST: Final = 10**150
_SMALLEST: Final = Fraction(1, _LARGEST)
"""Conversions of numbers between these stay within the range of a float."""


class UnitError(ValueError):
    """A unit that does not exist, or a quantity of another kind than the one expected."""


class NoUnitError(UnitError):
    """A number without a unit where one is wanted; the end of a sentence about it."""


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of measurement.

    Attributes:
        symbol: as written.
        factor, offset: a value `v` in this unit is `v * factor + offset` in base units.
        exponents: of the base units, in the order of `unit_table.BASE_UNITS`.
        reference: for levels such as dBm, the power at level 0 [W]; `None` for linear units.
    """

    symbol: str
    factor: Fraction
    exponents: Exponents
    offset: Fraction = Fraction(0)
    reference: Fraction | None = None

    def quantity(self) -> str:
        """What it measures, for messages: `a speed (km/h)`."""
        powers = zip(BASE_UNITS, self.exponents, strict=True)
        base = ".".join(f"{n}{p if p != 1 else ''}" for n, p in powers if p)
        name = QUANTITIES.get(self.exponents, f"a quantity in {base}")
        return name if self.symbol == "1" else f"{name} ({self.symbol})"


@dataclass(frozen=True, slots=True)
class Quantity:
    """A number and its unit; the number is exact."""

    number: Fraction
    unit: Unit

    def into(self, target: Unit, *, is_difference: bool = False) -> Fraction:
        """The number in unit `target`; exact between linear units.

        Args:
            target: the unit.
            is_difference: whether this is a difference of quantities, so that the offsets of units
                do not count (FMI: `relativeQuantity`).

        Raises:
            UnitError: the two units measure different quantities, or the level of a power
                that is not positive is asked for.
        """
        source = self.unit
        if source.exponents != target.exponents:
            raise UnitError(f"expected {target.quantity()}, got {source.quantity()}")
        if source.reference == target.reference:
            if source.reference is not None:
                return self.number
            if is_difference:
                return self.number * source.factor / target.factor
            return (self.number * source.factor + source.offset - target.offset) / target.factor
        return _from_base(_to_base(self.number, source), target)


def _to_base(number: Fraction, unit: Unit) -> Fraction:
    if unit.reference is None:
        return number * unit.factor + unit.offset
    try:
        return unit.reference * Fraction(10 ** (float(number) / 10))
    except OverflowError:
        raise UnitError(f"{float(number):g} {unit.symbol} is too large a power") from None


def _from_base(value: Fraction, unit: Unit) -> Fraction:
    if unit.reference is None:
        return (value - unit.offset) / unit.factor
    ratio = value / unit.reference
    if ratio <= 0:
        raise UnitError(f"{float(value):g} W has no level in {unit.symbol}; it must be positive")
    level = 10 * (math.log10(ratio.numerator) - math.log10(ratio.denominator))
    return Fraction(level)


@functools.cache
def parse_unit(text: str) -> Unit:
    """Read a unit.

    Raises:
        UnitError: with the nearest unit that exists.
    """
    whole = text.strip()
    if whole in {"", "1"}:
        return Unit("1", Fraction(1), PURE)
    numerator, slash, denominator = whole.partition("/")
    if "/" in denominator:
        hint = f"write {numerator}/({'.'.join(denominator.replace(' ', '').split('/'))})"
        raise UnitError(f"`{whole}` has more than one `/`; {hint}")
    alone = SYMBOLS.get(whole) or (None if slash else _symbol(whole))
    if alone is not None:
        return Unit(whole, alone.factor, alone.exponents, alone.offset, alone.reference)
    terms = [(*term, 1) for term in _terms(numerator, whole)]
    if slash:
        inner = denominator.strip()
        if inner.startswith("(") and inner.endswith(")"):
            inner = inner[1:-1]
        elif len(re.split(r"[.*]", inner)) > 1:
            raise UnitError(f"`{whole}`: write the units below `/` in parentheses")
        terms += [(*term, -1) for term in _terms(inner, whole)]
    factor, powers = Fraction(1), PURE
    for symbol, power, sign in terms:
        if symbol.reference is not None:
            raise UnitError(f"`{whole}`: a level such as dBm cannot be part of another unit")
        factor *= symbol.factor ** (power * sign)
        powers = tuple(a + power * sign * b for a, b in zip(powers, symbol.exponents, strict=True))
    return Unit(whole, factor, powers)


def _terms(product: str, whole: str) -> list[tuple[Symbol, int]]:
    """The symbols of `kg.m2` and their powers."""
    terms = []
    for factor in re.split(r"[.*]", product):
        match = _FACTOR.fullmatch(factor.strip())
        if match is None:
            raise UnitError(_unknown(whole))
        if match["one"]:
            continue
        symbol = _symbol(match["symbol"])
        if symbol is None:
            raise UnitError(_unknown(whole))
        terms.append((symbol, int(match["power"] or 1)))
    return terms


def _symbol(text: str) -> Symbol | None:
    """A symbol with or without a prefix; whole symbols win, so `min` is not a milli-inch."""
    if text in SYMBOLS:
        return SYMBOLS[text]
    for length in (1, 2):
        power, known = PREFIXES.get(text[:length]), SYMBOLS.get(text[length:])
        if power is not None and known is not None and known.takes_prefix:
            return Symbol(known.factor * Fraction(10) ** power, known.exponents)
    return None


def _unknown(text: str) -> str:
    prefixed = [p + s for s, row in SYMBOLS.items() if row.takes_prefix for p in "GMkcmun"]
    known = [*FREQUENT, *SYMBOLS, *prefixed]
    folded = {name.casefold(): name for name in reversed(known)} | OFTEN_WRITTEN
    close = difflib.get_close_matches(text.casefold(), folded, n=1, cutoff=0.5)
    hint = f"; did you mean `{folded[close[0]]}`?" if close else ""
    return f"`{text}` is not a unit{hint}"


def number_in(
    text: str, symbol: str, definition: Unit | None = None, *, is_difference: bool = False
) -> Fraction:
    """The number of a quantity in a unit.

    Args:
        text: the quantity; where it says this very unit, its number is taken as it is.
        symbol: of the unit.
        definition: what its owner says that it is. FMI has no base unit of bits, say, so the table
            of units is asked, too, where the quantity is none of this.
        is_difference: see `Quantity.into`.

    Raises:
        NoUnitError: there is a number only, and the unit is not `1`.
        UnitError: there is no number, a unit is not known, or they measure different quantities.
    """
    number, written = _number_and_unit(text)
    if written in {"", "1"} and symbol != "1":
        raise NoUnitError(f"has no unit; write `{text.strip()} {symbol}`")
    if written == symbol:
        return number
    given = parse_unit(written)
    target = definition
    if target is None or target.exponents != given.exponents:
        try:
            target = parse_unit(symbol)
        except UnitError:
            if definition is None:
                what = f"write a number in it, or with `{symbol}` behind it"
                raise UnitError(f"nobody says what the unit `{symbol}` is; {what}") from None
            target = definition
    return Quantity(number, given).into(target, is_difference=is_difference)


def parse_quantity(text: str) -> Quantity:
    """Read a number and its unit, e.g. `5.9 GHz`; without a unit it is a pure number.

    Raises:
        UnitError: there is no number, or the unit does not exist.
    """
    number, unit = _number_and_unit(text)
    return Quantity(number, parse_unit(unit))


def _number_and_unit(text: str) -> tuple[Fraction, str]:
    """The parts of a quantity; `UnitError` if it does not begin with a number."""
    match = _QUANTITY.fullmatch(text.strip()) if len(text) <= _LONGEST else None
    if match is None:
        raise UnitError(f"`{text[:_LONGEST]}` is not a number with a unit")
    number = Fraction(match["number"])
    if number and not _SMALLEST < abs(number) < _LARGEST:
        raise UnitError(f"{match['number']} is out of range")
    return number, match["unit"]
