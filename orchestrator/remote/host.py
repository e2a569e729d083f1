"""The host of one component: turns commands into calls, and what comes back into replies.

`orchestrator.remote.host_main` runs one in a process of its own; the loopback has one in this
process.
"""

import abc
import importlib
import logging
import traceback
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import Buffer

from orchestrator import registry
from orchestrator.capabilities import (
    CourseFollowing,
    EndRequesting,
    InitialEvaluation,
    OutputSelection,
    OutputSlopes,
    PortableState,
)
from orchestrator.component import Component, RestorableComponent
from orchestrator.declared import declared, not_a_mapping
from orchestrator.errors import ComponentError, ComponentTypeError, CosimError, defects, in_words
from orchestrator.local_module import local_type
from orchestrator.parameters import ComponentType, PythonComponentType
from orchestrator.raised_at import raised_at
from orchestrator.remote.admission import Admission, Anything
from orchestrator.remote.block import WireError
from orchestrator.remote.courses import courses_from_document, slopes_to_document
from orchestrator.remote.declarations import connectors_to_message
from orchestrator.remote.ending import request_to_document
from orchestrator.remote.laid_out import InMemory, LaidOut, Packed
from orchestrator.remote.protocol import (
    CAPABILITIES,
    SEQUENCE,
    STEP,
    Kind,
    Message,
    generator_from_document,
    grid_from_document,
)
from orchestrator.remote.sharing import NOTHING_SHARED, SharedMemory
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.wire import SignalDecoder, SignalEncoder
from orchestrator.signal import Causality, Connector, Signal, Signals

_log = logging.getLogger(__name__)


class HostChannel(abc.ABC):
    """A host's end of a link. Its constructor connects; its arguments come from the transport."""

    @property
    def memory(self) -> SharedMemory:
        """What this process and the orchestrator both see."""
        return NOTHING_SHARED

    @abc.abstractmethod
    def receive(self) -> bytes:
        """Wait for the next command; empty when there will be none."""

    @abc.abstractmethod
    def send(self, reply: bytes) -> None:
        """Answer the command received last."""

    @abc.abstractmethod
    def close(self) -> None:
        """Disconnect."""


def component_type_of(spec: ComponentSpec) -> ComponentType:
    """The component type that `spec` names.

    Raises:
        ComponentTypeError: there is none, or it cannot be loaded.
    """
    if isinstance(spec.type, Path):
        return registry.fmu_type(spec.type)
    if ":" in spec.type:
        return _imported_type(spec.type)
    return registry.component_type(spec.type)


def _imported_type(reference: str) -> ComponentType:
    module, _, name = reference.rpartition(":")
    if module.endswith(".py"):
        return local_type(reference, Path())
    try:
        found = getattr(importlib.import_module(module), name)
    except (ImportError, AttributeError) as error:
        kind = type(error).__name__
        raise ComponentTypeError(f"cannot load `{reference}`: {kind}: {error}") from error
    if not (isinstance(found, type) and issubclass(found, Component)):
        raise ComponentTypeError(f"`{reference}` is not a subclass of `Component`")
    return PythonComponentType(found)


class ComponentHost:
    """Carries out commands on the component that the first of them creates.

    Args:
        logs: gives the log records since it was called last, to travel with the reply.
        memory: shared with the orchestrator.
        admission: what may be created.
    """

    def __init__(
        self,
        logs: Callable[[], list[tuple[str, int, str]]] = list,
        memory: SharedMemory = NOTHING_SHARED,
        admission: Admission | None = None,
    ) -> None:
        self._admission = Anything() if admission is None else admission
        self._logs = logs
        self._memory = memory
        self._component: Component | None = None
        self._asking: EndRequesting | None = None
        self._needs_close = False
        self._states: dict[int, Any] = {}
        self._connectors: dict[Causality, dict[str, Connector]] = {}
        self._inputs = SignalDecoder({})
        self._outputs = SignalEncoder({})
        self._known: dict[str, Signal] = {}
        self._laid_out: LaidOut | None = None
        self._actions: Final[Mapping[Kind, Callable[[Message, bytes, int], bytes]]] = {
            Kind.CREATE: self._create,
            Kind.SETUP: self._setup,
            Kind.INITIALISE: self._initialise,
            Kind.STEP: self._step,
            Kind.CLOSE: self._close,
            Kind.SAVE: self._save,
            Kind.RESTORE: self._restore,
            Kind.EVALUATE: self._evaluate,
            Kind.DUMP: self._dump,
            Kind.LOAD: self._load,
            Kind.SLOPES: self._slopes,
            Kind.SELECT: self._select,
            Kind.LAY_OUT: self._lay_out,
            Kind.STEP_LAID_OUT: self._not_laid_out,
        }

    def handle(self, message: bytes) -> bytes:
        """Carry out one command and return its reply; errors of the component are replies.

        Raises:
            WireError: `message` is not a message.
        """
        laid_out = self._laid_out
        if laid_out is not None and message.startswith(laid_out.head):
            return self._step_laid_out(laid_out, message)
        command, offset = Message.decode(message)
        try:
            return self._actions[command.kind](command, message, offset)
        except defects() as error:
            return self._failure(command, error)

    def _failure(self, command: Message, error: BaseException) -> bytes:
        failure = describe_failure(error, type(self._component))
        document = {"failure": failure, **self._log_document()}
        return command.reply(Kind.FAILED, document).encode()

    def close(self) -> None:
        """Close the component if nobody has done so; there is nobody left to tell of errors."""
        if self._component is not None and self._needs_close:
            self._needs_close = False
            try:
                self._component.close()
            except defects():
                _log.warning("an error while closing a component", exc_info=True)

    def _create(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        if self._component is not None:
            raise WireError("the component was created already")
        self._admission.check(command.document)
        spec = ComponentSpec.from_document(command.document)
        self._component = component_type_of(spec).create(spec.name, spec.values)
        self._asking = self._component.capability(EndRequesting)  # type: ignore[type-abstract]
        connectors = declared(spec.name, self._component)
        self._connectors = {
            causality: {n: c for n, c in connectors.items() if c.causality is causality}
            for causality in Causality
        }
        is_restorable = isinstance(self._component, RestorableComponent)
        follower = self._component.capability(CourseFollowing)  # type: ignore[type-abstract]
        document = {
            "restorable": is_restorable,
            "input_degree": 0 if follower is None else follower.input_degree,
            "capabilities": [
                name
                for name, kind in CAPABILITIES.items()
                if self._component.capability(kind) is not None
            ],
            **self._log_document(),
        }
        return connectors_to_message(connectors, command, document)

    def _setup(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        # a new run: neither end remembers values of the one before
        self._inputs = SignalDecoder(self._connectors[Causality.INPUT], self._memory)
        self._outputs = SignalEncoder(self._connectors[Causality.OUTPUT], self._memory)
        self._known, self._laid_out = {}, None
        self._states.clear()
        document = command.document
        self._needs_close = True
        grid = grid_from_document(document.get("grid"))
        if grid is not None:
            self._created().expect(grid)
        self._created().setup(command.t, generator_from_document(document["rng"]))
        return self._done(command).encode()

    def _initialise(self, command: Message, message: bytes, offset: int) -> bytes:
        self._created().initialise(self._read(message, offset))
        return self._reached(command).encode(self._output_block())

    def _evaluate(self, command: Message, message: bytes, offset: int) -> bytes:
        component = self._created()
        evaluation = component.capability(InitialEvaluation)  # type: ignore[type-abstract]
        if evaluation is None:
            raise WireError("the component cannot be evaluated before it is initialised")
        outputs = evaluation.evaluate(self._read(message, offset))
        return self._done(command).encode(self._block(outputs))

    def _slopes(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        source = self._created().capability(OutputSlopes)  # type: ignore[type-abstract]
        if source is None:
            raise WireError("the component does not know how its outputs change")
        document = {**slopes_to_document(source.slopes()), **self._log_document()}
        return command.reply(Kind.DONE, document).encode()

    def _select(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        selection = self._created().capability(OutputSelection)  # type: ignore[type-abstract]
        if selection is None:
            raise WireError("the component cannot leave outputs out")
        selection.select(command.document["outputs"])
        return self._reached(command).encode(self._output_block())

    def _step(self, command: Message, message: bytes, offset: int) -> bytes:
        if courses := command.document.get("courses"):
            follower = self._created().capability(CourseFollowing)  # type: ignore[type-abstract]
            if follower is None:
                raise WireError("the component's inputs cannot change over a step")
            follower.follow(courses_from_document(courses))
        component = self._created()
        component.step(self._read(message, offset), command.t, command.h)
        return self._reached(command).encode(self._block(component.outputs()))

    def _lay_out(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        inputs, outputs = (self._connectors[c] for c in (Causality.INPUT, Causality.OUTPUT))
        self._laid_out = (
            InMemory(command, inputs, outputs, self._known, self._memory)
            if "place" in command.document
            else Packed(command, inputs, outputs, self._known)
        )
        said = {**self._laid_out.reply, **self._log_document()}
        return command.reply(Kind.DONE, said).encode()

    def _not_laid_out(self, command: Message, message: bytes, offset: int) -> bytes:
        raise WireError("nobody said where the values of a step are")

    def _step_laid_out(self, laid_out: LaidOut, message: bytes) -> bytes:
        component = self._created()
        t, h = STEP.unpack_from(message, SEQUENCE + 8)
        try:
            component.step(laid_out.inputs(message), t, h)
            outputs, said = component.outputs(), self._said()
            reply = None if said else laid_out.answer(message, outputs)
            if reply is not None:
                return reply
            command, _ = Message.decode(message)
            return command.reply(Kind.DONE, said).encode(self._block(outputs))
        except defects() as error:
            return self._failure(Message.decode(message)[0], error)

    def _read(self, message: bytes, offset: int) -> dict[str, Signal]:
        """The inputs in a message; they are known from now on."""
        inputs = self._inputs.decode(message, offset)
        self._known.update(inputs)
        return inputs

    def _close(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        self._needs_close = False
        self._states.clear()
        self._created().close()
        return self._done(command).encode()

    def _save(self, command: Message, message: bytes, offset: int) -> bytes:
        """Keep the state here, under the sequence number of the command."""
        del message, offset
        for number in command.document.get("forget", ()):
            self._states.pop(number, None)
        self._states[command.sequence] = self._restorable().save()
        return self._done(command).encode()

    def _restore(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        number = command.document["state"]
        if number not in self._states:
            raise WireError(f"there is no state {number} of this run")
        self._restorable().restore(self._states[number])
        return self._done(command).encode()

    def _dump(self, command: Message, message: bytes, offset: int) -> bytes:
        del message, offset
        return self._done(command).encode([self._portable().dump()])

    def _load(self, command: Message, message: bytes, offset: int) -> bytes:
        self._portable().load(message[offset:])
        return self._done(command).encode(self._output_block())

    def _portable(self) -> PortableState:
        found = self._created().capability(PortableState)  # type: ignore[type-abstract]
        if found is None:
            raise WireError("the state of the component cannot leave its process")
        return found

    def _restorable(self) -> RestorableComponent[Any]:
        component = self._created()
        if not isinstance(component, RestorableComponent):
            raise WireError("the component cannot return to an earlier state")
        return component

    def _created(self) -> Component:
        if self._component is None:
            raise WireError("the component was not created yet")
        return self._component

    def _output_block(self) -> list[Buffer]:
        return self._block(self._created().outputs())

    def _block(self, outputs: Signals) -> list[Buffer]:
        if wrong := not_a_mapping(outputs):
            raise WireError(wrong)
        try:
            block = self._outputs.parts(outputs)
        except WireError as error:
            raise WireError(f"output {error}") from None
        for value in outputs.values():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)  # as for a component in the importer's process
        return block

    def _done(self, command: Message) -> Message:
        return command.reply(Kind.DONE, self._log_document())

    def _reached(self, command: Message) -> Message:
        """`_done` behind a step, with what the component asks for."""
        return command.reply(Kind.DONE, self._said())

    def _said(self) -> dict[str, Any]:
        """What was logged in a step, and what the component asks for."""
        document = self._log_document()
        if self._asking is not None:
            document |= request_to_document(self._asking.end_request)
        return document

    def _log_document(self) -> dict[str, Any]:
        records = self._logs()
        return {"logs": records} if records else {}


def describe_failure(error: BaseException, owner: type | None = None) -> dict[str, Any]:
    """`error` as JSON: whose fault it is, what it says, and where it came from.

    Args:
        error: that was raised.
        owner: the class of the component.
    """
    component, time, where = "", None, ""
    if isinstance(error, ComponentError):
        component, time, text = error.component, error.time, error.message
        where = error.where
    elif isinstance(error, CosimError):
        text = str(error)
    else:
        text, where = in_words(error), raised_at(error, owner)
    return {
        "component": component,
        "time": time,
        "text": text,
        "where": where,
        "is_type_error": isinstance(error, ComponentTypeError),
        "traceback": "".join(traceback.format_exception(error)),
    }
