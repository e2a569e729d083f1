"""The table of a campaign of breaks, for the manual."""

import csv
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from orchestrator.intervals import share
from tests.mutation.areas import AREAS
from tests.mutation.journal import NOT_RUN, TRIED, UNBUILT, UNSEEN, Row
from tests.mutation.mutant import Mutant

EQUIVALENT: Final = "equivalent"

OPEN: Final = ("survived", UNSEEN)
"""Verdicts of breaks that no test notices."""

_TOP: Final = """\
# Breaks that tests notice

*Made by `make verify-mutation` from `docs/results/mutation.csv`.*

The code is broken in one place at a time, as bugs break it: a sign, an order, a constant, a
condition, a statement that is missing. A break that no test notices shows what no test holds. They
are drawn at random (seed {seed}), from each area in turn: a place first, then one of its breaks.
Python is broken by operators of [Cosmic Ray](https://pypi.org/project/cosmic-ray/) and three of our
own (a statement dropped, two arguments exchanged, a function replaced by its counterpart), C by the
rules of [universalmutator](https://pypi.org/project/universalmutator/), with the unit built again.
Left out by rule is what only declares or makes a text: messages of errors, the log, annotations,
docstrings, decorators such as `override`; and what has the same meaning or does not compile.

Each break is tried in a copy of the tree, first by the tests of the eight files nearest to the
module, by their names and by who imports whom, then by those that reach its lines as coverage says,
and by others of the first three of their files; by at most {budget:.0f} s of each kind. In place of
a measurement of what reaches what, what was left may be tried by files of tests that somebody names
(`BY`), for as long as one likes; who killed it is in the table. Tests marked slow are left out. A
break of C is tried by the tests of its unit. What *hangs* is noticed, too, and what a test notices
counts only if it does so twice, and passes without the break. *Equivalent* are breaks that change
nothing anybody could observe, set aside by hand with a reason each. *At first* is before tests were
written for what had not been noticed, by the nearest tests alone: how good these were, with the
interval of Wilson at 95 %; what only tests further away noticed does not count then. *Now* is with
the tests that were written, and with those further away.

"""

_HEADING: Final = (
    "| area | drawn | not run | no other program | equivalent | tried | noticed at first "
    "| noticed now | of these by a hang | share noticed at first | share noticed now |"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """Why a break changes nothing that anybody could observe.

    Attributes:
        file, before, after: of the break, its lines without indent.
        reason: in a sentence.
    """

    file: str
    before: str
    after: str
    reason: str

    def key(self) -> tuple[str, str, str]:
        """What it has in common with the break."""
        return self.file, " ".join(self.before.split()), " ".join(self.after.split())


def judgements(path: Path) -> list[Judgement]:
    """Those of a table that is kept by hand."""
    with path.open(newline="", encoding="utf-8") as file:
        return [Judgement(**row) for row in csv.DictReader(file)]


def table(sample: Sequence[Mutant], rows: Sequence[Row], judged: Sequence[Judgement]) -> list[Row]:
    """A row for each break of the sample, with what is equivalent and what was not run.

    Args:
        sample: the breaks.
        rows: of the journal, in their order.
        judged: what is equivalent.
    """
    known = {row.mutant.key(): row for row in rows}
    first = {row.mutant.key(): row.verdict for row in reversed(rows)}
    equivalent = {each.key() for each in judged}
    found = []
    for mutant in sample:
        row = known.get(mutant.key(), Row.of(mutant))
        row = replace(row, line=mutant.line, first=first.get(mutant.key(), ""))
        is_equivalent = row.verdict in OPEN and mutant.key() in equivalent
        found.append(replace(row, verdict=EQUIVALENT) if is_equivalent else row)
    return found


def written(
    rows: Sequence[Row],
    judged: Sequence[Judgement],
    *,
    seed: int,
    budget: float,
) -> str:
    """The page.

    Args:
        rows: a row for each break of the sample.
        judged: why some are equivalent.
        seed: of the sample.
        budget: of the tests of one break [s].
    """
    tried = [row for row in rows if row.verdict != NOT_RUN]
    left = len(rows) - len(tried)
    said = f"{len(tried)} of the {len(rows)} breaks of the sample were tried"
    rest = f"; the other {left} were not run, and nothing is known of them." if left else "."
    parts = [_TOP.format(seed=seed, budget=budget), said + rest + "\n\n", _HEADING, "\n"]
    parts.append("|---|" + "---:|" * 10 + "\n")
    parts += [_line(area, [row for row in rows if row.area == area]) for area in AREAS]
    parts += [_line("all", rows), *_open(rows), *_equivalent(rows, judged)]
    return "".join(parts)


def _line(name: str, rows: Sequence[Row]) -> str:
    count = {v: sum(r.verdict == v for r in rows) for v in {r.verdict for r in rows}}
    tried = [row for row in rows if row.verdict in (*TRIED, UNSEEN)]
    noticed = [row.verdict not in OPEN for row in tried]
    before = [(row.first or row.verdict) not in OPEN for row in tried]
    cells = [len(rows), *(count.get(v, 0) for v in (NOT_RUN, UNBUILT, EQUIVALENT)), len(tried)]
    cells += [sum(before), sum(noticed), count.get("timeout", 0)]
    shown = [_share(before), f"{100 * sum(noticed) / len(noticed):.0f} %" if noticed else ""]
    return f"| {name} | {' | '.join(map(str, [*cells, *shown]))} |\n"


def _share(noticed: Sequence[bool]) -> str:
    """The share of those that were noticed, with its interval."""
    if not noticed:
        return ""
    found = share(noticed)
    shown = f"{100 * found.value:.0f} %"
    if found.low is not None and found.high is not None:
        shown += f" ({100 * found.low:.0f} to {100 * found.high:.0f})"
    return shown


def _open(rows: Sequence[Row]) -> Iterator[str]:
    survived = [row for row in rows if row.verdict in OPEN]
    yield "\n## Not noticed\n\n"
    if not survived:
        yield "None.\n"
        return
    yield "| where | break | tried by |\n|---|---|---|\n"
    for row in survived:
        which = "tests near it" if row.verdict == UNSEEN else "tests that reach it, too"
        yield f"| `{row.file}:{row.line}` | {_change(row.before, row.after)} | {which} |\n"


def _equivalent(rows: Sequence[Row], judged: Sequence[Judgement]) -> Iterator[str]:
    reasons = {each.key(): each.reason for each in judged}
    found = [row for row in rows if row.verdict == EQUIVALENT]
    if found:
        yield "\n## Equivalent\n\n| where | break | why it changes nothing |\n|---|---|---|\n"
    for row in found:
        reason = reasons[row.mutant.key()]
        yield f"| `{row.file}:{row.line}` | {_change(row.before, row.after)} | {reason} |\n"


def _change(before: str, after: str) -> str:
    return f"{_shown(before)} becomes {_shown(after)}"


def _shown(text: str) -> str:
    plain = " ".join(text.split()).replace("|", "\\|")
    if len(plain) > 90:
        plain = plain[:87] + "..."
    return f"`` {plain} ``" if "`" in plain else f"`{plain}`"
