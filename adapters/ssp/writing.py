"""The XML of a description: elements by the prefixes of the standard."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from lxml import etree

from adapters.ssp.grammar import NAMESPACES, NOTES, OPENMODELICA
from orchestrator.unit_table import BASE_UNITS
from orchestrator.units import Unit

_OURS: Final = "urn:nlosim:ssp"
_OMS: Final = "https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"
_PREFIXES: Final = {
    **{prefix: uri for uri, prefix in NAMESPACES.items()},
    "nlosim": _OURS,
    "oms": _OMS,
}


@dataclass(frozen=True, slots=True)
class Tag:
    """One element to be written.

    Attributes:
        name: with a prefix of the standard.
        attributes: those that are `None` are left out.
        children: in their order.
    """

    name: str
    attributes: Mapping[str, str | None] = field(default_factory=dict)
    children: tuple["Tag", ...] = ()


def tag(name: str, /, *children: Tag | None, **attributes: str | None) -> Tag:
    """An element; children that are `None` are left out."""
    return Tag(name, attributes, tuple(child for child in children if child is not None))


def some(name: str, children: Iterable[Tag]) -> Tag | None:
    """An element around others; `None` if there are none, as lists must not be empty."""
    found = tuple(children)
    return Tag(name, {}, found) if found else None


def note(kind: str, said: Mapping[str, str], children: Iterable[Tag] = ()) -> Tag:
    """What nlosim notes down.

    Args:
        kind: of the element that it is about, for people.
        said: text by name.
        children: notes about elements within.
    """
    return Tag(f"nlosim:{kind}", said, tuple(children))


def noted(whole: Tag) -> Tag:
    """An annotation of nlosim around a note; SSP allows one element in it."""
    return tag("ssc:Annotation", whole, type=NOTES)


def steps_of_omsimulator(step: str) -> Tag:
    """An annotation that tells OMSimulator 2 and 3 the communication step size [s]."""
    master = tag("oms:FixedStepMaster", description="oms-ma", stepSize=step)
    solver = tag(
        "oms:SimulationInformation",
        master,
        name="oms_ma_default",
        method="oms_ma",
        fixedStepSize=step,
    )
    return tag("ssc:Annotation", tag("oms:Annotations", solver), type=OPENMODELICA)


def annotations(prefix: str, each: Iterable[Tag]) -> Tag:
    """Annotations of an element."""
    return Tag(f"{prefix}:Annotations", {}, tuple(each))


def unit(definition: Unit, name: str) -> Tag:
    """The definition of a unit, which has the base units of SSP only."""
    powers = zip(BASE_UNITS, definition.exponents, strict=True)
    base = {symbol: str(power) for symbol, power in powers if power}
    if definition.factor != 1:
        base["factor"] = repr(float(definition.factor))
    if definition.offset:
        base["offset"] = repr(float(definition.offset))
    return tag("ssc:Unit", Tag("ssc:BaseUnit", base), name=name)


def document(root: Tag) -> bytes:
    """The file, in UTF-8."""
    used = {uri: prefix for prefix, uri in _PREFIXES.items() if prefix in _prefixes(root)}
    made = _element(root, None, {prefix: uri for uri, prefix in used.items()})
    text: bytes = etree.tostring(made, xml_declaration=True, encoding="UTF-8", pretty_print=True)
    return text


def _prefixes(root: Tag) -> set[str]:
    found = {root.name.partition(":")[0]}
    for child in root.children:
        found |= _prefixes(child)
    return found


def _element(each: Tag, parent: Any, nsmap: Mapping[str, str] | None) -> Any:
    prefix, _, name = each.name.partition(":")
    full = f"{{{_PREFIXES[prefix]}}}{name}"
    said = {key: value for key, value in each.attributes.items() if value is not None}
    made = (
        etree.Element(full, said, nsmap=nsmap)
        if parent is None
        else etree.SubElement(parent, full, said)
    )
    for child in each.children:
        _element(child, made, None)
    return made
