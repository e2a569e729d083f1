"""All recorded numbers of a run, as a table and as curves."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.elements import Elements
from orchestrator.measure import Answer, Panel
from orchestrator.palette import COLOURS
from orchestrator.parameters import parameter
from orchestrator.recording.declared import declared_shape
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from orchestrator.table_files import Table
from studies.measures.held import BLOCK, Held
from studies.measures.style import LINES

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_CURVES: Final = 40
MOST_PANELS: Final = 12
CURVES_PER_PANEL: Final = len(COLOURS)

_ROWS: Final = BLOCK // 4
_POINTS: Final = 1000
"""Parts of which a drawing shows no more than two values each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Signals(Measure):
    """Every recorded number over time, as a table and as curves.

    The table has a row for each time at which one of them was published. A number holds from its
    communication point to the next one of its component; before the first one its field is empty.
    Elements of small arrays are columns of their own; arrays whose length may change, and bytes,
    are left out. Curves that share a unit share a panel.
    """

    by_default: ClassVar[bool] = True
    beside_reports: ClassVar[bool] = False

    elements: int = parameter(
        9, minimum=1, doc="arrays of constant shape with up to so many elements are taken apart"
    )

    @override
    def compute(self, recording: Recording) -> Answer:
        columns = list(self._columns(recording))
        if not columns:
            raise ValueError("no number is recorded that stands in a table")
        times = _union(columns)
        panels, curves = _panels(columns)
        drawn = {each.name for panel in panels.values() for each in panel}
        rest = [each.name for each in curves if each.name not in drawn]
        return Answer(
            numbers={
                "columns": len(columns),
                "rows": len(times),
                "drawn": len(drawn),
                "not_drawn": ", ".join(rest) or None,
            },
            long_tables={"table": partial(_rows, columns, times)},
            panels={name: _panel(each) for name, each in panels.items()},
        )

    def _columns(self, recording: Recording) -> Iterator[Held]:
        """Every number, with one array of times for all of a component."""
        known: dict[str, Array] = {}
        for name in recording.signals:
            shape = declared_shape(recording.kind(name))
            lengths = [] if shape is None else [n for n in shape if isinstance(n, int)]
            is_constant = shape is not None and len(lengths) == len(shape)
            if not is_constant or math.prod(lengths) > self.elements:
                continue
            series = recording[name]
            if not len(series):
                continue
            times = known.setdefault(name.partition(".")[0], series.times)
            if np.array_equal(times, series.times):
                series = replace(series, times=times)
            for index in np.ndindex(*lengths):
                elements = Elements(index)
                yield Held(f"{name}{elements}", series.unit, series, elements)


def _union(columns: Sequence[Held]) -> Array:
    """All times at which something was published [ns], ascending, shape (row,)."""
    different = {id(each.times): each.times for each in columns}
    times = np.empty(0, np.int64)
    for each in different.values():
        if not np.array_equal(times, each):
            times = np.union1d(times, each)
    return times


def _rows(columns: Sequence[Held], times: Array) -> Iterator[Table]:
    """The table, some rows at a time."""
    for first in range(0, len(times), _ROWS):
        now = times[first : first + _ROWS]
        table: dict[str, Array] = {"time [s]": now / 1e9}
        for each in columns:
            unit = "" if each.unit == "1" else f" [{each.unit}]"
            is_late = bool(each.times[0] > times[0])
            table[f"{each.name}{unit}"] = _held(each, now, is_late=is_late)
        yield table


def _held(column: Held, now: Array, *, is_late: bool) -> Array:
    """The newest values at `now` [ns], shape (row,).

    Args:
        column: the number.
        now: ascending.
        is_late: whether the first value comes after the first row of the table: then they are
            float64, and NaN where there is none yet. Else they are of the recorded type.
    """
    k = np.searchsorted(column.times, now, side="right") - 1
    first, last = max(int(k[0]), 0), max(int(k[-1]), 0)
    values = column.between(first, last + 1)[np.maximum(k, 0) - first]
    return np.where(k < 0, np.nan, values) if is_late else values


def _panels(columns: Sequence[Held]) -> tuple[dict[str, list[Held]], list[Held]]:
    """Which curves stand together, by the title of their panel; and all that could be drawn.

    Curves of one unit stand together, of some components if these have few, of parts of a component
    if it has many. What changes is drawn: a number that is declared constant is none.
    """
    curves = [each for each in columns if len(each.times) > 1]
    units: dict[str, list[Held]] = {}
    for each in curves[:MOST_CURVES]:
        units.setdefault(each.unit, []).append(each)
    panels: dict[str, list[Held]] = {}
    for unit, members in units.items():
        for group in _groups(members):
            if len(panels) == MOST_PANELS:
                break
            names = dict.fromkeys(each.name.partition(".")[0] for each in group)
            title = ", ".join(names) + ("" if unit == "1" else f" [{unit}]")
            number = sum(other.partition(" (")[0] == title for other in panels)
            panels[f"{title} ({number + 1})" if number else title] = group
    return panels, curves


def _groups(members: Sequence[Held]) -> Iterator[list[Held]]:
    """Curves, in groups that a panel can show; components stay together where they can."""
    group: list[Held] = []
    components: dict[str, list[Held]] = {}
    for each in members:
        components.setdefault(each.name.partition(".")[0], []).append(each)
    for own in components.values():
        if group and len(group) + len(own) > CURVES_PER_PANEL:
            yield group
            group = []
        for each in own:
            if len(group) == CURVES_PER_PANEL:
                yield group
                group = []
            group.append(each)
    if group:
        yield group


def _panel(members: Sequence[Held]) -> Panel:
    return partial(_draw, members)


def _draw(members: Sequence[Held], axes: "Axes") -> None:
    names = dict.fromkeys(each.name.partition(".")[0] for each in members)
    for k, (each, colour) in enumerate(zip(members, COLOURS, strict=False)):
        label = each.name if len(names) > 1 else each.name.partition(".")[2]
        style = "steps-post" if each.series.kind.startswith(("bool", "int", "uint")) else "default"
        line = LINES[k % len(LINES)]
        axes.plot(*curve(each), line, color=colour, label=label, lw=1.0, drawstyle=style)
    axes.set_xlabel("time [s]")
    unit = "" if members[0].unit == "1" else f"[{members[0].unit}]"
    if len(members) == 1:
        axes.set_ylabel(f"{axes.lines[0].get_label()} {unit}".rstrip())
        return
    axes.set_ylabel(unit)
    # beside the curves, which may be everywhere
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0)


def curve(column: Held) -> tuple[Array, Array]:
    """The values of a number over time, as far as a drawing can show them.

    Args:
        column: the number.

    Returns:
        Times [s] and values, shape (point,) each; of more than 2000 values the first, the last, and
        the least and the greatest one of each of 1000 parts with as many values.
    """
    times = column.times
    size = -(-len(times) // _POINTS)  # of a part
    if size <= 2:
        return times / 1e9, column.between(0, len(times))
    places, values = [np.zeros(1, np.int64)], [column.between(0, 1)]
    at_once = size * max(1, BLOCK // size)
    for first in range(0, len(times), at_once):
        block = column.between(first, min(first + at_once, len(times)))
        for k in range(0, len(block), size):
            part = block[k : k + size]
            own = np.unique([int(part.argmin()), int(part.argmax())])
            places.append(first + k + own)
            values.append(part[own])
    places.append(np.array([len(times) - 1]))
    values.append(column.between(len(times) - 1, len(times)))
    return times[np.concatenate(places)] / 1e9, np.concatenate(values)
