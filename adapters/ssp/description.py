"""One variant of a package (SSD), with all that it refers to."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Final, TypeAlias

from adapters.ssp.common import change, inner_notes, notes, port, step_note, units
from adapters.ssp.model import (
    Binding,
    Component,
    Description,
    Element,
    End,
    Entry,
    Group,
    Link,
    Port,
    Reference,
)
from adapters.ssp.node import Findings, Node, read
from adapters.ssp.package import MAIN, Package, resolved
from adapters.ssp.values import parameter_mapping, parameter_set, signal_dictionary
from orchestrator.errors import Location, Problem, ScenarioError
from orchestrator.suggestion import suggestion

ROOT: Final = "ssd:SystemStructureDescription"
_FMU: Final = "application/x-fmu-sharedlibrary"
_SYSTEMS: Final = ("application/x-ssp-definition", "application/x-ssp-package")
_CREDITS: Final = (
    "author", "fileversion", "copyright", "license", "generationTool", "generationDateAndTime",
)  # fmt: skip
_DEEPEST: Final = 20
"""Descriptions within descriptions."""

_MOST: Final = 1_000
"""How many components of a package may stand for systems; ten that stand for ten each, ten levels
deep, would be more than a machine holds."""

Fmus: TypeAlias = dict[str, tuple[Package, str]]
"""Where the FMUs of components are: packages and names in them, by `Component.source`."""


def read_description(
    package: Package, variant: str | None, findings: Findings
) -> tuple[Description, Fmus]:
    """Read a variant of a package, with all that it refers to.

    Args:
        package: an archive.
        variant: its file or its name; `None` for the main one.
        findings: what is wrong with it, or left out, is added.

    Raises:
        ScenarioError: there is no such variant, or what is there cannot be read at all.
    """
    whole = _Whole(findings)
    return _Reader(package, _file(package, variant), whole).description(), whole.fmus


def _file(package: Package, variant: str | None) -> str:
    """The file of a variant."""
    where = Location(f"{package.name}/{MAIN}", 1, 1)
    wanted = variant or MAIN
    if package.has(wanted):
        return wanted
    if variant is None:
        raise ScenarioError([Problem(where, f"there is no `{MAIN}` at the top of the archive")])
    names: dict[str, str] = {}
    for file in package.variants():
        root = read(package.xml(file), f"{package.name}/{file}", ROOT, Findings())
        names.setdefault(root.text("name"), file)
    if variant not in names:
        what = f"there is no variant `{variant}`; {suggestion(variant, names)}"
        raise ScenarioError([Problem(where, what)])
    return names[variant]


@dataclass(slots=True)
class _Whole:
    """What all descriptions of a package add to.

    Attributes:
        included: how many components stood for systems so far.
    """

    findings: Findings
    fmus: Fmus = field(default_factory=dict)
    included: int = 0


class _Reader:
    """One reading of one description, of which `around` are in the middle of theirs."""

    def __init__(
        self, package: Package, file: str, whole: _Whole, around: tuple[tuple[str, str], ...] = ()
    ) -> None:
        self._package = package
        self._file = file
        self._whole = whole
        self._findings = whole.findings
        self._around = (*around, (package.name, file))
        self._root = read(package.xml(file), f"{package.name}/{file}", ROOT, whole.findings)
        self._units = units(self._root.all("ssd:Units", "ssc:Unit"), whole.findings)
        self._inside: list[str] = []

    def description(self) -> Description:
        root, findings = self._root, self._findings
        top = root.first("ssd:System")
        if top is None:
            raise ScenarioError([Problem(root.where, "there is no `ssd:System`")])
        experiment = root.first("ssd:DefaultExperiment")
        times = {} if experiment is None else experiment.attributes
        start, stop = (
            findings.number(experiment, name) if experiment is not None and name in times else None
            for name in ("startTime", "stopTime")
        )
        return Description(
            file=f"{self._package.name}/{self._file}",
            name=root.text("name"),
            version=root.text("version"),
            description=root.text("description"),
            credits={name: root.text(name) for name in _CREDITS if root.get(name)},
            system=self._group(top, top.text("name")),
            start=start,
            stop=stop,
            step=step_note(top, findings),
            said=notes(top),
            where=root.where if experiment is None else experiment.where,
        )

    def _group(self, node: Node, name: str) -> Group:
        elements: dict[str, Element] = {}
        for child in (c for each in node.all("ssd:Elements") for c in each.children):
            element = self._element(child)
            if element is None:
                continue
            if element.name in elements:
                what = f"the system `{name}` has an element `{element.name}` already"
                self._findings.add(child.at("name"), what)
            elements[element.name] = element
        return Group(
            name=name,
            ports=self._ports(node),
            bindings=self._bindings(node),
            elements=elements,
            links=tuple(map(self._link, node.all("ssd:Connections", "ssd:Connection"))),
            dictionaries=dict(
                map(self._dictionary, node.all("ssd:SignalDictionaries", "ssd:SignalDictionary"))
            ),
            where=node.where,
        )

    def _element(self, node: Node) -> Element | None:
        name = node.text("name")
        if not name:
            self._findings.add(node.at("name"), "an element has no name")
        if node.name == "ssd:System":
            return self._group(node, name)
        if node.name == "ssd:SignalDictionaryReference":
            ports = self._ports(node)
            if (bindings := node.first("ssd:ParameterBindings")) is not None:
                what = f"`{name}` is a signal dictionary, which has no parameters"
                self._findings.add(bindings.where, what)
            return Reference(
                name=name, dictionary=node.text("dictionary"), ports=ports, where=node.where
            )
        return self._component(node)

    def _component(self, node: Node) -> Element | None:
        findings, name = self._findings, node.text("name")
        kind = node.get("type") or _FMU
        source = node.get("source")
        if source is None:
            findings.add(node.where, f"the component `{name}` has no source, so nothing to run")
            return None
        try:
            file, fragment = resolved(source, self._file)
        except ValueError as error:
            findings.add(node.at("source"), str(error))
            return None
        if kind == _FMU and source.startswith("#"):
            kind = _SYSTEMS[0]
        if kind != _FMU and kind not in _SYSTEMS:
            what = f"the component `{name}` is of the type `{kind}`; FMUs and systems are supported"
            findings.add(node.at("type"), what)
            return None
        if not self._package.has(file):
            findings.add(node.at("source"), f"there is no `{file}` in the package")
            return None
        if kind in _SYSTEMS:
            return self._stands_for(node, file, fragment)
        key = "/".join((*self._package.inner, file))
        self._whole.fmus[key] = (self._package, file)
        return Component(
            name=name,
            description=node.text("description"),
            source=key,
            implementation=node.get("implementation") or "any",
            ports=self._ports(node),
            bindings=self._bindings(node),
            said={**notes(node), **self._noted(node.get("id"))},
            where=node.where,
        )

    def _noted(self, id_: str | None) -> dict[str, str]:
        """What is noted down at the top about the element of this id."""
        top = self._root.first("ssd:System")
        return {} if id_ is None or top is None else inner_notes(top, id_)

    def _stands_for(self, node: Node, file: str, fragment: str) -> Group | None:
        """The system that a component stands for, with the values of both."""
        try:
            group = self._other(file, fragment)
        except ValueError as error:
            self._findings.add(node.at("source"), str(error))
            return None
        for name, each in self._ports(node).items():
            if name not in group.ports:
                what = f"the system has no connector `{name}`; {suggestion(name, group.ports)}"
                self._findings.add(each.where, what)
        bindings = (*group.bindings, *self._bindings(node))
        return replace(group, name=node.text("name"), bindings=bindings, where=node.where)

    def _other(self, file: str, fragment: str) -> Group:
        """A system by its id in this file, that of another file, or of a package."""
        self._whole.included += 1
        if self._whole.included > _MOST:
            raise ValueError(f"more than {_MOST} components stand for systems")
        if file == self._file and fragment:
            return self._embedded(fragment)
        package, inner = self._package, file
        if file.endswith(".ssp"):
            package = self._package.within(file)
            inner = fragment or MAIN
            if not package.has(inner):
                raise ValueError(f"`{file}` has no `{inner}`")
        if (package.name, inner) in self._around or len(self._around) > _DEEPEST:
            raise ValueError(f"`{file}` contains itself")
        reader = _Reader(package, inner, self._whole, self._around)
        return reader.description().system

    def _embedded(self, id_: str) -> Group:
        found = next((n for n in _systems(self._root) if n.get("id") == id_), None)
        if found is None:
            raise ValueError(f"no system here has the id `{id_}`")
        if id_ in self._inside or len(self._inside) > _DEEPEST:
            raise ValueError(f"the system `{id_}` contains itself")
        self._inside.append(id_)
        try:
            return self._group(found, found.text("name"))
        finally:
            self._inside.pop()

    def _ports(self, node: Node) -> Mapping[str, Port]:
        found: dict[str, Port] = {}
        for each in node.all("ssd:Connectors", "ssd:Connector"):
            made = port(each, self._units, self._findings)
            if made.name in found:
                what = f"`{node.text('name')}` has a connector `{made.name}` already"
                self._findings.add(each.at("name"), what)
            found[made.name] = made
        return found

    def _link(self, node: Node) -> Link:
        for name in ("startIndices", "endIndices"):
            if node.get(name) is not None:
                what = f"`{name}`: SSP does not say whether indices count from 0 or from 1"
                self._findings.add(node.at(name), what)
        return Link(
            start=End(node.get("startElement") or None, node.text("startConnector")),
            end=End(node.get("endElement") or None, node.text("endConnector")),
            change=change(node, self._findings),
            converts=not self._findings.is_true(node, "suppressUnitConversion"),
            said=notes(node),
            where=node.where,
        )

    def _dictionary(self, node: Node) -> tuple[str, Mapping[str, Port]]:
        content = self._content(node, "ssb:SignalDictionary", "application/x-ssp-signal-dictionary")
        entries = {} if content is None else signal_dictionary(content, self._findings)
        return node.text("name"), entries

    def _bindings(self, node: Node) -> tuple[Binding, ...]:
        found = (
            self._binding(each)
            for each in node.all("ssd:ParameterBindings", "ssd:ParameterBinding")
        )
        return tuple(filter(None, found))

    def _binding(self, node: Node) -> Binding | None:
        inline = node.first("ssd:ParameterValues")
        content = self._content(node, "ssv:ParameterSet", "application/x-ssp-parameter-set", inline)
        if content is None:
            return None
        values = parameter_set(content, node.text("prefix"), self._findings)
        mapping: tuple[Entry, ...] | None = None
        mapped = node.first("ssd:ParameterMapping")
        if mapped is not None:
            lines = self._content(
                mapped, "ssm:ParameterMapping", "application/x-ssp-parameter-mapping"
            )
            mapping = () if lines is None else parameter_mapping(lines, self._findings)
        return Binding(values=values, mapping=mapping, where=node.where)

    def _content(
        self, node: Node, name: str, type_: str, inline: Node | None = None
    ) -> Node | None:
        """What stands within an element, or in the file that it names.

        Args:
            node: with `source`, or without.
            name: of the element that is asked for.
            type_: the one type of files that is known.
            inline: what holds it if it is not `node`.
        """
        findings, source = self._findings, node.get("source")
        if node.get("type") not in {None, type_}:
            findings.add(node.at("type"), f"`{node.text('type')}` is not supported, {type_} is")
            return None
        found = (inline or node).first(name)
        if source is None:
            if found is None:
                findings.add(node.where, f"`{node.name}` has neither `source` nor `{name}`")
            return found
        if found is not None:
            findings.add(node.at("source"), f"`{node.name}` has `source` and `{name}`")
        if node.get("sourceBase") == "component":
            what = "`sourceBase`: files within a component are not read; copy them to `resources`"
            findings.add(node.at("sourceBase"), what)
            return None
        try:
            file, _ = resolved(source, self._file)
        except ValueError as error:
            findings.add(node.at("source"), str(error))
            return None
        if not self._package.has(file):
            findings.add(node.at("source"), f"there is no `{file}` in the package")
            return None
        return read(self._package.xml(file), f"{self._package.name}/{file}", name, findings)


def _systems(node: Node) -> Iterator[Node]:
    """All systems in an element, itself included."""
    if node.name == "ssd:System":
        yield node
    for child in node.children:
        yield from _systems(child)
