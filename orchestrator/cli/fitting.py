"""Text that fits a terminal."""

import re
import shutil
import textwrap
from collections.abc import Sequence
from typing import Final

from orchestrator import tables

WIDTH: Final = 80
"""Columns of a terminal that nobody has made wider."""

_LEAST: Final = 40
"""Columns below which nothing is made to fit."""

_COLUMN: Final = 30
"""Columns below which the last one of a table stands below the others instead of beside them."""

_LABEL: Final = re.compile(r"\S+(?: \S+)*?(?:: |  +)")
_WITHIN: Final = re.compile(r"(?<![,;:)]) ")
"""A blank within what is said between two commas."""

_GLUE: Final = "\N{NO-BREAK SPACE}"


def fitted(text: str) -> str:
    """Lines of `WIDTH` columns at most, or of a terminal that is narrower.

    What does not fit goes on below the words behind its label.

    Lines end behind commas where they can. A word that is longer stays in one piece, so that it
    can be copied.
    """
    columns = shutil.get_terminal_size((WIDTH, 24)).columns
    width = max(_LEAST, min(WIDTH, columns))
    return "\n".join(_fitted_line(line, width) for line in text.splitlines())


def _fitted_line(line: str, width: int) -> str:
    if len(line) <= width:
        return line
    found = _LABEL.match(line)
    label = found[0] if found is not None and len(found[0]) <= width // 3 else ""
    indent = " " * (len(label) or 2)
    body = line[len(label) :]
    whole = _WITHIN.sub(_GLUE, body)
    fits = all(len(piece) <= width - len(indent) for piece in whole.split(" "))
    lines = textwrap.wrap(
        whole if fits else body,
        width - len(indent),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return (label + f"\n{indent}".join(lines)).replace(_GLUE, " ")


def listed(rows: Sequence[Sequence[str]]) -> list[str]:
    """A table whose last column goes on below itself where the terminal ends.

    Where there is no terminal each row is a line, so that programs can search them.
    """
    width, whole = shutil.get_terminal_size((0, 24)).columns, tables.lines(rows)
    if width < _LEAST or all(len(line) <= width for line in whole):
        return whole
    heads = tables.lines([row[:-1] for row in rows])
    start = max(map(len, heads)) + 2
    is_beside = width - start >= _COLUMN
    indent = " " * (start if is_beside else 6)
    found = []
    for head, row in zip(heads, rows, strict=True):
        pieces = textwrap.wrap(
            row[-1], width - len(indent), break_long_words=False, break_on_hyphens=False
        )
        if is_beside and pieces:
            found.append(head.ljust(start) + pieces.pop(0))
        else:
            found.append(head)
        found += [indent + piece for piece in pieces]
    return found
