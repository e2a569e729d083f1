"""From the cells of a table to arrays; every cell that means nothing is a problem."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from fmus.channel.stand_ins.table import Table, TableError
from orchestrator.errors import Location, Problem
from orchestrator.suggestion import suggestion

Float: TypeAlias = npt.NDArray[np.float64]
Int: TypeAlias = npt.NDArray[np.int64]

_HIGHEST_VEHICLE: Final = 2**31 - 1
_MOST_PROBLEMS: Final = 20


class CellReader:
    """Reads the columns of one table and collects what is wrong with their cells.

    What the methods return holds some value where there is a problem; call `finish` before using
    it.
    """

    def __init__(self, table: Table) -> None:
        self._table = table
        self._problems: list[tuple[int, str, str]] = []
        self._more = 0

    @property
    def has_problems(self) -> bool:
        """Whether `finish` will raise."""
        return bool(self._problems or self._table.ragged)

    def add(self, rows: Sequence[int], column: str, describe: Callable[[int], str]) -> None:
        """Note problems with the cells of a column.

        Args:
            rows: of the cells, ascending.
            column: its name.
            describe: says what is wrong in a row; asked only for those that will be shown.
        """
        shown = rows[:_MOST_PROBLEMS]
        self._problems += [(row, column, describe(row)) for row in shown]
        self._more += len(rows) - len(shown)

    def finish(self) -> None:
        """Refuse the table if there are problems.

        Raises:
            TableError: the first of them, by line, and how many more there are.
        """
        table = self._table
        if not self.has_problems:
            return
        cells = sorted(self._problems, key=lambda problem: problem[0])[:_MOST_PROBLEMS]
        found = [
            Problem(table.place(row, column), f"`{column}`: {what}") for row, column, what in cells
        ]
        found += [Problem(Location(str(table.file), line, 1), what) for line, what in table.ragged]
        shown = sorted(found, key=lambda problem: problem.where)[:_MOST_PROBLEMS]
        count = len(self._problems) + self._more + len(table.ragged)
        raise TableError(shown, count - len(shown))

    def numbers(self, column: str, minimum: float = -np.inf, maximum: float = np.inf) -> Float:
        """A column of finite numbers within bounds; float64, shape (row,), units as in the file."""
        return self._numbers(column, minimum, maximum, may_be_empty=False)

    def optional_numbers(
        self, column: str, minimum: float = -np.inf, maximum: float = np.inf
    ) -> Float:
        """A column of numbers that there need not be; NaN where nothing is written, or `nan`.

        Returns:
            float64, shape (row,), units as in the file.
        """
        if column not in self._table.columns:
            return np.full(len(self._table), np.nan)
        return self._numbers(column, minimum, maximum, may_be_empty=True)

    def vehicles(self, column: str, names: Mapping[str, int]) -> Int:
        """A column of vehicles: numbers as they are, text as `names` says; int64, shape (row,)."""
        cells = self._table.columns[column]
        numbers = {cell: _vehicle(cell, names) for cell in set(cells)}
        values = np.array([numbers[cell] for cell in cells], np.int64)
        hint = (
            "no name in the file of `vehicles`; {}"
            if names
            else "there is no file `vehicles` of names; write a number, or give names there"
        )

        def describe(row: int) -> str:
            offers = hint.format(suggestion(str(cells[row]), names))
            return f"{self._shown(row, column)} is no number of a vehicle, and {offers}"

        self.add(np.flatnonzero(values < 0).tolist(), column, describe)
        return values

    def codes(self, column: str, codes: Mapping[str, int]) -> Int:
        """A column of words that stand for numbers; int64, shape (row,)."""
        return self._codes(column, codes)

    def optional_codes(self, column: str, codes: Mapping[str, int], default: int) -> Int:
        """A column of words that there need not be; `default` where nothing is written.

        Returns:
            int64, shape (row,).
        """
        if column not in self._table.columns:
            return np.full(len(self._table), default, np.int64)
        return self._codes(column, {**codes, None: default})

    def _codes(self, column: str, codes: Mapping[Any, int]) -> Int:
        cells = self._table.columns[column]
        values = np.array([codes.get(cell, -1) for cell in cells], np.int64)
        words = [word for word in codes if word is not None]
        self.add(
            np.flatnonzero(values < 0).tolist(),
            column,
            lambda row: (
                f"{self._shown(row, column)} is unknown; {suggestion(str(cells[row]), words)}"
            ),
        )
        return values

    def _numbers(self, column: str, minimum: float, maximum: float, *, may_be_empty: bool) -> Float:
        values, no_numbers = self._floats(column)
        is_wrong = np.isinf(values) if may_be_empty else ~np.isfinite(values)
        is_wrong |= (values < minimum) | (values > maximum)
        is_wrong[no_numbers] = True
        kind = _range(minimum, maximum)
        self.add(
            np.flatnonzero(is_wrong).tolist(),
            column,
            lambda row: f"{self._shown(row, column)} is no {kind}",
        )
        return values

    def _floats(self, column: str) -> tuple[Float, list[int]]:
        """The numbers in a column, NaN where there are none; rows of what is no number."""
        cells = self._table.columns[column]
        try:
            return np.array(cells, dtype=float), []
        except (TypeError, ValueError):  # look for the cells that are to blame
            pass
        values, wrong = np.full(len(cells), np.nan), []
        for row, cell in enumerate(cells):
            try:
                values[row] = np.nan if cell is None else float(cell)
            except (TypeError, ValueError):
                wrong.append(row)
        return values, wrong

    def _shown(self, row: int, column: str) -> str:
        cell = self._table.columns[column][row]
        return "an empty cell" if cell is None else f"`{cell}`"


def _range(minimum: float, maximum: float) -> str:
    if np.isinf(minimum) and np.isinf(maximum):
        return "finite number"
    if np.isinf(maximum):
        return f"number from {minimum:g} on"
    return f"number between {minimum:g} and {maximum:g}"


def _vehicle(cell: object, names: Mapping[str, int]) -> int:
    """The number of a vehicle; -1 if there is none."""
    if cell in names:
        return names[str(cell)]
    try:
        number = int(str(cell))
    except ValueError:
        return -1
    return number if 0 <= number <= _HIGHEST_VEHICLE else -1
