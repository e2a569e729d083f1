"""`python -m tests.faults`: the campaign of `make verify-faults`.

It goes on where it was interrupted; remove the folder to begin anew.
"""

import argparse
import csv
import shutil
import sys
from pathlib import Path
from typing import Final

from tests.faults.cases import drawn, first_of_each_kind
from tests.faults.examine import examined
from tests.faults.page import written

_FULL: Final = 200
_RESULTS: Final = Path("docs/results/faults.csv")
_PAGE: Final = Path("docs/reliability.md")
_COLUMNS: Final = ("case", "kind", "what", "transport", "exit_code", "seconds", "problems")


def main() -> int:
    """Run the cases; exit code 1 if one of them is not as it is to be."""
    parser = argparse.ArgumentParser(description=__doc__)
    cases = parser.add_mutually_exclusive_group()
    cases.add_argument("--small", action="store_true", help="one fault of each kind")
    cases.add_argument("--cases", type=int, default=_FULL, help="how many (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("runs/faults"))
    parser.add_argument("--docs", action="store_true", help=f"write {_PAGE} and {_RESULTS}, too")
    given = parser.parse_args()
    numbers = first_of_each_kind() if given.small else range(given.cases)
    given.out.mkdir(parents=True, exist_ok=True)
    table = given.out / "faults.csv"
    done = _rows(table)
    with table.open("a", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
        if not done:
            writer.writeheader()
        for number in list(numbers)[len(done) :]:
            case = drawn(given.seed, number)
            folder = given.out.absolute() / f"case-{number}"
            shutil.rmtree(folder, ignore_errors=True)
            result = examined(case, folder)
            problems = "; ".join(result.problems)
            row = {
                "case": number,
                "kind": case.fault.kind,
                "what": case.fault.what,
                "transport": case.transport,
                "exit_code": result.exit_code,
                "seconds": f"{result.seconds:.2f}",
                "problems": problems,
            }
            writer.writerow(row)
            file.flush()
            sys.stdout.write(
                f"{number}: {case.fault.what} ({case.transport}): {problems or 'ok'}\n"
            )
            sys.stdout.flush()
            if not problems:
                shutil.rmtree(folder)
    rows = _rows(table)[: len(numbers)]
    if given.docs:
        shutil.copy(table, _RESULTS)
        _PAGE.write_text(written(rows))
    return int(any(row["problems"] for row in rows))


def _rows(table: Path) -> list[dict[str, str]]:
    if not table.exists():
        return []
    with table.open(newline="") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    sys.exit(main())
