"""`nlosim fmu compare`."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from adapters.fmi.command.running import simulated_fmu, span_of
from adapters.fmi.command.table import Results, TableError, read_results, scalars
from adapters.fmi.component_type import FmuComponentType
from adapters.fmi.experiment import default_experiment
from orchestrator.cli.failures import outcome_of
from orchestrator.cli.outcome import Exit, Outcome
from orchestrator.errors import CosimError
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """How far one variable is from another of the same name.

    Attributes:
        name: of both.
        largest: the largest difference; NaN where one is NaN and the other is not.
        at_s: when that is [s].
        allowed: the difference up to which they agree.
        first_s: when it is exceeded first [s]; `None` if it never is.
    """

    name: str
    largest: float
    at_s: float
    allowed: float
    first_s: float | None


def compare(first: Path, second: Path, *, relative: float, absolute: float) -> Outcome:
    """Compare two results, or the results of FMUs."""
    try:
        results = [_results(path) for path in (first, second)]
    except (CosimError, OSError) as error:
        return outcome_of(error)
    ours, theirs = results
    found = differences(ours, theirs, relative=relative, absolute=absolute)
    own, others = ({name for name, _ in scalars(each)} for each in results)
    lines = [_line(each) for each in found]
    for path, only in ((first, sorted(own - others)), (second, sorted(others - own))):
        if only:
            lines.append(f"only in {path}: {', '.join(only)}")
    beyond = [each for each in found if each.first_s is not None]
    verdict = f"{len(found) - len(beyond)} of {len(found)} variables agree"
    if not found:
        verdict = "there is nothing to compare: no variable in both, or no time"
    lines.append(verdict)
    return Outcome(
        text="\n".join(lines),
        data={
            "variables": [asdict(each) for each in found],
            "only_first": sorted(own - others),
            "only_second": sorted(others - own),
        },
        exit_code=Exit.DONE if found and not beyond else Exit.NOT_PASSED,
    )


def _results(path: Path) -> Results:
    if path.suffix != ".fmu":
        return read_results(path)
    span = span_of(default_experiment(path), None, None, None)
    simulated = simulated_fmu(FmuComponentType(path), span)
    if simulated.error is not None:
        raise simulated.error
    return simulated.results


def differences(
    first: Results, second: Results, *, relative: float, absolute: float
) -> list[Difference]:
    """How far the variables of two results are from each other, those that both have.

    Raises:
        TableError: a result has no rows.
    """
    if not len(first.times) or not len(second.times):
        raise TableError("a result without rows cannot be compared")
    others = dict(scalars(second))
    low, high = (f(first.times[i], second.times[i]) for f, i in ((max, 0), (min, -1)))
    inside = (first.times >= low - 1e-9) & (first.times <= high + 1e-9)
    times = first.times[inside]
    found = []
    for name, column in scalars(first):
        if name not in others or not len(times):
            continue
        ours = np.asarray(column, np.float64)[inside]
        theirs = _at(times, second.times, np.asarray(others[name], np.float64))
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
                allowed=allowed,
                first_s=float(times[beyond[0]]) if len(beyond) else None,
            )
        )
    return found


def _at(times: Array, known: Array, values: Array) -> Array:
    """Values at `times`, interpolated; of two at one time that which is nearer in the order."""
    if len(known) == len(times) and np.array_equal(known, times):
        return values
    return np.interp(times, known, values)


def _line(each: Difference) -> str:
    text = f"{each.name}: largest difference {each.largest:.3g} at {each.at_s:g} s"
    if each.first_s is None:
        return f"{text} (allowed {each.allowed:.3g})"
    return f"{text}, beyond {each.allowed:.3g} from {each.first_s:g} s on"
