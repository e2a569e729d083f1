"""The studies' figures: drawn of the tables beside them, in one style, by the laws of figures."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure

from studies.collision.statistics import Result
from studies.figures.__main__ import main
from studies.figures.catalogue import catalogue, folder_of
from studies.lasting.decisions import Dose
from studies.method import records
from studies.relay.statistics import DensityPoint, Step
from tests.figures.laws import drawn_by, problems

DOCS = Path(__file__).parents[2] / "docs"
RESULTS = DOCS / "results"
CATALOGUE = catalogue(DOCS)
STUDIES = [
    name
    for name in CATALOGUE
    if name.startswith("results/") and (not name.endswith("-training") or "general" in name)
]  # all trainings look the same

Drawn = Callable[[str], list[Figure]]


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    """What the catalogue draws, once each: the figures that would be written."""
    known: dict[str, list[Figure]] = {}

    def draw(name: str) -> list[Figure]:
        if name not in known:
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(Path, "write_bytes", lambda *_: None)
                patch.setattr(Path, "read_bytes", lambda *_: b"")
                both = drawn_by(lambda: CATALOGUE[name](folder_of(DOCS, name)), patch)
            known[name] = list({id(figure): figure for figure in both}.values())
        return known[name]

    return draw


def marks(axes: Axes) -> dict[str, list[float]]:
    """The heights of the marks of every series with bars, by its name."""
    return {
        str(one.get_label()): [float(y) for y in np.asarray(one[0].get_ydata())]
        for one in axes.containers
        if isinstance(one, ErrorbarContainer) and one[0] is not None
    }


def test_every_picture_of_the_results_is_in_the_catalogue() -> None:
    names = {name.removeprefix("results/") for name in CATALOGUE}
    for path in [*RESULTS.glob("*.svg"), *RESULTS.glob("*.png"), *RESULTS.glob("training/*.svg")]:
        name = path.relative_to(RESULTS).with_suffix("").as_posix()
        assert name in names or name.startswith("apmm_"), path


@pytest.mark.slow
@pytest.mark.parametrize("name", STUDIES)
def test_figures_of_studies_fulfil_the_laws(name: str, drawn: Drawn) -> None:
    assert [problem for figure in drawn(name) for problem in problems(figure)] == []


def test_figure_7_shows_its_table(drawn: Drawn) -> None:
    table = records.read(RESULTS / "figure7.csv", DensityPoint)
    (figure,) = drawn("results/figure7")
    shown = [y for heights in marks(figure.axes[0]).values() for y in heights]
    expected = [100 * point.prr.value for point in table if point.prr is not None]
    assert sorted(shown) == pytest.approx(sorted(expected))


def test_figure_8_shows_its_table_and_says_where_the_scale_changes(drawn: Drawn) -> None:
    """75 points below take 18.75, as wide as 18.75 of the 25 above: a fourth of their size."""
    table = records.read(RESULTS / "figure8.csv", Step)
    (figure,) = drawn("results/figure8")
    first = figure.axes[0]
    by_method: dict[str, list[tuple[float, float]]] = {}
    for step in table:
        by_method.setdefault(step.method, []).append((100 * step.prr, step.share))
    for line, expected in zip(first.lines, by_method.values(), strict=True):
        shown = np.column_stack([line.get_xdata(), line.get_ydata()])[1:-1]
        np.testing.assert_allclose(shown, expected)
    place = first.transData.transform([(x, 0.0) for x in (0, 50, 75, 80, 100)])[:, 0]
    assert (place[1] - place[0]) / 50 * 4 == pytest.approx((place[4] - place[3]) / 20)
    assert (place[2] - place[0]) / 75 * 4 == pytest.approx((place[4] - place[2]) / 25)
    assert "below 75 %, drawn 4 times smaller" in figure.get_supxlabel()


@pytest.mark.parametrize("name", ["figure9_10", "lasting_figure9_10"])
def test_figures_9_and_10_show_their_table(name: str, drawn: Drawn) -> None:
    table = records.read(RESULTS / f"{name}.csv", Result)
    (figure,) = drawn(f"results/{name}")
    rates = {round(100 * row.rate, 4) for row in table if row.rate is not None}
    speeds = len({row.speed_kmh for row in table})
    shown = {
        round(y, 4) for axes in figure.axes[:speeds] for ys in marks(axes).values() for y in ys
    }
    lines = {
        round(float(y), 4)
        for axes in figure.axes[:speeds]
        for line in axes.lines
        if str(line.get_label()).startswith("constant PER")
        for y in np.asarray(line.get_ydata())
    }
    assert shown | lines == rates


def test_doses_are_all_drawn_each_in_the_row_of_its_experiment(drawn: Drawn) -> None:
    table = records.read(RESULTS / "lasting_doses.csv", Dose)
    (figure,) = drawn("results/lasting_doses")
    known = [row for row in table if row.collisions is not None]
    experiments = list(dict.fromkeys(row.experiment for row in known))
    assert len(figure.axes) == 2 * len(experiments)
    for k, experiment in enumerate(experiments):
        shown = [
            y for axes in figure.axes[2 * k : 2 * k + 2] for ys in marks(axes).values() for y in ys
        ]
        expected = [
            100 * row.collisions.value
            for row in known
            if row.experiment == experiment and row.collisions is not None
        ]
        assert sorted(shown) == pytest.approx(sorted(expected))


def test_the_command_draws_what_is_asked_for(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "results").mkdir()
    shutil.copy(RESULTS / "figure7.csv", tmp_path / "results")
    arguments = ["studies.figures", str(tmp_path), "--only", "results/figure7"]
    monkeypatch.setattr("sys.argv", arguments)
    main()
    assert {path.name for path in (tmp_path / "results").iterdir()} == {
        "figure7.csv", "figure7.svg", "figure7.png",
    }  # fmt: skip
    assert capsys.readouterr().out == "results/figure7\n"


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("results/figure77", "there is no figure `results/figure77`; did you mean `results/figure"),
        ("results/figure8", "results/figure8: there is no `"),
    ],
)
def test_what_it_cannot_draw_it_names(
    name: str,
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("sys.argv", ["studies.figures", str(tmp_path), "--only", name])
    with pytest.raises(SystemExit):
        main()
    assert told in capsys.readouterr().err
