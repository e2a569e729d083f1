"""The figures of the validation of perception: drawn of what is kept, as its page says."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.figures.laws import drawn_by, problems

pytest.importorskip("shapely", reason="the extra `verify` is not installed")

from studies.verification.drawing import write
from studies.verification.perception import figures
from studies.verification.perception.shown import BEST, EGO, SHARER, Shown
from studies.verification.perception.summary import ALWAYS, DEMANDED, WHOLE

DOCS = Path(__file__).parents[2] / "docs"
FOLDER = DOCS / "validation-perception"
PAGE = (DOCS / "validation-perception.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def shown() -> Shown:
    return Shown.read(FOLDER)


@pytest.fixture(scope="module")
def drawn(shown: Shown, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Figure]:
    names = [one.name for one in figures.drawings(shown)]
    folder = tmp_path_factory.mktemp("drawn")
    with pytest.MonkeyPatch.context() as patch:
        found = drawn_by(lambda: write(figures.drawings(shown), folder), patch)
    return dict(zip(names, found, strict=True))


def test_they_fulfil_the_laws_of_figures(drawn: dict[str, Figure]) -> None:
    assert set(drawn) == {path.name for path in FOLDER.glob("*.png")}
    assert {name: problems(figure) for name, figure in drawn.items() if problems(figure)} == {}


def test_an_axis_has_one_quality(drawn: dict[str, Figure]) -> None:
    grid = np.array(drawn["zones.png"].axes).reshape(3, -1)
    assert [row[0].get_ylabel() for row in grid] == ["precision", "recall", "IoU"]
    assert {len(axes.lines) for axes in grid.ravel()} == {3}


def test_what_is_kept_is_what_the_page_says(shown: Shown) -> None:
    """The right sharer, bytes and hidden road of the tables of results."""
    assert f"{shown.scenes} scenes of seed 1" in PAGE
    assert f"in {shown.wanted} scenes it is" in PAGE.replace("\n", " ")
    right, low, high = next(
        (curve.right[k], curve.low[k], curve.high[k])
        for curve in shown.sharers
        for k, value in enumerate(curve.values)
        if curve.parameter.startswith("error of the position") and value == 0.0
    )
    row = re.search(r"\| recommended \| \S+ \| (\S+)% \| (\d+)% to (\d+)%", PAGE)
    assert row is not None
    assert row.groups() == (f"{100 * right:.1f}", f"{100 * low:.0f}", f"{100 * high:.0f}")
    for cost in shown.costs:
        row = re.search(rf"\| {cost.size} \| {cost.way} \| (\d+) \| \S+ \| (\d+) \|", PAGE)
        assert row is not None
        assert row.groups() == (f"{cost.bytes:.0f}", f"{cost.revealed:.0f}")


def test_bytes_are_drawn_once_for_each_size_and_way(shown: Shown, drawn: dict[str, Figure]) -> None:
    left, right = drawn["bytes.png"].axes
    for way in (DEMANDED, WHOLE, ALWAYS):
        own = [cost for cost in shown.costs if cost.way == way]
        assert len(own) == 3
        assert {len(cost.shares) for cost in own} == {0 if way == ALWAYS else 5}
    curves = [line for line in left.lines if np.size(line.get_ydata()) == 5]
    assert len(curves) == 6
    expected = [list(cost.shares) for cost in shown.costs if cost.shares]
    for line, shares in zip(curves, expected, strict=True):
        np.testing.assert_allclose(np.asarray(line.get_ydata(), float), 100 * np.array(shares))
    points = [line for line in right.lines if np.size(line.get_ydata()) == 1]
    assert len(points) == len(shown.costs)


def test_scenes_show_the_ego_vehicle_and_who_was_chosen(shown: Shown) -> None:
    for one in shown.examples:
        roles = [body.role for body in one.bodies]
        assert roles.count(EGO) == roles.count(SHARER) == 1
        assert roles.count(BEST) == (one.told < one.best)
        assert one.told <= one.best


def test_what_is_kept_comes_back(shown: Shown, tmp_path: Path) -> None:
    shown.write(tmp_path)
    assert (tmp_path / "figures.json").read_bytes() == (FOLDER / "figures.json").read_bytes()
