"""One style: whoever draws takes settings and colours from one place."""

import ast
import re
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes

from orchestrator.drawing import draw_panels
from orchestrator.measure import Panel
from orchestrator.palette import COLOURS, LINK_COLOURS, LINK_LINES, LINK_MARKERS
from studies.measures import cbr, style
from studies.method.style import LOOKS
from tests.figures.laws import drawn_by, problems

ROOT = Path(__file__).parents[2]
SOURCES = [
    path
    for folder in ("orchestrator", "studies", "adapters", "fmus", "benchmarks")
    for path in sorted((ROOT / folder).rglob("*.py"))
]
STYLE = {"orchestrator/drawing.py", "orchestrator/palette.py", "studies/method/style.py"}
"""Where settings and colours are."""


def imported(path: Path) -> set[str]:
    """The modules that are imported when `path` is, or later; not those for types only."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for_types = {
        id(each)
        for node in ast.walk(tree)
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        for each in ast.walk(node)
    }
    found: set[str] = set()
    for node in ast.walk(tree):
        if id(node) in for_types:
            continue
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module}
        elif isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
    return found


@pytest.mark.parametrize(
    "path",
    [path for path in SOURCES if "matplotlib" in path.read_text(encoding="utf-8")],
    ids=lambda path: path.relative_to(ROOT).as_posix(),
)
def test_who_makes_figures_makes_them_in_the_style_of_all(path: Path) -> None:
    names = imported(path)
    if "matplotlib.figure" in names and path.name != "drawing.py":
        drawn = {"orchestrator.drawing", "studies.verification.drawing", "orchestrator"}
        assert names & drawn, "figures are drawn within `orchestrator.drawing.styled`"
    assert "matplotlib.pyplot" not in names


def test_colours_and_settings_are_in_the_style_alone() -> None:
    pattern = re.compile(r"""["']#[0-9A-Fa-f]{6}["']|rcParams""")
    texts = {path.relative_to(ROOT).as_posix(): path.read_text("utf-8") for path in SOURCES}
    assert {name for name, text in texts.items() if pattern.search(text)} <= STYLE


def test_a_figure_leaves_the_settings_of_others_alone(tmp_path: Path) -> None:
    before = dict(mpl.rcParams)
    draw_panels({"a": survival}, tmp_path / "a")
    assert dict(mpl.rcParams) == before


def test_no_two_link_classes_and_no_two_methods_look_the_same_without_colours() -> None:
    assert LINK_COLOURS.keys() == LINK_LINES.keys() == LINK_MARKERS.keys()
    assert len(set(LINK_LINES.values())) == len(set(LINK_MARKERS.values())) == len(LINK_LINES)
    assert len({look.marker for look in LOOKS.values()}) == len(LOOKS)
    assert len({look.colour for look in LOOKS.values()}) == len(LOOKS)
    assert len(set(COLOURS)) == len(COLOURS)


def shares(axes: Axes) -> None:
    place = np.array([10.0, 20.0])
    rows = {name: (place, place / 100 + k / 10, place / 200, place / 20)
            for k, name in enumerate(LINK_COLOURS)}  # fmt: skip
    style.draw_shares(axes, rows)
    axes.set_ylabel("share")


def quantiles(axes: Axes) -> None:
    names = ("from_m", "to_m", "median_s", "mean_s", "p95_s")
    style.draw_quantiles(axes, {name: np.arange(3.0) for name in names}, "age")


def distribution(axes: Axes) -> None:
    curves = {f"a{k}": style.distribution(np.arange(k, k + 9.0)) for k in range(4)}
    style.draw_distribution(axes, curves, "time [s]")


def survival(axes: Axes) -> None:
    style.draw_survival(axes, (np.array([1.0, 2.0]), np.array([0.5, 1.0])))


def busy(axes: Axes) -> None:
    table = {name: np.linspace(0.0, k / 10, 9) for k, name in enumerate(("mean", "p95", "max"))}
    cbr._draw(axes, {"time_s": np.arange(9.0), **table})


@pytest.mark.parametrize("panel", [shares, quantiles, distribution, survival, busy])
def test_panels_of_measures_fulfil_the_laws(panel: Panel, monkeypatch: pytest.MonkeyPatch) -> None:
    (figure,) = drawn_by(lambda: draw_panels({"panel": panel}, Path("unused")), monkeypatch)
    assert problems(figure) == []
