"""The model structure: outputs, derivatives, initial unknowns and what they depend on."""

from collections.abc import Iterable, Iterator, Mapping
from typing import Final

from adapters.fmi.validation.document import Element
from adapters.fmi.validation.finding import Finding
from adapters.fmi.validation.model import Model, Variable, number

_LISTS: Final[Mapping[int, Mapping[str, str]]] = {
    2: {
        "Outputs/Unknown": "outputs",
        "Derivatives/Unknown": "derivatives",
        "InitialUnknowns/Unknown": "initial unknowns",
    },
    3: {
        "Output": "outputs",
        "ContinuousStateDerivative": "derivatives",
        "InitialUnknown": "initial unknowns",
        "ClockedState": "clocked states",
        "EventIndicator": "event indicators",
    },
}
"""The lists by their path below `ModelStructure`."""

_UNKNOWN: Final = frozenset({"approx", "calculated"})


def findings(model: Model) -> Iterator[Finding]:
    """Broken rules about what `ModelStructure` lists."""
    structure = model.root.first("ModelStructure")
    if structure is None:
        return  # the schema has said so
    listed: dict[str, dict[int, Element]] = {}
    for path, name in _LISTS[model.version].items():
        listed[name] = {}
        for element in structure.all(path):
            variable = _variable(model, element)
            if variable is None:
                said = element.get(_key(model))
                noun = "index" if model.version == 2 else "value reference"
                what = f"the {name} list the {noun} {said}, which no variable has"
                yield model.finding(element, what, "structure", _key(model))
                continue
            if variable.index in listed[name]:
                what = f"the {name} list `{variable.name}` twice"
                yield model.finding(element, what, "structure", _key(model))
            listed[name].setdefault(variable.index, element)
            yield from _dependencies(model, element, variable)
    yield from _complete(model, structure, listed)


def _key(model: Model) -> str:
    return "index" if model.version == 2 else "valueReference"


def _variable(model: Model, element: Element) -> Variable | None:
    known = model.by_index if model.version == 2 else model.by_reference
    place = number(element.get(_key(model)))
    return None if place is None else known.get(place)


def _dependencies(model: Model, element: Element, of: Variable) -> Iterator[Finding]:
    said, kinds = element.get("dependencies"), element.get("dependenciesKind")
    if said is None:
        if kinds is not None:
            what = f"`{of.name}` says `dependenciesKind` without `dependencies`"
            yield model.finding(element, what, "structure", "dependenciesKind")
        return
    known = model.by_index if model.version == 2 else model.by_reference
    for each in said.split():
        if number(each) not in known:
            what = f"`{of.name}` depends on {each}, which is no variable"
            yield model.finding(element, what, "structure", "dependencies")
    if kinds is not None and len(kinds.split()) != len(said.split()):
        what = f"`{of.name}` has {len(said.split())} `dependencies` and {len(kinds.split())} "
        yield model.finding(element, f"{what}`dependenciesKind`", "structure", "dependenciesKind")


def _complete(
    model: Model, structure: Element, listed: Mapping[str, Mapping[int, Element]]
) -> Iterator[Finding]:
    outputs = [v for v in model.variables if v.causality == "output"]
    yield from _compare(
        model, structure, "outputs", listed["outputs"], wanted=outputs, what="an output"
    )
    derivatives = [v for v in model.variables if "derivative" in v.typed.attributes]
    found = listed["derivatives"]
    yield from _compare(
        model,
        structure,
        "derivatives",
        found,
        wanted=derivatives if model.root.first("ModelExchange") is not None else [],
        what="the derivative of a state",
        also=derivatives,
    )
    states = [s for v in derivatives if (s := model.reader("derivative", v)) is not None]
    held = [v for v in (*states, *derivatives) if v.initial in _UNKNOWN]
    unknown = [v for v in outputs if not v.is_clocked and v.initial in _UNKNOWN]
    unknown += [v for v in model.variables if v.causality == "calculatedParameter"]
    text = "a calculated parameter, or an output, a state or a derivative whose `initial` is "
    yield from _compare(
        model,
        structure,
        "initial unknowns",
        listed["initial unknowns"],
        wanted=[*unknown, *(held if found else ())],
        what=text + "approx or calculated",
        also=held,
    )


def _compare(
    model: Model,
    structure: Element,
    name: str,
    listed: Mapping[int, Element],
    *,
    wanted: Iterable[Variable],
    what: str,
    also: Iterable[Variable] = (),
) -> Iterator[Finding]:
    """What is missing in a list, and what does not belong there."""
    needed = {variable.index: variable for variable in wanted}
    allowed = {*needed, *(variable.index for variable in also)}
    for index, variable in needed.items():
        if index not in listed:
            text = f"the {name} do not list `{variable.name}` in line {variable.element.place.line}"
            yield model.finding(structure, text, "structure")
    for index, element in listed.items():
        if index not in allowed:
            text = f"the {name} list `{model.by_index[index].name}`, which is not {what}"
            yield model.finding(element, text, "structure", _key(model))
