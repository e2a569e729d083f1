"""`nlosim graph`."""

from argparse import Namespace
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Final

from orchestrator import tables
from orchestrator.cli.drawing import draw
from orchestrator.cli.outcome import Outcome
from orchestrator.cli.streams import tell_line
from orchestrator.errors import ScenarioError
from orchestrator.hosts_file import read_hosts
from orchestrator.placement import only_hosts, placing
from orchestrator.scenario.absent import absence
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.graph import Edge, Graph, Node, graph_of, grouped
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.units import format_duration
from orchestrator.scenario.wiring import assemble
from orchestrator.timebase import StepSize


def execute(arguments: Namespace) -> Outcome:
    """Print the wiring and, if asked to, draw it."""
    scenario = load_scenario(scenario_path(arguments.scenario), arguments.overrides)
    hosts = None if arguments.hosts is None else read_hosts(Path(arguments.hosts))
    problems = []
    for name, use in scenario.components.items() if hosts is None else ():
        problems += absence(scenario.document, name, use.type, use.host)
    if problems:
        raise ScenarioError(problems)
    with placing(only_hosts(scenario, hosts), tell_line) as places:
        assembly = assemble(scenario, places.create)
        try:
            graph = graph_of(scenario, assembly)
        finally:
            assembly.close()
    text = _text(scenario, graph)
    if arguments.svg is not None:
        Path(arguments.svg).write_text(draw(graph, scenario.title), encoding="utf-8")
        text += f"\n\ndrawn in {arguments.svg}"
    return Outcome(
        text=text,
        data={
            "algorithm": scenario.coupling.type_name,
            "components": [_component(node) for node in graph.nodes],
            "connections": [_connection(edge) for edge in graph.edges],
            "constants": [{"to": to, "value": value} for to, value in graph.constants],
            "loops": list(graph.loops),
            "undriven": [gap.data() for gap in graph.gaps],
            "until": None if scenario.until is None else str(scenario.until),
            "svg": arguments.svg,
        },
    )


def _component(node: Node) -> dict[str, object]:
    step = {"step": format_duration(node.step), "step_ns": _number(node.step)}
    fields = asdict(node)
    spans = {**step, "lag_ns": _number(fields.pop("lag"))}
    if node.host is None:
        del fields["host"]
    return {**fields, "process": node.process.value, **spans}


def _number(span: StepSize) -> int | float:
    """A span as JSON can hold it."""
    return span if isinstance(span, int) else float(span)


def _connection(edge: Edge) -> dict[str, object]:
    return {
        "from": edge.source,
        "to": edge.target,
        "signals": [_signal(edge, output, input_) for output, input_ in edge.signals],
        "youngest_ns": _number(edge.youngest),
        "oldest_ns": _number(edge.oldest),
    }


def _signal(edge: Edge, output: str, input_: str) -> dict[str, str]:
    change = edge.changes.get((output, input_))
    return {"from": output, "to": input_, **({} if change is None else {"change": change})}


def _text(scenario: Scenario, graph: Graph) -> str:
    span = f"{format_duration(scenario.start)} to {format_duration(scenario.stop)}"
    if scenario.until is not None:
        span += f" or until `{scenario.until}`"
    lines = [
        f"{scenario.title}: {span}, {scenario.coupling.type_name}",
        "",
        "components, in the order in which they step:",
        *tables.lines([_node_row(number, node) for number, node in enumerate(graph.nodes, 1)]),
        "",
        "connections, with the age of the values when a step of the target ends:",
        *tables.lines([_edge_row(edge) for edge in graph.edges]),
    ]
    if graph.constants:
        lines += ["", "constants:", *tables.lines(list(graph.constants))]
    if graph.gaps:
        rows = [
            (each.title.replace("`", ""), f"{each.meaning}{' (meant)' if each.is_meant else ''}")
            for each in graph.gaps
        ]
        lines += ["", "inputs that nothing drives, and what it means:", *tables.lines(rows)]
    through = [line for node in graph.nodes for line in _feedthrough(node)]
    lines += ["", "direct feedthrough:", *(through or ["  none"])]
    lines += ["", "algebraic loops:", *([f"  {loop}" for loop in graph.loops] or ["  none"])]
    return "\n".join(lines)


_WHERE: Final = {
    Isolation.NEVER: "this process",
    Isolation.ON_REQUEST: "own process, if a transport is given",
    Isolation.ALWAYS: "own process",
}


def _node_row(number: int, node: Node) -> tuple[str, ...]:
    every = f"every {format_duration(node.step)}"
    where = _WHERE[node.process]
    if node.host is not None:
        where = f"host `{node.host}` with --hosts, else {where}"
    return str(number), node.name, node.origin, every, where


def _edge_row(edge: Edge) -> tuple[str, ...]:
    ends = f"{edge.source} -> {edge.target}"
    return ends, age(edge), ", ".join(grouped(edge.signals, edge.changes))


def _feedthrough(node: Node) -> Iterator[str]:
    """One line for all outputs that depend on the same inputs."""
    outputs: dict[tuple[str, ...], list[str]] = defaultdict(list)
    for output, inputs in node.feedthrough.items():
        outputs[inputs].append(output)
    for inputs, names in outputs.items():
        then = f", as they were {format_duration(node.lag)} before" if node.lag else ""
        yield f"  {node.name}: {_names(names)} depends on {_names(inputs)}{then}"


def _names(connectors: Iterable[str]) -> str:
    return ", ".join(grouped([(name, name) for name in connectors]))


def age(edge: Edge) -> str:
    """The age of the values on `edge`, as text."""
    if edge.youngest == edge.oldest:
        return format_duration(edge.oldest) if edge.oldest else "0"
    youngest = format_duration(edge.youngest) if edge.youngest else "0"
    return f"{youngest} to {format_duration(edge.oldest)}"
