"""Parts of the pages of studies: where the numbers come from, claims, costs."""

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from typing import Any, Final

from studies.method.text import interval, markdown
from studies.method.verdict import Part

RULE: Final = """\
The rule: a comparison *holds* if its whole interval of 95 % satisfies it, *fails* if the whole
interval violates it, and is *open* else. A claim is **reproduced** if all its comparisons hold,
**partly reproduced** if some hold, **not reproduced** if none holds and at least one fails, and
**undecided** else. Differences are of runs with the same seed.
"""
"""How verdicts come about."""


def numbers(row: Mapping[str, str]) -> dict[str, float | None]:
    """The cells that are numbers, or empty."""
    found: dict[str, float | None] = {}
    for name, cell in row.items():
        try:
            found[name] = float(cell) if cell else None
        except ValueError:
            continue
    return found


def made(origin: Mapping[str, Any], runs: str | None = None) -> str:
    """Of how many runs, by which command, with what, and where.

    Args:
        origin: as `origin.origin` has it.
        runs: link to the table of all runs, if there is one.
    """
    counts = f"{origin['runs']} of {origin['planned']} runs, {origin['failed']} failed"
    rows = "" if runs is None else f"; [every run]({runs})"
    lines = [f"* {counts}, seeds {origin['seeds']}{rows}"]
    for session in origin["sessions"]:
        machine = session["machine"]
        host = f"{machine['cpu']}, {machine['cpus']} CPUs, {machine['platform']}"
        commit = session["commit"] or "not from a checkout"
        versions = ", ".join(map(" ".join, session["versions"].items()))
        lines += [
            f"* command: `{session['command']}`, {session['created']}",
            f"  * commit: {commit}; {versions}",
            f"  * machine: {host}",
        ]
    return "\n".join(lines) + "\n"


def claims(rows: Sequence[Mapping[str, str]]) -> str:
    """The table of claims, from what `claim.Claim.rows` makes."""
    head = ("claim", "whose", "verdict", "quantity", "measured", "wanted", "paper", "so it")
    body = []
    for _, group in groupby(rows, key=lambda row: row["claim"]):
        for number, row in enumerate(group):
            first = [row["text"], row["origin"], f"**{row['verdict']}**"]
            body.append([*(first if number == 0 else ["", "", ""]), *_comparison(row)])
    return markdown(head, body)


def _comparison(row: Mapping[str, str]) -> list[str]:
    values = numbers(row)
    paper = values["paper"]
    unit = f" [{row['unit']}]" if row["unit"] else ""
    is_open_but_holds = row["part"] == Part.OPEN.value and row["mean_satisfies"] == "True"
    return [
        f"{row['quantity']}{unit}",
        interval(values, "value", ".2f"),
        row["wanted"],
        "" if paper is None else f"{paper:.2f}",
        row["part"] + (", the mean holds" if is_open_but_holds else ""),
    ]


def cost(rows: Sequence[Mapping[str, Any]], factor: str, name: Callable[[str], str]) -> str:
    """The table of costs, from what `origin.origin` makes.

    Args:
        rows: by level.
        factor: whose levels they are.
        name: of a level, for readers.
    """
    body = [
        [
            name(row[factor]),
            str(row["runs"]),
            f"{row['simulated_s']:.0f}",
            f"{row['wall_s']:.0f}",
            "" if (ratio := row["wall_s_per_simulated_s"]) is None else f"{ratio:.3f}",
        ]
        for row in rows
    ]
    head = (factor, "runs", "simulated [s]", "time of workers [s]", "per simulated second [s]")
    note = (
        "Time of workers: wall time of the processes that ran, one thread each, from the start of "
        "a run to its metrics. On a machine with a core per worker that is processor time."
    )
    return f"{note}\n\n{markdown(head, body)}"
