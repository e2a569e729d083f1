"""A column of a table as what a number should have been."""

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

import numpy as np

from adapters.tables.content import Content, read
from adapters.tables.heading import Heading
from orchestrator.errors import Location, Problem
from orchestrator.signal import Array
from orchestrator.suggestion import suggestion
from orchestrator.timebase import Time, seconds
from orchestrator.units import Quantity, UnitError, parse_unit


@dataclass(frozen=True, slots=True)
class Reference:
    """A column over time.

    Attributes:
        path: of its file.
        content: of the file.
        values: of the column, in the unit of what is compared, shape (row,).
    """

    path: Path
    content: Content
    values: Array

    @classmethod
    def read(cls, path: Path, column: str, unit: str) -> "Reference | tuple[Problem, ...]":
        """The column called `column`, converted to `unit`; or what is wrong with the file.

        A column without a unit has that of what is compared.
        """
        content, problems = read(path, "time")
        if content is None:
            return problems
        top = Location(str(path), 1, 1)
        found = [heading for heading in content.columns if heading.name == column]
        if not found:
            hint = suggestion(column, [heading.name for heading in content.columns])
            return (Problem(top, f"there is no column `{column}`; {hint}"),)
        try:
            factor, shift = _conversion(found[0], unit)
        except UnitError as error:
            return (Problem(top, f"`{column}`: {error}"),)
        return cls(path, content, content.columns[found[0]] * factor + shift)

    def missing(self, begin: Time, end: Time) -> Iterator[Problem]:
        """What it does not say of the time from `begin` to `end` [ns]."""
        first, last = int(self.content.times[0]), int(self.content.times[-1])
        lines = self.content.lines
        if begin < first:
            what = f"rows are missing: the first is at {seconds(first):g} s, and the"
            yield self._at(int(lines[0]), f"{what} comparison begins at {seconds(begin):g} s")
        if end > last:
            what = f"rows are missing: the last is at {seconds(last):g} s, and the"
            yield self._at(int(lines[-1]), f"{what} comparison ends at {seconds(end):g} s")

    def _at(self, line: int, what: str) -> Problem:
        return Problem(Location(str(self.path), line, 1), what)

    def at(self, times: Array, *, is_linear: bool) -> Array:
        """The values at `times` [ns], within the table, shape (time,).

        Args:
            times: int64, shape (time,).
            is_linear: whether there is a straight line between rows, or each holds until the next.
        """
        known = self.content.times
        k = np.clip(np.searchsorted(known, times, side="right") - 1, 0, len(known) - 1)
        if not is_linear or len(known) == 1:
            return np.asarray(self.values[k])
        k = np.minimum(k, len(known) - 2)
        share = (times - known[k]) / (known[k + 1] - known[k])
        return np.asarray((1 - share) * self.values[k] + share * self.values[k + 1])


def _conversion(heading: Heading, unit: str) -> tuple[float, float]:
    """The factor for values of a column, and what is added then."""
    if heading.unit in ("1", unit):
        return 1.0, 0.0
    source, target = parse_unit(heading.unit), parse_unit(unit)
    at_zero = Quantity(Fraction(0), source).into(target)
    return float(Quantity(Fraction(1), source).into(target) - at_zero), float(at_zero)
