"""Names and value references."""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from typing import Final

from adapters.fmi.validation.document import Element
from adapters.fmi.validation.finding import Finding
from adapters.fmi.validation.model import Model, Variable

_QUOTED: Final = r"""'(?:[\w!#$%&()*+,\-./:;<>=?@\[\]^{}|~ ]|\\['"?\\abfnrtv])+'"""
_PART: Final = rf"(?:[A-Za-z_][A-Za-z_0-9]*|{_QUOTED})(?:\[\d+(?:,\d+)*\])?"
_IDENTIFIER: Final = rf"{_PART}(?:\.{_PART})*"
STRUCTURED: Final = re.compile(rf"{_IDENTIFIER}|der\({_IDENTIFIER}(?:,\d+)?\)", re.ASCII)
"""Names of the convention `structured`."""

C_IDENTIFIER: Final = re.compile(r"[A-Za-z_][A-Za-z_0-9]*", re.ASCII)


def findings(model: Model) -> Iterator[Finding]:
    """Broken rules about names and value references."""
    yield from _unique(model)
    yield from _spelling(model)
    yield from _references(model) if model.version == 3 else _alias_sets(model)


def _named(model: Model) -> Iterator[Element]:
    """The variables and, in FMI 3.0, their aliases."""
    for variable in model.variables:
        yield variable.element
        yield from variable.element.all("Alias")


def _unique(model: Model) -> Iterator[Finding]:
    types = list(model.root.all("TypeDefinitions/*"))
    yield from _twice(model, _named(model), "variable", "variables")
    yield from _twice(model, types, "type", "types")
    yield from _twice(model, model.root.all("UnitDefinitions/Unit"), "unit", "units")
    yield from _twice(model, model.root.all("LogCategories/Category"), "category", "categories")
    for unit in model.root.all("UnitDefinitions/Unit"):
        yield from _twice(model, unit.all("DisplayUnit"), "display unit", "units")
    variables = {element.get("name"): element for element in _named(model)}
    for type_ in types:
        other = variables.get(type_.get("name"))
        if other is not None:
            what = f"the type `{type_.get('name')}` has the name of the variable {_line(other)}"
            yield model.finding(type_, what, "types", "name")


def _twice(model: Model, elements: Iterable[Element], what: str, about: str) -> Iterator[Finding]:
    first: dict[str, Element] = {}
    for element in elements:
        name = element.get("name")
        if name is None:
            continue  # the schema has said so
        if name in first:
            text = f"the {what} `{name}` is there already, {_line(first[name])}"
            yield model.finding(element, text, about, "name")
        elif not name and what != "unit":
            yield model.finding(element, f"the name of the {what} is empty", about, "name")
        first.setdefault(name, element)


def _line(element: Element) -> str:
    return f"in line {element.place.line}"


def _spelling(model: Model) -> Iterator[Finding]:
    is_structured = model.root.get("variableNamingConvention") == "structured"
    for element in _named(model):
        name = element.get("name")
        if name and is_structured and not STRUCTURED.fullmatch(name):
            what = f"`{name}` is no name of the naming convention `structured`"
            yield model.finding(element, what, "names", "name")
        elif name and re.search(r"[\r\n\t]", name):
            what = f"{name!r} contains a carriage return, a line feed or a tab"
            yield model.finding(element, what, "names", "name")
    for kind in model.kinds:
        identifier = kind.get("modelIdentifier")
        if identifier is not None and not C_IDENTIFIER.fullmatch(identifier):
            what = f"`{identifier}` is no identifier of C"
            yield model.finding(kind, what, "flags", "modelIdentifier")


def _references(model: Model) -> Iterator[Finding]:
    for variable in model.variables:
        if variable.reference is None:
            continue
        first = model.by_reference[variable.reference]
        if first is not variable:
            what = f"`{variable.name}` has the value reference of `{first.name}`"
            what += f" {_line(first.element)}, {variable.reference}"
            yield model.finding(variable.element, what, "variables", "valueReference")


def _alias_sets(model: Model) -> Iterator[Finding]:
    """FMI 2.0: variables of one base type with one value reference have one value."""
    groups: defaultdict[tuple[str, int], list[Variable]] = defaultdict(list)
    for variable in model.variables:
        if variable.reference is not None:
            base = "Integer" if variable.type == "Enumeration" else variable.type
            groups[base, variable.reference].append(variable)
    for group in groups.values():
        for other in group[1:]:
            for what in _alias_problems(group[0], other):
                text = f"`{other.name}` is an alias of `{group[0].name}` "
                text += f"({_line(group[0].element)}), but {what}"
                yield model.finding(other.element, text, "variables", "valueReference")


def _alias_problems(first: Variable, other: Variable) -> Iterator[str]:
    constants = [v.variability == "constant" for v in (first, other)]
    if any(constants) and not all(constants):
        yield "only one of them is constant"
    elif all(constants) and first.starts != other.starts:
        yield "their start values differ"
    elif _is_set(first) and _is_set(other):
        yield "both can be set"
    elif not all(constants) and first.starts is not None and other.starts is not None:
        yield "both have a start value"
    if first.typed.get("unit") != other.typed.get("unit"):
        yield "their units differ"


def _is_set(variable: Variable) -> bool:
    return variable.causality in {"parameter", "input", "independent"}
