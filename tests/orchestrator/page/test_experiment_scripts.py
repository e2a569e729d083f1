"""What the scripts of the page of an experiment say: the numbers of the tables, and no others."""

import csv
import io
import itertools
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from orchestrator.campaign.work import RunKey
from orchestrator.experiment import stored, tables
from orchestrator.experiment.page.page import SCRIPTS, content
from orchestrator.experiment.page.parts import read_parts
from orchestrator.experiment.report import Results
from orchestrator.intervals import Estimate, mean, paired_shares
from orchestrator.page.arrays import Arrays
from tests.orchestrator.page.results import conducted
from tests.orchestrator.page.test_experiment_page import became, small
from tests.scripts import Engine, engine

NEEDED = [path for path in SCRIPTS if path.stem != "start"]
VIEW = {"metric": 0, "x": 0, "group": -1, "held": [0, 0], "factor": 0, "a": 0, "b": 1}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return conducted(tmp_path_factory.mktemp("street") / "out", small(), became)


@pytest.fixture(scope="module")
def results(folder: Path) -> Results:
    return stored.read(folder)


@pytest.fixture(scope="module")
def page(folder: Path) -> Iterator[Engine]:
    """The scripts, with `results` of the folder."""
    arrays = Arrays()
    data = content("street", read_parts([folder]), folder, arrays)
    bytes_of = "new NLOSIM.Arrays(NLOSIM.inflate(NLOSIM.bytesOf(letters)))"
    with engine(NEEDED) as found:
        found.value(
            f"(globalThis.results = new NLOSIM.Results(data, {bytes_of}), 1)",
            data=data,
            letters=arrays.letters(),
        )
        yield found


def rows_of(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


def same(a: str, b: str) -> bool:
    """Whether two cells are the same number to the last digit, or the same text."""
    try:
        return float(a) == float(b)
    except ValueError:
        return a == b


@pytest.mark.parametrize(("metric", "name"), [(0, "prr"), (1, "hit")])
def test_the_means_are_those_of_the_summary_to_the_last_digit(
    page: Engine, results: Results, folder: Path, metric: int, name: str
) -> None:
    """Every combination in one figure: its CSV is the part of `summary.csv` about the metric."""
    experiment = results.experiment
    table = tables.summary(experiment, results.rows)
    tables.write_summary(folder, table, tables.units(experiment, results.metrics))
    with (folder / "summary.csv").open(newline="", encoding="utf-8") as file:
        expected = list(csv.reader(file))
    own = [k for k, head in enumerate(expected[0]) if head.split(" ")[0].removesuffix("_n") == name]
    own += [
        k for k, head in enumerate(expected[0]) if head.startswith((f"{name}_low", f"{name}_high"))
    ]
    columns = [0, 1, 2, *sorted(own)]
    view = {**VIEW, "metric": metric, "x": -1}
    found = rows_of(page.value("NLOSIM.csv(NLOSIM.meansOf(results, view).table)", view=view))
    assert found[0] == [expected[0][k] for k in columns]
    assert len(found) == 5
    for row, wanted in zip(found[1:], expected[1:], strict=True):
        assert all(itertools.starmap(same, zip(row, [wanted[k] for k in columns], strict=True)))


def test_the_means_along_a_factor_hold_the_others(page: Engine) -> None:
    """The density along the axis: two marks; the method as groups: four."""
    cells = "NLOSIM.cellsOf(results, view).map((cell) => [cell.combination, cell.x, cell.group])"
    assert page.value(cells, view={**VIEW, "x": 1}) == [[0, 0, 0], [1, 1, 0]]
    assert page.value(cells, view={**VIEW, "x": 1, "held": [1, 0]}) == [[2, 0, 0], [3, 1, 0]]
    grouped = [[0, 0, 0], [1, 1, 0], [2, 0, 1], [3, 1, 1]]
    assert page.value(cells, view={**VIEW, "x": 1, "group": 0}) == grouped


def test_the_runs_are_there_one_by_one_and_failed_ones_are_counted(
    page: Engine, results: Results
) -> None:
    spread = "NLOSIM.spreadOf(results, view)"
    view = {**VIEW, "x": -1}
    cells = page.value(f"{spread}.cells", view=view)
    assert [cell["failed"] for cell in cells] == [0, 1, 0, 0]
    for number, cell in enumerate(cells):
        levels = results.experiment.combinations[number].levels.values()
        own = [r["prr"] for r in results.rows if [*r.values()][:2] == [*levels] and not r["error"]]
        assert sorted(point["value"] for point in cell["points"]) == sorted(own)
    table = page.value(f"{spread}.table", view=view)
    assert len(table) == 17
    failed = [row for row in table[1:] if row[-1] is not None]
    assert [row[-2:] for row in failed] == [[None, became(RunKey(3, 1), {"density": ""})]]


@given(
    st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=30), st.sampled_from([0, 0.25, 0.5, 0.9, 1])
)
def test_quantiles_are_those_of_numpy(page: Engine, values: list[float], share: float) -> None:
    found = page.value("NLOSIM.quantile(values, share)", values=sorted(values), share=share)
    assert found == pytest.approx(float(np.quantile(values, share)), rel=1e-12, abs=1e-9)


def samples(results: Results, name: str, level: str, density: str) -> dict[int, Any]:
    return {
        row["seed"]: row[name]
        for row in results.rows
        if [*row.values()][:2] == [level, density] and row["error"] is None
    }


def expected_pairs(results: Results, name: str) -> Iterator[tuple[Estimate, list[float]]]:
    """The first method minus the second at each density, as Python computes it."""
    methods = results.experiment.levels["method"]
    for density in ("30 m", "60 m"):
        a, b = (samples(results, name, method, density) for method in methods)
        seeds = sorted(a.keys() & b.keys())
        points = [float(a[seed]) - float(b[seed]) for seed in seeds]
        if name == "hit":
            yield paired_shares([a[s] for s in seeds], [b[s] for s in seeds]), points
        else:
            yield mean(points), points


@pytest.mark.parametrize(("metric", "name"), [(0, "prr"), (1, "hit")])
def test_differences_are_by_seed_with_the_intervals_of_python(
    page: Engine, results: Results, metric: int, name: str
) -> None:
    """Four seeds at 30 m, three at 60 m, where a run failed."""
    rows = page.value("NLOSIM.pairsOf(results, view).rows", view={**VIEW, "metric": metric})
    assert [row["n"] for row in rows] == [4, 3]
    assert [row["label"] for row in rows] == ["density 30 m", "density 60 m"]
    for row, (estimate, points) in zip(rows, expected_pairs(results, name), strict=True):
        assert [row["value"], row["low"], row["high"]] == [
            estimate.value,
            estimate.low,
            estimate.high,
        ]
        assert [point["value"] for point in row["points"]] == points
        assert row["more"] == sum(value > 0 for value in points)
        assert row["less"] == sum(value < 0 for value in points)


def test_differences_the_other_way_round_are_their_negatives(page: Engine) -> None:
    there, back = (
        page.value("NLOSIM.pairsOf(results, view).rows", view={**VIEW, "a": a, "b": 1 - a})
        for a in (0, 1)
    )
    for one, other in zip(there, back, strict=True):
        assert [-one["value"], -one["high"], -one["low"]] == [
            other[k] for k in ("value", "low", "high")
        ]
        assert (one["more"], one["less"]) == (other["less"], other["more"])
        assert [-p["value"] for p in one["points"]] == [p["value"] for p in other["points"]]
        assert one["ends"] == other["ends"][::-1]


def test_a_level_has_no_difference_to_itself(page: Engine) -> None:
    assert page.value("NLOSIM.pairsOf(results, view).rows", view={**VIEW, "b": 0}) == []


def test_the_command_of_every_run_is_the_one_that_repeats_it(
    page: Engine, results: Results
) -> None:
    """Quotes, brackets and a line separator in the names of levels included."""
    experiment = results.experiment
    at = {tuple(c.levels.values()): k for k, c in enumerate(experiment.combinations)}
    expected = [
        experiment.command(RunKey(row["seed"], at[tuple([*row.values()][:2])]))
        for row in results.rows
    ]
    assert page.value("Array.from(results.seed, (_, run) => results.command(run))") == expected
    assert page.value("results.settings(5)") == [*experiment.combinations[1].overrides]


def test_a_failed_run_has_its_error_and_no_numbers(page: Engine) -> None:
    error, value, who = page.value(
        "[results.error(6), ...[0, 2].map((k) => results.value(6, results.metrics[k]))]"
    )
    assert error.startswith("`car`: broke at 1 s")
    assert (value, who) == (None, None)


def test_an_address_keeps_the_view(page: Engine) -> None:
    view = {
        "metric": 1,
        "x": -1,
        "group": -1,
        "held": [1, 1],
        "toScale": False,
        "factor": 1,
        "a": 1,
        "b": 0,
    }
    again = "NLOSIM.viewOf(results, NLOSIM.hashOf(results, view))"
    assert page.value(again, view=view) == view


@pytest.mark.parametrize("text", ["", "x=9&group=z&held=7.-1", "metric=%&factor=-3&a=99", "==&&"])
def test_an_address_that_makes_no_sense_shows_the_first_view(page: Engine, text: str) -> None:
    both = page.value("[NLOSIM.viewOf(results, text), NLOSIM.firstView(results)]", text=text)
    assert both[0] == both[1]


def test_a_table_as_csv_is_read_as_it_was(page: Engine) -> None:
    rows = [["a", 'b "c", d', "e\nf"], ["", "1e-7", "\r"]]
    text = page.value("NLOSIM.csv(rows)", rows=rows)
    assert list(csv.reader(io.StringIO(text, newline=""))) == rows


ROWS = [
    {"seed": 1, "density": "30 m", "prr": 0.5, "hit": True, "status": "done"},
    {"seed": 2, "density": "30 m", "prr": None, "hit": None, "status": "failed: Broke"},
    {"seed": 12, "density": "60 m", "prr": 0.75, "hit": False, "status": "done"},
]


@pytest.mark.parametrize(
    ("text", "seeds"),
    [
        ("", [1, 2, 12]),
        ("seed=1", [1]),
        ("1", [1, 12]),
        ("seed>1 seed<=12", [2, 12]),
        ("prr<0.6", [1]),
        ("prr>=0.5", [1, 12]),
        ('density="30 m"', [1, 2]),
        ('density!="30 m"', [12]),
        ('"30 m" done', [1]),
        ("BROKE", [2]),
        ("hit=true", [1]),
        ("what=1", []),
        ("seed!=1", [2, 12]),
    ],
)
def test_a_filter_asks_for_words_and_for_values_of_columns(
    page: Engine, text: str, seeds: list[int]
) -> None:
    found = page.value(
        "rows.filter(NLOSIM.filterOf(text, Object.keys(rows[0]))).map((row) => row.seed)",
        rows=ROWS,
        text=text,
    )
    assert found == seeds


@pytest.mark.parametrize("down", [False, True])
def test_what_there_is_not_comes_last_in_either_order(page: Engine, *, down: bool) -> None:
    values = [3, None, 1, 2]
    found = page.value(
        "values.sort((a, b) => NLOSIM.compare(a, b, down))", values=values, down=down
    )
    assert found == [*sorted([1, 2, 3], reverse=down), None]


@given(low=st.floats(-1e5, 1e5), span=st.floats(1e-3, 1e5), count=st.integers(2, 9))
def test_ticks_are_round_and_within_the_range(
    page: Engine, low: float, span: float, count: int
) -> None:
    """Between half and one and a half times as many as asked for, evenly apart."""
    found = page.value("NLOSIM.ticks(low, high, count)", low=low, high=low + span, count=count)
    assert 1 <= len(found) <= count + 1
    gaps = np.diff(found)
    assert np.allclose(gaps, gaps[:1] if len(gaps) else 0, rtol=1e-6, atol=1e-9 * max(abs(low), 1))
    for value in found:
        assert (
            low - 1e-6 * span - 1e-9 * abs(low)
            <= value
            <= low + span * (1 + 1e-6) + 1e-9 * abs(low)
        )


@given(st.lists(st.one_of(st.none(), st.floats(-1e9, 1e9)), max_size=9))
def test_a_range_holds_all_numbers(page: Engine, values: list[float | None]) -> None:
    low, high = page.value("NLOSIM.extent(values)", values=values)
    assert low < high
    known = [value for value in values if value is not None]
    assert all(low <= value <= high for value in known)


def test_runs_are_spread_evenly_however_many_there_are(page: Engine) -> None:
    """Of 2^k - 1 places, each 2^-k from the next, within half of the middle."""
    found = page.value("Array.from({ length: 63 }, (_, k) => NLOSIM.evenly(k))")
    assert np.allclose(np.sort(found), np.arange(1, 64) / 64 - 0.5)


def test_groups_differ_in_shape_and_in_colour(page: Engine) -> None:
    """The first seven in both; beyond that no two are drawn alike before the 49th."""
    found = page.value(
        "Array.from({ length: 49 }, (_, group) => NLOSIM.markOf(group))"
        ".map(({ shape, colour }) => [shape(0, 0, 1), colour])"
    )
    assert len({shape for shape, _ in found[:7]}) == len({colour for _, colour in found[:7]}) == 7
    assert len(set(map(tuple, found))) == 49


def test_real_numbers_of_64_bits_arrive_as_they_were(page: Engine) -> None:
    arrays = Arrays()
    arrays.add(np.arange(3), "u1")
    values = [0.1, -1e300, 5e-324, math.pi]
    reference = arrays.add(np.array(values), "f8")
    found = page.value(
        "Array.from(new NLOSIM.Arrays(NLOSIM.inflate(NLOSIM.bytesOf(letters))).array(reference))",
        letters=arrays.letters(),
        reference=reference,
    )
    assert found == values


def test_a_view_of_what_does_not_exist_is_settled_on_what_is_most_alike(page: Engine) -> None:
    """Of three factors two combinations are there; who asks for a level gets it, if it is."""
    there = {"combinations": [[0, 0, 0], [1, 1, 0]], "factors": [0, 0, 0]}
    settled = "NLOSIM.settled(there, view, before).held"
    view = {"x": 2, "group": -1, "held": [1, 0, 0]}
    before = {**view, "held": [0, 0, 0]}
    assert page.value(settled, there=there, view=view, before=before) == [1, 1, 0]
    assert page.value(settled, there=there, view=before, before=view) == [0, 0, 0]


def test_the_first_view_shows_most_with_numbers_along_the_axis(page: Engine) -> None:
    """Densities are numbers, methods are not; a level of the latter minus another one."""
    found = page.value("NLOSIM.firstView(results)")
    assert (found["x"], found["group"], found["held"]) == (1, 0, [0, 0])
    assert (found["factor"], found["a"], found["b"]) == (0, 0, 1)
