"""The tables of both campaigns: `python -m tests.reliability.page` writes docs/reliability.md."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from tests.faults.page import section
from tests.reliability.areas import AREAS
from tests.reliability.tally import read_table

_RESULTS: Final = Path("docs/results")
_TABLES: Final = ("reliability", "faults", "starved", "faults-hosts")
_PAGE: Final = Path("docs/reliability.md")

_TOP: Final = """\
# Reliability

*Made by `make verify-reliability` from `docs/results/reliability.csv`, and by `make verify-faults`
from `docs/results/faults.csv`.*

`make verify-reliability` attacks the software: files, archives, messages and recordings are changed
at random, commands get signals and too little of everything. Each case follows from a seed and a
number. It has to end with an exit code that is documented for it (0 done, 1 what was checked did
not pass, 2 the input is wrong, 3 a component failed, 4 interrupted; never 5, a bug) and a message
that names the place, within bounds of time and memory. What does not is reported with a line that
shows it again:

```console
$ make verify-reliability                        # days on one core; it goes on where it was cut off
$ make verify-reliability CASES=small            # minutes; CI performs the same cases
$ make verify-reliability CASES=1000 AREA=archives
$ python -m tests.reliability archives --seed 1 --only 4711
```

Time and memory are the largest of a case, those before a repair included; memory is what it took
beyond what the process had before, where each case has a process of its own. Cases are counted that
were really performed, a part of an area as such; those that found a fault were performed again
after its repair.

"""

_AREAS: Final = """\
| area | cases | as it should be | longest [s] | most memory [MB] |
|---|---|---|---|---|
"""

_KINDS: Final = """\
| area | kind | cases | as it should be |
|---|---|---|---|
"""


def written(
    rows: Sequence[Mapping[str, str]],
    faults: Sequence[Mapping[str, str]],
    starved: Sequence[Mapping[str, str]],
    on_hosts: Sequence[Mapping[str, str]] = (),
) -> str:
    """The page.

    Args:
        rows: of the table of this campaign; see `tests.reliability.tally.COLUMNS`.
        faults: of that of faults in runs.
        starved: of that of runs that hardly got a processor.
        on_hosts: of that of faults with components on a host.
    """
    parts = [_TOP, *_whats(), "\n", _AREAS, *_summaries(rows), "\n", *_failures(rows)]
    parts += ["## By kind\n\n", _KINDS, *_kinds(rows), "\n"]
    return "".join([*parts, section(faults, starved, on_hosts)])


def _whats() -> Iterator[str]:
    for area in AREAS:
        yield f"* **{area.name}**: {area.what}\n"


def _summaries(rows: Sequence[Mapping[str, str]]) -> Iterator[str]:
    for name in dict.fromkeys(row["area"] for row in rows):
        group = [row for row in rows if row["area"] == name]
        cases, good = (sum(int(row[key]) for row in group) for key in ("cases", "as_it_should_be"))
        full = int(group[0]["full_size_of_area"])
        count = f"{cases:,}" if cases >= full else f"{cases:,} of {full:,}"
        longest = max(float(row["seconds_longest"]) for row in group)
        peak = max((float(row["peak_mb"]) for row in group if row["peak_mb"]), default=None)
        memory = "" if peak is None else f"{peak:.0f}"
        yield f"| {name} | {count} | {good:,} | {longest:.1f} | {memory} |\n"


def _failures(rows: Sequence[Mapping[str, str]]) -> Iterator[str]:
    found = [each for row in rows for each in row["failures"].split("; ") if each]
    if found:
        yield "Not as it should be:\n\n"
    for each in found:
        command, _, why = each.partition(": ")
        yield f"* `{command}`: {why}\n"
    if found:
        yield "\n"


def _kinds(rows: Sequence[Mapping[str, str]]) -> Iterator[str]:
    for row in rows:
        cells = (row["area"], row["kind"], row["cases"], row["as_it_should_be"])
        yield f"| {' | '.join(cells)} |\n"


def write() -> None:
    """Make the page from the tables in docs/results."""
    tables = [read_table(_RESULTS / f"{name}.csv") for name in _TABLES]
    _PAGE.write_text(written(*tables))


if __name__ == "__main__":
    write()
    sys.exit()
