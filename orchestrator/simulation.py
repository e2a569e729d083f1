"""The simulation loop."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from time import perf_counter_ns

from typing_extensions import TypeVarTuple

from orchestrator.algorithm.base import (
    CosimulationAlgorithm,
    Stepping,
    check_published,
    turns_of,
)
from orchestrator.algorithm.exchange import Due, Exchange, Schedule
from orchestrator.algorithm.looked_at import looked_at
from orchestrator.algorithm.requests import EndedWithinStep
from orchestrator.algorithm.start import initialise
from orchestrator.branching import Branching
from orchestrator.checkpoints import NO_CHECKPOINTS, Checkpoints, Spent, Standing
from orchestrator.early_end import EarlyEnd
from orchestrator.ending import Ending, ending
from orchestrator.errors import in_words
from orchestrator.last_call import NOWHERE, LastCall
from orchestrator.observer import Observer, SimulationResult, WallTime
from orchestrator.plan.plan import RunPlan, plan_of
from orchestrator.signal import Signals
from orchestrator.stretch import Stretch
from orchestrator.system import Endpoint, System
from orchestrator.timebase import Time, seconds

Values = TypeVarTuple("Values")


def simulate(
    system: System,
    algorithm: CosimulationAlgorithm,
    *,
    start: Time,
    stop: Time,
    seed: int,
    observers: Sequence[Observer] = (),
    until: Endpoint | None = None,
    compiled: bool = True,
    last_call: LastCall = NOWHERE,
    checkpoints: Checkpoints = NO_CHECKPOINTS,
) -> SimulationResult:
    """Simulate `system` from `start` to `stop`, or until an output is true or a component asks.

    A component that asks for the end (`EndRequesting`) ends the run where its request is published.
    One that did not come to the end of its step ends it at the last communication point before.

    Whatever happens, every component is closed, then every observer that began is ended. An
    error raised meanwhile does not hide an earlier one; it becomes a note on it. Observers see
    nothing of the branches in which a `DecidingComponent` tries its alternatives.

    Args:
        system: the components and their connections.
        algorithm: who steps when, and which values it sees.
        start: the first communication point [ns].
        stop: the last one [ns], unless `until` is true before.
        seed: the origin of every component's random stream.
        observers: called at every communication point, in this order.
        until: a scalar Boolean output. The first communication point, of whatever component, at
            which its published value is true is the last one; `start` may be that.
        compiled: let compiled code step FMUs where nothing else is due, see `orchestrator.plan`;
            the result is the same.
        last_call: where calls of components are noted.
        checkpoints: from which the run goes on, and which it writes. Observers that did not see
            what was before do not see it now.

    Raises:
        SystemStructureError: step sizes do not fit the interval, or the algorithm the system, or
            decisions are to be tried and the system cannot be copied, or `until` is no such output.
        ComponentError: a component failed or broke its contract; it says which, and when.
    """
    early = ending(system.components, until)
    branching = Branching(system, stop, seed)
    exchange = Exchange(system, branching, last_call)
    turns, solved = turns_of(algorithm, system), algorithm.solved(system)
    schedule = Schedule(exchange, turns, start, stop, solved)
    stepping = algorithm.of_run(system, exchange)
    run, audience = _Run(exchange, start, stepping), _Audience(observers, last_call)
    plan: RunPlan | None = None
    with run.guarded("simulating"), branching.confined():
        audience.begin(system, start, stop)
        exchange.set_up(start, stop, seed)
        initialise(system, exchange, start, solved)
        wanted = audience.wants(system)
        if wanted is not None and algorithm.pattern is not None:
            exchange.select(looked_at(system, wanted, until))
        if compiled and wanted is not None and not branching.has_decisions:
            plan = plan_of(
                system,
                exchange,
                turns,
                algorithm.pattern,
                recorded=wanted,
                start=start,
                until=until,
                last_call=last_call,
                are_kept=checkpoints.are_wanted,
            )
        standing = Standing(
            system=system,
            exchange=exchange,
            stepping=stepping,
            compiled=plan.names if plan else frozenset(),
            start=start,
            stop=stop,
            look_up=audience.look_up,
        )
        t, is_last = checkpoints.begin(standing), False
        begun = run.go_on(t, checkpoints.spent, audience)
        while True:
            due = schedule.at(t)
            exchange.sources.now = t
            reach = stepping.arrive if t == stop or checkpoints.is_due(t) else stepping.pass_by
            if t != begun and not run.arrives(reach, t, due):
                branching.arrive(run.time, is_last=True)
                break
            run.time = t
            is_last = t == stop or run.ends_early(early)
            branching.arrive(t, is_last=is_last)
            is_kept = not is_last and t != begun and checkpoints.is_due(t)
            if not (is_last or is_kept):
                stepping.look_ahead(t, due)
            if branching.is_trunk and (t != begun or t == start):
                audience.observe(t, due.names, exchange.values)
            if is_kept:
                checkpoints.keep(t, run.spent(audience))
                stepping.look_ahead(t, due)
            if plan and not is_last:
                t, is_last = run.stretches(
                    plan,
                    t,
                    stop,
                    early=early,
                    schedule=schedule,
                    audience=audience,
                    checkpoints=checkpoints,
                )
                due = schedule.at(t)
            if is_last:
                break
            stepping.depart(t, due)
            t = schedule.after(t)
        exchange.settle(t)
    run.close(audience, plan)
    if run.error is not None:
        raise run.error
    return run.result(audience.wall_time_ns)


class _Audience:
    """The observers, and the time they take."""

    def __init__(self, observers: Sequence[Observer], last_call: LastCall) -> None:
        self._last_call = last_call
        self.begun: list[Observer] = []
        self.wall_time_ns = 0
        self._observers = tuple(observers)

    def begin(self, system: System, start: Time, stop: Time) -> None:
        with self.timed():
            for observer in self._observers:
                self.begun.append(observer)
                observer.begin(system, start, stop)

    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self._last_call.nobody()
        before = perf_counter_ns()
        for observer in self._observers:
            observer.observe(t, published, values)
        self.wall_time_ns += perf_counter_ns() - before

    def wants(self, system: System) -> frozenset[Endpoint] | None:
        """The outputs of which they want every value; `None` if one of them sees no stretches."""
        if not all(observer.sees_stretches for observer in self._observers):
            return None
        return frozenset(end for observer in self._observers for end in observer.wants(system))

    def look_up(self) -> None:
        """Let them end the run while they observe nothing."""
        for observer in self._observers:
            observer.look_up()

    def observe_stretch(self, stretch: Stretch) -> None:
        """Show them what was published over a stretch, if there was anything."""
        if stretch.count:
            with self.timed():
                for observer in self._observers:
                    observer.observe_stretch(stretch)

    @contextmanager
    def timed(self) -> Iterator[None]:
        self._last_call.nobody()
        before = perf_counter_ns()
        try:
            yield
        finally:
            self.wall_time_ns += perf_counter_ns() - before


class _Run:
    """How far a run came, what went wrong, and where the time went."""

    def __init__(self, exchange: Exchange, start: Time, stepping: Stepping) -> None:
        self.time = start
        self.error: BaseException | None = None
        self._early_end: EarlyEnd | None = None
        self._exchange = exchange
        self._stepping = stepping
        self._start = start
        self._began_at_ns = perf_counter_ns()

    @contextmanager
    def guarded(self, doing: str) -> Iterator[None]:
        """Keep the first error; note later ones on it."""
        try:
            yield
        except BaseException as error:
            if self.error is None:
                self.error = error
            else:
                self.error.add_note(f"then, while {doing}, {in_words(error)}")

    def spent(self, audience: _Audience) -> Spent:
        """The wall time until now."""
        return Spent(
            run_ns=perf_counter_ns() - self._began_at_ns, observers_ns=audience.wall_time_ns
        )

    def go_on(self, t: Time, spent: Spent, audience: _Audience) -> Time:
        """Begin at `t` [ns], and count the wall time of the run that this one goes on with."""
        self.time = t
        self._began_at_ns -= spent.run_ns
        audience.wall_time_ns += spent.observers_ns
        return t

    def close(self, audience: _Audience, plan: RunPlan | None) -> None:
        """Close all participants, then end all observers."""
        if plan:
            plan.release()
        for name, participant in self._exchange.participants.items():
            with self.guarded(f"closing `{name}`"):
                participant.close()
        for observer in audience.begun:
            with self.guarded(f"ending {type(observer).__name__}"), audience.timed():
                observer.end(self.result(audience.wall_time_ns))

    def completes(self, steps: Callable[[*Values], None], *of: *Values) -> bool:
        """Complete `steps`; `False` if a component ends the run within one of them."""
        try:
            steps(*of)
        except EndedWithinStep as end:
            self._early_end = EarlyEnd.within_step(end.component, end.request, self.time)
            return False
        return True

    def arrives(self, steps: Callable[[Time, Due], None], t: Time, due: Due) -> bool:
        """Complete the steps that end at `t`, of all who are due there; `False` as `completes`."""
        if not self.completes(steps, t, due):
            return False
        check_published(self._stepping, t, due)
        return True

    def stretches(
        self,
        plan: RunPlan,
        t: Time,
        stop: Time,
        *,
        early: Ending,
        schedule: Schedule,
        audience: _Audience,
        checkpoints: Checkpoints,
    ) -> tuple[Time, bool]:
        """Let the engine work from `t` on, while it can; where it came, and whether that is all."""
        is_last = False
        while not is_last:
            end = plan.horizon(t, checkpoints.limit(t, stop))
            if end is None:
                break
            self._stepping.depart(t, schedule.at(t, but=plan.names))
            stretch = plan.run(t, end, audience.look_up)
            self.time = t = stretch.time
            audience.observe_stretch(stretch)
            is_last = not self.completes(plan.check) or t == stop or self.ends_early(early)
            if not is_last and checkpoints.is_due(t):
                checkpoints.keep(t, self.spent(audience))
        return t, is_last

    def ends_early(self, early: Ending) -> bool:
        """Whether the run ends at the point that it has reached, whatever its stop time."""
        if early.is_reached(self._exchange.values):
            self._early_end = early.early_end(self.time)
            return True
        requests = self._exchange.requests.published
        if requests:
            self._early_end = EarlyEnd.behind_steps(requests)
        return bool(requests)

    def result(self, observers_ns: int) -> SimulationResult:
        total = seconds(perf_counter_ns() - self._began_at_ns)
        participants = self._exchange.participants
        components = {name: seconds(p.wall_time_ns) for name, p in participants.items()}
        observers = seconds(observers_ns)
        return SimulationResult(
            start=self._start,
            time=self.time,
            values={name: dict(values) for name, values in self._exchange.values.items()},
            wall_time=WallTime(
                components=components,
                observers=observers,
                orchestrator=total - observers - sum(components.values()),
            ),
            error=self.error,
            early_end=self._early_end if self.error is None else None,
            coupling=dict(self._stepping.tally()),
        )
