"""Connections: which output drives which input, or elements of it, and how."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from orchestrator.elements import Elements, named
from orchestrator.signal import Connector
from orchestrator.transformation import PLAIN, Mix, Part, Term, Transformation, is_plain, term

Connectors = Mapping[str, Connector]


@dataclass(frozen=True, slots=True, order=True)
class Endpoint:
    """One connector of one component, written `component.connector`."""

    component: str
    connector: str

    @classmethod
    def parse(cls, text: str) -> "Endpoint":
        """Split `text` at its first dot; the name of a connector may contain further ones.

        Raises:
            ValueError: there is nothing before or behind the first dot.
        """
        component, _, connector = text.partition(".")
        if not component or not connector:
            raise ValueError(f"`{text}` names no connector; write `component.connector`")
        return cls(component, connector)

    @override
    def __str__(self) -> str:
        return f"{self.component}.{self.connector}"


@dataclass(frozen=True, slots=True)
class Connection:
    """The output `source` drives the input `target`, or elements of it, by way of `way`."""

    source: Endpoint
    target: Endpoint
    way: Transformation = PLAIN

    @override
    def __str__(self) -> str:
        return f"`{self.source}{self.way.picked}` to `{self.target}{self.way.placed}`"


@dataclass(frozen=True, slots=True)
class Feed:
    """Where one driven input of a component comes from, if it takes an output as it is."""

    input: str
    component: str
    output: str


@dataclass(frozen=True, slots=True)
class Claim:
    """Elements of an input that somebody drives.

    Attributes:
        who: a connection, or a constant, for messages.
        placed: the elements.
    """

    who: str
    placed: Elements


def claim(link: Connection) -> Claim:
    """What a connection drives."""
    return Claim(f"`{link.source}{link.way.picked}`", link.way.placed)


def overlap(input_: Connector, earlier: Sequence[Claim], placed: Elements) -> list[str]:
    """Who drives some of these elements of an input already: a sentence, or none."""
    try:
        placed.of(input_.shape)
        shape = tuple(int(length) for length in input_.shape)
    except ValueError:
        shape = ()
    for other in earlier:
        if other.placed.are_all:
            return [f"{other.who} drives it already"]
        if placed.are_all:
            return [f"{other.who} drives elements of it already"]
        if shape:
            common = np.intersect1d(placed.places(shape), other.placed.places(shape))
            if len(common):
                return [f"{other.who} drives {named(common.tolist(), shape)} already"]
    return []


def routed(
    connectors: Mapping[str, Connectors], connections: Sequence[Connection]
) -> tuple[dict[str, tuple[Feed, ...]], dict[str, tuple[Mix, ...]]]:
    """The feeds and the mixes of each component."""
    links: dict[Endpoint, list[Connection]] = defaultdict(list)
    for link in connections:
        links[link.target].append(link)
    feeds: dict[str, list[Feed]] = {name: [] for name in connectors}
    mixes: dict[str, list[Mix]] = {name: [] for name in connectors}
    for component, own in connectors.items():
        for name, input_ in own.items():
            driving = links.get(Endpoint(component, name), [])
            outputs = [connectors[e.source.component][e.source.connector] for e in driving]
            if len(driving) == 1 and is_plain(outputs[0], input_, driving[0].way):
                source = driving[0].source
                feeds[component].append(Feed(name, source.component, source.connector))
            elif driving:
                mixes[component].append(_mix(name, input_, driving, outputs))
    return (
        {name: tuple(each) for name, each in feeds.items()},
        {name: tuple(each) for name, each in mixes.items()},
    )


def _mix(
    name: str, input_: Connector, driving: Sequence[Connection], outputs: Sequence[Connector]
) -> Mix:
    """How an input is made of what drives it."""
    parts: dict[Elements, list[Term]] = defaultdict(list)
    for link, output in zip(driving, outputs, strict=True):
        source = link.source
        found = term(source.component, source.connector, (output, input_), link.way)
        parts[link.way.placed].append(found)
    return Mix(
        name,
        None if input_.is_binary else np.dtype(input_.dtype),
        tuple(Part(placed, tuple(terms)) for placed, terms in parts.items()),
    )
