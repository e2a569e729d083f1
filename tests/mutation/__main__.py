"""`python -m tests.mutation`: the campaign of `make verify-mutation`.

It goes on where it was interrupted, or from the table in `docs/results/`; remove both to begin
anew. Each break is tried by the tests near it first; what none of them notices is tried by those
that reach its lines, which has to be measured, unless `--near` is given. What survived is tried
again with `--again`, or with `--by` by the tests of files that one names.
"""

import argparse
import math
import signal
import sys
import time
from collections.abc import Collection, Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Final

from tests.mutation import journal, page
from tests.mutation.areas import AREAS
from tests.mutation.campaign import Campaign, run_all
from tests.mutation.choosing import Nearby, Reaching
from tests.mutation.journal import Row
from tests.mutation.measuring import measure
from tests.mutation.mutant import Mutant
from tests.mutation.near import Near
from tests.mutation.reach import Reach
from tests.mutation.sample import kept
from tests.mutation.tree import copied
from tests.mutation.trial import Limits, Patience

_FULL: Final = 300
_ROOT: Final = Path(__file__).parents[2]
_RESULTS: Final = _ROOT / "docs" / "results" / "mutation.csv"
_EQUIVALENT: Final = _ROOT / "docs" / "results" / "mutation-equivalent.csv"
_PAGE: Final = _ROOT / "docs" / "mutation.md"


def main() -> int:
    """Try breaks; exit code 4 if interrupted, 0 otherwise: what survived is for people to judge."""
    options = _options()
    for number in (signal.SIGINT, signal.SIGTERM):  # whoever starts this may have them ignored
        signal.signal(number, signal.default_int_handler)
    tree, work = options.out / "tree", options.out / "work"
    work.mkdir(parents=True, exist_ok=True)
    path = options.out / "journal.csv"
    if not path.exists() and _RESULTS.exists():
        journal.begin(path, journal.read(_RESULTS))
    areas = [options.area] if options.area else list(AREAS)
    sample = kept(options.out / "sample.json", _ROOT, options.seed, options.n, areas)
    code = 0
    try:
        if options.minutes > 0:
            copied(_ROOT, tree)
            _try_all(options, sample, path, tree=tree, work=work)
    except KeyboardInterrupt:
        sys.stdout.write("interrupted; the same command goes on\n")
        code = 4
    judged = page.judgements(_EQUIVALENT)
    rows = page.table(sample, journal.read_all(path), judged)
    if options.docs:
        journal.write(_RESULTS, rows)
        said = page.written(rows, judged, seed=options.seed, budget=options.budget)
        _PAGE.write_text(said, encoding="utf-8")
    _summary(rows)
    return code


def _try_all(
    options: argparse.Namespace, sample: list[Mutant], path: Path, *, tree: Path, work: Path
) -> None:
    """Try all breaks by the tests near them, then what these do not notice by all that reach it."""
    begin, patience = time.monotonic(), Patience(least=options.patience)
    is_again = options.again or options.by
    survived = (journal.UNSEEN, "survived") if is_again else (journal.UNSEEN,)
    limits = Limits(all=options.budget, **({"file": options.budget} if options.by else {}))
    near = Nearby(tree=tree, work=work, near=Near.read(tree), limits=limits, named=options.by)
    campaign = Campaign(tree=tree, work=work, choice=near, patience=patience)
    if is_again:
        some = [each for each in sample if fnmatchcase(each.file, options.of)]
        _again(campaign, some, path, survived)
    if options.by:
        return
    run_all(campaign.tried, sample, path, seconds=60 * options.minutes)
    over = time.monotonic() - begin >= 60 * options.minutes
    if options.near or over or not _those(sample, path, survived):
        return
    measure(tree, options.out)
    reach = Reach.load(options.out, tree)
    reaching = Reaching(tree=tree, work=work, reach=reach, budget=options.budget)
    _again(replace(campaign, choice=reaching), sample, path, survived)


def _those(sample: list[Mutant], path: Path, verdicts: Collection[str]) -> list[Row]:
    """Rows of the journal of these breaks with one of these verdicts."""
    wanted = {mutant.key(): mutant for mutant in sample}
    rows = [row for row in journal.read(path) if row.verdict in verdicts]
    return [Row.of(wanted[row.mutant.key()]) for row in rows if row.mutant.key() in wanted]


def _again(campaign: Campaign, sample: list[Mutant], path: Path, verdicts: Collection[str]) -> None:
    """Try what had one of these verdicts once more."""
    for row in _those(sample, path, verdicts):
        found = campaign.tried(row.mutant)
        journal.add(path, found)
        sys.stdout.write(f"{found.verdict:8} {found.file}:{found.line} {found.killer}\n")
        sys.stdout.flush()


def _summary(rows: list[Row]) -> None:
    for verdict in dict.fromkeys(row.verdict for row in rows):
        sys.stdout.write(f"{verdict}: {sum(row.verdict == verdict for row in rows)}\n")


def _options(words: Sequence[str] | None = None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-n", type=int, default=_FULL, help="breaks (default: %(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="of the sample (default: %(default)s)")
    parser.add_argument("--area", choices=list(AREAS), help="one area only")
    parser.add_argument(
        "--budget", type=float, default=60, help="tests of a break [s] (default: %(default)s)"
    )
    parser.add_argument(
        "--minutes", type=float, default=math.inf, help="begin no break after these; 0: none"
    )
    parser.add_argument("--out", type=Path, default=_ROOT / "build" / "mutation")
    parser.add_argument("--near", action="store_true", help="measure nothing: near tests alone")
    parser.add_argument(
        "--patience",
        type=float,
        default=60,
        help="with a test [s] (default: %(default)s)",
    )
    parser.add_argument("--again", action="store_true", help="try what survived once more")
    parser.add_argument(
        "--by",
        nargs="+",
        default=[],
        metavar="FILE",
        help="try what survived once more by the tests of these files, and nothing else",
    )
    parser.add_argument(
        "--of", default="*", metavar="PATTERN", help="with --by: breaks of these files only"
    )
    parser.add_argument("--docs", action="store_true", help="write the page of the manual, too")
    options = parser.parse_args(words)
    options.out = options.out.absolute()
    return options


if __name__ == "__main__":
    sys.exit(main())
