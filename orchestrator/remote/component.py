"""Components in other processes: they look like any other component.

    specs = [ComponentSpec(name="traffic", type="sumo-traffic", values={...}), ...]
    with launch(specs, ZenohTransport()) as remote:
        system = System({**local, **remote}, ...)
        simulate(system, ...)

Nothing started by `launch` outlives its `with` block.
"""

import logging
import weakref
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from time import monotonic
from types import MappingProxyType
from typing import Any, Final, NoReturn

import numpy as np
from typing_extensions import Buffer, override

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
from orchestrator.limits import USUAL, Deadlines, Limits
from orchestrator.remote.courses import courses_to_document, slopes_from_document
from orchestrator.remote.protocol import (
    CAPABILITIES,
    ComponentSpec,
    Kind,
    Message,
    connectors_from_message,
    generator_to_document,
    grid_to_document,
    request_from_document,
)
from orchestrator.remote.sharing import SharedMemory
from orchestrator.remote.transport import Link, LinkLostError, Transport
from orchestrator.remote.wire import SignalDecoder, SignalEncoder, WireError
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import CommunicationGrid, Duration, Time

_log = logging.getLogger(__name__)

_LIMITED: Final = {Kind.CREATE, Kind.SETUP, Kind.EVALUATE, Kind.INITIALISE, Kind.STEP}
"""Commands that users can give more time."""


@dataclass(frozen=True, slots=True)
class _Reply:
    message: Message
    raw: bytes
    offset: int


class _Dialogue:
    """Commands to one host and its replies, told apart by epoch and sequence number."""

    def __init__(self, name: str, link: Link) -> None:
        self.name = name
        self.epoch = 0
        self.awaiting: Message | None = None
        self._link = link
        self._sequence = 0
        self._is_over = False

    @property
    def memory(self) -> SharedMemory:
        """What the host sees, too."""
        return self._link.memory

    def ask(
        self,
        kind: Kind,
        *,
        t: Time = 0,
        h: Duration = 0,
        document: Mapping[str, Any] = MappingProxyType({}),
        block: Sequence[Buffer] = (),
    ) -> int:
        """Send a command; returns its sequence number."""
        if self._is_over:
            raise ComponentError(self.name, None, "its process has ended")
        self._sequence += 1
        command = Message(
            kind=kind, epoch=self.epoch, sequence=self._sequence, t=t, h=h, document=document
        )
        self.awaiting = command
        try:
            self._link.send(command.encode(block))
        except LinkLostError as error:
            self._fail(command, str(error))
        return self._sequence

    def answer(self, timeout: float) -> _Reply:
        """Wait for the reply to the command sent last; raise what the component raised."""
        command = self.awaiting
        if command is None:
            raise RuntimeError("`answer` without `ask`")
        deadline = monotonic() + timeout
        while True:
            try:
                raw = self._link.receive(max(0.0, deadline - monotonic()))
                message, offset = Message.decode(raw)
            except LinkLostError as error:
                self._fail(command, str(error))
            except WireError as error:
                self._fail(command, f"its process sent something unreadable: {error}")
            except TimeoutError:
                doing = command.kind.name.lower()
                allowed = "; its `deadline` allows no more" if command.kind in _LIMITED else ""
                what = f"did not answer within {timeout:g} s (to `{doing}`){allowed}"
                self._fail(command, what)
            if (message.epoch, message.sequence) == (command.epoch, command.sequence):
                break
            _log.debug("`%s`: dropped a reply to an earlier command: %s", self.name, message)
        self.awaiting = None
        if message.document:
            _replay(self.name, message.document.get("logs", ()))
            if message.kind is Kind.FAILED:
                self._raise(command, message.document["failure"])
        return _Reply(message, raw, offset)

    def abandon(self) -> None:
        """End the host by force, once."""
        if not self._is_over:
            self._is_over = True
            self.awaiting = None
            self._link.abandon()

    @property
    def is_over(self) -> bool:
        """Whether the host can no longer be asked anything."""
        return self._is_over

    def _fail(self, command: Message, text: str) -> NoReturn:
        self.abandon()
        raise ComponentError(self.name, _time_of(command), text) from None

    def _raise(self, command: Message, failure: Mapping[str, Any]) -> NoReturn:
        _log.debug("`%s`: traceback in its host:\n%s", self.name, failure["traceback"])
        if failure["is_type_error"]:
            raise ComponentTypeError(failure["text"])
        time = _time_of(command) if failure["time"] is None else failure["time"]
        raise ComponentError(failure["component"] or self.name, time, failure["text"])


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

    def __init__(self, dialogue: _Dialogue, created: _Reply, deadlines: Deadlines) -> None:
        self._dialogue = dialogue
        self._deadlines = deadlines
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
        self._dialogue.epoch += 1
        memory = self._dialogue.memory
        self._inputs = SignalEncoder(self._only(Causality.INPUT), memory)
        self._outputs = SignalDecoder(self._only(Causality.OUTPUT), memory)
        self._values = {}
        self._forgotten = []
        self._is_set_up = True
        document = {"rng": generator_to_document(rng), "grid": grid_to_document(self._grid)}
        self._dialogue.ask(Kind.SETUP, t=start, document=document)
        self._dialogue.answer(self._deadlines.create)

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        return super().capability(kind) if kind in self._capabilities else None

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        self._dialogue.ask(Kind.EVALUATE, block=self._inputs.parts(inputs))
        reply = self._dialogue.answer(self._deadlines.create)
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
        self._dialogue.ask(Kind.SLOPES)
        return slopes_from_document(self._dialogue.answer(self._deadlines.step).message.document)

    @override
    def initialise(self, inputs: Signals) -> None:
        self._dialogue.ask(Kind.INITIALISE, block=self._inputs.parts(inputs))
        self._accept(self._dialogue.answer(self._deadlines.create))

    @override
    def dump(self) -> bytes:
        self._dialogue.ask(Kind.DUMP)
        reply = self._dialogue.answer(self._deadlines.step)
        return reply.raw[reply.offset :]

    @override
    def load(self, content: bytes) -> None:
        self._dialogue.ask(Kind.LOAD, block=[content])
        self._accept(self._dialogue.answer(self._deadlines.step))

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        courses, self._courses = self._courses, {}
        said = {"courses": courses_to_document(courses)} if courses else {}
        self._dialogue.ask(Kind.STEP, t=t, h=h, document=said, block=self._inputs.parts(inputs))

    @override
    def finish_step(self) -> None:
        self._accept(self._dialogue.answer(self._deadlines.step))

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
            self._dialogue.ask(Kind.CLOSE)
            self._dialogue.answer(self._deadlines.close)

    def save(self) -> RemoteState:
        """The state of the component; the host forgets it when nobody holds it any more."""
        forgotten, self._forgotten = self._forgotten, []
        document = {"forget": forgotten} if forgotten else {}
        number = self._dialogue.ask(Kind.SAVE, document=document)
        self._dialogue.answer(self._deadlines.step)
        state = RemoteState(number, self._values)
        weakref.finalize(state, self._forgotten.append, number)
        return state

    def restore(self, state: RemoteState) -> None:
        """Return to `state`."""
        self._dialogue.ask(Kind.RESTORE, document={"state": state.number})
        self._dialogue.answer(self._deadlines.step)
        self._values = state.values

    def _only(self, causality: Causality) -> dict[str, Connector]:
        return {n: c for n, c in self._connectors.items() if c.causality is causality}

    def _accept(self, reply: _Reply) -> None:
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
        dialogues = {name: _Dialogue(name, links[name]) for name in documents}
        for name, dialogue in dialogues.items():
            links[name].limit_memory(limited[name].memory)
            dialogue.ask(Kind.CREATE, document=documents[name])
        yield _created(dialogues, {name: each.deadlines for name, each in limited.items()})


def _created(
    dialogues: Mapping[str, _Dialogue], deadlines: Mapping[str, Deadlines]
) -> Mapping[str, ConcurrentComponent]:
    components: dict[str, ConcurrentComponent] = {}
    errors: list[str] = []
    for name, dialogue in dialogues.items():
        try:
            created = dialogue.answer(deadlines[name].create)
            remote = RemoteComponent(dialogue, created, deadlines[name])
            is_restorable = created.message.document.get("restorable", False)
            components[name] = RestorableRemoteComponent(remote) if is_restorable else remote
        except ComponentTypeError as error:
            errors.append(f"component `{name}`: {error}")
    if errors:
        raise ComponentTypeError("\n".join(errors))
    return MappingProxyType(components)


def _time_of(command: Message) -> Time | None:
    """The simulated time a command works from, if it says so."""
    return command.t if command.kind in (Kind.SETUP, Kind.STEP) else None


def _replay(component: str, records: Sequence[tuple[str, int, str]]) -> None:
    """Log here what a host logged."""
    for name, level, text in records:
        logger = logging.getLogger(name)
        if logger.isEnabledFor(level):
            record = logger.makeRecord(name, level, component, 0, text, (), None)
            record.processName = component
            logger.handle(record)
