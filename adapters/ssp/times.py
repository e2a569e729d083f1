"""When a scenario from a package starts and stops, and how long its steps are."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from adapters.fmi.experiment import DefaultExperiment
from adapters.ssp.model import Description
from adapters.ssp.node import Findings
from orchestrator.errors import Location
from orchestrator.exact import exact
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, StepSize, Time, as_step_size

_STEPS: Final = 500
"""How many there are if nobody says a step size."""

_SIMPLE: Final = 10_000
"""Denominators of fractions of seconds that are taken as meant."""

_ASKED: Final = "as asked for"


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Times that the command line says [s]; `None` where it says nothing."""

    stop: Fraction | None = None
    step: Fraction | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Times:
    """What a scenario says of time.

    Attributes:
        start, stop: [ns].
        step: communication step size [ns].
        from_: who says start and stop.
        step_from: who says the step size.
    """

    start: Time
    stop: Time
    step: StepSize
    from_: str
    step_from: str


def times(
    description: Description,
    experiments: Sequence[DefaultExperiment],
    wanted: Wanted,
    findings: Findings,
) -> Times:
    """Start, stop and step.

    Args:
        description: of the system; SSP has no step sizes.
        experiments: the default experiments of its FMUs, asked where the system is silent.
        wanted: what comes before all others.
        findings: times that are no whole number of nanoseconds are added.
    """
    where = description.where
    start = description.start or Fraction(0)
    stop, from_ = _stop(description, experiments, wanted, start)
    span = _nanoseconds(stop, where, findings) - _nanoseconds(start, where, findings)
    if span <= 0:
        findings.add(where, f"stops at {float(stop)} s, and starts at {float(start)} s")
        span = NANOSECONDS_PER_SECOND
    step, step_from = _step(description, experiments, wanted, span, findings)
    return Times(
        start=_nanoseconds(start, where, findings),
        stop=_nanoseconds(stop, where, findings),
        step=step,
        from_=from_,
        step_from=step_from,
    )


def _stop(
    description: Description,
    experiments: Sequence[DefaultExperiment],
    wanted: Wanted,
    start: Fraction,
) -> tuple[Fraction, str]:
    if wanted.stop is not None:
        return wanted.stop, _ASKED
    if description.stop is not None:
        return description.stop, str(description.where)
    said = [exact(each.stop) for each in experiments if each.stop is not None]
    if said and max(said) > start:
        return max(said), "the latest stop of an FMU, as the system says none"
    return start + 1, "nobody says when to stop"


def _step(
    description: Description,
    experiments: Sequence[DefaultExperiment],
    wanted: Wanted,
    span: Duration,
    findings: Findings,
) -> tuple[StepSize, str]:
    if wanted.step is not None:
        return _positive(wanted.step, description.where, findings), _ASKED
    if description.step is not None:
        size, where = description.step
        return _positive(size, where, findings), str(where)
    said = (_as_meant(exact(each.step)) for each in experiments if each.step)
    shortest = min((Fraction(step) for step in said if step is not None), default=Fraction(0))
    if shortest >= 1 and (span / shortest).denominator == 1:
        return as_step_size(shortest), "the shortest step of an FMU, as SSP has none"
    count = next((n for n in range(_STEPS, 2 * _STEPS) if span % n == 0), 1)
    return span // count, f"{count} steps, as nobody says how long they are"


def _positive(seconds: Fraction, where: Location, findings: Findings) -> StepSize:
    found = _as_meant(seconds)
    if found is None or found <= 0:
        what = "" if found is not None else ", no whole number of nanoseconds"
        findings.add(where, f"a step size of {float(seconds)} s{what}")
        return 1
    return found


def _as_meant(seconds: Fraction) -> StepSize | None:
    """A step size in nanoseconds; 0.016666666666666666 s is 1/60 s. `None`: it is no such time."""
    whole = seconds * NANOSECONDS_PER_SECOND
    if whole.denominator == 1:
        return int(whole)
    simple = seconds.limit_denominator(_SIMPLE)
    same = float(simple) == float(seconds)
    return as_step_size(simple * NANOSECONDS_PER_SECOND) if same else None


def _nanoseconds(seconds: Fraction, where: Location, findings: Findings) -> Time:
    found = seconds * NANOSECONDS_PER_SECOND
    if found.denominator != 1:
        findings.add(where, f"{float(seconds)} s is not a whole number of nanoseconds")
    return int(found)
