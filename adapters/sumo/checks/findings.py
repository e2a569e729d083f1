"""What is found in the files of a scene: problems and remarks, none of them without end."""

from collections import Counter
from dataclasses import dataclass, field
from typing import Final

from orchestrator.errors import Location, Problem

MOST: Final = 20
"""Problems of one kind in one file that are written out; of the others there is the number."""


@dataclass(slots=True)
class Findings:
    """Problems and remarks, as they are found.

    Attributes:
        forgiven: kinds of problems that end no run; they are remarks.
        remarks: what is not wrong, but may not be meant.
    """

    forgiven: frozenset[str] = frozenset()
    remarks: list[Problem] = field(default_factory=list)
    _problems: list[Problem] = field(default_factory=list)
    _counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    _last: dict[tuple[str, str], Location] = field(default_factory=dict)

    def add(self, kind: str, where: Location, what: str) -> None:
        """A problem; `kind` says in a few words what such problems are, in the plural."""
        key = (where.file, kind)
        self._counts[key] += 1
        if self._counts[key] <= MOST:
            found = self.remarks if kind in self.forgiven else self._problems
            found.append(Problem(where, what))
        elif self._counts[key] == MOST + 1:
            self._last[key] = where

    def remark(self, where: Location, what: str) -> None:
        """Note something that is not wrong."""
        self.remarks.append(Problem(where, what))

    def problems(self) -> list[Problem]:
        """All problems; where there are more than `MOST` of a kind in a file, their number."""
        more = [
            Problem(where, f"... and {self._counts[key] - MOST:,} more {key[1]} from here on")
            for key, where in self._last.items()
            if key[1] not in self.forgiven
        ]
        return self._problems + more

    def all_remarks(self) -> list[Problem]:
        """All remarks; where there are more than `MOST` of a kind in a file, their number."""
        more = [
            Problem(where, f"... and {self._counts[key] - MOST:,} more {key[1]} from here on")
            for key, where in self._last.items()
            if key[1] in self.forgiven
        ]
        return self.remarks + more
