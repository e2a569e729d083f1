"""Tables for people: as text in columns, and in Markdown."""

import enum
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Final


class Alignment(enum.Enum):
    """Where the cells of a column stand; the value is that of a format specification."""

    LEFT = "<"
    RIGHT = ">"


@dataclass(frozen=True, slots=True)
class Column:
    """A column of a table.

    Attributes:
        heading: above the cells.
        alignment: of heading and cells.
        format: makes the text of a cell.
    """

    heading: str
    alignment: Alignment = Alignment.LEFT
    format: Callable[[Any], str] = str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """How the line under the headings is spelt; to Markdown all spellings are the same.

    Attributes:
        left: under a heading to the left.
        right: under one to the right.
        is_padded: whether blanks surround them.
    """

    left: str = "---"
    right: str = "--:"
    is_padded: bool = True

    def line(self, columns: Sequence[Column]) -> str:
        """The line of these columns."""
        cells = [self.left if c.alignment is Alignment.LEFT else self.right for c in columns]
        return _piped(cells) if self.is_padded else f"|{'|'.join(cells)}|"


PADDED: Final = Rule()
CLOSE: Final = Rule(is_padded=False)


def left(*headings: str) -> list[Column]:
    """Columns of text."""
    return [Column(heading) for heading in headings]


def right(*headings: str) -> list[Column]:
    """Columns of numbers, which are text already."""
    return [Column(heading, Alignment.RIGHT) for heading in headings]


def text(columns: Sequence[Column], rows: Sequence[Sequence[Any]]) -> list[str]:
    """One indented line for the headings, and one per row."""
    lines = [[column.heading for column in columns], *_cells(columns, rows)]
    return _aligned(lines, [column.alignment for column in columns])


def lines(rows: Sequence[Sequence[str]]) -> list[str]:
    """One indented line per row of a table without headings; `  none` if there are no rows."""
    return _aligned(rows, [Alignment.LEFT] * len(rows[0])) if rows else ["  none"]


def markdown(
    columns: Sequence[Column], rows: Sequence[Sequence[Any]], rule: Rule = PADDED
) -> list[str]:
    """The lines of a table in Markdown."""
    head = _piped([column.heading for column in columns])
    return [head, rule.line(columns), *map(_piped, _cells(columns, rows))]


def _cells(columns: Sequence[Column], rows: Sequence[Sequence[Any]]) -> list[list[str]]:
    return [
        [column.format(value) for column, value in zip(columns, row, strict=True)] for row in rows
    ]


def _aligned(rows: Sequence[Sequence[str]], alignments: Sequence[Alignment]) -> list[str]:
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    forms = [f"{a.value}{width}" for a, width in zip(alignments, widths, strict=True)]
    found = ["  " + "  ".join(map(format, row, forms)) for row in rows]
    return [line.rstrip() for line in found] if alignments[-1] is Alignment.LEFT else found


def _piped(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
