"""The wiring of an assembled scenario as a graph: who feeds whom, and how late."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from orchestrator.algorithm.age import Age
from orchestrator.algorithm.base import Pattern, ages_of
from orchestrator.constant import shown
from orchestrator.feedthrough import describe_outcome, is_within, loops
from orchestrator.gaps import Gap, gaps
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import Assembly
from orchestrator.system import Connection, System
from orchestrator.timebase import Duration, StepSize
from orchestrator.transformation import described


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """One component.

    Attributes:
        entry: the name under which the scenario says it; of an instance, that of all of them.
        copies: how many instances it stands for.
        origin: its installed type, or the path of its FMU.
        step: communication step size [ns].
        process: whether it runs in a process of its own.
        layer: the number of components before it on the longest chain without delay.
        feedthrough: for each output that has any, the inputs it depends on at the same time.
        lag: how old these inputs are when the output is published [ns].
        host: on which it is, where a hosts file says how to get there.
    """

    name: str
    entry: str
    copies: int = 1
    origin: str
    step: StepSize
    process: Isolation
    layer: int
    feedthrough: Mapping[str, tuple[str, ...]]
    lag: StepSize = 0
    host: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Edge:
    """All connections from one component to another.

    Attributes:
        signals: pairs of output and input, with the elements that are read and driven.
        changes: what happens on the way, as text, by pair; of those where anything does.
        youngest, oldest: the age of the values at the end of the target's steps [ns].
        is_forward: whether the source takes its turn first, and its newest value is seen.
        copies: how many pairs of instances it stands for.
    """

    source: str
    target: str
    signals: tuple[tuple[str, str], ...]
    changes: Mapping[tuple[str, str], str]
    youngest: StepSize
    oldest: StepSize
    is_forward: bool
    copies: int = 1


@dataclass(frozen=True, slots=True)
class Graph:
    """The wiring.

    Attributes:
        nodes: in the order in which they take turns.
        edges: in the order of their sources, then of their targets; connections with a delay or a
            sample time of their own have an edge of their own.
        constants: inputs, or elements of them, with their values.
        loops: one sentence per algebraic loop.
        gaps: inputs that nothing drives.
    """

    nodes: tuple[Node, ...]
    edges: tuple[Edge, ...]
    constants: tuple[tuple[str, str], ...]
    loops: tuple[str, ...]
    gaps: tuple[Gap, ...] = ()


class _Key(NamedTuple):
    """What connections that share an edge have in common."""

    source: str
    target: str
    delay: Duration
    sample: StepSize


def graph_of(scenario: Scenario, assembly: Assembly) -> Graph:
    """The graph of `scenario`, whose components are those of `assembly`."""
    turn = {name: index for index, name in enumerate(assembly.turns)}
    edges = _edges(assembly, turn)
    layers = _layers(assembly.turns, edges)
    lags = assembly.algorithm.lags(assembly.system)
    nodes = tuple(
        Node(
            name=name,
            entry=str(scenario.document.written(("components", name))[1]),
            origin=scenario.components[name].origin(),
            step=scenario.components[name].step,
            process=scenario.components[name].process,
            layer=layers[name],
            feedthrough=_feedthrough(assembly, name),
            lag=lags.get(name, 0),
            host=scenario.components[name].host,
        )
        for name in assembly.turns
    )
    solved = assembly.algorithm.solved(assembly.system)
    sentences = [
        describe_outcome(loop, is_solved=is_within(loop, solved)) for loop in loops(assembly.system)
    ]
    constants = tuple(
        (f"{each.target}{each.placed}", shown(each.value)) for each in assembly.system.constants
    )
    without = {name: use.without for name, use in scenario.components.items()}
    left_open = gaps(assembly.system, without)
    return Graph(nodes, edges, constants, tuple(sentences), left_open)


def _edges(assembly: Assembly, turn: Mapping[str, int]) -> tuple[Edge, ...]:
    system, links = assembly.system, defaultdict[_Key, list[Connection]](list)
    for link in system.connections:
        way = link.way
        links[_Key(link.source.component, link.target.component, way.delay, way.sample)] += [link]
    ages = ages_of(assembly.algorithm, system)
    reads_at_start = assembly.algorithm.pattern is Pattern.PARALLEL
    edges = []
    for key in sorted(links, key=lambda k: (turn[k.source], turn[k.target], k.delay, k.sample)):
        sizes = system.step_sizes[key.source], system.step_sizes[key.target]
        age = ages[key.source, key.target]
        if key.delay:
            age = Age.delayed(*sizes, key.delay, reads_at_start=reads_at_start)
        if key.sample:
            age = age.sampled(key.sample, sizes[1])
        found = [(_pair(link), _change(system, link)) for link in links[key]]
        edges.append(
            Edge(
                source=key.source,
                target=key.target,
                signals=tuple(pair for pair, _ in found),
                changes={pair: change for pair, change in found if change},
                youngest=age.youngest,
                oldest=age.oldest,
                is_forward=turn[key.source] < turn[key.target] and age.youngest == 0,
            )
        )
    return tuple(edges)


def _pair(link: Connection) -> tuple[str, str]:
    way = link.way
    return f"{link.source.connector}{way.picked}", f"{link.target.connector}{way.placed}"


def _change(system: System, link: Connection) -> str:
    """What happens to the values of a connection on their way."""
    output = system.connectors[link.source.component][link.source.connector]
    return described(
        output, system.connectors[link.target.component][link.target.connector], link.way
    )


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
    pairs: dict[tuple[str, ...], list[Edge]] = defaultdict(list)
    for edge in graph.edges:
        pairs[entries[edge.source], entries[edge.target], *edge.changes.values()].append(edge)
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
        for (source, target, *_), alike in pairs.items()
    )
    layers = _layers(turns, edges)
    nodes = tuple(
        replace(alike[0], name=entry, copies=len(alike), layer=layers[entry])
        for entry, alike in instances.items()
    )
    return Graph(nodes, edges, graph.constants, graph.loops, graph.gaps)


def grouped(
    signals: Sequence[tuple[str, str]], changes: Mapping[tuple[str, str], str] | None = None
) -> list[str]:
    """Pairs as text; what lies beneath one group on both sides becomes one entry.

    Args:
        signals: pairs of output and input.
        changes: what happens on the way, by pair.

    >>> grouped([("vehicle.x", "vehicle.x"), ("vehicle.y", "vehicle.y"), ("a", "b")])
    ['vehicle.* (2)', 'a -> b']
    >>> grouped([("v", "w")], {("v", "w"): "* 3.6"})
    ['v -> w (* 3.6)']
    """
    groups: dict[str, list[str]] = defaultdict(list)
    for output, input_ in signals:
        prefix, dot, _ = output.partition(".")
        single = output if output == input_ else f"{output} -> {input_}"
        change = (changes or {}).get((output, input_))
        if change:
            single += f" ({change})"
        is_alike = dot and output == input_ and not change
        groups[f"{prefix}.*" if is_alike else single].append(single)
    return [
        f"{group} ({len(members)})" if len(members) > 1 else members[0]
        for group, members in groups.items()
    ]
