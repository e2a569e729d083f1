"""Numbers and tables as text, for the terminal and for Markdown."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator import tables


def interval(row: Mapping[str, Any], name: str, form: str, scale: float = 1.0) -> str:
    """An estimate of a row as `mean [low, high]`, a dash where there is none."""
    value, low, high = (row[key] for key in (name, f"{name}_low", f"{name}_high"))
    if value is None:
        return "-"
    text = format(scale * value, form)
    return text if low is None else f"{text} [{scale * low:{form}}, {scale * high:{form}}]"


def columns_of_text(rows: Sequence[Sequence[str]]) -> list[str]:
    """One indented line per row."""
    return tables.lines(rows)


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of Markdown; all columns but the first are aligned to the right."""
    columns = [*tables.left(head[0]), *tables.right(*head[1:])]
    return "\n".join(tables.markdown(columns, rows))
