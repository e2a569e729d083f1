"""What the pages of studies have in common: their command, and the parts that all of them have."""

import argparse
import os
from collections.abc import Callable, Sequence
from itertools import groupby
from pathlib import Path
from typing import Final

from studies.method.claims import Judgement, Part
from studies.method.origin import Origin
from studies.method.text import markdown, shown

RULE: Final = """\
The rule: a comparison *holds* if its whole interval of 95 % satisfies it, *fails* if the whole
interval violates it, and is *open* else. A claim is **reproduced** if all its comparisons hold,
**partly reproduced** if some hold, **not reproduced** if none holds and at least one fails, and
**undecided** else. Differences are of runs with the same seed.
"""
"""How verdicts come about."""

Page = Callable[[Path, str, Path | None], str]
"""Makes a page of a folder of results, the link from the page to it, and a file written by hand."""


def command(study: str, page: Page, prepare: Callable[[Path], None] = lambda _: None) -> None:
    """Write the page of a study, as the command line `python -m STUDY PAGE DIR [ANALYSIS]` says.

    Args:
        study: the package of the study, e.g. `studies.relay`.
        page: makes the page, in Markdown.
        prepare: completes the folder of results first.
    """
    parser = argparse.ArgumentParser(prog=f"python -m {study}")
    parser.add_argument("page", type=Path, help="to write (Markdown)")
    parser.add_argument("directory", type=Path, help="what the reports wrote")
    parser.add_argument(
        "analysis", type=Path, nargs="?", help="text by hand, included if it is there"
    )
    given = parser.parse_args()
    link = Path(os.path.relpath(given.directory, given.page.parent)).as_posix()
    try:
        prepare(given.directory)
        text = page(given.directory, link, given.analysis)
    except FileNotFoundError as error:
        parser.error(f"there is no `{error.filename}`; `make paper` writes it")
    except ValueError as error:
        parser.error(str(error))
    given.page.write_text(text, encoding="utf-8")


def by_hand(analysis: Path | None) -> list[str]:
    """The text in the file `analysis`, if there is one."""
    there = analysis is not None and analysis.is_file()
    return [analysis.read_text(encoding="utf-8")] if analysis is not None and there else []


def made(origin: Origin, runs: str | None = None) -> str:
    """How numbers were made: of how many runs, by which command, with what, and where.

    Args:
        origin: where they come from.
        runs: link to the table of all runs, if there is one.
    """
    counts = f"{origin.runs} of {origin.planned} runs, {origin.failed} failed"
    rows = "" if runs is None else f"; [every run]({runs})"
    lines = [f"* {counts}, seeds {origin.seeds}{rows}"]
    for session in origin.sessions:
        machine = session.machine
        host = f"{machine.cpu}, {machine.cpus} CPUs, {machine.platform}"
        commit = session.commit or "not from a checkout"
        versions = ", ".join(map(" ".join, session.versions.items()))
        lines += [
            f"* command: `{session.command}`, {session.created}",
            f"  * commit: {commit}; {versions}",
            f"  * machine: {host}",
        ]
    return "\n".join(lines) + "\n"


def claims(judgements: Sequence[Judgement]) -> str:
    """The table of claims."""
    head = ("claim", "whose", "verdict", "quantity", "measured", "wanted", "paper", "so it")
    body = []
    for _, group in groupby(judgements, key=lambda one: one.claim):
        for number, one in enumerate(group):
            first = [one.text, one.origin, f"**{one.verdict}**"]
            body.append([*(first if number == 0 else ["", "", ""]), *_comparison(one)])
    return markdown(head, body)


def _comparison(one: Judgement) -> list[str]:
    unit = f" [{one.unit}]" if one.unit else ""
    is_open_but_holds = one.part == Part.OPEN.value and one.mean_satisfies
    return [
        f"{one.quantity}{unit}",
        shown(one.value, ".2f"),
        one.wanted,
        "" if one.paper is None else f"{one.paper:.2f}",
        one.part + (", the mean holds" if is_open_but_holds else ""),
    ]
