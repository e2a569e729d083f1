"""`python -m tests.faults [--hosts]`: the campaigns of `make verify-faults`.

With `--hosts` two of three components are on a host, which `nlosim serve` is. Each campaign goes on
where it was interrupted; remove its folder to begin anew, or rows of its table to have these cases
again. Runs that hardly get a processor come last.
"""

import argparse
import csv
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from tests.faults.cases import FAULTS, Case, drawn, first_of_each_kind
from tests.faults.examine import examined
from tests.faults.examine_hosts import examined_on_hosts
from tests.faults.judging import Result
from tests.faults.on_hosts import FAULTS as HOST_FAULTS, HostCase, drawn_on_hosts
from tests.reliability import page

_RESULTS: Final = Path("docs/results/faults.csv")
_ON_HOSTS: Final = Path("docs/results/faults-hosts.csv")
_COLUMNS: Final = (
    "case",
    "kind",
    "what",
    "transport",
    "exit_code",
    "seconds",
    "resumed",
    "problems",
)


def main() -> int:
    """Run the cases; exit code 1 if one of them is not as it is to be."""
    parser = argparse.ArgumentParser(description=__doc__)
    cases = parser.add_mutually_exclusive_group()
    cases.add_argument("--small", action="store_true", help="one fault of each kind")
    cases.add_argument("--cases", type=int, help="how many (default: 200; on hosts 60)")
    parser.add_argument("--hosts", action="store_true", help="with components on a host")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, help="(default: runs/faults, runs/faults-hosts)")
    parser.add_argument(
        "--docs", action="store_true", help="write docs/reliability.md and its table, too"
    )
    given = parser.parse_args()
    faults = HOST_FAULTS if given.hosts else FAULTS
    full = 60 if given.hosts else 200
    numbers = first_of_each_kind(faults) if given.small else range(given.cases or full)
    folder = given.out or Path("runs/faults-hosts" if given.hosts else "runs/faults")
    folder.mkdir(parents=True, exist_ok=True)
    table = folder / "faults.csv"
    _run(folder, _left(given.seed, numbers, _rows(table), on_hosts=given.hosts))
    rows = [row for row in _rows(table) if int(row["case"]) in numbers]
    if given.docs:
        with (_ON_HOSTS if given.hosts else _RESULTS).open("w", newline="") as file:
            writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
        page.write()
    return int(any(row["problems"] for row in rows))


def _run(out: Path, cases: Sequence[Case | HostCase]) -> None:
    """Run the cases, each in a folder of its own, and add them to the table as they come."""
    with (out / "faults.csv").open("a", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
        if not file.tell():
            writer.writeheader()
        for case in cases:
            folder = out.absolute() / f"case-{case.number}"
            shutil.rmtree(folder, ignore_errors=True)
            result, way = _examined(case, folder)
            problems = "; ".join(result.problems)
            row = {
                "case": case.number,
                "kind": case.fault.kind,
                "what": case.fault.what,
                "transport": way,
                "exit_code": result.exit_code,
                "seconds": f"{result.seconds:.2f}",
                "resumed": "" if result.resumed is None else f"{result.resumed:g}",
                "problems": problems,
            }
            writer.writerow(row)
            file.flush()
            sys.stdout.write(f"{case.number}: {case.fault.what} ({way}): {problems or 'ok'}\n")
            sys.stdout.flush()
            if not problems:
                shutil.rmtree(folder)


def _examined(case: Case | HostCase, folder: Path) -> tuple[Result, str]:
    """What became of a case, and how its components were reached."""
    if isinstance(case, HostCase):
        return examined_on_hosts(case, folder), "host"
    return examined(case, folder), case.transport


def _left(
    seed: int, numbers: Sequence[int], rows: Sequence[Mapping[str, str]], *, on_hosts: bool
) -> Sequence[Case | HostCase]:
    """The cases that are not in the table, in the order in which they run."""
    done = {int(row["case"]) for row in rows}
    draw = drawn_on_hosts if on_hosts else drawn
    left: list[Case | HostCase] = [draw(seed, number) for number in numbers if number not in done]
    return sorted(left, key=lambda case: case.fault.kind == "load")


def _rows(table: Path) -> list[dict[str, str]]:
    """Of the table, by number."""
    if not table.exists():
        return []
    with table.open(newline="") as file:
        return sorted(csv.DictReader(file), key=lambda row: int(row["case"]))


if __name__ == "__main__":
    sys.exit(main())
