"""A component in another process: it looks like any other component."""

import logging
import weakref
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.outputs import same
from orchestrator.capabilities import (
    CourseFollowing,
    EndRequest,
    EndRequesting,
    OutputSelection,
    OutputSlopes,
    PointEvaluation,
    PortableState,
    VariableSteps,
)
from orchestrator.component import Capability, ConcurrentComponent, WrappedRestorableComponent
from orchestrator.course import Course
from orchestrator.errors import ComponentError
from orchestrator.limits import Deadlines
from orchestrator.native import NativeUnit
from orchestrator.remote.courses import courses_to_document, slopes_from_document
from orchestrator.remote.declarations import connectors_from_message
from orchestrator.remote.dialogue import Dialogue, HostLostError, Reply
from orchestrator.remote.ending import request_from_document
from orchestrator.remote.journal import Journal, Step
from orchestrator.remote.kept_state import RemoteState
from orchestrator.remote.linked_steps import LinkedSteps, can_be_laid_out, linked_steps
from orchestrator.remote.naming import Origins, Sites
from orchestrator.remote.protocol import CAPABILITIES, Kind, generator_to_document, grid_to_document
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import CommunicationGrid, Duration, Time

_log = logging.getLogger(__name__)

_Answer = TypeVar("_Answer")


class RemoteComponent(
    ConcurrentComponent,
    PointEvaluation,
    CourseFollowing,
    EndRequesting,
    OutputSelection,
    OutputSlopes,
    PortableState,
    VariableSteps,
):
    """A component hosted at the other end of a link; `launch` creates it."""

    def __init__(
        self,
        dialogue: Dialogue,
        created: Reply,
        deadlines: Deadlines,
        renew: Callable[[], None] | None = None,
        sites: Sites | None = None,
    ) -> None:
        self._dialogue = dialogue
        self._sites = Sites() if sites is None else sites
        self._origins = Origins()
        self._deadlines = deadlines
        self._renew = renew
        self._journal = Journal()
        said = created.message.document
        with dialogue.reading():
            found = connectors_from_message(said, created.raw, created.offset)
            self._capabilities = {CAPABILITIES[name] for name in said.get("capabilities", ())}
            self._input_degree = int(said.get("input_degree", 0))
        self._connectors = MappingProxyType(found)
        self._inputs = SignalEncoder({})
        self._outputs = SignalDecoder({})
        self._values: Signals = {}
        self._end_request: EndRequest | None = None
        self._selection: list[str] | None = None
        self._courses: Mapping[str, Course] = {}
        self._is_set_up = False
        self._forgotten: list[int] = []
        self._grid: CommunicationGrid | None = None
        self._linked: LinkedSteps | None = None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def expect(self, grid: CommunicationGrid) -> None:
        self._grid = grid

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._values, self._forgotten, self._selection = {}, [], None
        self._is_set_up = True
        document = {"rng": generator_to_document(rng), "grid": grid_to_document(self._grid)}
        self._journal = Journal(start=start, document=document)
        self._set_up(start, document)

    def _set_up(self, start: Time, document: Mapping[str, Any]) -> None:
        self._dialogue.epoch += 1
        self._linked = None
        memory, outputs = self._dialogue.memory, self._only(Causality.OUTPUT)
        self._origins = self._sites.come_to(self._dialogue.site, self._dialogue.name, outputs)
        name_of = self._origins.name_of if self._dialogue.site else None
        self._inputs = SignalEncoder(self._only(Causality.INPUT), memory, name_of)
        self._outputs = SignalDecoder(outputs, memory)
        self._dialogue.ask(Kind.SETUP, self._deadlines.setup, t=start, document=document)
        self._dialogue.answer()

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        return super().capability(kind) if kind in self._capabilities else None

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return self._surviving(lambda: self._evaluate(inputs))

    def _evaluate(self, inputs: Signals) -> Signals:
        block = self._inputs.parts(inputs)
        self._dialogue.ask(Kind.EVALUATE, self._deadlines.setup, block=block)
        return self._decoded(self._dialogue.answer())

    @property
    @override
    def input_degree(self) -> int:
        return self._input_degree

    @override
    def follow(self, courses: Mapping[str, Course]) -> None:
        self._courses = courses

    @override
    def select(self, names: Collection[str] | None) -> None:
        self._selection = None if names is None else sorted(names)
        self._surviving(self._select)

    def _select(self) -> None:
        document = {"outputs": self._selection}
        self._dialogue.ask(Kind.SELECT, self._deadlines.step, document=document)
        self._accept(self._dialogue.answer())

    @override
    def slopes(self) -> Signals:
        return self._surviving(self._slopes)

    def _slopes(self) -> Signals:
        self._dialogue.ask(Kind.SLOPES, self._deadlines.step)
        return slopes_from_document(self._dialogue.answer().message.document)

    @override
    def initialise(self, inputs: Signals) -> None:
        self._initialise(inputs)
        if self._renew is not None:
            self._journal.initial = inputs

    def _initialise(self, inputs: Signals) -> None:
        block = self._inputs.parts(inputs)
        self._dialogue.ask(Kind.INITIALISE, self._deadlines.setup, block=block)
        self._accept(self._dialogue.answer())

    @override
    def dump(self) -> bytes:
        return self._surviving(self._dump)

    def _dump(self) -> bytes:
        self._dialogue.ask(Kind.DUMP, self._deadlines.step)
        reply = self._dialogue.answer()
        return reply.raw[reply.offset :]

    @override
    def load(self, content: bytes) -> None:
        self._load(content)
        if self._renew is not None:
            self._journal.keep(content)

    def _load(self, content: bytes) -> None:
        self._dialogue.ask(Kind.LOAD, self._deadlines.step, block=[content])
        self._accept(self._dialogue.answer())

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        courses, self._courses = self._courses, {}
        if self._renew is None:
            self._ask_step(inputs, t, h, courses)
            return
        step = Step(inputs=inputs, t=t, h=h, courses=courses)
        if self._journal.is_due:
            self._journal.keep(self.dump())
        self._journal.current = step
        try:
            self._begin(step)
        except HostLostError as error:
            self._return(error)

    def _begin(self, step: Step) -> None:
        self._ask_step(step.inputs, step.t, step.h, step.courses)

    def _ask_step(
        self, inputs: Signals, t: Time, h: Duration, courses: Mapping[str, Course]
    ) -> None:
        said = {"courses": courses_to_document(courses)} if courses else {}
        within, block = self._deadlines.step, self._inputs.parts(inputs)
        self._dialogue.ask(Kind.STEP, within, t=t, h=h, document=said, block=block)

    @override
    def finish_step(self) -> None:
        if self._renew is None:
            self._accept(self._dialogue.answer())
            return
        self._accept(self._surviving(self._dialogue.answer))
        self._journal.finish()

    @override
    def has_finished(self) -> bool:
        return self._dialogue.has_answered()

    def _surviving(self, asked: Callable[[], _Answer]) -> _Answer:
        """What is asked of the host; if it is lost, of the one that takes its place."""
        try:
            return asked()
        except HostLostError as error:
            self._return(error)
            return asked()

    def _return(self, error: HostLostError) -> None:
        """Bring another host to where the lost one was, in the middle of its step if it had one.

        Raises:
            HostLostError: that is not wanted, or was tried for this step before.
        """
        journal = self._journal
        current = journal.current
        if self._renew is None or (current is not None and current is journal.again):
            raise error
        journal.again = current
        before = dict(self._values)
        _log.warning("%s; it is started again, to make %d steps anew", error, len(journal.steps))
        self._renew()
        self._set_up(journal.start, journal.document)
        if journal.initial is not None:
            self._initialise(journal.initial)
        if journal.state is not None:
            self._load(journal.state)
        if self._selection is not None:
            self._select()
        for step in journal.steps:
            self._begin(step)
            self._accept(self._dialogue.answer())
        self._compare(before)
        if current is not None:
            self._begin(current)

    def _compare(self, before: Signals) -> None:
        """Say so if another host has not come to these outputs."""
        common = before.keys() & self._values.keys()
        other = [f"`{name}`" for name in common if not same(before[name], self._values[name])]
        if other:
            what = (
                "component `%s` was started again and came to another %s than before: its state is "
                "more than it dumps, or it depends on more than its inputs; what follows is not "
                "what it would have been"
            )
            _log.warning(what, self._dialogue.name, ", ".join(sorted(other)))

    @override
    def outputs(self) -> Signals:
        return self._values

    @override
    def native(self) -> NativeUnit | None:
        if self._renew is not None or not can_be_laid_out(self._connectors):
            return None
        self._linked = linked_steps(
            self._dialogue, self._connectors, deadlines=self._deadlines, accept=self._show
        )
        return None if self._linked is None else self._linked.unit()

    def _show(self, values: Signals) -> None:
        """Have outputs that came without a message, as those of a usual step do."""
        self._values, self._end_request = values, None

    @property
    @override
    def end_request(self) -> EndRequest | None:
        return self._end_request

    @override
    def close(self) -> None:
        if self._dialogue.awaiting is not None:
            # The run ended in the middle of this step, which may take long or fail as well.
            with suppress(ComponentError):
                self._dialogue.answer(self._deadlines.interrupted)
        if self._is_set_up and not self._dialogue.is_over:
            self._is_set_up = False
            self._dialogue.ask(Kind.CLOSE, self._deadlines.close)
            self._dialogue.answer(self._deadlines.close)

    def save(self) -> RemoteState:
        """The state of the component; the host forgets it when nobody holds it any more."""
        forgotten, self._forgotten = self._forgotten, []
        document = {"forget": forgotten} if forgotten else {}
        number = self._dialogue.ask(Kind.SAVE, self._deadlines.step, document=document)
        self._dialogue.answer()
        state = RemoteState(number, self._values)
        weakref.finalize(state, self._forgotten.append, number)
        return state

    def restore(self, state: RemoteState) -> None:
        """Return to `state`."""
        document = {"state": state.number}
        self._dialogue.ask(Kind.RESTORE, self._deadlines.step, document=document)
        self._dialogue.answer()
        self._values = state.values

    def _only(self, causality: Causality) -> dict[str, Connector]:
        return {n: c for n, c in self._connectors.items() if c.causality is causality}

    def _accept(self, reply: Reply) -> None:
        said = reply.message.document
        self._end_request = request_from_document(said) if said else None
        self._values = self._decoded(reply)

    def _decoded(self, reply: Reply) -> Signals:
        """The outputs in a reply; its host may know them by name from now on."""
        with self._dialogue.reading():
            if self._linked is not None:
                found = self._linked.outputs_in(reply.raw, reply.offset)
                if found is not None:
                    return found
            values = self._outputs.decode(reply.raw, reply.offset)
        if self._dialogue.site:
            self._origins.note(self._dialogue.name, values, reply.message)
        return values


class RestorableRemoteComponent(WrappedRestorableComponent[RemoteState], ConcurrentComponent):
    """A remote component that can return to an earlier state, as it could in this process."""

    def __init__(self, component: RemoteComponent) -> None:
        super().__init__(component, component)
        self._component = component

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._component.begin_step(inputs, t, h)

    @override
    def finish_step(self) -> None:
        self._component.finish_step()

    @override
    def has_finished(self) -> bool:
        return self._component.has_finished()
