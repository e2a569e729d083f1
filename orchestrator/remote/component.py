"""Components in other processes: they look like any other component.

    specs = [ComponentSpec(name="traffic", type="sumo-traffic", values={...}), ...]
    with launch(specs, ZenohTransport()) as remote:
        system = System({**local, **remote}, ...)
        simulate(system, ...)

Nothing started by `launch` outlives its `with` block.
"""

import logging
import weakref
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np
from typing_extensions import override

from orchestrator.capabilities import (
    CourseFollowing,
    EndRequest,
    EndRequesting,
    OutputSlopes,
    PointEvaluation,
    PortableState,
    VariableSteps,
)
from orchestrator.component import Capability, ConcurrentComponent, WrappedRestorableComponent
from orchestrator.course import Course
from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.limits import USUAL, Deadlines, Limits, OnFailure
from orchestrator.remote.courses import courses_to_document, slopes_from_document
from orchestrator.remote.dialogue import Company, Dialogue, HostLostError, Reply
from orchestrator.remote.journal import Journal, Step
from orchestrator.remote.protocol import (
    CAPABILITIES,
    ComponentSpec,
    Kind,
    connectors_from_message,
    generator_to_document,
    grid_to_document,
    request_from_document,
)
from orchestrator.remote.transport import Transport
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import CommunicationGrid, Duration, Time

_log = logging.getLogger(__name__)

_Answer = TypeVar("_Answer")


class RemoteState:
    """The state of a remote component, which its host keeps.

    Attributes:
        number: by which the host knows it.
        values: the outputs at that time.
    """

    __slots__ = ("__weakref__", "number", "values")

    def __init__(self, number: int, values: Signals) -> None:
        self.number = number
        self.values = values


class RemoteComponent(
    ConcurrentComponent,
    PointEvaluation,
    CourseFollowing,
    EndRequesting,
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
    ) -> None:
        self._dialogue = dialogue
        self._deadlines = deadlines
        self._renew = renew
        self._journal = Journal()
        found = connectors_from_message(created.message.document, created.raw, created.offset)
        self._connectors = MappingProxyType(found)
        self._inputs = SignalEncoder({})
        self._outputs = SignalDecoder({})
        self._values: Signals = {}
        self._end_request: EndRequest | None = None
        said = created.message.document
        self._capabilities = {CAPABILITIES[name] for name in said.get("capabilities", ())}
        self._input_degree: int = said.get("input_degree", 0)
        self._courses: Mapping[str, Course] = {}
        self._is_set_up = False
        self._forgotten: list[int] = []
        self._grid: CommunicationGrid | None = None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def expect(self, grid: CommunicationGrid) -> None:
        self._grid = grid

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._values = {}
        self._forgotten = []
        self._is_set_up = True
        document = {"rng": generator_to_document(rng), "grid": grid_to_document(self._grid)}
        self._journal = Journal(start=start, document=document)
        self._set_up(start, document)

    def _set_up(self, start: Time, document: Mapping[str, Any]) -> None:
        self._dialogue.epoch += 1
        memory = self._dialogue.memory
        self._inputs = SignalEncoder(self._only(Causality.INPUT), memory)
        self._outputs = SignalDecoder(self._only(Causality.OUTPUT), memory)
        self._dialogue.ask(Kind.SETUP, self._deadlines.create, t=start, document=document)
        self._dialogue.answer()

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        return super().capability(kind) if kind in self._capabilities else None

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return self._surviving(lambda: self._evaluate(inputs))

    def _evaluate(self, inputs: Signals) -> Signals:
        within = self._deadlines.create
        self._dialogue.ask(Kind.EVALUATE, within, block=self._inputs.parts(inputs))
        reply = self._dialogue.answer()
        return self._outputs.decode(reply.raw, reply.offset)

    @property
    @override
    def input_degree(self) -> int:
        return self._input_degree

    @override
    def follow(self, courses: Mapping[str, Course]) -> None:
        self._courses = courses

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
        within = self._deadlines.create
        self._dialogue.ask(Kind.INITIALISE, within, block=self._inputs.parts(inputs))
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
        step = Step(inputs=inputs, t=t, h=h, courses=courses)
        if self._renew is None:
            self._begin(step)
            return
        if self._journal.is_due:
            self._journal.keep(self.dump())
        self._journal.current = step
        try:
            self._begin(step)
        except HostLostError as error:
            self._return(error)

    def _begin(self, step: Step) -> None:
        said = {"courses": courses_to_document(step.courses)} if step.courses else {}
        within, block = self._deadlines.step, self._inputs.parts(step.inputs)
        self._dialogue.ask(Kind.STEP, within, t=step.t, h=step.h, document=said, block=block)

    @override
    def finish_step(self) -> None:
        self._accept(self._surviving(self._dialogue.answer))
        self._journal.finish()

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
        _log.warning("%s; it is started again, to make %d steps anew", error, len(journal.steps))
        self._renew()
        self._set_up(journal.start, journal.document)
        if journal.initial is not None:
            self._initialise(journal.initial)
        if journal.state is not None:
            self._load(journal.state)
        for step in journal.steps:
            self._begin(step)
            self._accept(self._dialogue.answer())
        if current is not None:
            self._begin(current)

    @override
    def outputs(self) -> Signals:
        return self._values

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
        self._end_request = request_from_document(reply.message.document)
        self._values = self._outputs.decode(reply.raw, reply.offset)


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


@contextmanager
def launch(
    specs: Sequence[ComponentSpec],
    transport: Transport,
    *,
    deadlines: Deadlines | None = None,
    limits: Mapping[str, Limits] = MappingProxyType({}),
) -> Iterator[Mapping[str, ConcurrentComponent]]:
    """Create remote components, all at the same time, and end their hosts with the block.

    Args:
        specs: one per component; names are unique.
        transport: closed with the block, too.
        deadlines: when a silent host counts as hung.
        limits: of single components by name, in place of `deadlines`.

    Yields:
        The components by name, in the order of `specs`.

    Raises:
        ComponentTypeError: types or parameters are wrong; all of these in one text.
        ComponentError: a host did not start, or died.
    """
    common = USUAL if deadlines is None else Limits(deadlines=deadlines)
    limited = {spec.name: limits.get(spec.name, common) for spec in specs}
    documents = {spec.name: spec.to_document() for spec in specs}
    longest = max((each.deadlines.create for each in limited.values()), default=0.0)
    with transport:
        links = transport.open(tuple(documents), longest)
        company = Company()
        dialogues = {name: Dialogue(name, links[name], company) for name in documents}
        for name, dialogue in dialogues.items():
            links[name].limit_memory(limited[name].memory)
            create = limited[name].deadlines.create
            dialogue.ask(Kind.CREATE, create, document=documents[name])

        def renew(name: str) -> None:
            """Start another host for the component, and have it created there."""
            limits_of, dialogue = limited[name], dialogues[name]
            create = limits_of.deadlines.create
            link = transport.renew(name, create)
            link.limit_memory(limits_of.memory)
            dialogue.renew(link)
            dialogue.ask(Kind.CREATE, create, document=documents[name])
            dialogue.answer()

        yield _created(dialogues, limited, renew)


def _created(
    dialogues: Mapping[str, Dialogue],
    limits: Mapping[str, Limits],
    renew: Callable[[str], None],
) -> Mapping[str, ConcurrentComponent]:
    components: dict[str, ConcurrentComponent] = {}
    errors: list[str] = []
    for name, dialogue in dialogues.items():
        try:
            created = dialogue.answer()
            own = limits[name]
            again = partial(renew, name) if own.on_failure is OnFailure.RESTART else None
            dialogue.is_renewable = again is not None
            remote = RemoteComponent(dialogue, created, own.deadlines, again)
            # states that a host keeps go with it
            is_restorable = again is None and created.message.document.get("restorable", False)
            components[name] = RestorableRemoteComponent(remote) if is_restorable else remote
        except ComponentTypeError as error:
            errors.append(f"component `{name}`: {error}")
    if errors:
        raise ComponentTypeError("\n".join(errors))
    return MappingProxyType(components)
