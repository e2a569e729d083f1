"""Times as scenario files write them, and the units of differences."""

import math
import re
from fractions import Fraction
from typing import Final

from orchestrator.timebase import (
    NANOSECONDS_PER_SECOND,
    Duration,
    StepSize,
    as_step_size,
    format_duration,
)
from orchestrator.units import Quantity, UnitError, parse_quantity, parse_unit

_FRACTION: Final = re.compile(
    r"\s*(?P<numerator>[0-9]{1,18})\s*/\s*(?P<denominator>[0-9]{1,18})\s*(?P<unit>[a-zµμ]*)\s*"
)


def duration(value: str | float) -> Duration:
    """A time as scenario files write it, in nanoseconds: `50 ms`, or a number of seconds.

    Raises:
        UnitError: it is not a time, not a whole number of nanoseconds, or longer than 292 years.
    """
    if isinstance(value, str):
        quantity = parse_quantity(value)
        shown = value.strip()
        if quantity.unit.symbol == "1":
            raise UnitError(f"`{shown}` has no unit; write `{shown} s`")
    else:
        if not isinstance(value, int) and not math.isfinite(value):
            raise UnitError(f"expected a time such as `50 ms`, got {value}")
        # the shortest decimal that reads as this float is what the author wrote
        quantity = Quantity(Fraction(repr(value)), parse_unit("s"))
        shown = f"{value} s"
    exact = quantity.into(parse_unit("s")) * NANOSECONDS_PER_SECOND
    if exact.denominator != 1:
        raise UnitError(f"{shown} is not a whole number of nanoseconds")
    _check_length(exact, shown)
    return int(exact)


def _check_length(nanoseconds: Fraction, shown: str) -> None:
    """Refuse a time that a signed integer of 64 bits does not hold."""
    if abs(nanoseconds) >= 1 << 63:
        raise UnitError(f"{shown:.40} is longer than 292 years, the nanoseconds of 64 bits")


def span(value: str | float) -> StepSize:
    """A time in nanoseconds that need not be whole, if it is written as a fraction: `1/60 s`.

    Raises:
        UnitError: it is not a time, shorter than a nanosecond, or a number that is not whole.
    """
    match = _FRACTION.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        try:
            return duration(value)
        except UnitError as error:
            is_odd = str(error).endswith("a whole number of nanoseconds")
            hint = "; write a step that is no decimal number as a fraction such as `1/60 s`"
            raise UnitError(f"{error}{hint}" if is_odd else str(error)) from None
    if not match["unit"]:
        raise UnitError(f"`{value}` has no unit; write `{match[0].strip()} s`")
    denominator = int(match["denominator"])
    if denominator == 0:
        raise UnitError(f"`{value}` divides by zero")
    whole = parse_quantity(f"{match['numerator']} {match['unit']}").into(parse_unit("s"))
    exact = whole / denominator * NANOSECONDS_PER_SECOND
    if 0 < exact < 1:
        raise UnitError(f"`{value}` is shorter than a nanosecond")
    _check_length(exact, match[0].strip())
    return as_step_size(exact)


def difference(symbol: str) -> str:
    """The unit of differences of values in the unit `symbol`: `dB` for levels, `K` for `degC`.

    Raises:
        UnitError: the unit does not exist.
    """
    unit = parse_unit(symbol)
    if unit.reference is not None:
        return "dB"
    return "K" if unit.offset else symbol


__all__ = ["difference", "duration", "format_duration", "span"]
