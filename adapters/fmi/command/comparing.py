"""`nlosim fmu compare`."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

import numpy as np

from adapters.fmi.command.reading import converted, read_results
from adapters.fmi.command.running import simulated_fmu
from adapters.fmi.command.span import span_of
from adapters.fmi.command.table import Results, TableError, scalars
from adapters.fmi.component_type import FmuComponentType
from adapters.fmi.experiment import default_experiment
from orchestrator.cli.failures import outcome_of
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import CosimError
from orchestrator.signal import Array
from orchestrator.units import UnitError

_INSTANT: Final = 1e-9
"""Times that are no farther apart are the same [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """How far one variable is from another of the same name.

    Attributes:
        name: of both.
        largest: the largest difference; NaN where one is NaN and the other is not.
        at_s: when that is [s].
        first, second: the values there, in the unit of the first.
        allowed: the difference up to which they agree.
        first_s: when it is exceeded first [s]; `None` if it never is.
    """

    name: str
    largest: float
    at_s: float
    first: float
    second: float
    allowed: float
    first_s: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """How far results may be from each other.

    Attributes:
        relative: of the largest value of a variable.
        absolute: added to that.
        whole: whether both have to cover the same time.
    """

    relative: float
    absolute: float
    whole: bool


def compare(first: Path, second: Path, tolerance: Tolerance) -> Outcome:
    """Compare two results, or the results of FMUs."""
    problems = [
        f"--{name} {value:g}: write a number of at least 0"
        for name, value in (("relative", tolerance.relative), ("absolute", tolerance.absolute))
        if not 0 <= value < math.inf
    ]
    if problems:
        return failure("usage", Exit.WRONG_INPUT, "\n".join(problems))
    try:
        ours, theirs = (_results(path) for path in (first, second))
        found = differences(ours, theirs, relative=tolerance.relative, absolute=tolerance.absolute)
    except (CosimError, OSError) as error:
        return outcome_of(error)
    own, others = ({name for name, _ in scalars(each)} for each in (ours, theirs))
    lines = [_line(each) for each in found]
    for path, only in ((first, sorted(own - others)), (second, sorted(others - own))):
        if only:
            lines.append(f"only in {path}: {', '.join(only)}")
    low, high = common(ours, theirs)
    uncovered = list(_uncovered((first, second), (ours, theirs), (low, high)))
    lines += uncovered if found else []
    beyond = [each for each in found if each.first_s is not None]
    verdict = f"{len(found) - len(beyond)} of {len(found)} variables agree"
    if beyond:
        worst = max(beyond, key=_excess)
        verdict += f"; the worst is {worst.name} at {worst.at_s:g} s"
    if not found:
        verdict = "there is nothing to compare: no variable in both, or no time"
    if found and tolerance.whole and uncovered:
        verdict += "; they do not cover the same time"
    passed = found and not beyond and not (tolerance.whole and uncovered)
    return Outcome(
        text="\n".join([*lines, verdict]),
        data={
            "variables": [asdict(each) for each in found],
            "from_s": low,
            "to_s": high,
            "only_first": sorted(own - others),
            "only_second": sorted(others - own),
        },
        exit_code=Exit.DONE if passed else Exit.NOT_PASSED,
    )


def _excess(each: Difference) -> float:
    """How many times more than allowed the largest difference is."""
    if math.isnan(each.largest) or each.allowed == 0.0:
        return math.inf
    return each.largest / each.allowed


def _results(path: Path) -> Results:
    if path.suffix != ".fmu":
        return read_results(path, skip_text=True)
    span = span_of(default_experiment(path), None, None, None)
    simulated = simulated_fmu(FmuComponentType(path), span)
    if simulated.error is not None:
        raise simulated.error
    return simulated.results


def common(first: Results, second: Results) -> tuple[float, float]:
    """The first and the last time that both results have [s].

    Raises:
        TableError: a result has no rows.
    """
    if not len(first.times) or not len(second.times):
        raise TableError("a result without rows cannot be compared")
    ends = [(each.times[0], each.times[-1]) for each in (first, second)]
    return float(max(e[0] for e in ends)), float(min(e[1] for e in ends))


def _uncovered(
    paths: tuple[Path, Path], results: tuple[Results, Results], both: tuple[float, float]
) -> Iterator[str]:
    """What one result has of the time and the other has not."""
    low, high = both
    for path, each in zip(paths, results, strict=True):
        if each.times[0] < low - _INSTANT:
            yield f"compared from {low:g} s on: {path} begins at {each.times[0]:g} s"
        if each.times[-1] > high + _INSTANT:
            yield f"compared until {high:g} s: {path} ends at {each.times[-1]:g} s"


def differences(
    first: Results, second: Results, *, relative: float, absolute: float
) -> list[Difference]:
    """How far the variables of two results are from each other, those that both have.

    Raises:
        TableError: a result has no rows.
    """
    low, high = common(first, second)
    others = dict(scalars(second))
    inside = (first.times >= low - _INSTANT) & (first.times <= high + _INSTANT)
    times = first.times[inside]
    found = []
    for name, column in scalars(first):
        if name not in others or not len(times):
            continue
        ours = np.asarray(column, np.float64)[inside]
        theirs = _at(times, second.times, np.asarray(others[name], np.float64))
        theirs = _converted(theirs, name, first.units, second.units)
        apart = np.abs(ours - theirs)
        apart[(ours == theirs) | (np.isnan(ours) & np.isnan(theirs))] = 0.0
        finite = np.abs(theirs[np.isfinite(theirs)])
        allowed = absolute + relative * float(finite.max(initial=0.0))
        beyond = np.flatnonzero(~(apart <= allowed))
        worst = int(np.argmax(np.where(np.isnan(apart), np.inf, apart)))
        found.append(
            Difference(
                name=name,
                largest=float(apart[worst]),
                at_s=float(times[worst]),
                first=float(ours[worst]),
                second=float(theirs[worst]),
                allowed=allowed,
                first_s=float(times[beyond[0]]) if len(beyond) else None,
            )
        )
    return found


def _at(times: Array, known: Array, values: Array) -> Array:
    """Values at `times`, interpolated; of two at one time that which is nearer in the order.

    Times of files are rounded: those that are next to a known one are that.
    """
    if len(known) == len(times) and np.allclose(known, times, rtol=0.0, atol=_INSTANT):
        return values
    near = np.clip(np.searchsorted(known, times - _INSTANT), 0, len(known) - 1)
    is_known = np.abs(known[near] - times) <= _INSTANT
    return np.asarray(np.interp(np.where(is_known, known[near], times), known, values))


def _converted(
    values: Array, name: str, into: Mapping[str, str], units: Mapping[str, str]
) -> Array:
    """Values of the second result in the unit of the first, where both say one.

    Raises:
        TableError: they measure different quantities.
    """
    variable = name.partition("[")[0]
    target, source = (each.get(name, each.get(variable, "")) for each in (into, units))
    if not target or not source or source == target:
        return values
    try:
        return converted(values, source, target)
    except UnitError as error:
        raise TableError(f"`{name}`: units differ: {target} and {source} ({error})") from error


def _line(each: Difference) -> str:
    text = f"{each.name}: largest difference {each.largest:.3g} at {each.at_s:g} s"
    if each.first_s is None:
        return f"{text} (allowed {each.allowed:.3g})"
    values = f"{each.first:.6g} and {each.second:.6g}"
    return f"{text} ({values}), beyond {each.allowed:.3g} from {each.first_s:g} s on"
