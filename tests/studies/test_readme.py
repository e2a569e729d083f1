"""The tables of results in the README are those that the committed results make."""

import re
from pathlib import Path

import pytest

from studies.readme import ROWS, collisions, main, relays, with_tables
from tests.studies.results import check_missing

ROOT = Path(__file__).parents[2]
RESULTS = ROOT / "docs" / "results"


def test_the_readme_has_the_committed_results() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    made = (relays(RESULTS), collisions(RESULTS))
    assert text == with_tables(text, made), "run `python -m studies.readme README.md docs/results`"


def test_a_row_is_of_one_condition(tmp_path: Path) -> None:
    """54 % is of 162 collisions in 300 runs; a condition that is there twice is refused."""
    assert collisions(RESULTS)[7] == "| constant PER | 80 | 54 [48.3, 59.6] |"
    assert len(collisions(RESULTS)) == 2 + len(ROWS)
    head, *rows = (RESULTS / "collision.csv").read_text(encoding="utf-8").splitlines()
    twice = [row for row in rows if "collision_relay" in row]
    (tmp_path / "collision.csv").write_text("\n".join([head, *rows, *twice]))
    with pytest.raises(ValueError, match="`MoHeD` is 2 rows of the results, not one"):
        collisions(tmp_path)


def test_a_table_takes_the_place_of_the_one_with_its_head() -> None:
    text = "before\n\n| a | b |\n|---|---|\n| 1 | 2 |\n| 3 | 4 |\n\n| a | c |\n|---|---|\n"
    wanted = "before\n\n| a | b |\n|---|---|\n| 5 | 6 |\n\n| a | c |\n|---|---|\n"
    assert with_tables(text, [["| a | b |", "|---|---|", "| 5 | 6 |"]]) == wanted
    with pytest.raises(
        ValueError, match=re.escape("there are 0 tables with the head `| b | a |`, not one")
    ):
        with_tables(text, [["| b | a |", "|---|---|"]])
    with pytest.raises(ValueError, match="there are 2 tables"):
        with_tables(text + text, [["| a | b |", "|---|---|"]])


def test_its_command_writes_the_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    heads = "\n\n".join("\n".join(made(RESULTS)[:2]) for made in (relays, collisions))
    (tmp_path / "page.md").write_text(heads + "\n")
    monkeypatch.setattr("sys.argv", ["readme", str(tmp_path / "page.md"), str(RESULTS)])
    main()
    tables = "\n\n".join("\n".join(made(RESULTS)) for made in (relays, collisions))
    assert (tmp_path / "page.md").read_text() == tables + "\n"
    (tmp_path / "page.md").unlink()
    check_missing("table2.csv", main, monkeypatch, tmp_path, capsys)
