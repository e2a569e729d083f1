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

from orchestrator.system import Connection, Endpoint, System

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


def describe_path(loop: Loop) -> str:
    """Say where an algebraic loop runs."""
    path = " -> ".join(f"`{end}`" for end in (*loop.path, loop.path[0]))
    others = ", ".join(f"`{end}`" for end in loop.others)
    return path + (f", entangled with {others}" if others else "")


def describe(loop: Loop) -> str:
    """Say where an algebraic loop runs that is an error, and what can be done about it."""
    return (
        f"algebraic loop: {describe_path(loop)}; solve it with `algorithm: quasi-newton` or "
        "`fixed-point`, or give Gauss-Seidel an explicit order, which breaks the loop with one "
        "step of delay, or use Jacobi, which delays every connection"
    )


def describe_outcome(loop: Loop, *, is_solved: bool) -> str:
    """Say where an algebraic loop runs, and what an algorithm makes of it.

    Args:
        loop: an algebraic loop.
        is_solved: whether the algorithm solves it; otherwise it is left with a delay.
    """
    where = f"algebraic loop: {describe_path(loop)}"
    if is_solved:
        return f"{where}; solved at every communication point"
    return (
        f"{where}; not solved: a delay breaks it, so its signals agree at the start only; "
        "solve it with `algorithm: quasi-newton` or `fixed-point`"
    )


def is_within(loop: Loop, solved: Iterable[frozenset[str]]) -> bool:
    """Whether one of these sets has all components of a loop."""
    names = {end.component for end in (*loop.path, *loop.others)}
    return any(names <= each for each in solved)


def feedthrough_order(system: System) -> tuple[str, ...]:
    """All components, each behind those whose outputs affect its own at the same time.

    Where that leaves a choice, the order of `system.components` decides. Where components
    depend on each other in a cycle, the first of them goes first and reads what is not yet known
    as it was before.
    """
    graph = _components(system, by_feedthrough=True)
    return tuple(_ordered(list(graph), graph))


def has_feedthrough(system: System, name: str) -> bool:
    """Whether an output of a component depends on one of its driven inputs at the same time."""
    driven = frozenset(system.driven(name))
    return any(driven & c.feedthrough for c in system.connectors[name].values())


def start_groups(system: System) -> tuple[tuple[str, ...], ...]:
    """The components in the order of `feedthrough_order`, those of a cycle together.

    A component is in a cycle if its outputs affect its inputs at the same time, if need be
    through others.
    """
    graph = _components(system, by_feedthrough=True)
    knots = _condensed(list(graph), graph)
    return tuple((first, *_ordered(rest, graph)) for first, *rest in knots)


def dependent_groups(system: System, *, by_feedthrough: bool) -> tuple[tuple[str, ...], ...]:
    """All components in groups that depend on each other, each group behind those it depends on.

    Args:
        system: the components and their connections.
        by_feedthrough: whether only those of an algebraic loop form a group; the groups are then in
            the order of direct feedthrough. Otherwise any cycle of connections makes one.

    Returns:
        Groups of names; a component that depends on no other one that depends on it is a group of
        its own. Where that leaves a choice, the order of `system.components` decides; within a
        group the first of them goes first, and the rest as in `feedthrough_order`.
    """
    graph = _components(system, by_feedthrough=by_feedthrough)
    sets = _looped(system) if by_feedthrough else [set(knot) for knot in _knots(graph)]
    first_of = {name: name for name in graph}
    for names in sets:
        first = next(name for name in graph if name in names)
        first_of.update(dict.fromkeys(names, first))
    members = {first: [n for n in graph if first_of[n] == first] for first in first_of.values()}
    contracted = {
        first: [first_of[target] for name in names for target in graph[name]]
        for first, names in members.items()
    }
    leaders = [name for name in graph if first_of[name] == name]
    return tuple(tuple(_ordered(members[f], graph)) for f in _ordered(leaders, contracted))


def _looped(system: System) -> list[set[str]]:
    """Sets of components that algebraic loops connect, disjoint."""
    found: list[set[str]] = []
    for loop in loops(system):
        names = {end.component for end in (*loop.path, *loop.others)}
        for other in [each for each in found if each & names]:
            found.remove(other)
            names |= other
        found.append(names)
    return found


def _components(system: System, *, by_feedthrough: bool) -> dict[str, list[str]]:
    """Which components each component affects; by its connections, or only at the same time."""
    graph: dict[str, list[str]] = {name: [] for name in system.components}
    for link in _immediate(system):
        own = system.connectors[link.target.component].values()
        if not by_feedthrough or any(link.target.connector in c.feedthrough for c in own):
            graph[link.source.component].append(link.target.component)
    return graph


def _immediate(system: System) -> Iterator[Connection]:
    """The connections without a delay of their own."""
    return (link for link in system.connections if not link.way.delay)


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
    for link in _immediate(system):
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
    for first, *rest in _condensed(nodes, graph):
        yield first
        yield from _ordered(rest, graph)


def _condensed(nodes: Sequence[str], graph: Graph[str]) -> Iterator[list[str]]:
    """The knots among `nodes`, in a stable topological order."""
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
        yield knots[index]


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
