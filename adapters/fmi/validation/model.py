"""A modelDescription.xml as it is, right or wrong, in the words of the rules."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

from adapters.fmi.validation.document import Element
from adapters.fmi.validation.finding import Finding

FLOATS: Final = frozenset({"Real", "Float32", "Float64"})
INTEGERS: Final = frozenset(
    {"Integer", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64))}
)
KINDS: Final = ("ModelExchange", "CoSimulation", "ScheduledExecution")
_PARAMETERS: Final = frozenset({"parameter", "calculatedParameter", "structuralParameter"})

EXACT: Final = ("exact",)
_COMPUTED: Final = ("calculated", "approx")
_STATE: Final = ("calculated", "exact", "approx")
_RESTING: Final = ("fixed", "tunable")
_CHANGING: Final = ("discrete", "continuous")

INITIAL: Final[Mapping[tuple[str, str], tuple[str, ...]]] = {
    **{(c, v): EXACT for c in ("parameter", "structuralParameter") for v in _RESTING},
    **{(c, v): _COMPUTED for c in ("calculatedParameter", "local") for v in _RESTING},
    **{(c, v): _STATE for c in ("output", "local") for v in _CHANGING},
    **{("input", v): EXACT for v in _CHANGING},
    **{(c, "constant"): EXACT for c in ("output", "local")},
    ("independent", "continuous"): (),
}
"""The values that `initial` may have for a causality and a variability, the default first; what is
not in it is not allowed (FMI 2.0.4, 2.2.7; FMI 3.0.2, 2.4.7.4)."""

SECTIONS: Final[Mapping[str, tuple[str, str]]] = {
    "root": ("2.2.1", "2.4.1"),
    "flags": ("2.2.1", "2.4.2"),
    "units": ("2.2.2", "2.4.3"),
    "types": ("2.2.3", "2.4.4"),
    "categories": ("2.2.4", "2.4.5"),
    "experiment": ("2.2.5", "2.4.6"),
    "variables": ("2.2.7", "2.4.7"),
    "structure": ("2.2.8", "2.4.8"),
    "names": ("2.2.9", "2.4.7.5.1"),
    "terminals": ("2.2", "2.4.9"),
    "sources": ("2.3", "2.4.10"),
    "archive": ("2.3", "2.5"),
    "functions": ("2.1", "2.5"),
    "instance": ("2.1.5", "2.3.1"),
}
"""Where the standards 2.0.4 and 3.0.2 say the rules about something."""


@dataclass(frozen=True, slots=True, eq=False)
class TypeDefinition:
    """A declared type.

    Attributes:
        name: of the type.
        kind: the variables that may have it: `Real`, `Float64`, `Enumeration`.
        element: with the attributes.
    """

    name: str
    kind: str
    element: Element


@dataclass(frozen=True, slots=True, eq=False)
class Variable:
    """A variable; what is not written has its default.

    Attributes:
        element: of the variable.
        typed: with the attributes of its type; in FMI 3.0 the same element.
        index: its place in the list, from 1.
        name: as in the file.
        type: `Real`, `Float64`, `Enumeration`.
        reference: its value reference, if it is a number.
        causality, variability: as they count.
        initial: as it counts; `None` if it has none, or none can be said.
    """

    element: Element
    typed: Element
    index: int
    name: str
    type: str
    reference: int | None
    causality: str
    variability: str
    initial: str | None

    @property
    def starts(self) -> list[str] | None:
        """The start values as they are written, if there are any."""
        if self.element is self.typed and self.type in {"String", "Binary"}:
            return [e.get("value") or "" for e in self.element.all("Start")] or None
        text = self.typed.get("start")
        if text is None:
            return None
        return [text] if self.type in {"String", "Binary"} else text.split()

    @property
    def is_clocked(self) -> bool:
        """Whether it belongs to clocks."""
        return "clocks" in self.element.attributes


@dataclass(frozen=True, eq=False)
class Model:
    """One description.

    Attributes:
        file: what findings call it.
        root: of the document.
        version: 2 or 3.
    """

    file: str
    root: Element
    version: int

    variables: list[Variable] = field(init=False)
    types: dict[str, TypeDefinition] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "types", {t.name: t for t in self._types()})
        elements = enumerate(self.root.all("ModelVariables/*"), start=1)
        found = [self._variable(index, element) for index, element in elements]
        object.__setattr__(self, "variables", found)

    @cached_property
    def by_reference(self) -> dict[int, Variable]:
        """The first variable with each value reference."""
        return {v.reference: v for v in reversed(self.variables) if v.reference is not None}

    @cached_property
    def by_index(self) -> dict[int, Variable]:
        """Variables by their place in the list, from 1."""
        return {v.index: v for v in self.variables}

    @property
    def kinds(self) -> list[Element]:
        """The elements that say what the FMU can be used for."""
        return [element for element in self.root.children if element.tag in KINDS]

    @cached_property
    def units(self) -> dict[str, set[str]]:
        """The display units of each unit."""
        found: defaultdict[str, set[str]] = defaultdict(set)
        for unit in self.root.all("UnitDefinitions/Unit"):
            found[unit.get("name") or ""] |= {u.get("name") or "" for u in unit.all("DisplayUnit")}
        return dict(found)

    def reader(self, attribute: str, variable: Variable) -> Variable | None:
        """The variable that an attribute like `derivative` refers to."""
        known = self.by_index if self.version == 2 else self.by_reference
        return known.get(number(variable.typed.get(attribute)) or -1)

    def rule(self, about: str) -> str:
        """Where the standard of this version says the rules about something."""
        return f"FMI {('2.0.4', '3.0.2')[self.version - 2]}, {SECTIONS[about][self.version - 2]}"

    def finding(
        self, element: Element, what: str, about: str, attribute: str | None = None
    ) -> Finding:
        """A broken rule at an element, or at one of its attributes."""
        place = element.where(attribute)
        return Finding(file=self.file, place=place, what=what, rule=self.rule(about))

    def _types(self) -> Iterator[TypeDefinition]:
        for element in self.root.all("TypeDefinitions/*"):
            name = element.get("name") or ""
            if self.version == 3:
                yield TypeDefinition(name, element.tag.removesuffix("Type"), element)
            elif element.children:
                yield TypeDefinition(name, element.children[0].tag, element.children[0])

    def _variable(self, index: int, element: Element) -> Variable:
        typed = element
        if self.version == 2:
            types = FLOATS | INTEGERS | {"Boolean", "String", "Enumeration"}
            typed = next((c for c in element.children if c.tag in types), element)
        causality = element.get("causality") or "local"
        variability = element.get("variability") or self._variability(causality, typed.tag)
        allowed = INITIAL.get((causality, variability), ())
        return Variable(
            element=element,
            typed=typed,
            index=index,
            name=element.get("name") or "",
            type=typed.tag,
            reference=number(element.get("valueReference")),
            causality=causality,
            variability=variability,
            initial=element.get("initial") or (allowed[0] if allowed else None),
        )

    def _variability(self, causality: str, type_: str) -> str:
        if self.version == 2:
            return "continuous"
        if causality in _PARAMETERS:
            return "fixed"
        return "continuous" if type_ in FLOATS else "discrete"


def number(text: str | None) -> int | None:
    """A whole number, if it is one and not negative."""
    return int(text) if text is not None and re.fullmatch(r"\s*\d{1,18}\s*", text) else None
