"""Times as scenario files write them, and the units of differences."""

import math
from fractions import Fraction

from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, format_duration
from orchestrator.units import Quantity, UnitError, parse_quantity, parse_unit


def duration(value: str | float) -> Duration:
    """A time as scenario files write it, in nanoseconds: `50 ms`, or a number of seconds.

    Raises:
        UnitError: it is not a time, or not a whole number of nanoseconds.
    """
    if isinstance(value, str):
        quantity = parse_quantity(value)
        shown = value.strip()
        if quantity.unit.symbol == "1":
            raise UnitError(f"`{shown}` has no unit; write `{shown} s`")
    else:
        if not math.isfinite(value):
            raise UnitError(f"expected a time such as `50 ms`, got {value}")
        # the shortest decimal that reads as this float is what the author wrote
        quantity = Quantity(Fraction(repr(value)), parse_unit("s"))
        shown = f"{value} s"
    exact = quantity.into(parse_unit("s")) * NANOSECONDS_PER_SECOND
    if exact.denominator != 1:
        raise UnitError(f"{shown} is not a whole number of nanoseconds")
    return int(exact)


def difference(symbol: str) -> str:
    """The unit of differences of values in the unit `symbol`: `dB` for levels, `K` for `degC`.

    Raises:
        UnitError: the unit does not exist.
    """
    unit = parse_unit(symbol)
    if unit.reference is not None:
        return "dB"
    return "K" if unit.offset else symbol


__all__ = ["difference", "duration", "format_duration"]
