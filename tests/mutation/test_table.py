"""The page says what was tried and what was not, and judges by nothing else."""

import re
from dataclasses import replace
from pathlib import Path

from tests.mutation import journal, page
from tests.mutation.areas import AREAS
from tests.mutation.journal import Row
from tests.mutation.mutant import Mutant

ROOT = Path(__file__).parents[2]


def mutant(line: int, area: str = "kernel") -> Mutant:
    return Mutant(
        area=area, file="a.py", line=line, operator="op", before=f"  x = {line}", after="  pass"
    )


def rows_of(*verdicts: str) -> list[Row]:
    return [replace(Row.of(mutant(k)), verdict=each) for k, each in enumerate(verdicts)]


JUDGED = [page.Judgement(file="a.py", before="x  =  2", after="pass", reason="Nobody reads x.")]


def test_what_was_judged_equivalent_is_so_only_if_it_survived() -> None:
    rows = rows_of("killed", "survived", "survived")
    found = page.table([mutant(k) for k in range(5)], rows, JUDGED)
    verdicts = [row.verdict for row in found]
    assert verdicts == ["killed", "survived", "equivalent", "not run", "not run"]
    assert page.table([mutant(2)], rows_of("", "", "killed"), JUDGED)[0].verdict == "killed"


def test_the_share_is_of_those_that_were_tried_when_they_were_tried_first() -> None:
    """Two of four are 50 %, and a test written for a third does not make them more."""
    rows = rows_of("killed", "killed", "timeout", "survived", "unbuilt", "not run", "not run")
    rows[0] = replace(rows[0], killer="t", first="survived")
    text = page.written(rows, [], seed=5, budget=60.0)
    line = next(line for line in text.splitlines() if line.startswith("| kernel "))
    cells = [cell.strip() for cell in line.strip("|").split("|")]
    assert cells[1:9] == ["7", "2", "1", "0", "4", "2", "3", "1"]
    assert cells[9].startswith("50 % (15 to 85)")
    assert cells[10] == "75 %"
    assert "5 of the 7 breaks of the sample were tried; the other 2 were not run" in text
    assert "seed 5" in text
    assert "`a.py:3` | `x = 3` becomes `pass`" in text
    empty = next(line for line in text.splitlines() if line.startswith("| policies "))
    assert [cell.strip() for cell in empty.strip("|").split("|")][1:] == ["0"] * 8 + ["", ""]


def test_the_table_keeps_how_a_break_was_judged_at_first_and_a_campaign_goes_on_from_it(
    tmp_path: Path,
) -> None:
    rows = [*rows_of("unseen", "killed"), *rows_of("killed")]
    found = page.table([mutant(k) for k in range(3)], rows, [])
    assert [(r.first, r.verdict) for r in found] == [
        ("unseen", "killed"),
        ("killed", "killed"),
        ("", "not run"),
    ]
    journal.begin(tmp_path / "journal.csv", found)
    again = journal.read_all(tmp_path / "journal.csv")
    assert [r.verdict for r in again] == ["unseen", "killed", "killed"]
    assert page.table([mutant(k) for k in range(3)], again, []) == found


def test_the_page_tells_what_was_tried_by_near_tests_only() -> None:
    text = page.written(rows_of("unseen", "survived"), [], seed=1, budget=1.0)
    assert "| `a.py:0` | `x = 0` becomes `pass` | tests near it |" in text
    assert "| `a.py:1` | `x = 1` becomes `pass` | tests that reach it, too |" in text


def test_what_is_equivalent_has_its_reason_on_the_page() -> None:
    found = page.table([mutant(2)], rows_of("", "", "survived"), JUDGED)
    text = page.written(found, JUDGED, seed=1, budget=1.0)
    assert "| `a.py:2` | `x = 2` becomes `pass` | Nobody reads x. |" in text
    assert "## Not noticed\n\nNone.\n" in text


def test_the_results_that_are_kept_are_of_the_areas_and_judged_with_reasons() -> None:
    rows = journal.read(ROOT / "docs" / "results" / "mutation.csv")
    assert {row.area for row in rows} == set(AREAS)
    others = {"unbuilt", "unseen", "not run", "equivalent"}
    assert {row.verdict for row in rows} <= {*journal.TRIED, *others}
    judged = page.judgements(ROOT / "docs" / "results" / "mutation-equivalent.csv")
    assert len({each.key() for each in judged}) == len(judged)
    assert all(re.fullmatch(r"[A-Z].{20,}\.", each.reason) for each in judged)
    known = {each.key() for each in judged}
    assert all(row.mutant.key() in known for row in rows if row.verdict == "equivalent")
