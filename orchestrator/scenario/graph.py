"""The wiring of an assembled scenario as a graph: who feeds whom, and how late."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from orchestrator.feedthrough import describe_outcome, is_within, loops
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import Assembly
from orchestrator.timebase import Duration


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """One component.

    Attributes:
        entry: the name under which the scenario says it; of an instance, that of all of them.
        copies: how many instances it stands for.
        origin: its installed type, or the path of its FMU.
        step: communication step size [ns].
        process: whether it runs in a process of its own where a transport is given.
        layer: the number of components before it on the longest chain without delay.
        feedthrough: for each output that has any, the inputs it depends on at the same time.
    """

    name: str
    entry: str
    copies: int = 1
    origin: str
    step: Duration
    process: bool
    layer: int
    feedthrough: Mapping[str, tuple[str, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """All connections from one component to another.

    Attributes:
        signals: pairs of output and input.
        youngest, oldest: the age of the values at the end of the target's steps [ns].
        is_forward: whether the source takes its turn first, and its newest value is seen.
        copies: how many pairs of instances it stands for.
    """

    source: str
    target: str
    signals: tuple[tuple[str, str], ...]
    youngest: Duration
    oldest: Duration
    is_forward: bool
    copies: int = 1


@dataclass(frozen=True, slots=True)
class Graph:
    """The wiring.

    Attributes:
        nodes: in the order in which they take turns.
        edges: in the order of their sources, then of their targets.
        loops: one sentence per algebraic loop.
    """

    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    loops: tuple[str, ...]


def graph_of(scenario: Scenario, assembly: Assembly) -> Graph:
    """The graph of `scenario`, whose components are those of `assembly`."""
    turn = {name: index for index, name in enumerate(assembly.turns)}
    edges = _edges(assembly, turn)
    layers = _layers(assembly.turns, edges)
    nodes = tuple(
        Node(
            name=name,
            entry=str(scenario.document.written(("components", name))[1]),
            origin=scenario.components[name].origin(),
            step=scenario.components[name].step,
            process=scenario.components[name].process,
            layer=layers[name],
            feedthrough=_feedthrough(assembly, name),
        )
        for name in assembly.turns
    )
    solved = assembly.algorithm.solved(assembly.system)
    sentences = [
        describe_outcome(loop, is_solved=is_within(loop, solved)) for loop in loops(assembly.system)
    ]
    return Graph(nodes, edges, tuple(sentences))


def _edges(assembly: Assembly, turn: Mapping[str, int]) -> tuple[Edge, ...]:
    signals: dict[tuple[str, str], list[tuple[str, str]]] = defaultdict(list)
    for link in assembly.system.connections:
        pair = link.source.component, link.target.component
        signals[pair].append((link.source.connector, link.target.connector))
    ages = assembly.algorithm.ages(assembly.system)
    edges = []
    for source, target in sorted(signals, key=lambda pair: (turn[pair[0]], turn[pair[1]])):
        age = ages[source, target]
        edges.append(
            Edge(
                source=source,
                target=target,
                signals=tuple(signals[source, target]),
                youngest=age.youngest,
                oldest=age.oldest,
                is_forward=turn[source] < turn[target] and age.youngest == 0,
            )
        )
    return tuple(edges)


def _layers(turns: Sequence[str], edges: Sequence[Edge]) -> dict[str, int]:
    layers = dict.fromkeys(turns, 0)
    for name in turns:
        for edge in edges:
            if edge.target == name and edge.is_forward:
                layers[name] = max(layers[name], layers[edge.source] + 1)
    return layers


def _feedthrough(assembly: Assembly, name: str) -> dict[str, tuple[str, ...]]:
    return {
        output: tuple(sorted(connector.feedthrough))
        for output, connector in assembly.system.connectors[name].items()
        if connector.feedthrough
    }


def folded(graph: Graph) -> Graph:
    """The graph with one node for all instances of a component, as the scenario says it.

    An edge has the signals of the first pair of instances, and the ages of all.
    """
    entries = {node.name: node.entry for node in graph.nodes}
    instances: dict[str, list[Node]] = defaultdict(list)
    for node in graph.nodes:
        instances[node.entry].append(node)
    pairs: dict[tuple[str, str], list[Edge]] = defaultdict(list)
    for edge in graph.edges:
        pairs[entries[edge.source], entries[edge.target]].append(edge)
    turns = list(instances)
    edges = tuple(
        replace(
            alike[0],
            source=source,
            target=target,
            youngest=min(edge.youngest for edge in alike),
            oldest=max(edge.oldest for edge in alike),
            is_forward=turns.index(source) < turns.index(target)
            and all(edge.is_forward for edge in alike),
            copies=len(alike),
        )
        for (source, target), alike in pairs.items()
    )
    layers = _layers(turns, edges)
    nodes = tuple(
        replace(alike[0], name=entry, copies=len(alike), layer=layers[entry])
        for entry, alike in instances.items()
    )
    return Graph(nodes, edges, graph.loops)


def grouped(signals: Sequence[tuple[str, str]]) -> list[str]:
    """Pairs as text; what lies beneath one group on both sides becomes one entry.

    >>> grouped([("vehicle.x", "vehicle.x"), ("vehicle.y", "vehicle.y"), ("a", "b")])
    ['vehicle.* (2)', 'a -> b']
    """
    groups: dict[str, list[str]] = defaultdict(list)
    for output, input_ in signals:
        prefix, dot, _ = output.partition(".")
        single = output if output == input_ else f"{output} -> {input_}"
        groups[f"{prefix}.*" if dot and output == input_ else single].append(single)
    return [
        f"{group} ({len(members)})" if len(members) > 1 else members[0]
        for group, members in groups.items()
    ]
