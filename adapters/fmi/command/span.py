"""The communication points of a run of one FMU."""

from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from adapters.fmi.experiment import DefaultExperiment
from orchestrator.errors import CosimError
from orchestrator.exact import quotient
from orchestrator.timebase import (
    NANOSECONDS_PER_SECOND,
    CommunicationGrid,
    StepSize,
    Time,
    as_step_size,
    nanoseconds,
)

_STEPS: Final = 500
"""How many there are in a run whose FMU does not say a step size."""


class RunError(CosimError):
    """What is asked for cannot be run; a line for each problem. Exit code 2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Span:
    """Communication points of a run.

    Attributes:
        start, stop: the first and the last one [ns].
        step: between two of them [ns], exactly.
    """

    start: Time
    stop: Time
    step: StepSize


def span_of(
    default: DefaultExperiment, start: str | None, stop: str | None, step: str | None
) -> Span:
    """The communication points that are asked for, and what the FMU says where nothing is.

    Args:
        default: of the FMU.
        start: the first one [s], or `None`.
        stop: the last one [s], or `None`.
        step: between two [s], also a fraction such as `1/60`, or `None`.

    Raises:
        RunError: they do not fit together.
    """
    problems: list[str] = []
    begin = _time("--start-time", start, default.start or "0", problems)
    if stop is None and default.stop is None:
        stop = str(float(Fraction(begin, 10**9) + 1))
    end = _time("--stop-time", stop, default.stop, problems)
    if not problems and end <= begin:
        what = f"the run stops at {end / 1e9:g} s, not after its start at {begin / 1e9:g} s"
        problems.append(what)
    if problems:
        raise RunError("\n".join(problems))
    if step is None and default.step is None:
        return Span(start=begin, stop=end, step=as_step_size(Fraction(end - begin, _STEPS)))
    size = _step_size(step, default.step, problems)
    if not problems:
        try:
            CommunicationGrid.over(begin, end, size)
        except ValueError as error:
            problems.append(f"--step {float(size) / 1e9:g}: {error}")
    if problems:
        raise RunError("\n".join(problems))
    return Span(start=begin, stop=end, step=size)


def _time(option: str, said: str | None, default: str | None, problems: list[str]) -> Time:
    text = default if said is None else said
    try:
        return nanoseconds(text or "")
    except (ValueError, ZeroDivisionError):
        of = option if said is not None else f"{option}: the default experiment says"
        problems.append(f"{of} {text!r}: write seconds, a whole number of nanoseconds")
        return 0


def _step_size(said: str | None, default: str | None, problems: list[str]) -> StepSize:
    text = (default if said is None else said) or ""
    try:
        return as_step_size(quotient(text) * NANOSECONDS_PER_SECOND)
    except (ValueError, ZeroDivisionError):
        of = "--step" if said is not None else "--step: the default experiment says"
        problems.append(f"{of} {text!r}: write seconds, such as `0.01` or `1/60`")
        return 0
