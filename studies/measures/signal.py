"""One number of one recorded signal."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final, Literal, TypeAlias

import numpy as np
from typing_extensions import override

from orchestrator import Measure
from orchestrator.errors import ParameterProblem, Problem
from orchestrator.measure import Findings, Planned
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.timebase import Time
from orchestrator.units import Unit, UnitError, parse_unit
from studies.measures.condition import Condition
from studies.measures.held import Held, Stretch, element, no_number, stretches
from studies.measures.reference import Reference

Statistic: TypeAlias = Literal[
    "first",
    "last",
    "minimum",
    "maximum",
    "mean",
    "rms",
    "integral",
    "time-of-minimum",
    "time-of-maximum",
    "time-of-first",
    "duration",
    "rms-error",
    "maximum-error",
]

_CONDITIONED: Final = ("time-of-first", "duration")
_COMPARED: Final = ("rms-error", "maximum-error")


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalStatistic(Measure):
    """One number of a recorded signal: its mean, when it is largest, how far it is from a file.

    Values hold from their communication point to the next one of the component, as they do for
    everybody who reads them: means, integrals and durations are exact for that. Times are of the
    simulation. Errors are those at the communication points of the signal, each counted once.
    """

    signal: str = parameter(doc="`component.connector`, or an element, `component.connector[2]`")
    statistic: Statistic = parameter("last", doc="which number of it")
    condition: str | None = parameter(
        None, doc="`> 3`, `<= 30 km/h`, `== true`: of `time-of-first` and `duration`"
    )
    reference: Path | None = parameter(
        None, doc="a table with a column `time`, `.csv` or `.parquet`: of errors"
    )
    column: str | None = parameter(
        None, doc="of the reference; without it, that with the name of the signal"
    )
    interpolation: Literal["linear", "hold"] = parameter(
        "linear", doc="between rows of the reference: a straight line, or the earlier row"
    )
    begin: float | None = parameter(None, unit="s", doc="what is before does not count")
    end: float | None = parameter(None, unit="s", doc="what is later does not count")

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        for name, needing in (("condition", _CONDITIONED), ("reference", _COMPARED)):
            is_needed = self.statistic in needing
            if is_needed and getattr(self, name) is None:
                yield ParameterProblem((), f"`{self.statistic}` needs a `{name}`", at_key=True)
            if not is_needed and getattr(self, name) is not None:
                what = f"only {' and '.join(f'`{each}`' for each in needing)} have a {name}"
                yield ParameterProblem((name,), what, at_key=True)
        if self.reference is None and self.column is not None:
            yield ParameterProblem(("column",), "there is no `reference`", at_key=True)
        if self.begin is not None and self.end is not None and self.end <= self.begin:
            yield ParameterProblem(("end",), "must be after `begin`")
        if self.condition is not None:
            try:
                Condition.parse(self.condition)
            except ValueError as error:
                yield ParameterProblem(("condition",), str(error))

    @override
    def signals(self) -> Sequence[str]:
        return (self.signal,)

    @override
    def check(self, planned: Planned) -> Iterator[ParameterProblem | Problem]:
        try:
            name, elements = element(self.signal, planned.signals)
        except ValueError as error:
            yield ParameterProblem(("signal",), str(error))
            return
        connector = planned.signals[name]
        if what := no_number(connector.kind(), elements):
            yield ParameterProblem(("signal",), f"`{self.signal}` {what}")
        if self.condition is not None:
            try:
                Condition.parse(self.condition).limit(_known(connector.unit))
            except ValueError as error:
                yield ParameterProblem(("condition",), str(error))
        begin, end = self._span(planned.start, planned.stop)
        if begin > end:
            yield ParameterProblem(("begin",), "is after the end of the run")
        elif self.reference is not None:
            reference = self._reference(self.reference, connector.unit)
            if isinstance(reference, Reference):
                yield from reference.missing(begin, end)
            else:
                yield from reference

    @override
    def compute(self, recording: Recording) -> Findings:
        held = Held.of(recording, self.signal)
        begin, end = (None if t is None else round(t * 1e9) for t in (self.begin, self.end))
        parts = stretches(held, begin, end)
        if self.reference is not None:
            return {"value": self._error(held, parts, self.reference), "unit": held.unit}
        condition = None if self.condition is None else Condition.parse(self.condition)
        summary = Summary(condition, _known(held.unit))
        for part in parts:
            summary.add(part)
        value, unit = summary.value(self.statistic), _unit_of(self.statistic, held.unit)
        return {"value": value, "unit": unit}

    def _span(self, start: Time, stop: Time) -> tuple[Time, Time]:
        begin = start if self.begin is None else max(start, round(self.begin * 1e9))
        return begin, stop if self.end is None else min(stop, round(self.end * 1e9))

    def _reference(self, path: Path, unit: str) -> "Reference | tuple[Problem, ...]":
        return Reference.read(path, self.column or self.signal, unit)

    def _error(self, held: Held, parts: Iterator[Stretch], path: Path) -> float | None:
        reference = self._reference(path, held.unit)
        if not isinstance(reference, Reference):
            raise ValueError("\n".join(map(str, reference)))  # noqa: TRY004 - what a file says
        squares, count, largest = 0.0, 0, 0.0
        for part in parts:
            wrong = list(reference.missing(int(part.times[0]), int(part.times[-1])))
            if wrong:
                raise ValueError("\n".join(map(str, wrong)))
            is_linear = self.interpolation == "linear"
            apart = np.abs(part.values - reference.at(part.times, is_linear=is_linear))
            squares += float(np.square(apart).sum())
            count += len(apart)
            largest = max(largest, float(apart.max()))
        if not count:
            return None
        return largest if self.statistic == "maximum-error" else math.sqrt(squares / count)


@dataclass(slots=True)
class Summary:
    """What is known of the values of a number, stretch by stretch.

    Args:
        condition: whose time is asked for.
        unit: of the values, if we know it.
    """

    condition: Condition | None
    unit: Unit | None
    found: dict[str, float] = field(default_factory=dict)

    def add(self, part: Stretch) -> None:
        """Take further values into account."""
        values, found = part.values, self.found
        if not found:
            found |= {"first": float(values[0]), "span": 0.0, "integral": 0.0, "squares": 0.0}
            found |= {"minimum": math.inf, "maximum": -math.inf, "duration": 0.0}
        found["last"] = float(values[-1])
        for name, k in (("minimum", int(values.argmin())), ("maximum", int(values.argmax()))):
            is_beyond = values[k] < found[name] if name == "minimum" else values[k] > found[name]
            if is_beyond:
                found[name], found[f"time-of-{name}"] = float(values[k]), part.times[k] / 1e9
        found["span"] += float(part.durations.sum())
        found["integral"] += float((values * part.durations).sum())
        found["squares"] += float((values * values * part.durations).sum())
        if self.condition is not None:
            holds = self.condition.holds(values, self.unit)
            found["duration"] += float(part.durations[holds].sum())
            if holds.any() and "time-of-first" not in found:
                found["time-of-first"] = float(part.times[int(holds.argmax())] / 1e9)

    def value(self, statistic: str) -> float | None:
        """One number of all values; `None` if there is none."""
        found = self.found
        if not found:
            return None
        if statistic not in _MEANS:
            value = found.get(statistic)
            return None if value is None else float(value)
        if found["span"] == 0.0:  # a single value, which held for no time
            return abs(found["last"]) if statistic == "rms" else found["last"]
        return _MEANS[statistic](found)


_MEANS: Final[Mapping[str, Callable[[Mapping[str, float]], float]]] = MappingProxyType(
    {
        "mean": lambda found: found["integral"] / found["span"],
        "rms": lambda found: math.sqrt(found["squares"] / found["span"]),
    }
)


def _unit_of(statistic: str, unit: str) -> str:
    """The unit of a number of a signal in `unit`."""
    if statistic.startswith("time-of-") or statistic == "duration":
        return "s"
    if statistic != "integral":
        return unit
    if unit == "1":
        return "s"
    numerator, slash, denominator = unit.partition("/")
    return f"{numerator}.s{slash}{denominator}"


def _known(unit: str) -> Unit | None:
    try:
        return parse_unit(unit)
    except UnitError:
        return None
