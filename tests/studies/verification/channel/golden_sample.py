"""The golden sample of the repository, and ways to change a copy of it."""

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

GOLDEN: Final = Path(__file__).parent / "golden"
RUN: Final = "stack/cross44_tworay_obstacles"
SEEDS: Final = 10


def read_text(path: Path) -> str:
    """The text of a file, compressed or not."""
    data = path.read_bytes()
    return (gzip.decompress(data) if path.suffix == ".gz" else data).decode()


def write_text(path: Path, text: str) -> None:
    """Write it back."""
    data = text.encode()
    path.write_bytes(gzip.compress(data) if path.suffix == ".gz" else data)


def change_json(path: Path, change: Callable[[Any], object]) -> None:
    """Change what a JSON file holds, in place."""
    value = json.loads(path.read_text())
    change(value)
    path.write_text(json.dumps(value))


def change_cell(path: Path, column: str, change: Callable[[str], str], row: int = 0) -> None:
    """Change one cell of a CSV file; row 0 is the line under the header."""
    lines = read_text(path).splitlines()
    place = lines[0].split(",").index(column)
    cells = lines[row + 1].split(",")
    cells[place] = change(cells[place])
    lines[row + 1] = ",".join(cells)
    write_text(path, "\n".join(lines) + "\n")


def find_row(path: Path, column: str, value: str) -> int:
    """The first row whose cell in `column` is `value`."""
    head, *lines = read_text(path).splitlines()
    place = head.split(",").index(column)
    return next(k for k, line in enumerate(lines) if line.split(",")[place] == value)


def add(amount: float) -> Callable[[str], str]:
    """Adds `amount` to a number in a cell."""
    return lambda cell: repr(float(cell) + amount)
