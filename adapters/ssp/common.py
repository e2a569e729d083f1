"""What the files of SSP have in common: units, types, changes of values, notes of tools."""

from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from typing import Final

from adapters.ssp.grammar import NOTES, OPENMODELICA, REALS, WHOLES
from adapters.ssp.model import AS_IT_IS, Change, Linear, Port, Table, UnitUse
from adapters.ssp.node import Findings, Node
from orchestrator.errors import Location
from orchestrator.unit_table import exponents
from orchestrator.units import Unit, UnitError, parse_unit

TOP: Final = ("seed", "coupling", "recording", "measures", "tables", "report")
"""Keys of a scenario that nlosim notes down in a description, as JSON; `title`, `description` and
`until` are noted down as text."""

COMPONENT: Final = ("process", "deadline", "memory", "without", "parameters")
"""Likewise, of a component; its `step` is noted down as text."""

TYPES: Final = (*REALS, *WHOLES, "Boolean", "String", "Enumeration", "Binary", "Clock")
_KINDS: Final = frozenset(
    {"input", "output", "parameter", "calculatedParameter", "structuralParameter", "constant",
     "local", "inout", "unspecified"}
)  # fmt: skip
_STEPS: Final = ("stepSize", "fixedStepSize")
"""What OMSimulator 2 and 3 call it."""

_BASE: Final = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
_WAYS: Final = {
    f"ssc:{kind}MappingTransformation": kind for kind in ("Boolean", "Integer", "Enumeration")
}


def units(nodes: Iterable[Node], findings: Findings) -> dict[str, Unit]:
    """The units that a file defines, by name.

    Args:
        nodes: each an `ssc:Unit`.
        findings: what is wrong with them is added.
    """
    found: dict[str, Unit] = {}
    for node in nodes:
        name, base = node.text("name"), node.first("ssc:BaseUnit")
        if base is None:
            findings.add(node.where, f"the unit `{name}` has no `ssc:BaseUnit`")
            continue
        powers = {symbol: findings.number(base, symbol, "0") for symbol in _BASE}
        for symbol, power in powers.items():
            if power.denominator != 1:
                findings.add(base.at(symbol), f"`{symbol}`: expected a whole number")
        factor = findings.number(base, "factor", "1")
        offset = findings.number(base, "offset", "0")
        if not factor:
            findings.add(base.at("factor"), f"the factor of the unit `{name}` is 0")
        elif name in found:
            findings.add(node.at("name"), f"the unit `{name}` is defined twice")
        else:
            whole = {symbol: int(power) for symbol, power in powers.items()}
            found[name] = Unit(name, factor, exponents(**whole), offset)
    return found


def unit_use(node: Node, known: Mapping[str, Unit], findings: Findings) -> UnitUse | None:
    """The unit that an element names, if it does; the table of units helps out."""
    name = node.get("unit")
    if not name:
        return None
    definition = known.get(name)
    if definition is None:
        try:
            definition = parse_unit(name)
        except UnitError:
            if findings.trusts_numbers:
                what = f"the unit `{name}`, which nothing defines; numbers are taken as they are"
                findings.leave_out(node.at("unit"), what)
                return None
    return UnitUse(name=name, definition=definition, where=node.at("unit"))


def port(
    node: Node, known: Mapping[str, Unit], findings: Findings, kind: str | None = None
) -> Port:
    """A connector, or an entry of a signal dictionary.

    Args:
        node: `ssd:Connector` or `ssb:DictionaryEntry`.
        known: units by name.
        findings: what is wrong with it is added.
        kind: of an entry; a connector says its own.
    """
    said = kind or node.text("kind")
    if said not in _KINDS:
        findings.add(node.at("kind"), f"`kind`: there is no `{said}`")
    name = node.text("name")
    types = [child for child in node.children if child.name.removeprefix("ssc:") in TYPES]
    if len(types) > 1:
        findings.add(types[1].where, f"`{name}` has a type already")
    if any(child.name == "ssc:Clock" for child in types) or node.first("ssd:Clock"):
        findings.add(node.where, f"`{name}`: clocks are not supported")
    dimensions = list(node.all("ssc:Dimension"))
    return Port(
        name=name,
        kind=said,
        type=types[0].name.removeprefix("ssc:") if types else None,
        unit=unit_use(types[0], known, findings) if types else None,
        is_array=bool(dimensions),
        where=node.where,
    )


def change(node: Node, findings: Findings) -> Change:
    """What the element says happens to values besides the conversion of their unit."""
    linear = node.first("ssc:LinearTransformation")
    if linear is not None:
        return Linear(
            findings.number(linear, "factor", "1"), findings.number(linear, "offset", "0")
        )
    for name, kind in _WAYS.items():
        table = node.first(name)
        if table is not None:
            return _table(table, kind, findings)
    return AS_IT_IS


def _table(node: Node, kind: str, findings: Findings) -> Table:
    entries: dict[str, str] = {}
    for line in node.all("ssc:MapEntry"):
        source, target = (
            normal(line, name, kind, findings, line.text(name)) for name in ("source", "target")
        )
        if source in entries:
            findings.add(line.where, f"`{source}` has an entry already")
        entries[source] = target
    return Table(kind, entries, node.where)


def normal(node: Node, name: str, kind: str, findings: Findings, text: str) -> str:
    """One value as it is compared: Booleans are `true` and `false`, whole numbers without signs.

    Args:
        node: where it is.
        name: of the attribute that has it.
        kind: `Boolean`, `Integer`, `Enumeration`.
        findings: what is wrong with it is added.
        text: as written.
    """
    words = {"true": "true", "1": "true", "false": "false", "0": "false"}
    if kind == "Boolean":
        if text.strip() not in words:
            findings.add(node.at(name), f"`{name}`: expected true or false, got `{text}`")
        return words.get(text.strip(), "false")
    if kind == "Integer":
        try:
            return str(int(text))
        except ValueError:
            findings.add(node.at(name), f"`{name}`: expected a whole number, got `{text[:40]}`")
            return "0"
    return text


def notes(node: Node) -> dict[str, str]:
    """What nlosim has noted down in the annotations of an element."""
    return {name: text for each in _notes(node) for name, text in each.attributes.items()}


def inner_notes(node: Node, of: str) -> dict[str, str]:
    """What nlosim has noted down there about an element within it, whose id is `of`."""
    return {
        name: text
        for whole in _notes(node)
        for each in whole.children
        if each.get("of") == of
        for name, text in each.attributes.items()
        if name != "of"
    }


def _notes(node: Node) -> Iterator[Node]:
    for annotation in node.all("ssd:Annotations", "ssc:Annotation"):
        if annotation.get("type") == NOTES:
            yield from annotation.children


def step_note(node: Node, findings: Findings) -> tuple[Fraction, Location] | None:
    """The communication step size that OMSimulator has noted down within an element [s]."""
    for annotation in node.all("ssd:Annotations", "ssc:Annotation"):
        if annotation.get("type") == OPENMODELICA:
            for each in _all(annotation):
                for name in _STEPS:
                    if each.get(name) is not None:
                        return findings.number(each, name), each.at(name)
    return None


def _all(node: Node) -> Iterable[Node]:
    for child in node.children:
        yield child
        yield from _all(child)
