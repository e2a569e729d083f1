"""Measuring: repetitions in turn, until done or until the user has enough."""

import fnmatch
import gc
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from tqdm import tqdm

from benchmarks.benchmark import Benchmark, Case, Measurement, Row
from orchestrator.errors import CosimError
from orchestrator.suggestion import suggestion


class NoSuchCaseError(CosimError):
    """No case has the name that was asked for. Exit code 2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a benchmark.

    Attributes:
        rows: of the cases that were measured at least once.
        repetitions: of the case that was measured least often; 0 if it was not reached.
        is_complete: whether nobody stopped it.
    """

    rows: tuple[Row, ...]
    repetitions: int
    is_complete: bool


def measure(benchmark: Benchmark, *, repeat: int, pattern: str = "*", label: str = "") -> Result:
    """Measure the cases of a benchmark.

    The repetitions take turns - all cases once, then all cases again - so that a disturbance of
    the machine hits all of them and not all repetitions of one. Ctrl-C ends it with what was
    measured until then.

    Args:
        benchmark: what to measure.
        repeat: how often each case is measured, at least once.
        pattern: names of cases, with the wildcards of a shell.
        label: of the progress bar.

    Raises:
        NoSuchCaseError: no case matches `pattern`.
    """
    measured: dict[str, list[Measurement]] = {}
    chosen: Mapping[str, Case] = {}
    is_complete = False
    try:
        chosen = _chosen(benchmark.cases(), pattern)
        turns = list(chosen.items()) * repeat
        with tqdm(turns, desc=label, unit="run", file=sys.stderr, disable=None) as bar:
            for name, case in bar:
                gc.collect()  # the garbage of one case is not collected at the cost of the next
                found = case.measure()
                measured.setdefault(name, []).append(found)
        is_complete = True
    except KeyboardInterrupt:
        pass
    return Result(
        rows=tuple(benchmark.rows(measured)),
        repetitions=_fewest(chosen, measured),
        is_complete=is_complete,
    )


def _chosen(cases: Mapping[str, Case], pattern: str) -> Mapping[str, Case]:
    found = {name: case for name, case in cases.items() if fnmatch.fnmatchcase(name, pattern)}
    if not found:
        hint = suggestion(pattern, cases)
        raise NoSuchCaseError(f"no case matches `{pattern}`; {hint}")
    return found


def _fewest(cases: Iterable[str], measured: Mapping[str, Sequence[Measurement]]) -> int:
    return min((len(measured.get(name, ())) for name in cases), default=0)
