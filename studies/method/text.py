"""Numbers and tables as text, for the terminal and for Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any


def interval(row: Mapping[str, Any], name: str, form: str, scale: float = 1.0) -> str:
    """An estimate of a row as `mean [low, high]`, a dash where there is none."""
    value, low, high = (row[key] for key in (name, f"{name}_low", f"{name}_high"))
    if value is None:
        return "-"
    text = format(scale * value, form)
    return text if low is None else f"{text} [{scale * low:{form}}, {scale * high:{form}}]"


def columns_of_text(rows: Sequence[Sequence[str]]) -> list[str]:
    """One indented line per row."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(row, widths, strict=True)).rstrip()
        for row in rows
    ]


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of Markdown; all columns but the first are aligned to the right."""
    lines = [head, ["---", *["--:"] * (len(head) - 1)], *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
