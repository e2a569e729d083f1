"""The wiring of a scenario as SVG.

Layers run from left to right. Connections over several layers run above, feedback dashed beneath.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final
from xml.sax.saxutils import escape

from orchestrator.scenario.graph import Edge, Graph, Node, folded, grouped
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.units import format_duration

_WIDTH: Final = 190  # of a box; all lengths are in pixels
_HEIGHT: Final = 64
_GAP_X: Final = 160
_GAP_Y: Final = 46
_MARGIN: Final = 30
_TITLE: Final = 40
_RAIL: Final = 24  # between two connections above or beneath the boxes
_SLOT: Final = 13  # between the ends of two of them at a box

_STYLE: Final = """\
  text { font-family: sans-serif; font-size: 11px; fill: #222; }
  .title { font-size: 16px; font-weight: bold; }
  .name { font-size: 14px; font-weight: bold; }
  .label { fill: #555; font-size: 10px; paint-order: stroke; stroke: #fff; stroke-width: 3px; }
  rect { fill: #eef3fa; stroke: #33557a; }
  rect.process { fill: #f7efe2; stroke: #8a5a12; }
  path { fill: none; stroke: #33557a; stroke-width: 1.4; marker-end: url(#arrow); }
  path.delayed { stroke: #a33; stroke-dasharray: 5 3; }"""

_ARROW: Final = (
    '<defs><marker id="arrow" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" '
    'markerHeight="8" orient="auto"><path d="M0,0 L8,4 L0,8 z" style="fill:#555;stroke:none;'
    'marker-end:none"/></marker></defs>'
)


@dataclass(slots=True)
class _Column:
    """The boxes of one layer; rails that end at them have slots that they share.

    Attributes:
        x: of the left sides.
        leaving, arriving: slots given away so far.
    """

    x: float
    leaving: int = 0
    arriving: int = 0

    def next_exit(self) -> float:
        """Where the next rail leaves: from the right."""
        self.leaving += 1
        return self.x + _WIDTH - _SLOT * self.leaving

    def next_entry(self) -> float:
        """Where the next rail enters: from the left."""
        self.arriving += 1
        return self.x + _SLOT * self.arriving


@dataclass(frozen=True, slots=True)
class _Box:
    """The place of a component: its column, and the top of its box."""

    column: _Column
    y: float

    @property
    def x(self) -> float:
        return self.column.x


def draw(graph: Graph, title: str) -> str:
    """An SVG document; all instances of one component are one box."""
    graph = folded(graph)
    layers = {node.name: node.layer for node in graph.nodes}
    near, far, back = _by_route(graph.edges, layers)
    boxes = _boxes(graph, _MARGIN + _TITLE + _RAIL * len(far))
    bottom = max(box.y for box in boxes.values()) + _HEIGHT
    width = max(box.x for box in boxes.values()) + _WIDTH + _MARGIN
    height = bottom + _RAIL * (len(back) + 1) + _MARGIN
    size = f'viewBox="0 0 {width:g} {height:g}" width="{width:g}" height="{height:g}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size}>',
        f"<style>\n{_STYLE}\n</style>",
        _ARROW,
        '<rect width="100%" height="100%" style="fill:#fff;stroke:none"/>',
        f'<text class="title" x="{_MARGIN}" y="{_MARGIN}">{escape(title)}</text>',
        *(_curve(edge, boxes) for edge in near),
        *(_over(edge, boxes, _MARGIN + _TITLE + _RAIL * row) for row, edge in enumerate(far)),
        *(_under(edge, boxes, bottom + _RAIL * (row + 1)) for row, edge in enumerate(back)),
        *(_node(node, boxes[node.name]) for node in graph.nodes),
        "</svg>\n",
    ]
    return "\n".join(parts)


def _by_route(
    edges: Sequence[Edge], layers: Mapping[str, int]
) -> tuple[list[Edge], list[Edge], list[Edge]]:
    """Edges to the next layer, those over several, the longest first, and those that lead back."""

    def span(edge: Edge) -> int:
        return layers[edge.target] - layers[edge.source]

    near = [edge for edge in edges if edge.is_forward and span(edge) == 1]
    far = sorted((e for e in edges if e.is_forward and span(e) > 1), key=span, reverse=True)
    back = sorted((e for e in edges if not e.is_forward), key=span, reverse=True)
    return near, far, back


def _boxes(graph: Graph, top: float) -> dict[str, _Box]:
    """One column per layer, components one below the other."""
    layers: dict[int, list[str]] = defaultdict(list)
    for node in graph.nodes:
        layers[node.layer].append(node.name)
    columns = {layer: _Column(_MARGIN + layer * (_WIDTH + _GAP_X)) for layer in layers}
    return {
        name: _Box(columns[layer], top + row * (_HEIGHT + _GAP_Y))
        for layer, names in layers.items()
        for row, name in enumerate(names)
    }


def _node(node: Node, box: _Box) -> str:
    is_here = node.process is Isolation.NEVER and node.host is None
    kind = "" if is_here else ' class="process"'
    origin = node.origin.replace("\\", "/").rsplit("/", 1)[-1]
    times = f" \u00d7 {node.copies}" if node.copies > 1 else ""
    every = f"every {format_duration(node.step)}"
    every += "" if node.host is None else f", host {node.host}"
    lines = (("name", node.name + times), ("", origin), ("", every))
    texts = "".join(
        f'<text class="{style}" x="{box.x + 10:g}" y="{box.y + 20 + 17 * row:g}">'
        f"{escape(text)}</text>"
        for row, (style, text) in enumerate(lines)
    )
    behind = "".join(
        f'<rect{kind} x="{box.x + shift:g}" y="{box.y - shift:g}" width="{_WIDTH}" '
        f'height="{_HEIGHT}" rx="6"/>'
        for shift in ((6, 3) if node.copies > 1 else ())
    )
    return (
        f"{behind}"
        f'<rect{kind} x="{box.x:g}" y="{box.y:g}" width="{_WIDTH}" height="{_HEIGHT}" rx="6"/>'
        f"{texts}"
    )


def _label(edge: Edge, x: float, y: float) -> str:
    names = grouped(edge.signals, edge.changes)
    shown = ", ".join(names[:2]) + (f" and {len(names) - 2} more" if len(names) > 2 else "")
    shown += f" (\u00d7 {edge.copies})" if edge.copies > 1 else ""
    title = f"<title>{escape(', '.join(f'{o} -> {i}' for o, i in edge.signals))}</title>"
    return f'<text class="label" x="{x:g}" y="{y:g}">{title}{escape(shown)}</text>'


def _curve(edge: Edge, boxes: Mapping[str, _Box]) -> str:
    """From the right side of the source to the left side of the target."""
    source, target = boxes[edge.source], boxes[edge.target]
    x0, y0 = source.x + _WIDTH, source.y + _HEIGHT / 2
    x1, y1 = target.x, target.y + _HEIGHT / 2
    bend = _GAP_X / 2
    path = f"M{x0:g},{y0:g} C{x0 + bend:g},{y0:g} {x1 - bend:g},{y1:g} {x1:g},{y1:g}"
    return f'<path d="{path}"/>{_label(edge, x0 + 8, (y0 + y1) / 2 - 6)}'


def _over(edge: Edge, boxes: Mapping[str, _Box], rail: float) -> str:
    """Up, along a rail of its own above the boxes, and down."""
    source, target = boxes[edge.source], boxes[edge.target]
    x0, x1 = source.column.next_exit(), target.column.next_entry()
    path = f"M{x0:g},{source.y:g} V{rail:g} H{x1:g} V{target.y:g}"
    return f'<path d="{path}"/>{_label(edge, x0 + 6, rail - 4)}'


def _under(edge: Edge, boxes: Mapping[str, _Box], rail: float) -> str:
    """Down, along a rail of its own beneath the boxes, and up."""
    source, target = boxes[edge.source], boxes[edge.target]
    x0, x1 = source.column.next_exit(), target.column.next_entry()
    path = f"M{x0:g},{source.y + _HEIGHT:g} V{rail:g} H{x1:g} V{target.y + _HEIGHT:g}"
    delay = f"up to {format_duration(edge.oldest)} old"
    return (
        f'<path class="delayed" d="{path}"><title>{escape(delay)}</title></path>'
        f"{_label(edge, min(x0, x1) + 6, rail - 4)}"
    )
