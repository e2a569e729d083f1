"""`python -m tests.reliability`: the campaign of `make verify-reliability`.

An area goes on where it was interrupted, or where the table says that it was, and performs again
what was not as it should be; `--anew` begins anew. The exit code is 1 if something is not as it
should be, 4 after Ctrl-C.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from tqdm import tqdm

from tests.reliability.area import Area
from tests.reliability.areas import AREAS
from tests.reliability.tally import Tally, reproducer, write_table
from tests.reliability.throttle import Throttle

_STATE: Final = Path("runs/reliability")


def main(
    arguments: Sequence[str] | None = None,
    areas: Sequence[Area] = AREAS,
    state: Path = _STATE,
) -> int:
    """Perform the cases, and tabulate what became of them.

    Args:
        arguments: without the program's name; those of the process if `None`.
        areas: that can be asked for.
        state: where it is kept what was done.

    Returns:
        The exit code.
    """
    parser = _parser(areas)
    given = parser.parse_args(arguments)
    unknown = {*given.areas} - {area.name for area in areas}
    if unknown:
        parser.error(f"there is no area {', '.join(sorted(unknown))}")
    chosen = [area for area in areas if not given.areas or area.name in given.areas]
    if given.only is not None:
        if len(chosen) != 1:
            parser.error("--only needs one area")
        return _one(chosen[0], given.seed, given.only)
    if given.cases == "small":  # quick, so it is performed each time, whatever was done before
        state, given.anew = state.with_name(f"{state.name}-small"), True
    state.mkdir(parents=True, exist_ok=True)
    tallies: list[tuple[Area, Tally]] = []
    code = 0
    try:
        for area in chosen:
            if area.needs:
                sys.stderr.write(f"{area.name}: not here, {area.needs}\n")
                continue
            path = state / f"{area.name}-{given.seed}.json"
            if given.anew:
                tally = Tally(area.name, given.seed)
            elif path.exists():
                tally = Tally.read(path, area.name, given.seed)
            else:
                tally = Tally.of_table(given.out, area.name, given.seed)
            tallies.append((area, tally))
            _run(area, tally, _count(area, given.cases), path)
    except KeyboardInterrupt:
        code = 4
    write_table(given.out, tallies, [area.name for area in areas])
    _tell(tallies, given.cases)
    return code or int(any(tally.failures for _, tally in tallies))


def _parser(areas: Sequence[Area]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m tests.reliability",
        description=__doc__,
        epilog="\n".join(f"{area.name}: {area.what}" for area in areas),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    names = [area.name for area in areas]
    parser.add_argument("areas", metavar="AREA", nargs="*", help=", ".join(names))
    parser.add_argument("--cases", default="full", help="small, full or a number (default: full)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int, metavar="CASE", help="perform this case, and say more")
    parser.add_argument("--anew", action="store_true", help="forget what was done")
    out = _STATE / "reliability.csv"
    parser.add_argument("--out", type=Path, default=out, help="the table (default: %(default)s)")
    return parser


def _count(area: Area, cases: str) -> int:
    sizes = {"small": area.small, "full": area.full}
    return sizes[cases] if cases in sizes else int(cases)


def _one(area: Area, seed: int, case: int) -> int:
    """Perform one case again."""
    (outcome,) = area.outcomes(seed, [case])
    verdict = "as it should be" if outcome.is_expected else outcome.why
    took = f"{outcome.seconds:.2f} s, {outcome.peak_mb:.0f} MB"
    sys.stdout.write(f"{area.name}, case {case}, {outcome.kind}: {verdict} ({took})\n")
    return int(not outcome.is_expected)


def _run(area: Area, tally: Tally, count: int, path: Path) -> None:
    """Perform what is left of an area; what is done is kept in `path`."""
    seed = tally.seed
    for outcome in area.outcomes(seed, [failure.case for failure in tally.failures]):
        tally.mend(outcome)  # what failed may have been repaired since
    tally.write(path)
    throttle = Throttle(seconds=2)
    outcomes = area.outcomes(seed, range(tally.done, count))
    bar = tqdm(
        outcomes,
        total=count,
        initial=min(tally.done, count),
        desc=area.name,
        unit=" cases",
        file=sys.stderr,
        mininterval=0.5 if sys.stderr.isatty() else 30,
    )
    try:
        for outcome in bar:
            tally.add(outcome)
            if not outcome.is_expected:
                line = f"{reproducer(area.name, seed, outcome)}: {outcome.kind}: {outcome.why}"
                tqdm.write(line, file=sys.stderr)
            if throttle.is_due():
                tally.write(path)
    finally:
        tally.write(path)


def _tell(tallies: Sequence[tuple[Area, Tally]], cases: str) -> None:
    """A table for people, to standard output."""
    for area, tally in tallies:
        part = "" if tally.done >= area.full else f", {tally.done} of {area.full} at full size"
        sys.stdout.write(f"{area.name} (seed {tally.seed}, {cases}{part})\n")
        for kind, count in sorted(tally.counts.items()):
            sys.stdout.write(f"  {kind:44} {count.cases:8} {count.good:8} as they should be\n")
        for failure in tally.failures:
            sys.stdout.write(f"  {failure.reproducer}\n    {failure.why}\n")
    failed = sum(len(tally.failures) for _, tally in tallies)
    done = sum(tally.done for _, tally in tallies)
    sys.stdout.write(f"{done - failed} of {done} cases were as they should be\n")


if __name__ == "__main__":
    sys.exit(main())
