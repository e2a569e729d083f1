"""A break of a source file: lines that become others."""

from collections.abc import Iterator
from dataclasses import dataclass


class StaleMutantError(Exception):
    """The source has other lines than those that the mutant replaces."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mutant:
    """Lines of a file, and what becomes of them.

    Attributes:
        area: of the product, a key of `tests.mutation.areas.AREAS`.
        file: its path from the root, with slashes.
        line: the number of the first line, from 1.
        operator: what is done, in the words of the tool that does it.
        before: the lines, as they stand in the file.
        after: what stands there instead.
    """

    area: str
    file: str
    line: int
    operator: str
    before: str
    after: str

    def applied(self, source: str) -> str:
        """The source of the file with this break.

        Raises:
            StaleMutantError: the lines are not those of `before`.
        """
        lines = source.split("\n")
        first, last = self.line - 1, self.line - 1 + len(self.before.split("\n"))
        if lines[first:last] != self.before.split("\n"):
            raise StaleMutantError(f"{self.file}:{self.line} has changed since the break was drawn")
        return "\n".join([*lines[:first], *self.after.split("\n"), *lines[last:]])

    def lines(self) -> Iterator[int]:
        """Numbers of the lines that change, from 1."""
        return iter(range(self.line, self.line + len(self.before.split("\n"))))

    def key(self) -> tuple[str, str, str]:
        """What stays the same while the file changes elsewhere: its name, and the break."""
        return self.file, _text(self.before), _text(self.after)


def difference(area: str, file: str, operator: str, old: str, new: str) -> Mutant:
    """The mutant that makes the text `new` of a file out of `old`; they differ."""
    left, right = old.split("\n"), new.split("\n")
    shorter = min(len(left), len(right))
    first = next((k for k in range(shorter) if left[k] != right[k]), shorter - 1)
    tail = shorter - first - 1
    last = next((k for k in range(tail) if left[-1 - k] != right[-1 - k]), tail)
    return Mutant(
        area=area,
        file=file,
        line=first + 1,
        operator=operator,
        before="\n".join(left[first : len(left) - last]),
        after="\n".join(right[first : len(right) - last]),
    )


def _text(lines: str) -> str:
    return " ".join(lines.split())
