"""Estimates and tables as text, for the terminal and for Markdown."""

from collections.abc import Sequence

from orchestrator import tables
from orchestrator.intervals import Estimate
from studies.method.estimates import percent


def shown(found: Estimate | None, form: str) -> str:
    """An estimate as `mean [low, high]`, a dash where there is none."""
    if found is None:
        return "-"
    text = format(found.value, form)
    return text if found.low is None else f"{text} [{found.low:{form}}, {found.high:{form}}]"


def percent_shown(found: Estimate | None, form: str = ".1f") -> str:
    """A share in percent, or a difference of shares in points, with its interval."""
    return shown(percent(found), form)


def columns_of_text(rows: Sequence[Sequence[str]]) -> list[str]:
    """One indented line per row."""
    return tables.lines(rows)


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table of Markdown; all columns but the first are aligned to the right."""
    columns = [*tables.left(head[0]), *tables.right(*head[1:])]
    return "\n".join(tables.markdown(columns, rows))
