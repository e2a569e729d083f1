"""The host's end of steps whose values are laid out once and not described in every message.

All signals are numbers of fixed size, so it is enough to say once which are where (LAY_OUT:
`inputs` and `outputs`, offsets by name, and `room`, what outputs take). Between processes of one
machine values are in memory that both see: LAY_OUT says where the inputs will be (`place`, `size`),
its reply where two rooms for outputs are (`place`). Elsewhere they are in the messages:

    STEP_LAID_OUT: number of the room u8 | whether it changed u8 * input | padding to 16 bytes
                   each input that changed, padded to 16 bytes, unless it is in memory
    DONE:          nothing, if the outputs are in memory; else `PACKED`, and the room

Outputs that are not what was declared come in a block of signals, as ever.
"""

import abc
import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from typing_extensions import Buffer, override

from orchestrator.remote.block import WireError
from orchestrator.remote.protocol import HEADER_SIZE, SEQUENCE, Kind, Message
from orchestrator.remote.segment import PlaceError
from orchestrator.remote.sharing import SharedMemory
from orchestrator.signal import Array, Connector, Signal, Signals

PACKED: Final = b"\xff" * 16
"""Stands where a block of signals would begin, with their number."""


class LaidOut(abc.ABC):
    """Inputs and outputs of a component whose host knows where they are.

    What is usual is done with as few calls as can be: a process that waits for each of its steps
    begins each of them with code and data that the processor has forgotten.

    Args:
        command: LAY_OUT.
        inputs: of the component.
        outputs: likewise.
        known: the inputs of the last step, all of them; kept up to date here and by the host.

    Attributes:
        head: with which every step begins that is laid out.
        reply: what there is to say to the command.

    Raises:
        LookupError, TypeError, ValueError, AttributeError: the document is something else.
    """

    reply: Mapping[str, Any]

    def __init__(
        self,
        command: Message,
        inputs: Mapping[str, Connector],
        outputs: Mapping[str, Connector],
        known: dict[str, Signal],
    ) -> None:
        self.head = Message(Kind.STEP_LAID_OUT, command.epoch, 0).encode()[:SEQUENCE]
        usual = Message(Kind.DONE, command.epoch, 0).encode()
        self._before, self._behind = usual[:SEQUENCE], usual[SEQUENCE + 8 :]
        self._known = known
        self._inputs = [
            (name, shape_of(inputs[name]), np.dtype(inputs[name].dtype), size_of(inputs[name]))
            for name in command.document["inputs"]
        ]
        self._outputs = [
            (name, shape_of(outputs[name]), np.dtype(outputs[name].dtype))
            for name in command.document["outputs"]
        ]

    @abc.abstractmethod
    def inputs(self, message: bytes) -> dict[str, Signal]:
        """All inputs of the step that `message` orders, read-only."""

    @abc.abstractmethod
    def _write(self, values: Sequence[Array], room: int) -> Sequence[Buffer]:
        """Have the outputs written; what travels of them."""

    def answer(self, message: bytes, outputs: Signals) -> bytes | None:
        """The reply to a step; `None` if the outputs are not what was declared.

        Args:
            message: the command.
            outputs: of the component; nobody can write them any more.
        """
        if type(outputs) is not dict or len(outputs) != len(self._outputs):
            return None
        values = []
        for name, shape, dtype in self._outputs:
            value = outputs.get(name)
            if type(value) is not np.ndarray or value.dtype != dtype or value.shape != shape:
                return None
            value.setflags(write=False)  # as for a component in the importer's process
            values.append(value)
        parts = self._write(values, message[HEADER_SIZE])
        return b"".join((self._before, message[SEQUENCE : SEQUENCE + 8], self._behind, *parts))


class InMemory(LaidOut):
    """Reads inputs where the orchestrator writes them, and writes outputs where it reads them.

    Args:
        command, inputs, outputs, known: see `LaidOut`.
        memory: that both see.

    Raises:
        WireError: there is no such memory.
        LookupError, TypeError, ValueError, AttributeError: the document is something else.
    """

    def __init__(
        self,
        command: Message,
        inputs: Mapping[str, Connector],
        outputs: Mapping[str, Connector],
        known: dict[str, Signal],
        memory: SharedMemory,
    ) -> None:
        super().__init__(command, inputs, outputs, known)
        document = command.document
        room = document["room"]
        try:
            theirs = memory.mapped(document["place"], document["size"])
            place, ours = memory.reserve(2 * room)
        except PlaceError as error:
            raise WireError(str(error)) from None
        self.reply = {"place": place}
        self._seen = [
            (name, np.ndarray(shape, dtype, theirs, document["inputs"][name]))
            for name, shape, dtype, _ in self._inputs
        ]
        self._rooms = [
            [
                np.ndarray(shape, dtype, ours, begin + document["outputs"][name])
                for name, shape, dtype in self._outputs
            ]
            for begin in (0, room)
        ]

    @override
    def inputs(self, message: bytes) -> dict[str, Signal]:
        for (name, view), is_new in zip(self._seen, message[HEADER_SIZE + 1 :], strict=False):
            if is_new:
                value = self._known[name] = view.copy()
                value.setflags(write=False)
        return dict(self._known)

    @override
    def _write(self, values: Sequence[Array], room: int) -> Sequence[Buffer]:
        for value, view in zip(values, self._rooms[room], strict=True):
            view[...] = value
        return ()


class Packed(LaidOut):
    """Reads inputs from the command, and puts outputs into the reply; see `LaidOut`."""

    def __init__(
        self,
        command: Message,
        inputs: Mapping[str, Connector],
        outputs: Mapping[str, Connector],
        known: dict[str, Signal],
    ) -> None:
        super().__init__(command, inputs, outputs, known)
        self.reply = {}
        self._begin = HEADER_SIZE + -(-(1 + len(self._inputs)) // 16) * 16
        offsets = command.document["outputs"]
        ends = [*offsets.values(), command.document["room"]][1:]
        self._gaps = [
            bytes(end - offsets[name] - size_of(outputs[name]))
            for (name, _, _), end in zip(self._outputs, ends, strict=True)
        ]

    @override
    def inputs(self, message: bytes) -> dict[str, Signal]:
        at = self._begin
        flags = message[HEADER_SIZE + 1 : at]  # and some padding
        for (name, shape, dtype, size), is_new in zip(self._inputs, flags, strict=False):
            if is_new:
                self._known[name] = np.ndarray(shape, dtype, message, at)
                at += size + -size % 16
        return dict(self._known)

    @override
    def _write(self, values: Sequence[Array], room: int) -> Sequence[Buffer]:
        found: list[Buffer] = [PACKED]
        for value, gap in zip(values, self._gaps, strict=True):
            found += value.data if value.flags.c_contiguous else value.tobytes(), gap
        return found


def shape_of(connector: Connector) -> tuple[int, ...]:
    """That of a signal without named axes."""
    return tuple(int(length) for length in connector.shape)


def size_of(connector: Connector) -> int:
    """What a signal of fixed size takes [byte]."""
    return np.dtype(connector.dtype).itemsize * math.prod(shape_of(connector))
