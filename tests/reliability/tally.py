"""What became of the cases of an area, kept while they are performed, and as rows of a table."""

import csv
import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Final

from tests.reliability.area import Area, Outcome

COLUMNS: Final = (
    "area",
    "kind",
    "cases",
    "as_it_should_be",
    "seconds_longest",
    "peak_mb",
    "full_size_of_area",
    "seed",
    "failures",
)
_FAILURE: Final = re.compile(
    r"(?P<line>python -m tests\.reliability \S+ --seed \d+ --only (?P<case>\d+)): "
    r"(?P<why>.*?)(?=; python -m |$)",
    re.DOTALL,
)
_NAMED: Final = 5
"""So many failures of a kind are named in the table."""


@dataclass(slots=True)
class Count:
    """Of a kind of cases: how many, how many were as they should be, and the most they took."""

    cases: int = 0
    good: int = 0
    seconds: float = 0.0
    peak_mb: float = 0.0


@dataclass(slots=True)
class Failure:
    """A case that was not as it should be."""

    case: int
    kind: str
    why: str
    reproducer: str


@dataclass(slots=True)
class Tally:
    """What is known of an area.

    Attributes:
        area: its name.
        seed: of its cases.
        done: the number of the first case that was not performed.
        counts: by kind.
        failures: in the order of their cases.
    """

    area: str
    seed: int
    done: int = 0
    counts: dict[str, Count] = field(default_factory=dict)
    failures: list[Failure] = field(default_factory=list)

    def add(self, outcome: Outcome) -> None:
        """Count the next case."""
        count = self.counts.setdefault(outcome.kind, Count())
        count.cases += 1
        count.good += outcome.is_expected
        count.seconds = max(count.seconds, outcome.seconds)
        count.peak_mb = max(count.peak_mb, outcome.peak_mb)
        if not outcome.is_expected:
            self.failures.append(
                Failure(
                    outcome.case,
                    outcome.kind,
                    outcome.why,
                    reproducer(self.area, self.seed, outcome),
                )
            )
        self.done = outcome.case + 1

    def mend(self, outcome: Outcome) -> None:
        """Count a case anew that was not as it should be."""
        if not outcome.is_expected:
            return
        self.failures = [each for each in self.failures if each.case != outcome.case]
        self.counts[outcome.kind].good += 1

    def write(self, path: Path) -> None:
        """Keep it, so that the campaign can go on."""
        draft = path.with_suffix(".draft")
        draft.write_text(json.dumps(asdict(self), indent=1))
        draft.replace(path)

    @classmethod
    def read(cls, path: Path, area: str, seed: int) -> "Tally":
        """What was kept; that nothing was done if there is nothing."""
        if not path.exists():
            return cls(area, seed)
        kept = json.loads(path.read_text())
        counts = {kind: Count(**count) for kind, count in kept["counts"].items()}
        failures = [Failure(**failure) for failure in kept["failures"]]
        return cls(area, seed, kept["done"], counts, failures)

    @classmethod
    def of_table(cls, path: Path, area: str, seed: int) -> "Tally":
        """What a table says of an area: a campaign goes on from there on another machine, too.

        The table has no more than the first few failures of a kind; the others count as such for
        ever.
        """
        found = cls(area, seed)
        for row in read_table(path):
            if (row["area"], row["seed"]) == (area, str(seed)):
                found._take(row)
        return found

    def _take(self, row: Mapping[str, str]) -> None:
        count = Count(
            cases=int(row["cases"]),
            good=int(row["as_it_should_be"]),
            seconds=float(row["seconds_longest"]),
            peak_mb=float(row["peak_mb"] or 0),
        )
        self.counts[row["kind"]] = count
        self.done += count.cases
        self.failures += [
            Failure(int(found["case"]), row["kind"], found["why"], found["line"])
            for found in _FAILURE.finditer(row["failures"])
        ]

    def rows(self, full: int) -> list[dict[str, str]]:
        """One for each kind; see `COLUMNS`."""
        found = []
        for kind, count in sorted(self.counts.items()):
            failures = [each for each in self.failures if each.kind == kind][:_NAMED]
            row = {
                "area": self.area,
                "kind": kind,
                "cases": str(count.cases),
                "as_it_should_be": str(count.good),
                "seconds_longest": f"{count.seconds:.2f}",
                "peak_mb": f"{count.peak_mb:.0f}" if count.peak_mb else "",
                "full_size_of_area": str(full),
                "seed": str(self.seed),
                "failures": "; ".join(f"{each.reproducer}: {each.why}" for each in failures),
            }
            found.append(row)
        return found


def reproducer(area: str, seed: int, outcome: Outcome) -> str:
    """One line that shows the case again."""
    command = f"python -m tests.reliability {area} --seed {seed} --only {outcome.case}"
    return outcome.reproducer or command


def read_table(path: Path) -> list[dict[str, str]]:
    """The rows of a table; none if there is no such file."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def write_table(path: Path, tallies: Iterable[tuple[Area, Tally]], order: Iterable[str]) -> None:
    """Put the rows of some areas in the place of theirs in a table; those of others stay.

    Args:
        path: of the table.
        tallies: of the areas.
        order: the names of all areas, in that of the table.
    """
    rows: dict[str, list[Mapping[str, str]]] = {}
    for row in read_table(path):
        rows.setdefault(row["area"], []).append(row)
    for area, tally in tallies:
        rows[area.name] = [*tally.rows(area.full)]
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        for name in order:
            writer.writerows(rows.get(name, []))
