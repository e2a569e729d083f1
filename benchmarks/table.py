"""Rows of a benchmark as text in columns, and as a table in Markdown."""

from collections.abc import Sequence

from benchmarks.benchmark import Row


def cells(rows: Sequence[Row]) -> list[list[str]]:
    """A heading and one line per row; a column for each name of a detail."""
    names = list(dict.fromkeys(name for row in rows for name in row.details))
    head = ["case", "ours", "(low .. high)", "unit", "peer", "ratio", *names]
    return [head, *(_line(row, names) for row in rows)]


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


def table(rows: Sequence[Row]) -> list[str]:
    """Lines of text, columns aligned, names to the left and numbers to the right."""
    if not rows:
        return ["  nothing was measured"]
    lines = cells(rows)
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return ["  " + "  ".join(map(_aligned, range(len(line)), line, widths)) for line in lines]


def markdown(rows: Sequence[Row]) -> list[str]:
    """Lines of a table in Markdown."""
    head, *body = cells(rows)
    rule = [":---" if _is_text(k) else "---:" for k in range(len(head))]
    return [f"| {' | '.join(line)} |" for line in (head, rule, *body)]


def _is_text(column: int) -> bool:
    return column in {0, 3, 4}


def _aligned(column: int, cell: str, width: int) -> str:
    return f"{cell:<{width}}" if _is_text(column) else f"{cell:>{width}}"
