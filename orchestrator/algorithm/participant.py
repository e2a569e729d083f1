"""One component taking part in a co-simulation: its inputs, its step, its published outputs."""

import abc
from collections.abc import Collection, Mapping, Sequence
from time import perf_counter_ns
from typing import Any, ClassVar, Final, TypeAlias

import numpy as np

from orchestrator.algorithm.history import History, InputCourses
from orchestrator.algorithm.inputs import Inputs
from orchestrator.algorithm.journal import Journal
from orchestrator.algorithm.looked_at import LookedAt
from orchestrator.algorithm.mixing import PastValues
from orchestrator.algorithm.pieces import Piece, Pieces
from orchestrator.algorithm.requests import Asking
from orchestrator.algorithm.slopes import KnownSlopes
from orchestrator.capabilities import InitialEvaluation, PointEvaluation
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import ComponentError, CosimError, defects, in_words
from orchestrator.last_call import NOWHERE, Call
from orchestrator.native import NativeUnit
from orchestrator.raised_at import raised_at
from orchestrator.signal import Connector, Signal, Signals
from orchestrator.timebase import CommunicationGrid, Duration, StepSize, Time


class Participant(abc.ABC):
    """A component together with its place in the exchange of signals.

    A step takes three calls, so that an algorithm decides when each happens: `begin` reads
    the inputs and starts the step, `finish` waits for its end and checks the outputs, `publish`
    makes them visible to others. If its component is restorable, the participant can `save` before
    a step, and `restore` to take it again; what others see stays as it is until `publish`.

    Attributes:
        name: of the component in its system.
        asking: whether it asks for the end of the run.
        step_size: communication step size [ns].
        is_concurrent: whether the step runs elsewhere between `begin` and `finish`.
        notes: where calls of the component are noted.
        is_begun: whether a step has been begun that has not been waited for yet.
        inputs: what it reads, and from whom.
        journal: where its steps are written down; `None`: nowhere.
        published: the outputs that others may see now; updated in place by `publish`.
        wall_time_ns: time spent in calls of the component so far [ns].
    """

    __slots__ = ("_component", "_evaluation", "_followed", "_grid", "_history", "_looked_at",
                 "_past", "_pending", "_pieces", "_reached", "_shown", "_sloped", "_used", "asking",
                 "inputs", "is_begun", "journal", "name", "notes", "published", "step_size",
                 "wall_time_ns")  # fmt: skip

    is_concurrent: ClassVar[bool]

    def __init__(
        self,
        name: str,
        component: Component,
        connectors: Mapping[str, Connector],
        step_size: StepSize,
    ) -> None:
        self.name: Final = name
        self.asking: Final = Asking(name, component)
        self.step_size: Final = step_size
        self.published: Final[dict[str, Signal]] = {}
        self.is_begun, self.wall_time_ns = False, 0
        self.notes = NOWHERE.notes_of(0)
        self._component = component
        self._evaluation = component.capability(InitialEvaluation)  # type: ignore[type-abstract]
        self._sloped = KnownSlopes(component, connectors)
        self._looked_at = LookedAt(component, connectors)
        self.inputs: Final = Inputs(connectors)
        self._past: tuple[PastValues, ...] = ()
        self._pending: Signals = {}
        self._followed: frozenset[str] = frozenset()
        self._used: Signals = {}
        self._reached: Time = 0
        self._shown: Time | None = None
        self._grid = CommunicationGrid(0, step_size, 0)
        self._history: History | None = None
        self._pieces: Pieces | None = None
        self.journal: Journal | None = None

    def take_turns(self, leaders: "Participants", followers: "Participants") -> None:
        """Know who of those that it reads publishes before its turn, and who behind it."""

    def note_in(self, past: tuple[PastValues, ...]) -> None:
        """Note what is published in `past`, from now on."""
        self._past = past

    def remember(self) -> History:
        """Keep what is published from now on; where it is kept."""
        if self._history is None:
            self._history = History()
        return self._history

    def approximate(self, courses: InputCourses) -> None:
        """Let inputs run as these polynomials over every step from now on."""
        self._pieces = Pieces(self._component, courses)

    def set_up(self, start: Time, stop: Time, rng: np.random.Generator) -> None:
        """Enter the initial state at `start`, of a run that ends at `stop` at the latest."""
        before = self.notes.call(Call.SET_UP, start)
        try:
            self._grid = CommunicationGrid.over(start, stop, self.step_size)
            self._component.expect(self._grid)
            self._component.setup(start, rng)
            self._reached = start
        except defects() as error:
            raise self.failure(start, error) from error
        self.wall_time_ns += perf_counter_ns() - before

    def initialise(self, start: Time) -> None:
        """Compute and publish the outputs at `start` from the inputs known so far."""
        before = self.notes.call(Call.INITIALISE, start)
        try:
            inputs = self.inputs.known()
            self._component.initialise(inputs)
            outputs = self._component.outputs()
            self.wall_time_ns += perf_counter_ns() - before
            self.accept(outputs, start)
            self.asking.is_within(start)
        except defects() as error:
            raise self.failure(start, error) from error
        self._used, self._reached, self._followed = inputs, start, frozenset()
        self.publish()

    def select(self, names: Collection[str]) -> None:
        """Publish only these of the outputs from now on, between two steps, if that can be."""
        kept = self._looked_at.narrow(names)
        self._pending = {name: self._pending[name] for name in self._pending if name in kept}
        for name in self.published.keys() - kept:
            del self.published[name]

    def complete(self, t: Time) -> None:
        """Show also what was not selected, unless a step was begun that ends behind `t` [ns]."""
        if self._reached <= t:
            self.published.update(self._looked_at.rest())

    @property
    def can_be_tried(self) -> bool:
        """Whether `try_out` can be called before `initialise`."""
        return self._evaluation is not None

    def try_out(self, start: Time) -> None:
        """Publish what the outputs at `start` would be with the inputs known so far.

        Called before `initialise`, any number of times, if `can_be_tried`.
        """
        evaluation = self._evaluation
        before = self.notes.call(Call.INITIALISE, start)
        try:
            inputs = self.inputs.known()
            outputs = self._pending if evaluation is None else evaluation.evaluate(inputs)
            self.wall_time_ns += perf_counter_ns() - before
            self.accept(outputs, start)
        except defects() as error:
            raise self.failure(start, error) from error
        self.published.update(self._pending)

    @property
    def can_refresh(self) -> bool:
        """Whether `refresh` can be called between two steps."""
        return self._component.capability(PointEvaluation) is not None  # type: ignore[type-abstract]

    def refresh(self, t: Time) -> None:
        """Publish the outputs at `t` anew, for the inputs that are published now.

        Called at the end of a step, if `can_refresh`. Where no input has another value than the
        step had, there is nothing to do.
        """
        try:
            inputs = self.inputs.now()
        except defects() as error:
            raise self.failure(t, error) from error
        if all(inputs[name] is self._used.get(name) for name in self.inputs.driven):
            return
        evaluation = self._component.capability(PointEvaluation)  # type: ignore[type-abstract]
        before = self.notes.call(Call.STEP, t)
        try:
            outputs = self._pending if evaluation is None else evaluation.evaluate(inputs)
            self.wall_time_ns += perf_counter_ns() - before
            self.accept(outputs, t)
        except defects() as error:
            raise self.failure(t, error) from error
        self._used = inputs
        self.publish()

    @property
    def grid(self) -> CommunicationGrid:
        """Its communication points, once it is set up."""
        return self._grid

    def before(self, t: Time) -> Time:
        """Where the communication step starts that ends at `t`."""
        return self._grid.before(t)

    @property
    def sources(self) -> frozenset[str]:
        """The names of the components it reads."""
        return self.inputs.sources

    @property
    def reads(self) -> frozenset[tuple[str, str]]:
        """Component and name of each output that it reads."""
        return self.inputs.reads

    @abc.abstractmethod
    def begin(self, t: Time, h: Duration | None = None) -> None:
        """Start the step from `t` with the inputs that are published now.

        Args:
            t: where it starts [ns].
            h: its length [ns]; without, the communication step size.
        """

    @abc.abstractmethod
    def begin_early(self, t: Time) -> None:
        """Start the step from `t` before its turn comes, unless it is begun; it sees all.

        What goes wrong is raised by `finish`, in its turn.
        """

    @abc.abstractmethod
    def begin_ahead(self, t: Time) -> None:
        """Start the step from `t` before its turn comes, if it works elsewhere and sees all.

        One that is begun goes on.
        What it sees does not depend on when it steps. If the run ends before its step does, what
        comes of the step is ignored, an error too, also one of beginning it, which `finish` raises.
        """

    @abc.abstractmethod
    def foresee(self, now: Time) -> None:
        """Hear of the step that was begun, if it is done; else begin one of which all is known.

        Where each of those that publish what it reads has published it at `now`, or has made the
        step that it is going to publish, the step to the next communication point is begun as by
        `begin_ahead`.

        Args:
            now: where all have published that were due [ns].
        """

    def foreseen(self, now: Time, end: Time) -> Signals | None:
        """What it will have published last at `end`, of which it has not published all at `now`.

        Nothing, if it publishes nothing between `now` and `end`, `end` included; `None`, if that is
        not known.

        Args:
            now: where all have published that were due [ns].
            end: not before `now` [ns].
        """
        return {} if self._grid.after(now) > end else None

    @abc.abstractmethod
    def finish(self) -> None:
        """Wait until the step that was begun is done, and check its outputs.

        Raises `EndedWithinStep`, if it was not made and the run is to end.
        """

    def publish(self) -> None:
        """Show the outputs of the step finished last to others."""
        self.published.update(self._pending)
        self._shown = self._reached
        self.asking.publish()
        for past in self._past:
            past.note()
        if self._history is not None:
            self._history.put(self._reached, self._pending, self._slopes())

    def was_left_behind(self, t: Time) -> str:
        """What an algorithm missed that says that a step of this ended at `t`; empty: nothing."""
        if self._shown == t:
            return ""
        missed = "publish" if self._reached == t else "step"
        return f"did not let `{self.name}` {missed} at t = {t / 1e9:.9g} s"

    def show(self, values: Signals, t: Time | None = None) -> None:
        """Let others see `values` in place of these outputs until the next `publish`.

        Args:
            values: by output.
            t: the time that they are of [ns]; without, that of what was published last.
        """
        self.published.update(values)
        if self._history is not None:
            self._history.put(self._reached if t is None else t, self.published, {})

    @property
    def history(self) -> History | None:
        """What it published lately, if anybody asks for it."""
        return self._history

    @property
    def continuous(self) -> Collection[str]:
        """The connectors whose real signals are continuous functions of time."""
        return self._sloped.continuous

    def _slopes(self) -> Signals:
        before = self.notes.call(Call.STEP, self._reached)
        try:
            found = self._sloped.now(self.inputs.driven - self._followed)
        except defects() as error:
            raise self.failure(self._reached, error) from error
        self.wall_time_ns += perf_counter_ns() - before
        return found

    def save(self, t: Time) -> Any:
        """The state of the component at `t`, between two steps.

        Raises:
            ComponentError: the component failed to, or is not restorable.
        """
        before = self.notes.call(Call.STATE, t)
        try:
            state = self._restorable().save()
        except defects() as error:
            raise self.failure(t, error, "while saving its state: ") from error
        self.wall_time_ns += perf_counter_ns() - before
        return state if self.journal is None else (state, self.journal.mark())

    def restore(self, state: Any, t: Time) -> None:
        """Return the component to `state`, which `save` gave at `t`; raises what that raises."""
        before = self.notes.call(Call.STATE, t)
        try:
            if self.journal is not None:
                state, mark = state
                self.journal.return_to(mark)
            self._restorable().restore(state)
        except defects() as error:
            raise self.failure(t, error, "while restoring its state: ") from error
        self.wall_time_ns += perf_counter_ns() - before

    def _restorable(self) -> RestorableComponent[Any]:
        if isinstance(self._component, RestorableComponent):
            return self._component
        raise ComponentError(self.name, None, "cannot return to an earlier state")

    @abc.abstractmethod
    def settle(self) -> None:
        """Finish a step that was begun, if there is one; its outputs are checked, not shown.

        So a step that fails beyond the end of a run fails wherever the component works.
        """

    def close(self) -> None:
        """Release what the component holds.

        Raises:
            ComponentError: the component failed to.
        """
        self.notes.call(Call.CLOSE, self._reached)
        try:
            self._component.close()
        except defects() as error:
            raise self.failure(None, error, "while closing: ") from error

    def _read(
        self, t: Time, h: Duration | None, unpublished: Mapping[str, Signals] | None = None
    ) -> tuple[Signals, Duration]:
        """The inputs of a step from `t`, and its length [ns]; see `Inputs.foreseen`."""
        length = self._grid.after(t) - t if h is None else h
        inputs = self.inputs.foreseen(unpublished) if unpublished else self.inputs.now()
        self._used, self._reached = inputs, t + length
        return inputs, length

    @property
    def _is_whole(self) -> bool:
        """Whether steps are made as they are read, and written down nowhere."""
        return self._pieces is None and self.journal is None

    def _begun(
        self, t: Time, h: Duration | None, unpublished: Mapping[str, Signals] | None = None
    ) -> tuple[Piece, ...]:
        """What there is to do for a step from `t`."""
        inputs, length = self._read(t, h, unpublished)
        if self._pieces is None:
            return (Piece(inputs, t, length),)
        return self._pieces.of(inputs, t, length)

    def _follow(self, piece: Piece) -> None:
        if self.journal is not None:
            self.journal.note(piece)
        if self._pieces is not None:
            self._followed = self._pieces.follow(piece)

    def _outputs(self) -> Signals:
        """The outputs at the end of the step just made."""
        return self._component.outputs() if self._pieces is None else self._pieces.outputs()

    def native(self) -> NativeUnit | None:
        """How to step it without Python, once it is initialised; `None` if that cannot be."""
        return None

    @property
    def pending(self) -> Signals:
        """The outputs of the step finished last."""
        return self._pending

    def go_on(self, published: Signals, pending: Signals, reached: Time, spent_ns: int) -> None:
        """Go on behind steps that were not made here.

        Args:
            published: the outputs that others see now.
            pending: those of the step finished last.
            reached: where that step ends [ns].
            spent_ns: in calls of the component [ns].
        """
        self.published.update(published)
        self._pending, self._reached, self._shown = pending, reached, reached
        self.wall_time_ns += spent_ns

    def memory(self) -> dict[str, Any]:
        """What it knows beside its component between two steps, for `orchestrator.packing`."""
        return {
            "shown": [self.published, self._pending, self._reached, self.wall_time_ns],
            "sampled": self.inputs.memory(),
            "history": None if self._history is None else self._history.memory(),
            "pieces": None if self._pieces is None else self._pieces.memory(),
        }

    def recall(self, memory: Mapping[str, Any]) -> None:
        """Know what `memory` told, in place of all else."""
        self.published.clear()
        self.wall_time_ns = 0
        self.go_on(*memory["shown"])
        self.inputs.recall(memory["sampled"])
        if self._history is not None:
            self._history.recall(memory["history"])
        if self._pieces is not None:
            self._pieces.recall(memory["pieces"])

    def accept(self, outputs: Signals, t: Time) -> None:
        """Keep `outputs` of a step from `t` for `publish`, or raise what is wrong with them."""
        problems = self._looked_at.problems(outputs, self.published)
        if problems:
            raise ComponentError(self.name, t, "; ".join(problems))
        self._pending = outputs

    def failure(self, t: Time | None, error: BaseException, doing: str = "") -> ComponentError:
        """`error` with the name of the component and the time it worked from."""
        if isinstance(error, ComponentError):
            when = t if error.time is None else error.time
            name = error.component or self.name
            return ComponentError(name, when, doing + error.message, error.where)
        if isinstance(error, CosimError):
            return ComponentError(self.name, t, f"{doing}{error}")
        what = f"{doing}{in_words(error)}"
        return ComponentError(self.name, t, what, raised_at(error, type(self._component)))


Participants: TypeAlias = Sequence[Participant]
