"""XML files of SSP: elements by the names of the standard, each with its place, checked."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Final

from adapters.fmi.validation.document import Element, MarkupError, Place, parse
from adapters.ssp.grammar import NAMESPACES, NOTES, OPENMODELICA, RULES, UNUSED, Rule
from orchestrator.errors import Location, Problem, ScenarioError
from orchestrator.exact import exact
from orchestrator.suggestion import suggestion

_DEEPEST: Final = 200
"""Levels of elements; a system of systems needs four for each of its levels."""

_OTHER: Final = "other-"
"""What names begin with whose prefix is one of the standard and stands for something else."""

_URIS: Final = {prefix: uri for uri, prefix in NAMESPACES.items()}

_ALWAYS: Final = ("xmlns", "xml", "xsi")


@dataclass(frozen=True, slots=True, eq=False)
class Node:
    """One element.

    Attributes:
        name: with the prefix that the standard uses; that of the file in other namespaces.
        attributes: by name.
        where: where it begins.
        places: where each attribute begins.
        children: the elements within.
    """

    name: str
    attributes: Mapping[str, str]
    where: Location
    places: Mapping[str, Location]
    children: tuple["Node", ...]

    def all(self, *names: str) -> Iterator["Node"]:
        """The elements at a path of names."""
        for child in self.children:
            if child.name == names[0]:
                if len(names) == 1:
                    yield child
                else:
                    yield from child.all(*names[1:])

    def first(self, *names: str) -> "Node | None":
        """The first element at a path of names, if there is one."""
        return next(self.all(*names), None)

    def get(self, name: str) -> str | None:
        """The value of an attribute, if it is there."""
        return self.attributes.get(name)

    def text(self, name: str) -> str:
        """The value of an attribute; empty if it is not there."""
        return self.attributes.get(name, "")

    def at(self, name: str) -> Location:
        """The place of an attribute; that of the element if it is not there."""
        return self.places.get(name, self.where)


@dataclass(slots=True)
class Findings:
    """What is wrong with a package, what may not be meant, and what is left out of it.

    Attributes:
        trusts_numbers: whether units that nothing defines are left out, so that numbers in them
            are taken as they are.
    """

    trusts_numbers: bool = False
    problems: list[Problem] = field(default_factory=list)
    remarks: list[Problem] = field(default_factory=list)
    unused: dict[str, Location] = field(default_factory=dict)

    def add(self, where: Location, what: str) -> None:
        """Something is wrong."""
        self.problems.append(Problem(where, what))

    def remark(self, where: Location, what: str) -> None:
        """Something may not be meant."""
        self.remarks.append(Problem(where, what))

    def leave_out(self, where: Location, what: str) -> None:
        """Something has no place in a scenario; said once, where it is found first."""
        self.unused.setdefault(what, where)

    def check(self) -> None:
        """Go on only if nothing is wrong.

        Raises:
            ScenarioError: all problems, in the order of the files.
        """
        if self.problems:
            unique = dict.fromkeys(sorted(self.problems, key=lambda p: (p.where, p.what)))
            raise ScenarioError(list(unique))

    def is_true(self, node: Node, name: str) -> bool:
        """Whether a Boolean attribute is there and true."""
        text = node.text(name).strip() or "false"
        if text not in {"true", "false", "1", "0"}:
            self.add(node.at(name), f"`{name}`: expected true or false, got `{text}`")
        return text in {"true", "1"}

    def number(self, node: Node, name: str, otherwise: str | None = None) -> Fraction:
        """A number as it is written, without rounding; 0 if there is none, which is a problem."""
        text = node.get(name)
        if text is None:
            text = otherwise or ""
        try:
            return exact(text)
        except ValueError as error:
            self.add(node.at(name), f"`{name}`: {error}")
            return Fraction(0)


def read(xml: bytes, file: str, root: str, findings: Findings) -> Node:
    """Read and check a file.

    Args:
        xml: the contents.
        file: what locations call it.
        root: the name of its outermost element.
        findings: everything that its schema does not know, or does not allow, is added.

    Raises:
        ScenarioError: it is no XML, or another file.
    """
    try:
        top = parse(xml)
    except MarkupError as error:
        where = Location(file, error.place.line, error.place.column)
        raise ScenarioError([Problem(where, f"is no XML: {error}")]) from error
    node = _resolved(top, file, {}, 0)
    if node.name != root:
        what = f"expected `{root}` of SSP 1.0 or 2.0, got `{top.tag}`"
        if node.name.startswith(_OTHER):
            what += f", whose prefix does not stand for {_URIS[root.partition(':')[0]]}"
        raise ScenarioError([Problem(node.where, what)])
    _check(node, findings)
    version = node.get("version")
    if version is not None and version not in {"1.0", "2.0"}:
        findings.add(node.at("version"), f"SSP `{version}` is not supported, 1.0 and 2.0 are")
    return node


def _resolved(element: Element, file: str, outer: Mapping[str, str], depth: int) -> Node:
    where = Location(file, element.place.line, element.place.column)
    if depth > _DEEPEST:
        raise ScenarioError([Problem(where, f"elements are nested more than {_DEEPEST} deep")])
    prefixes = dict(outer)
    for name, value in element.attributes.items():
        first, _, last = name.partition(":")
        if first == "xmlns":
            prefixes[last] = value
    return Node(
        _name(element.tag, prefixes),
        {n: v for n, v in element.attributes.items() if n.partition(":")[0] not in _ALWAYS},
        where,
        {n: _location(file, place) for n, place in element.places.items()},
        tuple(_resolved(child, file, prefixes, depth + 1) for child in element.children),
    )


def _location(file: str, place: Place) -> Location:
    return Location(file, place.line, place.column)


def _name(tag: str, prefixes: Mapping[str, str]) -> str:
    first, colon, last = tag.rpartition(":")
    known = NAMESPACES.get(prefixes.get(first, ""))
    if known is not None:
        return f"{known}:{last}"
    return f"{_OTHER}{tag}" if colon and first in _URIS else tag


def _check(node: Node, findings: Findings) -> None:
    """Everything in `node` that should not be there, or is missing."""
    if node.name in UNUSED:
        findings.leave_out(node.where, UNUSED[node.name])
    if node.name == "ssc:Annotation" and node.get("type") != NOTES:
        rest = ", except the step size" if node.get("type") == OPENMODELICA else ""
        findings.leave_out(node.where, f"annotations of `{node.text('type')}`{rest}")
    rule = RULES.get(node.name)
    if rule is None:  # told at the element that holds it
        return
    allowed = (*rule.required, *rule.optional)
    for name in node.attributes:
        if name not in allowed:
            hint = f"; {suggestion(name, allowed)}" if allowed else ""
            findings.add(node.at(name), f"`{node.name}` has no attribute `{name}`{hint}")
    for name in rule.required:
        if name not in node.attributes:
            findings.add(node.where, f"`{node.name}`: `{name}` is missing")
    _check_children(node, rule, findings)


def _check_children(node: Node, rule: Rule, findings: Findings) -> None:
    if rule.children is None:
        return
    for child in node.children:
        if child.name in rule.children:
            _check(child, findings)
        else:
            findings.add(child.where, f"`{node.name}` has no element `{child.name}`")
