"""Table II under readings: what is compared with what, maps of differences, and the page."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import Results
from orchestrator.intervals import Estimate
from studies.method import records
from studies.relay import RelayReadings, ahead
from studies.relay.advantage import Cell, Margin
from studies.relay.reading_table import (
    AHEAD,
    BASE,
    BUDGET,
    POLICIES,
    READINGS,
    SCENES,
    Run,
    Runs,
    Where,
    results,
)
from studies.relay.readings_page import TABLE, main, page, prepare
from tests.studies.relay.synthetic import experiment
from tests.studies.results import SESSION, check_missing

ROOT = Path(__file__).parents[3]
DOCS = ROOT / "docs"
FACTORS = {"share": ("13 %", "30 %"), "exponent": ("2", "3")}
MAP = {"columns": "exponent", "rows": "share", "better": "mohed", "worse": "own"}
GAINS = {("13 %", "2"): 0.0, ("13 %", "3"): 0.2, ("30 %", "2"): -0.1, ("30 %", "3"): 0.05}
"""By how much MoHeD is better, on average; only in the last cell do the seeds disagree."""


def plan(parameters: dict[str, Any], name: str = "map") -> Experiment:
    scenario = {"time": {"start": "0 s", "stop": "10 s"}, "components": {}}
    combinations = [
        Combination({"share": share, "exponent": exponent, "method": method}, (), scenario)
        for share, exponent in GAINS
        for method in ("mohed", "own")
    ]
    return replace(
        experiment(("mohed",)),
        path=Path(f"{name}.yaml"),
        combinations=tuple(combinations),
        report=ReportPlan(name="relay-readings", parameters=parameters),
    )


def found(asked: Experiment) -> Results:
    """Three seeds each: the gain and a hundredth of the seed, but in one cell ten times as much."""
    rows: list[dict[str, Any]] = []
    for combination in asked.combinations:
        levels = combination.levels
        key = (levels["share"], levels["exponent"])
        for seed in (1, 2, 3):
            gain = GAINS[key] + (0.1 if key == ("30 %", "3") else 0.01) * (seed - 2)
            prr = 0.5 + (gain if levels["method"] == "mohed" else 0.0)
            state = {"fingerprint": "0", "wall_s": 5.0, "cpu_s": None, "error": None}
            metrics = {"prr": prr, "direct_prr": 0.4, "relay_switches": 1, "collision_rate": False}
            rows.append({**levels, "seed": seed, **metrics, **state})
    rows.append({**rows[0], "seed": 4, "prr": None, "error": "it broke"})
    return Results(experiment=asked, rows=rows, metrics=[{} for _ in rows], sessions=[SESSION])


def test_a_cell_has_the_difference_by_the_same_seeds_and_its_interval(tmp_path: Path) -> None:
    """Student's t: 4.303 times 0.01 over the root of 3 is 2.48 points, with 0.1 24.8 points."""
    RelayReadings().write(found(plan({"map": MAP})), tmp_path)
    cells = records.read(tmp_path / "map.csv", Cell)
    assert [(cell.row, cell.column, cell.n) for cell in cells] == [(*key, 3) for key in GAINS]
    for cell, gain, half in zip(cells, GAINS.values(), (2.484, 2.484, 2.484, 24.84), strict=True):
        assert cell.difference is not None
        assert cell.difference.value == pytest.approx(100 * gain, abs=1e-4)
        assert cell.difference.high == pytest.approx(100 * gain + half, abs=1e-2)
        assert cell.difference.low == pytest.approx(100 * gain - half, abs=1e-2)
    assert [cell.is_decided for cell in cells] == [False, True, True, False]


@pytest.mark.parametrize(("comparisons", "wanted"), [(1, 2), (4, 2), (40, 1), (400, 0)])
def test_many_cells_at_once_need_wider_intervals(
    tmp_path: Path, comparisons: int, wanted: int
) -> None:
    """Two degrees of freedom bound a share p at p sqrt(2 / (1 - p^2)).

    Of 95 % that is 4.30, with 4 comparisons 8.86 and with 40 28.3: 2.484 points become 5.1 and
    16.3, so that -10 points are decided among 4 and not among 40, and 20 points are among both.
    """
    RelayReadings().write(found(plan({"map": MAP})), tmp_path)
    cells = records.read(tmp_path / "map.csv", Cell)
    assert sum(cell.is_decided_among(comparisons) for cell in cells) == wanted


def test_a_map_hatches_what_is_open_and_says_what_its_colours_mean(tmp_path: Path) -> None:
    """Two of four cells are open; the others have the colours of the two signs."""
    RelayReadings().write(found(plan({"map": MAP})), tmp_path)
    picture = (tmp_path / "map.svg").read_text()
    assert picture.count("fill: url(#h") == 2
    assert "[points], 3 seeds per cell" in picture
    assert "blue: MoHeD delivers more; orange: less; hatched: the interval" in picture
    assert ("#0072b2" in picture, "+20.0" in picture, "-10.0" in picture) == (True, True, True)


def test_a_margin_is_the_mean_over_the_other_factor_by_seed(tmp_path: Path) -> None:
    """Slopes over seeds of 0.01 and 0.1 make 0.055; without 0.01 of the first level 0.045."""
    RelayReadings().write(found(plan({"map": MAP})), tmp_path)
    margins = records.read(tmp_path / "map_margins.csv", Margin)
    levels = [("share", "13 %"), ("share", "30 %"), ("exponent", "2"), ("exponent", "3")]
    assert [(one.factor, one.level) for one in margins] == levels
    assert {one.n for one in margins} == {3}
    to_half = 4.30265 / 3**0.5
    wanted = [(10.0, 1.0, None), (-2.5, 5.5, -12.5), (-5.0, 1.0, None), (12.5, 5.5, 17.5)]
    for one, (middle, slope, change) in zip(margins, wanted, strict=True):
        assert one.difference is not None
        assert one.difference.value == pytest.approx(middle)
        assert one.difference.high == pytest.approx(middle + slope * to_half, abs=1e-3)
        assert (one.change is None) == (change is None)
        if one.change is not None and change is not None:
            assert one.change.value == pytest.approx(change)
            assert one.change.low == pytest.approx(change - 4.5 * to_half, abs=1e-3)


def test_the_page_counts_the_cells_of_a_map(tmp_path: Path) -> None:
    """One is decided on either side; among four intervals at once both still are."""
    scene(tmp_path)
    prepare(tmp_path)
    RelayReadings().write(found(plan({"map": MAP}, "relay_map_load")), tmp_path)
    text = page(tmp_path, "results")
    assert "MoHeD delivers more in 1 of 4 cells (at once: 1), less in 1 (at once: 1)" in text
    assert "| 13 % | 0.0 [-2.5, 2.5] | 20.0 [17.5, 22.5] |" in text
    assert "| 13 % | 50.0, 50.0 | 70.0, 50.0 |" in text
    assert "| exponent | 3 | 3 | 12.5 [-1.2, 26.2] | 17.5 [6.3, 28.7] |" in text


def test_the_cost_is_given_for_all_seeds_that_are_planned(tmp_path: Path) -> None:
    """24 runs of 5 s: 8 combinations with 50 seeds are 2000 s, on two cores 0.28 h."""
    scene(tmp_path)
    prepare(tmp_path)
    RelayReadings().write(found(plan({"map": MAP}, "relay_map_load")), tmp_path)
    text = page(tmp_path, "results")
    assert "| relay_map_load | 24 | 0.03 | wall time | 5.00 | 400 | 0.28 |" in text
    assert "| all | 24 | 0.03 |  |  | 400 | 0.28 |" in text


def test_equal_results_make_equal_bytes_and_a_map_is_drawn(tmp_path: Path) -> None:
    written = []
    for name in ("first", "second"):
        folder = tmp_path / name
        folder.mkdir()
        RelayReadings().write(found(plan({"map": MAP})), folder)
        written.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert written[0] == written[1]
    kinds = {"map.csv", "map.png", "map.svg", "map_provenance.json", "map_runs.csv"}
    assert written[0].keys() == kinds | {"map_margins.csv"}
    assert b"secret" not in written[0]["map_provenance.json"]


@pytest.mark.parametrize(
    ("parameters", "what"),
    [
        (
            {"map": {"columns": "exponent"}},
            "expected a mapping with the keys columns, rows, better",
        ),
        ({"map": {**MAP, "rows": "shares"}}, "there is no factor `shares`; did you mean `share`"),
        ({"map": {**MAP, "rows": "method"}}, "there is no factor `method`"),
        ({"map": {**MAP, "worse": "owns"}}, "there is no method `owns`; did you mean `own`"),
        ({"maps": MAP}, "there is no parameter `maps`"),
    ],
)
def test_what_is_wrong_is_said_before_the_first_run(parameters: dict[str, Any], what: str) -> None:
    (problem,) = RelayReadings().check(plan(parameters))
    assert problem.what.startswith(what)


def test_readings_without_a_map_need_the_method_and_the_metrics() -> None:
    assert list(RelayReadings().check(plan({}))) == []
    bare = replace(plan({}), metrics={"prr": "prr.end_to_end"})
    told = [problem.what for problem in RelayReadings().check(bare)]
    assert told == [
        "the relay readings needs the metric `direct_prr`",
        "the relay readings needs the metric `relay_switches`",
    ]


RATES = {"mohed": 0.88, "signal-strength": 0.6, "signal-strength-own": 0.46, "random": 0.51}
"""Of a scene; the direct link loses 61 %."""


def test_trajectories_are_compared_with_both_rules_by_the_same_seeds(tmp_path: Path) -> None:
    """MoHeD has 87 and 89 %, with trajectories 90 and 94 %: 4 points more, and t is 12.7."""
    scene(tmp_path)
    here = {"scene": "30 % tall", "method": "mohed-trajectories"}
    always = {**here, "relay_switches": 5, "error": None}
    rows = [{**always, "seed": seed, "prr": 0.86 + 0.04 * seed} for seed in (1, 2, 3)]
    records.write(tmp_path / AHEAD, rows)
    (text,) = ahead.part(tmp_path)
    (row,) = (line for line in text.splitlines() if line.startswith("| 30 % tall"))
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert cells[:2] == ["30 % tall", "2"]
    assert cells[4] == "4.0 [-8.7, 16.7]"
    assert [cell.split()[0] for cell in cells[2:]] == [
        "88.0",
        "92.0",
        "4.0",
        "3.50",
        "32.0",
        "46.0",
    ]


def test_every_scene_of_the_readings_has_its_rules_beside_each_other() -> None:
    found = list(ahead.places())
    names = ["30 % tall", "exponent 2.75", "exponent 3", "30 % tall, exponent 2.75"]
    assert [place.name for place in found] == ["as in the study", *names]
    for place in found:
        assert place.total.levels["method"] == "signal-strength"
        assert place.own.levels["method"] == "signal-strength-own"


VALUES = ("seed", "prr", "direct_prr", "relay_switches", "collision_rate", "error")
"""The columns of a table of runs that are no levels."""


def scene(folder: Path) -> None:
    """Two seeds of one scene, a hundredth above and below each rate; one run more failed."""
    here = {"scene": "30 % tall"}
    cell = {"tall_vehicles": "30 %", "path-loss_exponent": "2"}
    tables: dict[str, list[dict[str, Any]]] = {SCENES: [], BUDGET: []}
    for method, rate in {**RATES, "direct": 0.39}.items():
        name, levels = (
            (BUDGET, cell) if method in {"mohed", "signal-strength-own"} else (SCENES, here)
        )
        rows = tables[name]
        for seed in (1, 2):
            prr = rate + 0.01 * (2 * seed - 3)
            rows.append({**levels, "method": method, "seed": seed, "prr": prr})
            rows[-1] |= {"direct_prr": prr, "relay_switches": seed, "error": None}
            rows[-1] |= {"collision_rate": method != "mohed" and seed == 1}
    for name, rows in tables.items():
        rows.append({**rows[0], "seed": 3, "prr": 0.0, "error": "it broke"})
        records.write(folder / name, rows)


def test_a_reading_takes_each_method_from_its_runs(tmp_path: Path) -> None:
    """Both rules of signal strength are beside the same MoHeD, random and direct link."""
    scene(tmp_path)
    by_sum, by_own = results(Runs(tmp_path))
    assert (by_sum.rule, by_own.rule, by_sum.n) == ("sum", "own hop", 2)
    for row, strength in ((by_sum, 0.6), (by_own, 0.46)):
        values = (row.mohed, row.strength, row.random, row.direct_per, row.over_strength)
        wanted = (0.88, strength, 0.51, 0.61, 0.88 - strength)
        for value, expected in zip(values, wanted, strict=True):
            assert value is not None
            assert value.value == pytest.approx(expected)
    assert by_own.random_over_strength is not None
    assert by_own.random_over_strength.value == pytest.approx(0.05)
    assert by_own.mohed_switches is not None
    assert by_own.mohed_switches.value == 1.5


def test_collisions_are_counted_where_all_methods_recorded_them(tmp_path: Path) -> None:
    """Of two runs MoHeD collides in none, its rivals in one: Wilson bounds 0 of 2 by 65.8 %."""
    scene(tmp_path)
    prepare(tmp_path)
    row = "| 30 % tall | own hop | 2 | 0.0 [0.0, 65.8] | 50.0 [9.5, 90.5] | 50.0 [9.5, 90.5] |"
    assert row in page(tmp_path, "results")
    rows = records.read(tmp_path / SCENES, Run)
    kept = [{**row.levels, **{k: getattr(row, k) for k in VALUES}} for row in rows]
    bare = [{k: v for k, v in row.items() if k != "collision_rate"} for row in kept]
    records.write(tmp_path / SCENES, bare)
    prepare(tmp_path)
    assert "## Collisions" not in page(tmp_path, "results")


def test_a_reading_is_of_the_seeds_that_all_its_methods_have(tmp_path: Path) -> None:
    """A third seed of MoHeD alone would move its mean from 88 to 92 %."""
    scene(tmp_path)
    rows = records.read(tmp_path / BUDGET, Run)
    more = replace(rows[0], seed=4, prr=1.0)
    assert more.levels["method"] == "mohed"
    every = [{**row.levels, **{k: getattr(row, k) for k in VALUES}} for row in (*rows, more)]
    records.write(tmp_path / BUDGET, every)
    (by_sum, _) = results(Runs(tmp_path))
    assert by_sum.n == 2
    assert by_sum.mohed is not None
    assert by_sum.mohed.value == pytest.approx(0.88)


def marked(folder: Path, strength: Estimate) -> str:
    """The cell of signal strength, for which the paper has 46.59 %."""
    scene(folder)
    (_, own) = results(Runs(folder))
    records.write(folder / TABLE, records.rows([replace(own, strength=strength)]))
    lines = page(folder, "results").splitlines()
    row = next(line for line in lines if line.startswith("| 30 % tall | own hop"))
    return [cell.strip() for cell in row.strip("|").split("|")][5]


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [
        (0.416, 0.515, "**46.0 [41.6, 51.5]**"),
        (0.415, 0.515, "*46.0 [41.5, 51.5]*"),
        (0.416, 0.517, "*46.0 [41.6, 51.7]*"),
        (0.517, 0.6, "46.0 [51.7, 60.0]"),
        (0.1, 0.415, "46.0 [10.0, 41.5]"),
    ],
)
def test_the_page_marks_what_lies_within_five_points_of_the_paper(
    tmp_path: Path, low: float, high: float, wanted: str
) -> None:
    """From 41.59 to 51.59 %: the whole interval reproduces it, a part of it may."""
    assert marked(tmp_path, Estimate(0.46, low, high)) == wanted


def test_the_page_in_the_manual_is_what_the_committed_results_give(tmp_path: Path) -> None:
    folder, written = DOCS / "results", DOCS / "relay-readings.md"
    analysis = folder / "relay-readings-analysis.md"
    assert written.read_text() == page(folder, "results", analysis), "run `make paper-readings`"
    for name in (BASE, POLICIES, SCENES, BUDGET):
        if (folder / name).is_file():
            (tmp_path / name).write_bytes((folder / name).read_bytes())
    prepare(tmp_path)
    assert (tmp_path / TABLE).read_bytes() == (folder / TABLE).read_bytes()


def test_its_command_says_what_is_missing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("studies.relay.readings_page.prepare", lambda _folder: None)
    check_missing(TABLE, main, monkeypatch, tmp_path, capsys)


def test_every_reading_names_another_comparison() -> None:
    assert len({(one.name, one.rule) for one in READINGS}) == len(READINGS)


@pytest.mark.parametrize(
    ("table", "levels"),
    [
        (BASE, {"density": "30 m", "speed": "30 km/h", "method": "mohed"}),
        (POLICIES, {"reading": "one hop", "method": "signal-strength-own"}),
    ],
)
def test_what_two_experiments_have_both_run_came_out_equal(
    table: str, levels: dict[str, str]
) -> None:
    """The scene of Table II is one cell of the map of the link budget, run again by later code."""
    here = {"tall_vehicles": "13 %", "path-loss_exponent": "2", "method": levels["method"]}
    runs = Runs(DOCS / "results")
    for metric in ("prr", "direct_prr", "relay_switches"):
        one = runs.sample(Where(table, levels), metric)
        other = runs.sample(Where(BUDGET, here), metric)
        common = one.keys() & other.keys()
        assert len(common) >= 7
        assert all(one[seed] == other[seed] for seed in common), metric
