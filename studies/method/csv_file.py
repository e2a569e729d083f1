"""Tables as CSV files: an empty cell is a value that there is not."""

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any


def write(path: Path, table: Sequence[Mapping[str, Any]]) -> None:
    """Write `table`, whose rows have the same columns; an empty one makes an empty file."""
    with path.open("w", newline="", encoding="utf-8") as file:
        if table:
            writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
            writer.writeheader()
            writer.writerows([{k: _cell(v) for k, v in row.items()} for row in table])


def read(path: Path) -> list[dict[str, str]]:
    """The rows, all values as text."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def number(row: Mapping[str, str], column: str) -> float | None:
    """A cell as a number; `None` where it is empty."""
    return float(row[column]) if row[column] else None


def _cell(value: Any) -> Any:
    """Numbers with six digits behind the point, more than any of them means."""
    return round(value, 6) + 0.0 if isinstance(value, float) else value  # no `-0.0`
