"""Causality, variability, initial and start of variables."""

import re
from collections.abc import Iterator
from typing import Final

from adapters.fmi.validation.finding import Finding
from adapters.fmi.validation.model import FLOATS, INITIAL, Model, Variable

_NOT_SET: Final = {2: ("input", "independent"), 3: ("independent",)}
"""The causalities of variables that must not say `initial`."""


def findings(model: Model) -> Iterator[Finding]:
    """Broken rules about what variables are."""
    for variable in model.variables:
        yield from _combination(model, variable)
        yield from _start(model, variable)
        yield from _references(model, variable)
    yield from _independent(model)


def _combination(model: Model, variable: Variable) -> Iterator[Finding]:
    element, name = variable.element, variable.name
    causality, variability = variable.causality, variable.variability
    if variability == "continuous" and variable.type not in FLOATS:
        default = "" if "variability" in element.attributes else ", the default,"
        what = f"`{name}` is of type {variable.type}; only floating-point numbers can be continuous"
        yield model.finding(element, what + default.rstrip(","), "variables", "variability")
    if (causality, variability) not in INITIAL:
        said = "" if "variability" in element.attributes else " (the default)"
        what = f"`{name}` cannot have the causality {causality} and the variability {variability}"
        yield model.finding(element, what + said, "variables", "causality")
        return
    initial, allowed = element.get("initial"), INITIAL[causality, variability]
    if initial is None:
        return
    if causality in _NOT_SET[model.version]:
        what = f"`{name}` has the causality {causality}, so it cannot say `initial`"
        yield model.finding(element, what, "variables", "initial")
    elif initial not in allowed:
        what = f"`{name}` cannot have `initial` {initial}: with the causality {causality} and the "
        what += f"variability {variability} it is {' or '.join(sorted(allowed))}"
        yield model.finding(element, what, "variables", "initial")


def _start(model: Model, variable: Variable) -> Iterator[Finding]:
    has_start = variable.starts is not None
    if variable.type == "Clock":
        return
    why = _why_start(variable)
    if why and not has_start:
        what = f"`{variable.name}` has no start value, which {why} needs"
        yield model.finding(variable.element, what, "variables")
    no = _why_no_start(variable)
    if no and has_start:
        what = f"`{variable.name}` has a start value, which {no} cannot have"
        yield model.finding(variable.typed, what, "variables", "start")


def _why_start(variable: Variable) -> str:
    if variable.causality in {"input", "parameter", "structuralParameter"}:
        return f"an {variable.causality}" if variable.causality == "input" else "a parameter"
    if variable.variability == "constant":
        return "a constant"
    if variable.initial in {"exact", "approx"}:
        return f"`initial` {variable.initial}"
    return ""


def _why_no_start(variable: Variable) -> str:
    if variable.causality == "independent":
        return "the independent variable"
    if variable.initial == "calculated":
        return "`initial` calculated"
    return ""


def _references(model: Model, variable: Variable) -> Iterator[Finding]:
    """`derivative`, `reinit`, and what only Model Exchange has."""
    typed, name = variable.typed, variable.name
    if "derivative" in typed.attributes:
        yield from _derivative(model, variable)
    if typed.says("reinit") and not _is_state(model, variable):
        what = f"`{name}` says `reinit`, which only a continuous state can"
        yield model.finding(typed, what, "variables", "reinit")
    attribute = "canHandleMultipleSetPerTimeInstant"
    if attribute in variable.element.attributes and variable.causality != "input":
        what = f"`{name}` says `{attribute}`, which only an input can"
        yield model.finding(variable.element, what, "variables", attribute)


def _derivative(model: Model, variable: Variable) -> Iterator[Finding]:
    said = variable.typed.get("derivative")
    state = model.reader("derivative", variable)
    if state is None:
        whose = "variable of the index" if model.version == 2 else "variable of the value reference"
        what = f"`{variable.name}` is the derivative of nothing: there is no {whose} {said}"
    elif state is variable:
        what = f"`{variable.name}` is its own derivative"
    elif state.variability != "continuous" or state.type not in FLOATS:
        what = f"`{variable.name}` is the derivative of `{state.name}`, which is not continuous"
    else:
        return
    yield model.finding(variable.typed, what, "variables", "derivative")


def _is_state(model: Model, variable: Variable) -> bool:
    readers = (v for v in model.variables if "derivative" in v.typed.attributes)
    return any(model.reader("derivative", v) is variable for v in readers)


def _independent(model: Model) -> Iterator[Finding]:
    found = [v for v in model.variables if v.causality == "independent"]
    for variable in found:
        if variable.type not in FLOATS:
            what = f"the independent variable `{variable.name}` is of type {variable.type}; "
            what += "it has to be a floating-point number"
            yield model.finding(variable.element, what, "variables")
    for variable in found[1:]:
        what = f"`{variable.name}` is a second independent variable, besides `{found[0].name}`"
        yield model.finding(variable.element, what, "variables", "causality")
    if not found and model.version == 3:
        element = model.root.first("ModelVariables") or model.root
        yield model.finding(element, "there is no independent variable", "variables")


def plain(text: str) -> bool:
    """Whether a text has a form in which the standard writes numbers."""
    return re.fullmatch(r"\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*", text) is not None
