"""Table II under readings: what is compared with what, maps of differences, and the page."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from orchestrator.experiment.plan import Combination, Experiment, ReportPlan
from orchestrator.experiment.report import Results
from orchestrator.intervals import Estimate
from studies.method import records
from studies.relay import RelayReadings
from studies.relay.advantage import Cell
from studies.relay.reading_table import (
    BASE,
    BUDGET,
    POLICIES,
    READINGS,
    SCENES,
    Runs,
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
            state = {"fingerprint": "0", "wall_s": 5.0, "error": None}
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


def test_equal_results_make_equal_bytes_and_a_map_is_drawn(tmp_path: Path) -> None:
    written = []
    for name in ("first", "second"):
        folder = tmp_path / name
        folder.mkdir()
        RelayReadings().write(found(plan({"map": MAP})), folder)
        written.append({path.name: path.read_bytes() for path in folder.iterdir()})
    assert written[0] == written[1]
    kinds = ("map.csv", "map.png", "map.svg", "map_provenance.json", "map_runs.csv")
    assert sorted(written[0]) == list(kinds)
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
