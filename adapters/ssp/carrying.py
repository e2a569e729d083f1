"""What becomes of numbers on their way: units are converted, then a linear function applied."""

from collections.abc import Mapping
from fractions import Fraction

from adapters.ssp.flows import Hop, Spot
from adapters.ssp.model import AS_IT_IS, Linear, Port, Table, UnitUse
from adapters.ssp.node import Findings


class UnlikeUnits(ValueError):  # noqa: N818 - a sentence, to be located by the caller
    """No linear function leads from one unit to another."""


def conversion(source: UnitUse | None, target: UnitUse | None, *, is_relative: bool) -> Linear:
    """What turns values of one unit into values of another; nothing if one of them is not known.

    Raises:
        UnlikeUnits: they measure different quantities.
    """
    if source is None or target is None or source.definition is None or target.definition is None:
        if source is not None and target is not None and source.name != target.name:
            unknown = source.name if source.definition is None else target.name
            raise UnlikeUnits(
                f"units differ: {source.name} and {target.name}, and nothing says what "
                f"`{unknown}` is"
            )
        return AS_IT_IS
    one, other = source.definition, target.definition
    if one.exponents != other.exponents or one.reference != other.reference:
        raise UnlikeUnits(f"units differ: {source.name} and {target.name}")
    offset = Fraction(0) if is_relative else one.offset - other.offset
    return Linear(one.factor / other.factor, offset / other.factor)


def carried(hops: tuple[Hop, ...], ports: Mapping[Spot, Port], findings: Findings) -> Linear | None:
    """What becomes of a number on its way over connections; `None` if that is no linear function.

    Args:
        hops: one after the other.
        ports: the connectors at their ends.
        findings: the reasons are added.
    """
    first = ports[hops[0].source]
    unit, total = first.unit, AS_IT_IS
    for hop in hops:
        target = ports[hop.target].unit
        if hop.link.converts:
            try:
                total = conversion(unit, target, is_relative=first.is_relative).after(total)
            except UnlikeUnits as error:
                findings.add(hop.link.where, str(error))
                return None
        change = hop.link.change
        if isinstance(change, Table):
            if change.changes:
                what = f"a scenario has no connection with a table of values ({change.kind})"
                findings.add(change.where, what)
                return None
        else:
            total = change.after(total)
        unit = target or unit
    return total
