"""`signals`: the numbers of any run as a table and as curves."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from orchestrator.cli import main
from orchestrator.measure import Answer
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import scenario_path
from orchestrator.scenario.measures import questions_of
from orchestrator.signal import Array
from orchestrator.table_files import has_parquet, read_table
from studies.measures import held, signals
from studies.measures.held import Held
from studies.measures.signals import CURVES_PER_PANEL, MOST_CURVES, MOST_PANELS, Signals
from tests.studies.measures.numbers import MS, recorded
from tests.studies.measures.test_signal import SCENARIO


def table(answer: Answer) -> dict[str, Array]:
    (blocks,) = answer.long_tables.values()
    parts = list(blocks())
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def test_a_row_for_each_time_at_which_one_was_published(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of 100 and 250 ms these are 13 in a second; values hold in between, in whatever pieces."""
    run = recorded(tmp_path / "run")
    answer = Signals().compute(run)
    found = table(answer)
    times = [0, 0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.75, 0.8, 0.9, 1]
    assert found["time [s]"].tolist() == times
    assert found["plant.ramp [m]"].tolist() == [0, 0.1, 0.2, 0.2, *times[4:9], 0.7, 0.8, 0.9, 1]
    expected = np.repeat([0.0, -0.25, -0.5, -0.75, -1.0], [3, 3, 3, 3, 1])
    np.testing.assert_array_equal(found["sensor.value [m]"], expected)
    # whole numbers and truths stay what they are
    assert found["plant.count"].dtype == np.int32
    assert found["plant.is_late"].tolist() == [False] * 8 + [True] * 5
    np.testing.assert_array_equal(found["plant.force[2] [N]"], -3 * found["plant.ramp [m]"])
    assert set(found["plant.mass [kg]"]) == {2.0}
    assert sorted(found) == [
        "plant.count",
        "plant.force[0] [N]",
        "plant.force[1] [N]",
        "plant.force[2] [N]",
        "plant.is_late",
        "plant.mass [kg]",
        "plant.ramp [m]",
        "sensor.value [m]",
        "time [s]",
    ]
    assert answer.numbers == {"columns": 8, "rows": 13, "drawn": 7, "not_drawn": None}
    assert list(answer.panels) == ["plant", "plant [N]", "plant, sensor [m]"]
    monkeypatch.setattr(signals, "_ROWS", 5)
    again = table(answer)
    assert all(
        np.array_equal(column, again[name], equal_nan=True) for name, column in found.items()
    )
    assert "plant.many[9]" in table(Signals(elements=10).compute(run))


def test_before_its_first_value_a_field_is_empty() -> None:
    column = Held("a.x", "1", _Late(np.array([20, 30]), np.array([2.0, 3.0])))  # type: ignore[arg-type]
    times = np.array([10, 15, 20, 29, 30, 40])
    (found,) = signals._rows([column], times)
    np.testing.assert_array_equal(found["a.x"], [np.nan, np.nan, 2, 2, 3, 3])
    (early,) = signals._rows([column, _columns("b.x")[0]], np.array([0, 10, 15]))
    np.testing.assert_array_equal(early["a.x"], [np.nan] * 3)


class _Late:
    """A series of these times and values."""

    def __init__(self, times: Array, values: Array) -> None:
        self.times, self._values, self.kind = times, values, "float64[]"

    def __len__(self) -> int:
        return len(self.times)

    def between(self, first: int, end: int) -> Array:
        return self._values[first:end]


def test_a_curve_of_many_values_keeps_all_extremes(monkeypatch: pytest.MonkeyPatch) -> None:
    """100,001 values become at most 2002 points, a spike of one value among them."""
    values = np.sin(np.arange(100_001) * 1e-3)
    values[54_321] = 7.0
    column = Held("a.x", "1", _Late(np.arange(100_001) * MS, values))  # type: ignore[arg-type]
    times, drawn = signals.curve(column)
    assert len(times) == len(drawn) <= 2002
    assert (np.diff(times) >= 0).all()
    assert times[np.argmax(drawn)] == 54.321
    assert drawn.max() == 7.0
    assert drawn.min() == values.min()
    assert (times[0], times[-1]) == (0.0, 100.0)
    np.testing.assert_array_equal(values[np.round(times * 1e3).astype(int)], drawn)
    monkeypatch.setattr(signals, "BLOCK", 250)
    np.testing.assert_array_equal(signals.curve(column)[1], drawn)
    short = Held("a.x", "1", _Late(np.arange(2000) * MS, values[:2000]))  # type: ignore[arg-type]
    assert len(signals.curve(short)[0]) == 2000


def _columns(*names: str, unit: str = "m") -> list[Held]:
    series = _Late(np.arange(2), np.zeros(2))
    return [Held(name, unit, series) for name in names]  # type: ignore[arg-type]


def test_curves_of_a_unit_share_panels_that_hold_seven() -> None:
    few = _columns("a.x", "a.y", "b.x") + _columns("a.v", unit="m/s")
    panels, _ = signals._panels(few)
    assert {title: len(group) for title, group in panels.items()} == {"a, b [m]": 3, "a [m/s]": 1}
    many = _columns(*(f"a.x{k}" for k in range(9)), *(f"b.x{k}" for k in range(6)))
    panels, _ = signals._panels(many)
    sizes = {title: len(group) for title, group in panels.items()}
    assert sizes == {"a [m]": 7, "a [m] (2)": 2, "b [m]": 6}
    assert CURVES_PER_PANEL == 7


def test_what_is_not_drawn_is_named() -> None:
    """Of 45 signals in one unit 40 are drawn; of 14 units 12 panels."""
    panels, curves = signals._panels(_columns(*(f"a.x{k}" for k in range(45))))
    assert sum(map(len, panels.values())) == MOST_CURVES == 40
    assert len(curves) == 45
    different = [column for k in range(14) for column in _columns("a.x", unit=f"u{k}")]
    assert len(signals._panels(different)[0]) == MOST_PANELS == 12


def test_axes_say_what_and_in_which_unit() -> None:
    """One curve is named at the axis; several, of several components, have a legend."""
    figure = Figure()
    one, more, pure = figure.subplots(3)
    signals._draw(_columns("a.x"), one)
    signals._draw(_columns("a.x", "b.x"), more)
    signals._draw(_columns("a.n", "a.m", unit="1"), pure)
    assert [axes.get_ylabel() for axes in (one, more, pure)] == ["x [m]", "[m]", ""]
    assert one.get_legend() is None
    for axes, names in ((more, ["a.x", "b.x"]), (pure, ["n", "m"])):
        legend = axes.get_legend()
        assert legend is not None
        assert [text.get_text() for text in legend.get_texts()] == names
    whole = _columns("a.n")
    whole[0].series.kind = "int32[]"  # type: ignore[misc]
    signals._draw(whole, one)
    assert [line.get_drawstyle() for line in one.lines] == ["default", "steps-post"]


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    (tmp_path / "in.csv").write_text("time [s],height [m],x[2] [m]\n0,0,0\n0.5,3,1\n1,1,1\n")
    path = tmp_path / "play.yaml"
    path.write_text(SCENARIO.partition("measures:")[0])
    return path


def test_a_run_that_names_no_report_and_no_measures_has_a_table_and_a_page(
    scenario: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "signals: columns 2, rows 11, drawn 2" in said
    assert (out / "measures.svg").read_text().startswith("<?xml")
    found = read_table(out / "measures" / "signals-table.csv")
    assert list(found) == ["time [s]", "source.height [m]", "source.x[2] [m]"]
    assert found["source.height [m]"][5] == 3.0
    if has_parquet():
        again = read_table(out / "measures" / "signals-table.parquet")
        assert all((again[name] == found[name]).all() for name in found)
    # the table can be played back
    again_file = SCENARIO.partition("measures:")[0].replace(
        "in.csv", "out/measures/signals-table.csv"
    )
    scenario.write_text(again_file)
    assert main(["run", str(scenario), "--out", str(tmp_path / "second"), "--no-figure"]) == 0
    second = read_table(tmp_path / "second" / "measures" / "signals-table.csv")
    assert second["source.source.height [m]"].tolist() == found["source.height [m]"].tolist()


def test_who_wants_none_gets_none(scenario: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert main(["run", str(scenario), "--set", "measures={}", "--out", str(out), "--quiet"]) == 0
    assert not (out / "measures").exists()
    assert not (out / "measures.svg").exists()


def test_it_is_asked_of_scenarios_without_a_report(scenario: Path) -> None:
    """Of others who names it, or asks `all`."""
    with_report = load_scenario(scenario_path("red_light"))
    without = load_scenario(scenario)
    for each, is_asked in ((with_report, False), (without, True)):
        assert ("signals" in each.asked(every_run=True).optional) == is_asked
        assert ("signals" in questions_of(each.resolved()).optional) == is_asked
        assert "prr" in questions_of(each.resolved()).optional
        assert "signals" in questions_of(each.resolved(), more=["all"]).optional
        assert "signals" in questions_of(each.resolved(), more=["signals"]).measures


def test_long_runs_are_read_in_pieces(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody asks for more than a block of samples at once."""
    run = recorded(tmp_path / "run", step=10 * MS, stop=2000 * MS)
    monkeypatch.setattr(signals, "_ROWS", 32)
    monkeypatch.setattr(held, "BLOCK", 32)
    asked: list[int] = []
    between = Held.between

    def noted(self: Held, first: int, end: int) -> Array:
        asked.append(end - first)
        return between(self, first, end)

    monkeypatch.setattr(Held, "between", noted)
    assert len(table(Signals().compute(run))["time [s]"]) == 201
    assert max(asked) <= 33
