"""Rows of a benchmark as text in columns, and as a table in Markdown."""

from collections.abc import Sequence
from typing import Final

from benchmarks.benchmark import Row
from orchestrator import tables

_RULE: Final = tables.Rule(left=":---", right="---:")


def table(rows: Sequence[Row]) -> list[str]:
    """Lines of text, columns aligned, names to the left and numbers to the right."""
    if not rows:
        return ["  nothing was measured"]
    names = _names(rows)
    return tables.text(_columns(names), [_line(row, names) for row in rows])


def markdown(rows: Sequence[Row]) -> list[str]:
    """Lines of a table in Markdown."""
    names = _names(rows)
    return tables.markdown(_columns(names), [_line(row, names) for row in rows], _RULE)


def _names(rows: Sequence[Row]) -> list[str]:
    """Every detail has a column."""
    return list(dict.fromkeys(name for row in rows for name in row.details))


def _columns(names: Sequence[str]) -> list[tables.Column]:
    left, right = tables.left, tables.right
    return [
        *left("case"),
        *right("ours", "(low .. high)"),
        *left("unit", "peer"),
        *right("ratio", *names),
    ]


def _line(row: Row, names: Sequence[str]) -> list[str]:
    return [
        row.case,
        number(row.ours),
        f"({number(row.low)} .. {number(row.high)})",
        row.unit,
        "" if row.peer is None else f"{number(row.peer)} ({row.peer_name})",
        "" if row.ratio is None else number(row.ratio),
        *(number(row.details[name]) if name in row.details else "" for name in names),
    ]


def number(value: float) -> str:
    """Three significant digits; whole numbers in full."""
    if float(value).is_integer():
        return f"{value:.0f}"
    return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
