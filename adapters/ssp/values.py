"""Parameter sets (SSV), parameter mappings (SSM) and signal dictionaries (SSB)."""

import math
from collections.abc import Mapping
from typing import Final

from adapters.ssp.common import change, port, unit_use, units
from adapters.ssp.grammar import REALS, WHOLES
from adapters.ssp.model import Entry, Port, Value
from adapters.ssp.node import Findings, Node
from orchestrator.units import Unit

_KINDS: Final = (*REALS, *WHOLES, "Boolean", "String", "Enumeration", "Binary")
_LISTED: Final = ("String", "Enumeration", "Binary")
"""Types whose arrays have an element for each value, as values may have spaces in them."""


def parameter_set(node: Node, prefix: str, findings: Findings) -> tuple[Value, ...]:
    """The values of an `ssv:ParameterSet`.

    Args:
        node: the element.
        prefix: put in front of their names.
        findings: what is wrong with them is added.
    """
    known = units(node.all("ssv:Units", "ssc:Unit"), findings)
    found = []
    for parameter in node.all("ssv:Parameters", "ssv:Parameter"):
        value = _value(parameter, prefix, known, findings)
        if value is not None:
            found.append(value)
    return tuple(found)


def _value(node: Node, prefix: str, known: Mapping[str, Unit], findings: Findings) -> Value | None:
    name = node.text("name")
    typed = [c for c in node.children if c.name.removeprefix("ssv:") in _KINDS]
    if len(typed) != 1:
        findings.add(node.where, f"`{name}` has {len(typed)} values; expected one")
        return None
    kind, element = typed[0].name.removeprefix("ssv:"), typed[0]
    listed = tuple(each.text("value") for each in element.all("ssv:Value"))
    text = element.get("value")
    if (text is None) == (not listed):
        findings.add(element.where, f"`{name}` needs either `value` or `ssv:Value`")
        return None
    texts = listed if text is None else (text,) if kind in _LISTED else tuple(text.split())
    _check_size(node, name, len(texts), findings)
    return Value(
        name=prefix + name,
        type=kind,
        texts=texts,
        unit=unit_use(element, known, findings),
        where=element.at("value"),
    )


def _check_size(node: Node, name: str, count: int, findings: Findings) -> None:
    sizes = list(node.all("ssc:Dimension"))
    if not sizes and count != 1:
        findings.add(node.where, f"`{name}` has {count} values and no `Dimension`")
    if sizes and all(each.get("size") is not None for each in sizes):
        expected = math.prod(int(findings.number(each, "size")) for each in sizes)
        if expected != count:
            findings.add(node.where, f"`{name}` has {count} values, by its dimensions {expected}")


def parameter_mapping(node: Node, findings: Findings) -> tuple[Entry, ...]:
    """The lines of an `ssm:ParameterMapping`."""
    found: dict[str, Entry] = {}
    for line in node.all("ssm:MappingEntry"):
        entry = Entry(
            source=line.text("source"),
            target=line.text("target"),
            change=change(line, findings),
            converts=not findings.is_true(line, "suppressUnitConversion"),
            where=line.where,
        )
        if entry.target in found:
            what = f"`{entry.target}` has a source already: `{found[entry.target].source}`"
            findings.add(line.at("target"), what)
        found[entry.target] = entry
    return tuple(found.values())


def signal_dictionary(node: Node, findings: Findings) -> dict[str, Port]:
    """The entries of an `ssb:SignalDictionary`, by name."""
    known = units(node.all("ssb:Units", "ssc:Unit"), findings)
    entries = node.all("ssb:DictionaryEntry")
    return {each.text("name"): port(each, known, findings, "inout") for each in entries}
