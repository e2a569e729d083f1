"""The plan of a run: which of its components the engine steps, and with which calls.

The engine takes part where only FMUs of this process are due whose signals have fixed sizes. At all
other communication points the algorithm works through Python, as it does without a plan; values are
handed over where one follows the other.
"""

import ctypes
import weakref
from collections.abc import Callable, Collection, Iterable, Mapping
from time import perf_counter_ns
from typing import Any, Final

import numpy as np

from orchestrator.algorithm.base import Pattern
from orchestrator.algorithm.exchange import Exchange
from orchestrator.algorithm.jacobi import is_renewed
from orchestrator.algorithm.requests import Asking
from orchestrator.capabilities import PortableState
from orchestrator.last_call import LastCall
from orchestrator.native import NativeUnit
from orchestrator.plan import layouts
from orchestrator.plan.linked_unit import unit_plan
from orchestrator.plan.mixes import can_mix, can_remember
from orchestrator.plan.outside import fixed_shape
from orchestrator.plan.points import is_countable
from orchestrator.plan.sources import Sources
from orchestrator.signal import Array, Causality, Variability
from orchestrator.stretch import Stretch
from orchestrator.system import Endpoint, System
from orchestrator.timebase import StepSize, Time

FEWEST_POINTS: Final = 4
"""Shorter stretches are not worth handing values over."""

_MOST_POINTS: Final = 1 << 16
_MOST_BYTES: Final = 8 << 20
"""That a stretch records, except where one point does."""

_SPAN_NS: Final = 10_000_000
"""Wall time of a call of the engine, about: a request to stop is heard between two."""

_MOST_GROWTH: Final = 64
_LEAST_GROWTH: Final = 1.25
"""How many times more points a call may have than the one before, if it has more."""

_MOST_GIVEN: Final = 4
"""Memories of stretches that observers may have at a time."""

_STRETCH_NS: Final = 40_000_000
"""Wall time after which observers are shown what was published, where calls follow each other."""


def plan_of(
    system: System,
    exchange: Exchange,
    order: Iterable[str],
    pattern: Pattern | None,
    *,
    recorded: Iterable[Endpoint],
    start: Time,
    until: Endpoint | None,
    last_call: LastCall,
    are_kept: bool = False,
) -> "RunPlan | None":
    """The plan of a run whose components are initialised; `None` where there is nothing to gain.

    Args:
        system: the components.
        exchange: their participants.
        order: names of the components, in the order of their turns.
        pattern: of the algorithm.
        recorded: outputs that observers want every value of.
        start: of the run [ns].
        until: the output that ends the run.
        last_call: where the engine notes what it calls.
        are_kept: whether checkpoints are written.
    """
    library = layouts.engine()
    if library is None or pattern is None:
        return None
    units = {
        name: unit
        for name in order
        if (unit := exchange.participants[name].native()) is not None
        and _may_change(system, name)
        and is_countable(exchange.participants[name].grid)
        and not (pattern is Pattern.PARALLEL and is_renewed(system, exchange, name))
        and (unit.link is None or not are_kept or _is_portable(system, name))
    }
    while unsuited := [name for name in units if not _suits(system, name, units)]:
        for name in unsuited:
            del units[name]
    if not units:
        return None
    return RunPlan(
        system,
        exchange,
        units,
        pattern,
        recorded=frozenset(recorded),
        start=start,
        until=until,
        library=library,
        last_call=last_call,
    )


def _may_change(system: System, name: str) -> bool:
    """Whether all outputs may change their values; that others do not is checked in Python."""
    return not any(
        c.causality is Causality.OUTPUT and c.variability is Variability.FIXED
        for c in system.connectors[name].values()
    )


def _is_portable(system: System, name: str) -> bool:
    """Whether its state can be saved: the steps of others are written down for checkpoints."""
    return system.components[name].capability(PortableState) is not None  # type: ignore[type-abstract]


def _suits(system: System, name: str, units: Mapping[str, NativeUnit]) -> bool:
    """Whether the engine can make what it reads, and keep what others ask of its past."""

    def shape_of(component: str, output: str) -> tuple[int, ...]:
        if component in units:
            return units[component].variables[output].shape
        return fixed_shape(system.connectors[component][output])

    inputs = units[name].variables
    return (
        _has_fixed_sources(system, name, units)
        and all(can_mix(system, inputs[m.input].shape, m, shape_of) for m in system.mixes[name])
        and can_remember(system, name, shape_of)
    )


def _has_fixed_sources(system: System, name: str, units: Collection[str]) -> bool:
    """Whether what it reads keeps its sizes: of other units, or without named axes."""
    ends = [(feed.component, feed.output) for feed in system.feeds[name]]
    ends += [(term.component, term.output) for mix in system.mixes[name] for term in mix.terms]
    return all(
        component in units
        or all(isinstance(n, int) for n in system.connectors[component][output].shape)
        for component, output in ends
    )


class RunPlan:
    """The units of one run in the memory of the engine.

    Between two stretches Python steps them, too; what changed meanwhile is brought over when the
    next stretch begins.
    """

    def __init__(
        self,
        system: System,
        exchange: Exchange,
        natives: Mapping[str, NativeUnit],
        pattern: Pattern,
        *,
        recorded: frozenset[Endpoint],
        start: Time,
        until: Endpoint | None,
        library: Any,
        last_call: LastCall,
    ) -> None:
        self._library = library
        self._last_call = last_call
        self._values = exchange.values
        grids = {name: each.grid for name, each in exchange.participants.items()}
        self._others = {grid for name, grid in grids.items() if name not in natives}
        self._smallest = min(grids[name].step_size for name in natives)
        self._table = (layouts.Unit * len(natives))()
        self._units = {
            name: unit_plan(
                participant=exchange.participants[name],
                unit=unit,
                connectors=system.connectors[name],
                feeds=system.feeds[name],
                recorded=[end.connector for end in recorded if end.component == name],
                table=self._table[k],
                is_parallel=pattern is Pattern.PARALLEL,
                library=library,
            )
            for k, (name, unit) in enumerate(natives.items())
        }
        for name, each in self._units.items():
            each.remember(exchange.sources.histories_of(name))
        self._sources = Sources(system, self._units, exchange.sources, library)
        names = list(self._units)
        for each in self._units.values():
            each.connect(self._sources)
            each.take_turns(names)
        self._mixing = exchange.sources
        has_links = any(unit.link is not None for unit in natives.values())
        self._most = 4 if has_links else 64  # a step in another process may take long
        self._failure: BaseException | None = None
        self._ended: Asking | None = None
        # the engine has there which unit it calls, and from when
        self._plan = last_call.place(layouts.Plan)
        last_call.compiled(
            list(natives), layouts.Plan.failed.offset, layouts.Plan.failed_from.offset
        )
        self._plan.unit, self._plan.units = self._table, len(natives)
        self._plan.has_links = has_links
        self._plan.is_parallel, self._plan.start = pattern is Pattern.PARALLEL, start
        if until is not None and until.component in natives:
            self._plan.until = self._sources.of(until.component, until.connector)
        recorded_bytes = sum(each.recorded_bytes for each in self._units.values())
        self._limit = min(_MOST_POINTS, max(1, _MOST_BYTES // recorded_bytes))
        self._memory: Array | None = None
        self._given: list[weakref.ref[Array]] = []

    @property
    def names(self) -> frozenset[str]:
        """The components that the engine steps."""
        return frozenset(self._units)

    def horizon(self, t: Time, stop: Time) -> Time | None:
        """The last point that the engine may reach from `t`; `None` if it is not worth it."""
        end = min([stop, *(grid.after(t) - 1 for grid in self._others)])
        return end if end - t >= FEWEST_POINTS * self._smallest else None

    def run(self, t: Time, end: Time, look_up: Callable[[], None]) -> Stretch:
        """Work through the points behind `t`, up to `end` at most.

        Steps that start at `t` have not been begun; those that start at the last point are not,
        either. The stretch ends early after some ten milliseconds, where an output ends the run,
        and where a component failed, or what looks up did, see `check`.

        Args:
            t: where all are [ns].
            end: no point lies beyond [ns].
            look_up: called every few milliseconds; it may raise what ends the run.
        """
        if self._memory is None:
            self._memory = self._reserved()
        self._sources.renew(self._values)
        for unit in self._units.values():
            unit.enter(t, self._values)
        plan = self._plan
        plan.now, plan.end, plan.points, plan.is_departed = t, end, 0, False
        outcome, spent = self._work(look_up)
        sampled = sum(each.spent for each in self._table)
        for unit in self._units.values():
            unit.show(plan.now, min(1.0, spent / sampled) if sampled else 0.0)
        for unit in self._units.values():
            unit.leave(plan.now, self._values)
        self._mixing.now = plan.now
        if outcome == layouts.RUN_ENDED:
            self._ended = list(self._units.values())[plan.failed].participant.asking
        elif outcome not in {layouts.ALL_DONE, layouts.HAS_PAUSED, layouts.RUN_ENDS}:
            failed = list(self._units.values())[plan.failed]
            self._failure = failed.fail(outcome, plan.call, plan.status, plan.failed_from)
        are_kept = self._gives_away(plan.points)
        times: dict[StepSize, Array] = {}  # the same of units with the same step
        samples = {}
        for name, unit in self._units.items():
            if unit.rows:
                if unit.step_size not in times:
                    times[unit.step_size] = unit.times(t)
                samples[name] = unit.samples(times[unit.step_size], are_kept=are_kept)
        return Stretch(plan.now, plan.points, samples, self._values)

    def _work(self, look_up: Callable[[], None]) -> tuple[int, int]:
        """Call the engine until the stretch ends; its last outcome, and its wall time [ns]."""
        plan, spent = self._plan, 0
        while True:
            first = plan.points
            plan.most = min(first + self._most, self._limit)
            self._last_call.engine(plan.now)
            before = perf_counter_ns()
            outcome = self._library.plan_run(ctypes.byref(plan))
            last = perf_counter_ns() - before
            self._last_call.nobody()
            spent += last
            self._adapt(last, plan.points - first)
            if outcome != layouts.HAS_PAUSED or plan.points == self._limit or spent > _STRETCH_NS:
                return outcome, spent
            try:
                look_up()
            except BaseException as error:  # once observers have seen what there is
                self._failure = error
                return outcome, spent

    def check(self) -> None:
        """Raise what ended the last stretch early.

        Raises:
            ComponentError: a component failed, or broke its contract.
            EndedWithinStep: a component asks for the end of the run, within a step.
            BaseException: what `look_up` raised.
        """
        if self._ended is not None:
            self._ended.check()
        if self._failure is not None:
            raise self._failure

    def release(self) -> None:
        """Free what the engine allocated; the components go on without it."""
        for unit in self._units.values():
            unit.release()
        self._sources.release()

    def _reserved(self) -> Array:
        """New memory for the samples of a stretch, shape (byte,)."""
        sizes = [unit.room(self._limit) for unit in self._units.values()]
        memory: Array = np.empty(sum(sizes), np.uint8)
        at, view = memory.ctypes.data, memory.data
        for unit, size in zip(self._units.values(), sizes, strict=True):
            unit.reserve(self._limit, at, view[:size])
            at, view = at + size, view[size:]
        return memory

    def _gives_away(self, points: int) -> bool:
        """Whether observers may keep the memory of a stretch: what is in it need not be copied.

        Not if most of it is empty, or it is so large as only a point with large outputs makes it.
        """
        memory = self._memory
        self._given = [each for each in self._given if each() is not None]
        if (
            memory is None
            or 2 * points < self._limit
            or memory.nbytes > 2 * _MOST_BYTES
            or len(self._given) == _MOST_GIVEN
        ):
            return False
        self._given.append(weakref.ref(memory))
        self._memory = None
        return True

    def _adapt(self, spent: int, points: int) -> None:
        """Let the next call take about `_SPAN_NS`."""
        growth = min(_SPAN_NS / max(spent, 1), _MOST_GROWTH)
        if points == self._most and growth > _LEAST_GROWTH:
            self._most = min(int(growth * self._most), self._limit)
        elif spent > 2 * _SPAN_NS:
            self._most = max(1, self._most // 2)
