"""Summaries fit a terminal of 80 columns, and say the same words."""

import os

import pytest
from hypothesis import given, strategies as st

from orchestrator import tables
from orchestrator.cli.fitting import WIDTH, fitted, listed

WORDS = st.lists(st.text("ab,;:.0", min_size=1, max_size=30), min_size=1, max_size=40)


@given(lines=st.lists(WORDS.map(" ".join), max_size=4))
def test_no_line_is_too_long_and_no_word_is_lost(lines: list[str]) -> None:
    text = fitted("\n".join(lines))
    assert text.split() == "\n".join(lines).split()
    assert all(len(line) <= WIDTH for line in text.splitlines())


def test_what_goes_on_stands_below_what_the_label_says() -> None:
    numbers = ", ".join(f"number_{k} {k}.25" for k in range(8))
    first, second = fitted(f"delivery: {numbers}").splitlines()
    assert first == f"delivery: {', '.join(f'number_{k} {k}.25' for k in range(4))},"
    assert second == " " * 10 + ", ".join(f"number_{k} {k}.25" for k in range(4, 8))
    (columns, more) = fitted(f"on the air     {'a' * 40} {'b' * 40}").splitlines()
    assert columns == f"on the air     {'a' * 40}"
    assert more == " " * 15 + "b" * 40


def test_what_fits_and_what_is_one_word_stays_as_it_is() -> None:
    short = "  traffic            0.97 s   40%"
    assert fitted(short) == short
    path = "recorded in  /" + "d" * 90
    assert fitted(path).replace("\n", "").split() == path.split()
    assert "d" * 90 in fitted(path)


def test_a_narrow_terminal_has_shorter_lines(monkeypatch: pytest.MonkeyPatch) -> None:
    words = "prr: " + ", ".join(f"number_{k} {k}.25" for k in range(8))
    for columns, width in (("60", 60), ("200", WIDTH), ("3", 40)):
        monkeypatch.setenv("COLUMNS", columns)
        lines = fitted(words).splitlines()
        assert width - 15 < max(map(len, lines)) <= width
        assert " ".join(lines).split() == words.split()


ROWS = [
    ("window", "number", "= 2 s", "time between " + "re-selections " * 6),
    ("count", "integer", "required", ""),
]


@pytest.mark.parametrize("columns", [50, 90])
def test_the_last_column_of_a_table_goes_on_below_itself(
    columns: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    lines = listed(ROWS)
    assert max(map(len, lines)) <= columns
    assert " ".join(lines).split() == " ".join(tables.lines(ROWS)).split()
    begins = [line.index("re-selections") for line in lines if "re-selections" in line]
    below = lines[0].find("time between")
    assert all(each == (6 if below < 0 else below) for each in begins[1:])


def test_what_is_no_terminal_gets_a_line_for_each_row(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("COLUMNS", raising=False)
    monkeypatch.setattr("shutil.get_terminal_size", os.terminal_size)
    assert listed(ROWS) == tables.lines(ROWS)
