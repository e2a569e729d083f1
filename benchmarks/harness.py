"""Measuring: repetitions in turn, until done or until the user has enough."""

import fnmatch
import gc
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

from tqdm import tqdm

from benchmarks.benchmark import Benchmark, Case, Measurement, PeerFailedError, Row
from orchestrator.errors import CosimError, defects
from orchestrator.raised_at import raised_at
from orchestrator.suggestion import suggestion


class NoSuchCaseError(CosimError):
    """No case has the name that was asked for. Exit code 2."""


class DefectError(CosimError):
    """A benchmark raised what it should not; the text says which line. Exit code 2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What became of a benchmark.

    Attributes:
        rows: of the cases that were measured at least once.
        repetitions: of the case that was measured least often; 0 if it was not reached.
        is_complete: whether nobody stopped it.
        left_out: cases of peers that failed, and how; they are not among the others.
    """

    rows: tuple[Row, ...]
    repetitions: int
    is_complete: bool
    left_out: Mapping[str, str] = field(default_factory=dict)


def measure(benchmark: Benchmark, *, repeat: int, pattern: str = "*", label: str = "") -> Result:
    """Measure the cases of a benchmark.

    The repetitions take turns - all cases once, then all cases again - so that a disturbance of
    the machine hits all of them and not all repetitions of one. Ctrl-C ends it with what was
    measured until then. A peer that fails is left out from then on, with what was measured of that
    case before.

    Args:
        benchmark: what to measure.
        repeat: how often each case is measured, at least once.
        pattern: names of cases, with the wildcards of a shell.
        label: of the progress bar.

    Raises:
        NoSuchCaseError: no case matches `pattern`.
        DefectError: the benchmark itself is broken.
    """
    name_of = f"benchmark `{label}`"
    measured: dict[str, list[Measurement]] = {}
    chosen: Mapping[str, Case] = {}
    left_out: dict[str, str] = {}
    is_complete = False
    try:
        with _defects(name_of):
            cases = benchmark.cases()
        chosen = _chosen(cases, pattern)
        turns = list(chosen.items()) * repeat
        with tqdm(turns, desc=label, unit="run", file=sys.stderr, disable=None) as bar:
            for name, case in bar:
                if name in left_out:
                    continue
                gc.collect()  # the garbage of one case is not collected at the cost of the next
                try:
                    with _defects(f"{name_of}, case `{name}`"):
                        found = case.measure()
                except PeerFailedError as error:
                    left_out[name] = str(error)
                    measured.pop(name, None)
                    continue
                measured.setdefault(name, []).append(found)
        is_complete = True
    except KeyboardInterrupt:
        pass
    with _defects(name_of):
        rows = tuple(benchmark.rows(measured))
    return Result(
        rows=rows,
        repetitions=_fewest([name for name in chosen if name not in left_out], measured),
        is_complete=is_complete,
        left_out=left_out,
    )


@contextmanager
def _defects(whose: str) -> Iterator[None]:
    """Say whose fault it is what is raised here, and where, unless it was raised on purpose."""
    try:
        yield
    except (CosimError, OSError, MemoryError):
        raise
    except defects() as error:
        trace = error.__traceback__
        while trace is not None and trace.tb_frame.f_code.co_filename == __file__:
            trace = trace.tb_next
        where = raised_at(error.with_traceback(trace))
        what = f"{whose}: {type(error).__name__}: {error}"
        raise DefectError(what + (f"\nraised at {where}" if where else "")) from error


def _chosen(cases: Mapping[str, Case], pattern: str) -> Mapping[str, Case]:
    found = {name: case for name, case in cases.items() if fnmatch.fnmatchcase(name, pattern)}
    if not found:
        hint = suggestion(pattern, cases)
        raise NoSuchCaseError(f"no case matches `{pattern}`; {hint}")
    return found


def _fewest(cases: Iterable[str], measured: Mapping[str, Sequence[Measurement]]) -> int:
    return min((len(measured.get(name, ())) for name in cases), default=0)
