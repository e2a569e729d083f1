"""The journal of a campaign: a row per break, written when it has been tried."""

import csv
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Final, Self, TextIO

from tests.mutation.mutant import Mutant

TRIED: Final = ("killed", "timeout", "survived")
"""Verdicts of breaks that count: noticed by a failure, by a hang, or not at all."""

UNBUILT: Final = "unbuilt"
"""The verdict of a break that no compiler takes, or of which it makes the same program."""

UNSEEN: Final = "unseen"
"""The verdict of a break that no test near it notices; those that reach it were not run."""

NOT_RUN: Final = "not run"
"""The verdict of a break of the sample that has not been tried."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A break that was tried, or not.

    Attributes:
        area, file, line, operator, before, after: as of the mutant.
        first: the verdict when it was tried for the first time; only in tables.
        verdict: one of `TRIED`, `UNBUILT`, `UNSEEN` or `NOT_RUN`; in tables `equivalent`, too.
        killer: the test that failed or hung.
        tests: how many tests were begun.
        seconds: of the trial [s].
    """

    area: str
    file: str
    line: int
    operator: str
    before: str
    after: str
    first: str = ""
    verdict: str = NOT_RUN
    killer: str = ""
    tests: int = 0
    seconds: float = 0.0

    @classmethod
    def of(cls, mutant: Mutant) -> Self:
        """The row of a break that has not been tried."""
        return cls(**asdict(mutant))

    @property
    def mutant(self) -> Mutant:
        """The break."""
        return Mutant(**{each.name: getattr(self, each.name) for each in fields(Mutant)})


COLUMNS: Final = tuple(each.name for each in fields(Row))


def read(path: Path) -> list[Row]:
    """The rows; where a break was tried again the last one."""
    return list({row.mutant.key(): row for row in read_all(path)}.values())


def read_all(path: Path) -> list[Row]:
    """All rows, in the order in which they were written; one that was cut is left out."""
    if not path.exists():
        return []
    text = path.read_text("utf-8")
    whole = text[: text.rfind("\n") + 1].splitlines(keepends=True)
    return [_row(cells) for cells in csv.DictReader(whole) if None not in cells.values()]


def add(path: Path, row: Row) -> None:
    """Add a row; it is in the file when this returns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a+", newline="", encoding="utf-8") as file:
        file.seek(0)
        whole = file.read()
        if whole and not whole.endswith("\n"):  # cut while it was written
            file.truncate(len(whole[: whole.rfind("\n") + 1].encode()))
        if not whole:
            csv.writer(file, lineterminator="\n").writerow(COLUMNS)
        _writer(file).writerow(_cells(row))


def begin(path: Path, rows: Iterable[Row]) -> None:
    """Begin with what a table says of the breaks that were tried."""
    for row in rows:
        if row.first and row.first != row.verdict:
            add(path, replace(row, verdict=row.first, first="", killer=""))
        if row.verdict != NOT_RUN:
            add(path, replace(row, first=""))


def write(path: Path, rows: Iterable[Row]) -> None:
    """Make a file of these rows."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerow(COLUMNS)
        _writer(file).writerows(map(_cells, rows))


def _writer(file: TextIO) -> "csv.DictWriter[str]":
    return csv.DictWriter(file, COLUMNS, lineterminator="\n")


def _cells(row: Row) -> dict[str, object]:
    texts = {name: _line(getattr(row, name)) for name in ("before", "after", "killer")}
    return {**asdict(row), **texts, "seconds": f"{row.seconds:.1f}"}


def _row(cells: Mapping[str, str]) -> Row:
    return Row(
        area=cells["area"],
        file=cells["file"],
        line=int(cells["line"]),
        operator=cells["operator"],
        before=_lines(cells["before"]),
        after=_lines(cells["after"]),
        first=cells["first"],
        verdict=cells["verdict"],
        killer=_lines(cells["killer"]),
        tests=int(cells["tests"]),
        seconds=float(cells["seconds"]),
    )


def _line(text: str) -> str:
    """The text in one line, so that a row that is cut ends with its line."""
    return text.replace("\\", "\\\\").replace("\n", "\\n")


def _lines(text: str) -> str:
    return re.sub(r"\\(.)", lambda found: "\n" if found[1] == "n" else found[1], text)


def untried(rows: Iterable[Row], mutants: Iterable[Mutant]) -> Iterator[Mutant]:
    """Of these breaks those that have no row."""
    known = {row.mutant.key() for row in rows}
    yield from (each for each in mutants if each.key() not in known)
