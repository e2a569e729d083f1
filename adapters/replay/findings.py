"""Everything that is wrong with a file, each with its place."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, TypeAlias

from orchestrator.errors import ComponentTypeError, Location, Problem

Place: TypeAlias = tuple[int, int]
"""Line and column, counted from 1; in Parquet files the number of the row and of the column."""

_MOST_SHOWN: Final = 20


class TrafficFileError(ComponentTypeError):
    """What is wrong with files of traffic, one line `file:line:column: problem` each."""


class Findings:
    """Collects what is wrong with one file.

    Args:
        file: its path.

    Attributes:
        remarks: what is not wrong, but may not be meant.
    """

    def __init__(self, file: Path) -> None:
        self.remarks: list[Problem] = []
        self._file = file
        self._problems: list[Problem] = []
        self._count = 0
        self._unknown_types: dict[str, tuple[Place, set[str]]] = {}

    def __bool__(self) -> bool:
        return bool(self._count or self._unknown_types)

    def note(self, place: Place, what: str) -> None:
        """Note a problem; beyond the first twenty only their number is kept."""
        self._count += 1
        if len(self._problems) < _MOST_SHOWN:
            self._problems.append(Problem(Location(str(self._file), *place), what))

    def remark(self, place: Place, what: str) -> None:
        """Note something that is not wrong, but may not be meant."""
        self.remarks.append(Problem(Location(str(self._file), *place), what))

    def note_type(self, kind: str, name: str, place: Place) -> None:
        """Note that the road user `name` is of a type that is not known."""
        self._unknown_types.setdefault(kind, (place, set()))[1].add(name)

    def lines(self, hint: Callable[[str], str]) -> Sequence[str]:
        """One line per problem.

        Args:
            hint: what to write instead of an unknown type.
        """
        shown = [*self._problems]
        for kind, (place, names) in self._unknown_types.items():
            users = "1 road user" if len(names) == 1 else f"{len(names)} road users"
            what = f"type `{kind}` of {users} is not known; {hint(kind)}"
            shown.append(Problem(Location(str(self._file), *place), what))
        lines = [str(problem) for problem in sorted(shown, key=lambda found: found.where)]
        if self._count > len(self._problems):
            lines.append(f"... and {self._count - len(self._problems)} more problems in this file")
        return lines
