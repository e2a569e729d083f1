"""Lines of text for people."""

import textwrap
from collections.abc import Sequence
from typing import Final

_WIDTH: Final = 98


def wrapped(part: str) -> str:
    """Paragraphs and lists in lines of some length; tables as they are."""
    if part.startswith("|"):
        return part
    return "\n".join(
        textwrap.fill(
            line,
            _WIDTH,
            subsequent_indent="  " if line.startswith("* ") else "",
            break_long_words=False,
            break_on_hyphens=False,
        )
        for line in part.splitlines()
    )


def section(*parts: str) -> str:
    """A part of a page: headings, paragraphs, lists, tables."""
    return "\n\n".join(map(wrapped, parts)) + "\n"


def table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """In Markdown: the first column to the left, the others to the right."""
    rule = ["---", *["--:"] * (len(head) - 1)]
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, rule, *rows))


def whole_percent(share: float) -> str:
    """In whole per cent."""
    return f"{100 * share:.0f} %"
