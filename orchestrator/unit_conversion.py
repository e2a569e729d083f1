"""From the unit of an output to that of an input.

FMI 2.0.4 (section 2.2.2) and 3.0.2 (section 2.4.3) define a unit by a factor, an offset and the
exponents of base units: `base = factor * value + offset`. Two units with the same exponents are
converted into each other; of relative quantities, such as differences of temperatures, without the
offsets. Units of connectors for which no FMU has a definition are looked up in the table of units.
"""

from fractions import Fraction
from typing import Final

from orchestrator.operation import Operation, add, divide, multiply
from orchestrator.signal import Connector
from orchestrator.units import Unit, UnitError, parse_unit

_SIMPLE: Final = 10**9
"""A ratio of numbers up to this is converted by these numbers, as people write them."""


class UnitsDifferError(ValueError):
    """Why values of one unit are none of the other; a sentence."""


def conversion(output: Connector, input_: Connector) -> tuple[Operation, ...]:
    """What turns values of an output into values of an input; nothing for equal units.

    Raises:
        UnitsDifferError: the units measure different quantities, or no linear function leads from
            one to the other.
    """
    same_name = output.unit == input_.unit
    if same_name and (output.definition is None or input_.definition is None):
        return ()
    differ = f"units differ: {output.unit} and {input_.unit}"
    source, target = unit_of(output), unit_of(input_)
    if source is None or target is None or source.exponents != target.exponents:
        raise UnitsDifferError(differ)
    if source.reference != target.reference:
        level = source if source.reference is not None else target
        what = f"{level.symbol} is a level, which no gain converts; convert it in a component"
        raise UnitsDifferError(f"{differ} ({what})")
    factors = _factors(source, target)
    shift = source.offset - target.offset
    if shift and output.is_relative != input_.is_relative:
        what = "one is a difference (relativeQuantity), the other is not"
        raise UnitsDifferError(f"{differ} ({what})")
    is_shifted = shift and not output.is_relative
    return (*factors, *([add(float(shift / target.factor))] if is_shifted else []))


def unit_of(connector: Connector) -> Unit | None:
    """The unit of a connector, of the table if it does not define it; `None` if none is known."""
    if connector.definition is not None:
        return connector.definition
    try:
        return parse_unit(connector.unit)
    except UnitError:
        return None


def _factors(source: Unit, target: Unit) -> tuple[Operation, ...]:
    """Multiplications that cost as few roundings as can be."""
    ratio = source.factor / target.factor
    if float(ratio) == 1.0:
        return ()
    if abs(ratio.numerator) <= _SIMPLE and ratio.denominator <= _SIMPLE:
        up, down = Fraction(ratio.numerator), Fraction(ratio.denominator)
    else:
        up, down = source.factor, target.factor
    return (
        *([multiply(float(up))] if up != 1 else []),
        *([divide(float(down))] if down != 1 else []),
    )
