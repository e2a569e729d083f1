"""Where values go: connections through systems, followed to the components at both ends."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final, TypeAlias

from adapters.ssp.model import (
    SOURCES,
    TARGETS,
    Component,
    Element,
    End,
    Group,
    Link,
    Port,
    Reference,
)
from adapters.ssp.node import Findings
from orchestrator.suggestion import suggestion

Path: TypeAlias = tuple[str, ...]
"""The names of elements from the top; empty for the top itself."""

_DICTIONARY: Final = "\0dictionary"


@dataclass(frozen=True, slots=True, order=True)
class Spot:
    """A connector of an element, or an entry of a signal dictionary."""

    path: Path
    connector: str


@dataclass(frozen=True, slots=True)
class Hop:
    """One connection, in the direction of values."""

    source: Spot
    target: Spot
    link: Link


@dataclass(frozen=True, slots=True)
class Flow:
    """How an input or a parameter of a component gets its values.

    Attributes:
        hops: the connections one after the other; the first begins at an output of a component,
            or where no connection leads to.
        is_driven: whether it begins at an output of a component.
    """

    hops: tuple[Hop, ...]
    is_driven: bool

    @property
    def source(self) -> Spot:
        """Where it begins."""
        return self.hops[0].source

    @property
    def target(self) -> Spot:
        """Where it ends."""
        return self.hops[-1].target

    def behind(self, spot: Spot) -> tuple[Hop, ...]:
        """The hops from a spot on; none if it does not pass through it."""
        for k, hop in enumerate(self.hops):
            if hop.source == spot:
                return self.hops[k:]
        return ()


@dataclass(frozen=True, slots=True)
class Network:
    """What connections make of a system.

    Attributes:
        ports: every connector, and every entry of a dictionary that is used.
        components: by path, in the order of the file.
        flows: in the order of the components and their connectors.
    """

    ports: Mapping[Spot, Port]
    components: Mapping[Path, Component]
    flows: tuple[Flow, ...]


def network(system: Group, findings: Findings) -> Network:
    """Follow all connections of a system.

    Args:
        system: at the top.
        findings: what is wrong with connections is added.
    """
    tracing = _Tracing(findings)
    tracing.enter((), system, {})
    return Network(tracing.ports, tracing.components, tuple(tracing.flows()))


class _Tracing:
    """One walk over a system and all systems in it."""

    def __init__(self, findings: Findings) -> None:
        self._findings = findings
        self._hops: dict[Spot, Hop] = {}
        self.ports: dict[Spot, Port] = {}
        self.components: dict[Path, Component] = {}

    def enter(self, path: Path, group: Group, outer: Mapping[str, Path]) -> None:
        """Note down a system, and all that is in it.

        Args:
            path: of the system.
            group: the system.
            outer: signal dictionaries of the systems around, by name.
        """
        known = {**outer, **{name: (_DICTIONARY, *path, name) for name in group.dictionaries}}
        for name, entries in group.dictionaries.items():
            self.ports.update({Spot(known[name], e): p for e, p in entries.items()})
        self.ports.update({Spot(path, name): port for name, port in group.ports.items()})
        for name, element in group.elements.items():
            self._note((*path, name), element, known)
        for link in group.links:
            self._connect(path, group, known, link)

    def _note(self, path: Path, element: Element, known: Mapping[str, Path]) -> None:
        if isinstance(element, Group):
            self.enter(path, element, known)
            return
        if isinstance(element, Component):
            self.components[path] = element
            self.ports.update({Spot(path, name): port for name, port in element.ports.items()})
            return
        entries = known.get(element.dictionary)
        if entries is None:
            what = f"there is no signal dictionary `{element.dictionary}`"
            self._findings.add(element.where, f"{what}; {suggestion(element.dictionary, known)}")
            return
        for name, port in element.ports.items():
            if Spot(entries, name) not in self.ports:
                what = f"the signal dictionary `{element.dictionary}` has no entry `{name}`"
                self._findings.add(port.where, what)

    def _connect(self, path: Path, group: Group, known: Mapping[str, Path], link: Link) -> None:
        """Note down one connection, in the direction of values."""
        ends = [self._end(path, group, known, link, end) for end in (link.start, link.end)]
        if None in ends:
            return
        (first, one), (last, other) = (end for end in ends if end is not None)
        is_forward = one == "gives" or other == "takes"
        if is_forward == (other == "gives" or one == "takes"):
            said = {"gives": "both ends give values", "takes": "both ends take values"}
            what = said.get(one, "nothing says in which direction values go")
            self._findings.add(link.where, f"{self._named(link)}: {what}")
            return
        hop = Hop(first, last, link) if is_forward else Hop(last, first, link)
        earlier = self._hops.get(hop.target)
        if earlier is not None and hop.source != hop.target:
            what = (
                f"`{hop.target.connector}` is connected in line {earlier.link.where.line} already"
            )
            self._findings.add(link.where, f"{self._named(link)}: {what}")
            return
        if hop.source != hop.target:
            self._hops[hop.target] = hop

    def _end(
        self, path: Path, group: Group, known: Mapping[str, Path], link: Link, end: End
    ) -> tuple[Spot, str] | None:
        """What an end of a connection is, and whether it gives values, takes them, or either."""
        if end.element is None:
            port = group.ports.get(end.connector)
            if port is None:
                self._missing(link, "the system", end.connector, group.ports)
                return None
            gives = port.kind in TARGETS
            return Spot(path, end.connector), _role(port, gives=gives, takes=port.kind in SOURCES)
        element = group.elements.get(end.element)
        if element is None:
            what = f"there is no element `{end.element}`; {suggestion(end.element, group.elements)}"
            self._findings.add(link.where, f"{self._named(link)}: {what}")
            return None
        port = element.ports.get(end.connector)
        if port is None:
            self._missing(link, f"`{end.element}`", end.connector, element.ports)
            return None
        role = _role(port, gives=port.kind in SOURCES, takes=port.kind in TARGETS)
        if isinstance(element, Reference):
            place = known.get(element.dictionary)
            return None if place is None else (Spot(place, end.connector), role)
        return Spot((*path, end.element), end.connector), role

    def _missing(self, link: Link, who: str, name: str, ports: Mapping[str, Port]) -> None:
        what = f"{who} has no connector `{name}`; {suggestion(name, ports)}"
        self._findings.add(link.where, f"{self._named(link)}: {what}")

    def _named(self, link: Link) -> str:
        ends = (f"{e.element}.{e.connector}" if e.element else e.connector for e in
                (link.start, link.end))  # fmt: skip
        return f"the connection of {' and '.join(f'`{end}`' for end in ends)}"

    def flows(self) -> Iterator[Flow]:
        """The flows to all connectors of components that take values."""
        for path, component in self.components.items():
            for name, port in component.ports.items():
                if Spot(path, name) in self._hops and port.kind not in SOURCES:
                    flow = self._followed(Spot(path, name))
                    if flow is not None:
                        yield flow

    def _followed(self, target: Spot) -> Flow | None:
        hops = [self._hops[target]]
        while (before := self._hops.get(hops[0].source)) is not None:
            if before in hops:
                what = f"`{target.connector}`: connections lead in a circle without a component"
                self._findings.add(before.link.where, what)
                return None
            hops.insert(0, before)
        return Flow(tuple(hops), hops[0].source.path in self.components)


def _role(port: Port, *, gives: bool, takes: bool) -> str:
    """What a connector does; `unspecified` and `inout` fit any other end."""
    if port.kind in {"inout", "unspecified"}:
        return "either"
    return "gives" if gives else "takes" if takes else "either"
