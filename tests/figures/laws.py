"""What every figure must fulfil, whoever draws it; `problems` says what one does not."""

from collections.abc import Callable, Iterator
from itertools import combinations

import matplotlib.colors as mcolors
import numpy as np
import pytest
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Annotation, Text
from matplotlib.transforms import Bbox

from orchestrator import drawing

SMALLEST = 7.0
"""Texts are at least this high where the manual shows them [points]."""

HIDDEN = 0.02
"""So much of its points a legend may hide of a line."""


def drawn_by(draw: Callable[[], object], monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that `draw` saves, in order; they are not written."""
    found: list[Figure] = []

    def keep(figure: Figure, *_: object, **__: object) -> None:
        FigureCanvasAgg(figure)
        figure.draw_without_rendering()  # in the style in which it would be saved
        found.append(figure)

    monkeypatch.setattr(Figure, "savefig", keep)
    draw()
    return found


def problems(figure: Figure) -> list[str]:
    """What is wrong with a figure that has been drawn; a sentence each."""
    return [
        *_cut(figure),
        *_small(figure),
        *_overlapping(figure),
        *_unlabelled(figure),
        *_legends(figure),
        *_unlisted(figure),
    ]


def _panels(figure: Figure) -> list[Axes]:
    return [axes for axes in figure.axes if axes.get_visible() and axes.axison]


def _texts(figure: Figure) -> list[Text]:
    """The texts that are seen: ticks that are out of range have some that are not."""
    unseen = {id(text) for axes in figure.axes for text in _unseen(axes)}
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text() and id(text) not in unseen
    ]


def _unseen(axes: Axes) -> Iterator[Text]:
    for axis in (axes.xaxis, axes.yaxis):
        is_drawn = axes.axison and axes.get_visible()
        drawn = axis._update_ticks() if is_drawn else []  # type: ignore[union-attr]
        for tick in (*axis.majorTicks, *axis.minorTicks):
            if tick not in drawn:
                yield from (tick.label1, tick.label2)
        if not axes.axison:
            yield axis.label
    for text in axes.texts:
        if isinstance(text, Annotation) and text.get_annotation_clip():
            place = axes.transData.transform(text.xy)
            if not axes.bbox.contains(*place):
                yield text


def _box(text: Text) -> Bbox:
    return text.get_window_extent()


def _cut(figure: Figure) -> Iterator[str]:
    """Every text lies inside the canvas, to a pixel."""
    canvas = figure.bbox.padded(1.0)
    for text in _texts(figure):
        box = _box(text)
        if not (
            canvas.x0 <= box.x0 and box.x1 <= canvas.x1 and canvas.y0 <= box.y0
            and box.y1 <= canvas.y1
        ):  # fmt: skip
            yield f"`{text.get_text()}` is cut"


def _small(figure: Figure) -> Iterator[str]:
    shrunk = min(1.0, drawing.WIDTH / figure.get_figwidth())
    for text in _texts(figure):
        if float(text.get_fontsize()) * shrunk < SMALLEST - 1e-6:
            size = float(text.get_fontsize()) * shrunk
            yield f"`{text.get_text()}` is shown with {size:.1f} points"


def _overlapping(figure: Figure) -> Iterator[str]:
    """No text lies on another one."""
    boxes = [(text, _box(text)) for text in _texts(figure)]
    for (first, a), (second, b) in combinations(boxes, 2):
        wide = min(a.x1, b.x1) - max(a.x0, b.x0)
        high = min(a.y1, b.y1) - max(a.y0, b.y0)
        if wide > 1.5 and high > 1.5:
            yield f"`{first.get_text()}` and `{second.get_text()}` overlap"


def _unlabelled(figure: Figure) -> Iterator[str]:
    """Every axis has a label: its own, that of the axes that share it, or the figure's."""
    for axes in _panels(figure):
        for which, shared in (("x", axes.get_shared_x_axes()), ("y", axes.get_shared_y_axes())):
            family = [axes, *shared.get_siblings(axes)]
            labels = [getattr(each, f"get_{which}label")() for each in family]
            whole = getattr(figure, f"get_sup{which}label")()
            if not any(labels) and not whole and not _has_common_label(axes, which, figure):
                yield f"the {which} axis of `{axes.get_title() or axes.get_title('left')}` has none"


def _has_common_label(axes: Axes, which: str, figure: Figure) -> bool:
    """Whether the panel has no numbers, and one in line with it has numbers and a label."""
    labels = getattr(axes, f"get_{which}ticklabels")()
    if which == "y" or any(text.get_text() and text.get_visible() for text in labels):
        return False
    return any(other.get_xlabel() and other.get_xlim() == axes.get_xlim() for other in figure.axes)


def all_legends(figure: Figure) -> list[Legend]:
    """Those of panels and of the figure; a panel may have several."""
    return figure.findobj(Legend)


def _legends(figure: Figure) -> Iterator[str]:
    """No two entries of a legend look the same, with colours or without; none hides data."""
    for legend in all_legends(figure):
        names = [text.get_text() for text in legend.get_texts()]
        drawn = _drawn(figure)
        handles = [drawn.get(n, h) for n, h in zip(names, legend.legend_handles, strict=True)]
        for (one, a), (other, b) in combinations(zip(names, handles, strict=True), 2):
            if a is not None and b is not None and _look(a) == _look(b):
                yield f"`{one}` and `{other}` look the same without colours"
        for axes in _panels(figure):
            yield from _hidden(axes, legend)


def _drawn(figure: Figure) -> dict[str, Artist]:
    """The line of marks of every series with bars, by its name: legends have only their bars."""
    return {
        str(one.get_label()): one[0]
        for axes in figure.axes
        for one in axes.containers
        if isinstance(one, ErrorbarContainer) and one[0] is not None
    }


def _look(handle: Artist) -> tuple[object, ...]:
    """What tells it apart without colours; a grey tone counts for areas."""
    if isinstance(handle, Line2D):
        return (
            "line", str(handle.get_linestyle()), str(handle.get_marker()),
            handle.get_fillstyle(), round(float(handle.get_linewidth()), 1),
            str(handle.get_markerfacecolor()) == "white",
        )  # fmt: skip
    if isinstance(handle, Patch):
        red, green, blue, alpha = mcolors.to_rgba(handle.get_facecolor())
        tone = (0.3 * red + 0.59 * green + 0.11 * blue) * alpha + 1.0 - alpha
        dashes = str(getattr(handle, "_dash_pattern", ""))  # copies in legends say `solid`
        return ("area", handle.get_hatch(), dashes, round(tone * 12))
    marker = tuple(len(path.vertices) for path in getattr(handle, "get_paths", list)())
    return (type(handle).__name__, marker, str(getattr(handle, "get_linestyle", str)()))


def _hidden(axes: Axes, legend: Legend) -> Iterator[str]:
    box = legend.get_window_extent()
    for line in axes.lines:
        points = np.asarray(line.get_xydata(), float)
        if not len(points) or line.get_transform() != axes.transData or not line.get_visible():
            continue
        seen = axes.transData.transform(points[~np.isnan(points).any(axis=1)])
        inside = [bool(box.contains(x, y) and axes.bbox.contains(x, y)) for x, y in seen]
        if np.mean(inside) > HIDDEN:
            yield f"a legend hides {sum(inside)} points of `{line.get_label()}`"


def _unlisted(figure: Figure) -> Iterator[str]:
    """What has a name is in a legend; several series in a panel have names."""
    listed = {text.get_text() for legend in all_legends(figure) for text in legend.get_texts()}
    for axes in _panels(figure):
        labels = axes.get_legend_handles_labels()[1]
        for label in labels:
            if label not in listed:
                yield f"`{label}` is in no legend"
        bars = [one for one in axes.containers if isinstance(one, ErrorbarContainer)]
        if len(bars) > 1 and not labels:
            yield "series without names"
