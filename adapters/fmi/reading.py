"""The variables in modelDescription.xml, defaults filled in."""

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Final
from xml.etree import ElementTree as ET

from adapters.fmi.caution import cautions
from adapters.fmi.undriven import annotated
from adapters.fmi.unit_definitions import read_definitions
from adapters.fmi.variable import Axis, Clock, ClockKind, FmuVariable
from orchestrator.absence import Undriven
from orchestrator.caution import Caution
from orchestrator.exact import exact
from orchestrator.units import Unit

_CLOCK_KINDS: Final = {kind.value: kind for kind in ClockKind}


def variables(parsed: Any, root: ET.Element) -> dict[str, FmuVariable]:
    """The variables by name, in the order of the file.

    Args:
        parsed: as FMPy reads them.
        root: of modelDescription.xml, for what FMPy leaves out.
    """
    enumeration = "Integer" if parsed.fmiVersion == "2.0" else "Int64"
    raw = _raw_attributes(root)
    listed = _listed_starts(root)
    dependencies = {
        unknown.variable.name: unknown.dependencies
        for unknown in parsed.outputs
        if unknown.dependencies is not None
    }
    definitions = read_definitions(root)
    undriven, warned = annotated(root), cautions(root)
    return {
        variable.name: _variable(
            variable,
            raw.get(variable.name, {}),
            dependencies,
            listed=listed,
            enumeration=enumeration,
            definitions=definitions,
            undriven=undriven,
            warned=warned,
        )
        for variable in parsed.modelVariables
    }


def _raw_attributes(root: ET.Element) -> dict[str, Mapping[str, str]]:
    """Attributes by variable name: FMPy drops the bounds of unsigned integers and mimeType."""
    found: dict[str, Mapping[str, str]] = {}
    for element in root.iterfind("ModelVariables/*"):
        typed = element[0].attrib if element.tag == "ScalarVariable" and len(element) else {}
        found[element.get("name", "")] = {**typed, **element.attrib}
    return found


def _listed_starts(root: ET.Element) -> dict[str, tuple[Any, ...]]:
    """The start values of FMI 3.0 that are elements, of which FMPy reads the first only."""
    found: dict[str, tuple[Any, ...]] = {}
    for element in root.iterfind("ModelVariables/*"):
        values = tuple(start.get("value", "") for start in element.iterfind("Start"))
        is_text = element.tag == "String"
        found[element.get("name", "")] = values if is_text else tuple(map(bytes.fromhex, values))
    return found


def _variable(
    parsed: Any,
    raw: Mapping[str, str],
    dependencies: Mapping[str, list[Any]],
    *,
    listed: Mapping[str, tuple[Any, ...]],
    enumeration: str,
    definitions: Mapping[str, Unit],
    undriven: Mapping[str, Undriven],
    warned: Mapping[str, Caution],
) -> FmuVariable:
    declared = parsed.declaredType
    unit = parsed.unit or (declared.unit if declared is not None else None) or "1"
    low = raw.get("min", declared.min if declared is not None else None)
    high = raw.get("max", declared.max if declared is not None else None)
    minimum = None if low is None else _number(low)
    maximum = None if high is None else _number(high)
    known = dependencies.get(parsed.name)
    return FmuVariable(
        name=parsed.name,
        reference=parsed.valueReference,
        type=enumeration if parsed.type == "Enumeration" else parsed.type,
        causality=parsed.causality,
        variability=parsed.variability,
        initial=parsed.initial or "",
        unit=unit,
        definition=definitions.get(unit),
        is_relative=_is_relative(raw, declared),
        start=listed.get(parsed.name) or _start(parsed),
        minimum=minimum,
        maximum=maximum,
        items=_items(declared, minimum, maximum) if parsed.type == "Enumeration" else {},
        axes=tuple(map(_axis, parsed.dimensions)),
        dependencies=None if known is None else frozenset(v.name for v in known),
        mime_type=raw.get("mimeType", "application/octet-stream"),
        clock=_clock(raw) if parsed.type == "Clock" else None,
        clocks=tuple(int(each) for each in raw.get("clocks", "").split()),
        derivative_of=None if parsed.derivative is None else parsed.derivative.name,
        description=parsed.description or "",
        undriven=undriven.get(parsed.name),
        caution=warned.get(parsed.name),
    )


def _clock(raw: Mapping[str, str]) -> Clock:
    """FMI 3.0.2, 2.4.7.5: a fraction counts, if there is one, else the decimal."""
    said = raw.get("intervalVariability", "")
    resolution = int(raw.get("resolution", "1"))

    def time(name: str) -> Fraction | None:
        if f"{name}Counter" in raw and "resolution" in raw:
            return Fraction(int(raw[f"{name}Counter"]), resolution)
        return exact(raw[f"{name}Decimal"]) if f"{name}Decimal" in raw else None

    return Clock(
        kind=_CLOCK_KINDS.get(said, ClockKind.PERIODIC),
        interval=time("interval"),
        shift=time("shift") or Fraction(0),
        priority=int(raw.get("priority", "0")),
        is_fraction=raw.get("supportsFraction") in {"true", "1"},
    )


def _is_relative(raw: Mapping[str, str], declared: Any) -> bool:
    """FMI 2.0.4, 2.2.7, and 3.0.2, 2.4.7.5: what a variable says overrides its type."""
    if "relativeQuantity" in raw:
        return raw["relativeQuantity"] in {"true", "1"}
    return declared is not None and bool(declared.relativeQuantity)


def _items(declared: Any, minimum: float | None, maximum: float | None) -> dict[str, int]:
    """FMI 3.0.2, 2.4.4: items outside the bounds are not allowed."""
    low = -math.inf if minimum is None else minimum
    high = math.inf if maximum is None else maximum
    values = {item.name: int(item.value) for item in declared.items} if declared else {}
    return {name: value for name, value in values.items() if low <= value <= high}


def _axis(dimension: Any) -> Axis:
    if dimension.variable is None:
        return Axis(length=int(dimension.start), structural=None)
    return Axis(length=int(dimension.variable.start), structural=dimension.variable.name)


def _number(text: str) -> float:
    """Integers stay exact: a float has no room for the largest ones."""
    try:
        return int(text)
    except ValueError:
        value = float(text)
        return int(value) if math.isfinite(value) and value == int(value) else value


def _start(parsed: Any) -> tuple[Any, ...]:
    if parsed.start is None:
        return ()
    if parsed.type == "String":
        return (parsed.start,)
    if parsed.type == "Binary":
        return (bytes.fromhex(parsed.start),)
    words = parsed.start.split()
    if parsed.type == "Boolean":
        return tuple(word in {"true", "1"} for word in words)
    if parsed.type in {"Real", "Float32", "Float64"}:
        return tuple(float(word) for word in words)
    return tuple(int(word) for word in words)
