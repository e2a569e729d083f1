"""Figures: as large as their panels, each under its name, the same bytes every time."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest
from matplotlib.axes import Axes

from orchestrator.drawing import draw_panels


def line(axes: Axes) -> None:
    axes.plot([0.0, 1.0], [0.0, 1.0])


def size(path: Path) -> tuple[float, float]:
    """Width and height of an SVG file [inch]."""
    root = ET.fromstring(path.read_text())  # noqa: S314 - our own file
    width, height = (float(root.attrib[name].removesuffix("pt")) for name in ("width", "height"))
    return width / 72, height / 72


@pytest.mark.parametrize(
    ("count", "columns", "rows"), [(1, 1, 1), (2, 2, 1), (3, 2, 2), (4, 2, 2), (5, 2, 3)]
)
def test_panels_are_two_side_by_side_of_one_size(
    count: int, columns: int, rows: int, tmp_path: Path
) -> None:
    """4.8 by 3.2 inches each."""
    drawn = draw_panels({f"panel {k}": line for k in range(count)}, tmp_path / "a")
    assert drawn == tmp_path / "a.svg"
    assert size(drawn) == pytest.approx((4.8 * columns, 3.2 * rows))


def test_a_panel_is_drawn_into_axes_that_say_its_name(tmp_path: Path) -> None:
    names: list[str] = []
    seen: list[Axes] = []

    def look(axes: Axes) -> None:
        seen.append(axes)
        names.append(axes.get_title(loc="left"))

    draw_panels({"gap": look, "speed": look}, tmp_path / "a")
    assert names == ["gap", "speed"]
    first, second = (axes.get_subplotspec() for axes in seen)
    assert first is not None
    assert second is not None
    assert (first.num1, second.num1) == (0, 1)
    assert all(axes.spines[side].get_visible() for axes in seen for side in ("left", "bottom"))
    assert not any(axes.spines[side].get_visible() for axes in seen for side in ("top", "right"))
    assert all(line.get_visible() for axes in seen for line in axes.get_xgridlines())


def test_two_drawings_are_equal_bytes(tmp_path: Path) -> None:
    first, second = (draw_panels({"gap": line}, tmp_path / name) for name in ("a", "b"))
    assert first.read_bytes() == second.read_bytes()
