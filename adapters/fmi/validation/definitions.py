"""Units, types, dimensions, bounds, clocks and the default experiment."""

import math
from collections.abc import Iterator
from typing import Final

from adapters.fmi.validation.document import Element
from adapters.fmi.validation.finding import Finding
from adapters.fmi.validation.model import FLOATS, INTEGERS, Model, Variable, number

_BITS: Final = {f"Int{b}": (-(2 ** (b - 1)), 2 ** (b - 1) - 1) for b in (8, 16, 32, 64)}
_RANGES: Final = {
    **_BITS,
    **{f"UInt{b}": (0, 2**b - 1) for b in (8, 16, 32, 64)},
    "Integer": _BITS["Int32"],
}
"""The least and the greatest value of each type of whole numbers."""


def findings(model: Model) -> Iterator[Finding]:
    """Broken rules about what variables refer to, and about numbers."""
    for type_ in model.types.values():
        yield from _units(model, type_.element, f"the type `{type_.name}`", "types")
        yield from _items(model, type_.element, type_.name)
    for variable in model.variables:
        yield from _units(model, variable.typed, f"`{variable.name}`", "variables")
        yield from _declared_type(model, variable)
        yield from _bounds(model, variable)
        if model.version == 3:
            yield from _dimensions(model, variable)
            yield from _clocks(model, variable)
    yield from _experiment(model)


def _units(model: Model, element: Element, what: str, about: str) -> Iterator[Finding]:
    unit, display = element.get("unit"), element.get("displayUnit")
    if unit is not None and unit not in model.units:
        text = f"{what} has the unit `{unit}`, which is not defined"
        yield model.finding(element, text, about, "unit")
    elif display is not None and unit is not None and display not in model.units[unit]:
        text = f"{what} has the display unit `{display}`, which `{unit}` does not define"
        yield model.finding(element, text, about, "displayUnit")


def _items(model: Model, element: Element, name: str) -> Iterator[Finding]:
    seen: dict[str | None, str | None] = {}
    for item in element.all("Item"):
        value = item.get("value")
        if value in seen:
            what = f"the items `{seen[value]}` and `{item.get('name')}` of the type `{name}` have "
            yield model.finding(item, f"{what}the same value, {value}", "types", "value")
        seen.setdefault(value, item.get("name"))


def _declared_type(model: Model, variable: Variable) -> Iterator[Finding]:
    element, said = variable.typed, variable.typed.get("declaredType")
    if said is None:
        if variable.type == "Enumeration":
            what = f"`{variable.name}` is an Enumeration and has no `declaredType`"
            yield model.finding(element, what, "variables")
        return
    type_ = model.types.get(said)
    if type_ is None:
        what = f"`{variable.name}` has the type `{said}`, which is not defined"
        yield model.finding(element, what, "variables", "declaredType")
    elif type_.kind != variable.type:
        what = f"`{variable.name}` is of type {variable.type}, `{said}` is for {type_.kind}"
        yield model.finding(element, what, "variables", "declaredType")


def _bounds(model: Model, variable: Variable) -> Iterator[Finding]:
    if variable.type not in FLOATS | INTEGERS | {"Enumeration"}:
        return
    element = variable.typed
    type_ = model.types.get(element.get("declaredType") or "")
    given = {name: _value(element.get(name)) for name in ("min", "max")}
    inherited = {} if type_ is None else {n: _value(type_.element.get(n)) for n in given}
    low, high = (given[n] if given[n] is not None else inherited.get(n) for n in given)
    if low is not None and high is not None and low > high:
        at = "min" if given["min"] is not None else "max"
        what = f"`{variable.name}`: min {low:g} is greater than max {high:g}"
        yield model.finding(element, what, "variables", at)
    for text in variable.starts or ():
        value = _value(text)
        if value is None:
            continue  # the schema has said so
        least, most = _RANGES.get(variable.type, (-math.inf, math.inf))
        if not least <= value <= most:
            what = f"`{variable.name}`: the start value {text} does not fit {variable.type}"
        elif low is not None and value < low:
            what = f"`{variable.name}`: the start value {text} is below min {low:g}"
        elif high is not None and value > high:
            what = f"`{variable.name}`: the start value {text} is above max {high:g}"
        else:
            continue
        yield model.finding(element, what, "variables", "start")


def _value(text: str | None) -> float | int | None:
    try:
        return None if text is None else int(text)
    except ValueError:
        pass
    try:
        return float(text or "")
    except ValueError:
        return None


def _dimensions(model: Model, variable: Variable) -> Iterator[Finding]:
    lengths: list[int | None] = []
    for dimension in variable.element.all("Dimension"):
        fixed = number(dimension.get("start"))
        by = model.by_reference.get(number(dimension.get("valueReference")) or -1)
        if dimension.get("valueReference") is None:
            lengths.append(fixed)
        elif by is None:
            what = f"a dimension of `{variable.name}` refers to the value reference "
            what += f"{dimension.get('valueReference')}, which no variable has"
            yield model.finding(dimension, what, "variables", "valueReference")
            lengths.append(None)
        elif by.type != "UInt64" or not _is_length(by):
            what = f"a dimension of `{variable.name}` refers to `{by.name}`, which is neither a "
            what += "structural parameter nor a constant of type UInt64"
            yield model.finding(dimension, what, "variables", "valueReference")
            lengths.append(None)
        else:
            lengths.append(number((by.starts or [""])[0]))
    known = [length for length in lengths if length is not None]
    starts = variable.starts
    if starts is None or len(known) < len(lengths):
        return
    count = math.prod(known)
    if len(starts) != count and len(starts) != 1:
        what = f"`{variable.name}` has {len(starts)} start values for {count} elements"
        yield model.finding(variable.element, what, "variables", "start")


def _is_length(variable: Variable) -> bool:
    return variable.causality == "structuralParameter" or variable.variability == "constant"


def _clocks(model: Model, variable: Variable) -> Iterator[Finding]:
    for said in (variable.element.get("clocks") or "").split():
        clock = model.by_reference.get(number(said) or -1)
        if clock is None or clock.type != "Clock":
            found = "no variable has" if clock is None else f"is `{clock.name}`, which is no clock"
            what = f"`{variable.name}` belongs to a clock with the value reference {said}, which "
            yield model.finding(variable.element, what + found, "variables", "clocks")
    if variable.is_clocked and variable.variability != "discrete":
        what = f"`{variable.name}` belongs to a clock, so it has to be discrete"
        yield model.finding(variable.element, what, "variables", "clocks")


def _experiment(model: Model) -> Iterator[Finding]:
    element = model.root.first("DefaultExperiment")
    if element is None:
        return
    found = {n: _value(element.get(n)) for n in ("startTime", "stopTime", "tolerance", "stepSize")}
    start, stop = found["startTime"], found["stopTime"]
    if start is not None and stop is not None and stop <= start:
        what = f"the default experiment stops at {stop:g}, not after its start at {start:g}"
        yield model.finding(element, what, "experiment", "stopTime")
    for name in ("tolerance", "stepSize"):
        value = found[name]
        if value is not None and value <= 0:
            what = f"`{name}` of the default experiment has to be positive, not {value:g}"
            yield model.finding(element, what, "experiment", name)
