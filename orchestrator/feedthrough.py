"""Direct feedthrough: which outputs depend on which inputs at the same time.

Connections and the `feedthrough` of connectors span a graph of endpoints. Its cycles are
algebraic loops; the order it leaves to the components is the one in which outputs can be
computed without a delay.
"""

import heapq
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import TypeAlias, TypeVar

from orchestrator.system import Endpoint, System

Node = TypeVar("Node")
Graph: TypeAlias = Mapping[Node, Sequence[Node]]
"""The successors of every node."""


@dataclass(frozen=True, slots=True)
class Loop:
    """An algebraic loop.

    Attributes:
        path: a shortest cycle, each endpoint affecting the next and the last the first.
        others: further endpoints that depend on the path and affect it.
    """

    path: tuple[Endpoint, ...]
    others: tuple[Endpoint, ...] = ()


def loops(system: System) -> tuple[Loop, ...]:
    """The algebraic loops of `system`, in the order of its components; usually none."""
    graph = _endpoints(system)
    return tuple(_loop(graph, knot) for knot in _knots(graph) if len(knot) > 1)


def describe(loop: Loop) -> str:
    """Say where an algebraic loop runs and what can be done about it."""
    path = " -> ".join(f"`{end}`" for end in (*loop.path, loop.path[0]))
    others = ", ".join(f"`{end}`" for end in loop.others)
    also = f", entangled with {others}" if others else ""
    return (
        f"algebraic loop: {path}{also}; give Gauss-Seidel an explicit order, which breaks the "
        "loop with one step of delay, or use Jacobi, which delays every connection"
    )


def feedthrough_order(system: System) -> tuple[str, ...]:
    """All components, each behind those whose outputs affect its own at the same time.

    Where that leaves a choice, the order of `system.components` decides. Where components
    depend on each other in a cycle, the first of them goes first and reads what is not yet known
    as it was before.
    """
    graph: dict[str, list[str]] = {name: [] for name in system.components}
    for link in system.connections:
        own = system.connectors[link.target.component].values()
        if any(link.target.connector in connector.feedthrough for connector in own):
            graph[link.source.component].append(link.target.component)
    return tuple(_ordered(list(graph), graph))


def _endpoints(system: System) -> dict[Endpoint, list[Endpoint]]:
    """Which endpoints each endpoint affects at the same time."""
    graph: dict[Endpoint, list[Endpoint]] = {
        Endpoint(component, name): []
        for component, connectors in system.connectors.items()
        for name in connectors
    }
    for component, connectors in system.connectors.items():
        for name, connector in connectors.items():
            for cause in sorted(connector.feedthrough):
                graph[Endpoint(component, cause)].append(Endpoint(component, name))
    for link in system.connections:
        graph[link.source].append(link.target)
    return graph


def _loop(graph: Graph[Endpoint], knot: Sequence[Endpoint]) -> Loop:
    """The shortest cycle through the first endpoint of a knot, and the rest of the knot."""
    first, members = knot[0], set(knot)
    before: dict[Endpoint, Endpoint] = {}
    queue = deque([first])
    while first not in before:
        node = queue.popleft()
        for successor in graph[node]:
            if successor in members and successor not in before:
                before[successor] = node
                queue.append(successor)
    path = [before[first]]
    while path[-1] != first:
        path.append(before[path[-1]])
    path.reverse()
    return Loop(tuple(path), tuple(end for end in knot if end not in path))


def _ordered(nodes: Sequence[str], graph: Graph[str]) -> Iterator[str]:
    """A stable topological order of `nodes`; a knot is cut in front of its first node."""
    members = set(nodes)
    inner = {node: [n for n in graph[node] if n in members] for node in nodes}
    knots = _knots(inner)
    place = {node: index for index, knot in enumerate(knots) for node in knot}
    sorter: TopologicalSorter[int] = TopologicalSorter(dict.fromkeys(range(len(knots)), ()))
    for node, successors in inner.items():
        for successor in successors:
            if place[node] != place[successor]:
                sorter.add(place[successor], place[node])
    for index in _lowest_first(sorter):
        first, *rest = knots[index]
        yield first
        yield from _ordered(rest, inner)


def _lowest_first(sorter: "TopologicalSorter[int]") -> Iterator[int]:
    sorter.prepare()
    ready: list[int] = []
    while sorter.is_active():
        for index in sorter.get_ready():
            heapq.heappush(ready, index)
        index = heapq.heappop(ready)
        yield index
        sorter.done(index)


def _knots(graph: Graph[Node]) -> list[list[Node]]:
    """The strongly connected components, and the nodes within each, in the order of `graph`.

    Two nodes are strongly connected if each reaches the other (Kosaraju and Sharir 1981: search
    the reversed graph, last finished first).
    """
    reverse: dict[Node, list[Node]] = {node: [] for node in graph}
    for node, successors in graph.items():
        for successor in successors:
            reverse[successor].append(node)
    finished: list[Node] = []
    seen: set[Node] = set()
    for node in graph:
        finished += _depth_first(graph, node, seen)
    seen = set()
    groups = [set(_depth_first(reverse, node, seen)) for node in reversed(finished)]
    group_of = {node: index for index, group in enumerate(groups) for node in group}
    knots: dict[int, list[Node]] = {}
    for node in graph:
        knots.setdefault(group_of[node], []).append(node)
    return list(knots.values())


def _depth_first(graph: Graph[Node], root: Node, seen: set[Node]) -> Iterable[Node]:
    """Nodes reached from `root` and not yet `seen`, in the order in which they are left."""
    if root in seen:
        return []
    seen.add(root)
    left = []
    path = [(root, iter(graph[root]))]
    while path:
        node, successors = path[-1]
        following = next((n for n in successors if n not in seen), None)
        if following is None:
            left.append(node)
            path.pop()
        else:
            seen.add(following)
            path.append((following, iter(graph[following])))
    return left
