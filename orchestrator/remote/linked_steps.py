"""Steps of a remote component that compiled code begins and waits for.

The engine writes the inputs into memory of ours and reads the outputs in one of two rooms; see
`orchestrator.remote.laid_out` for how they come and go. It understands the usual reply only. At any
other one, at silence and at the end of the host the dialogue goes on from what came.
"""

import abc
import ctypes
import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from typing_extensions import Buffer, override

from orchestrator.limits import Deadlines
from orchestrator.native import NativeKind, NativeLink, NativePlace, NativeUnit, NativeVariable
from orchestrator.plan import layouts
from orchestrator.remote.block import WireError, padding
from orchestrator.remote.dialogue import Dialogue
from orchestrator.remote.laid_out import PACKED, shape_of, size_of
from orchestrator.remote.patience import SLICE
from orchestrator.remote.protocol import HEADER_SIZE, Kind, Message
from orchestrator.remote.segment import PlaceError
from orchestrator.remote.transport import LinkLostError
from orchestrator.signal import Array, Causality, Connector, Signal, Signals
from orchestrator.timebase import Duration, Time

_FRAME: Final = struct.Struct("<Q")
"""What is in front of a message: how long it is."""

_STEP: Final = struct.Struct("<qq")
_TIME: Final = 32
_ROOM: Final = 56
"""Where a command has its time and its length, and the number of the room for outputs [byte]."""

_MOST: Final = 1 << 20
"""All signals of a component together; more are copied sooner by their places [byte]."""

_ALIGNED: Final = 64
_KINDS: Final = {np.dtype("f4"): NativeKind.FLOAT32, np.dtype("f8"): NativeKind.FLOAT64}


class LinkedSteps(NativeLink):
    """What the engine knows of one remote component, which is set up.

    Args:
        dialogue: with its host.
        connectors: of the component, see `can_be_laid_out`.
        deadlines: for the host.
        accept: takes outputs that came without a message.
    """

    def __init__(
        self,
        dialogue: Dialogue,
        connectors: Mapping[str, Connector],
        *,
        deadlines: Deadlines,
        accept: Callable[[Signals], None],
    ) -> None:
        self._dialogue = dialogue
        self._connectors = connectors
        self._deadlines = deadlines
        self._accept = accept
        self._link = layouts.Link()
        self._names = [n for n, c in connectors.items() if c.causality is Causality.INPUT]
        self._places: Mapping[str, NativePlace] = {}
        self._rooms: Sequence[Array] = ()
        self._memory: Array = np.zeros(0, np.uint8)
        self._command: Array = self._memory
        self.address = ctypes.addressof(self._link)
        self.inputs: dict[str, int] = {}
        dialogue.before_listening = self._hand_over

    @abc.abstractmethod
    def _make_rooms(self, document: dict[str, Any], size: int) -> None:
        """Make the memory for inputs and outputs, and agree on it with the host.

        Args:
            document: of the command, but for what is to be added.
            size: of the inputs [byte].
        """

    @abc.abstractmethod
    def outputs_in(self, raw: bytes, offset: int) -> Signals | None:
        """The outputs of a usual reply, read-only; `None` if it is none.

        Args:
            raw: the reply.
            offset: where its block begins [byte].
        """

    def unit(self) -> NativeUnit:
        """The component as a unit of a plan."""
        variables = {
            name: NativeVariable(
                type=name if c.causality is Causality.INPUT else np.dtype(c.dtype).str,
                kind=_KINDS.get(np.dtype(c.dtype), NativeKind.PLAIN),
                reference=self._names.index(name) if c.causality is Causality.INPUT else 0,
                shape=shape_of(c),
            )
            for name, c in self._connectors.items()
        }
        no_calls = dict.fromkeys((each.type for each in variables.values()), 0)
        return NativeUnit(
            version=0,
            instance=0,
            step=0,
            keeps_state=True,
            flags=(0, 0, 0),
            last_time=0,
            setters=no_calls,
            getters=no_calls,
            variables=variables,
            owner=self,
            link=self,
        )

    @override
    def lay_out(self, outputs: Mapping[str, NativePlace], size: int) -> Sequence[Array]:
        offsets, end = {}, 0
        for name in self._names:
            offsets[name] = end
            end += _aligned(size_of(self._connectors[name]))
        self._places = dict(sorted(outputs.items(), key=lambda each: each[1].offset))
        document = {
            "inputs": offsets,
            "outputs": {name: each.offset for name, each in self._places.items()},
            "room": size,
        }
        self._make_rooms(document, max(end, 1))
        begin = self._memory.ctypes.data
        self.inputs = {name: begin + offset for name, offset in offsets.items()}
        self._prepare()
        return self._rooms

    def _agree(self, document: Mapping[str, Any]) -> Mapping[str, Any]:
        """Tell the host; its answer."""
        self._dialogue.ask(Kind.LAY_OUT, self._deadlines.setup, document=document)
        return self._dialogue.answer().message.document

    def _prepare(self) -> None:
        """Write the messages, but for what is different in each step."""
        epoch, flags = self._dialogue.epoch, bytes(1 + len(self._names))
        command = Message(Kind.STEP_LAID_OUT, epoch, 0).encode([flags, padding(len(flags))])
        usual = Message(Kind.DONE, epoch, 0).encode()
        self._command = np.frombuffer(bytearray(_FRAME.pack(len(command)) + command), np.uint8)
        link = self._link
        link.command, link.size = self._command.ctypes.data, len(self._command)
        link.inputs = len(self._names)
        link.slot = (ctypes.c_void_p * 2)(*(room.ctypes.data for room in self._rooms))
        link.usual = (ctypes.c_uint8 * layouts.REPLY)(*_FRAME.pack(len(usual)), *usual)

    @override
    def enter(self, *, is_begun: bool) -> None:
        self._link.sequence = self._dialogue.sequence
        self._link.is_begun = self._link.is_handed = is_begun

    @override
    def leave(self) -> tuple[Time, Duration] | None:
        self._hand_over()
        self._dialogue.sequence = self._link.sequence
        return self._step if self._link.is_begun else None

    def _hand_over(self) -> None:
        """Let the dialogue wait for the step that is under way, if there is one."""
        link = self._link
        if link.is_begun and not link.is_handed:
            link.is_handed = True
            t, h = self._step
            came = bytes(link.reply[: link.came])
            within = self._deadlines.step
            self._dialogue.carry_on(within, t=t, h=h, sequence=link.sequence, came=came)

    @property
    def _step(self) -> tuple[Time, Duration]:
        """That of the last command."""
        t, h = _STEP.unpack_from(self._command.tobytes(), _TIME)
        return t, h

    def _views(self, content: bytes, begin: int) -> Signals:
        """The outputs in a room that begins at `begin`."""
        return {
            name: np.ndarray(place.shape, place.dtype, content, begin + place.offset)
            for name, place in self._places.items()
        }

    # ---- the owner ----

    @override
    def complete_step(self, status: int, t: Time, h: Duration) -> None:
        del status, t, h
        self._hand_over()
        self._link.is_begun = self._link.is_handed = False

    @override
    def adopt(self, driven: Sequence[str], written: Mapping[str, Signal], read: Signals) -> None:
        del driven, written
        self._accept(read)

    @override
    def is_written(self, name: str, value: Signal) -> bool:
        return False  # what the host was told in a message is not in the memory

    @override
    def count_calls(self, address: int | None) -> None:
        pass

    @override
    def setting_failed(self, type_: str, names: Sequence[str], status: int) -> None:
        pass

    @override
    def getting_failed(self, type_: str, status: int) -> None:
        pass


class SharedSteps(LinkedSteps):
    """Values are in memory that both processes see; messages go over a socket.

    Args:
        dialogue, connectors: see `LinkedSteps`.
        descriptor: of the socket.
        settings: likewise, those with a name.
    """

    def __init__(
        self,
        dialogue: Dialogue,
        connectors: Mapping[str, Connector],
        descriptor: int,
        **settings: Any,
    ) -> None:
        super().__init__(dialogue, connectors, **settings)
        self._link.descriptor = descriptor

    @override
    def _make_rooms(self, document: dict[str, Any], size: int) -> None:
        room = _aligned(document["room"])
        place, self._memory = self._dialogue.memory.reserve(size)
        said = self._agree({**document, "place": place, "size": size, "room": room})
        with self._dialogue.reading():
            self._rooms = [
                self._mapped(said["place"] + k * room, document["room"]) for k in range(2)
            ]

    def _mapped(self, place: int, size: int) -> Array:
        try:
            return self._dialogue.memory.mapped(place, size)
        except PlaceError as error:
            raise WireError(str(error)) from None

    @override
    def outputs_in(self, raw: bytes, offset: int) -> Signals | None:
        if offset != len(raw):
            return None
        return self._views(self._rooms[self._command[_ROOM]].tobytes(), 0)


class PackedSteps(LinkedSteps):
    """Values are in the messages, which Python sends and receives."""

    def __init__(
        self, dialogue: Dialogue, connectors: Mapping[str, Connector], **settings: Any
    ) -> None:
        super().__init__(dialogue, connectors, **settings)
        self._callbacks = layouts.Say(self._say), layouts.Hear(self._hear)
        self._link.say, self._link.hear = (
            ctypes.cast(each, ctypes.c_void_p) for each in self._callbacks
        )
        self._came: bytes | None = None
        self._raised: BaseException | None = None
        self._parts: list[tuple[memoryview, bytes]] = []
        self._head = self._flags = memoryview(b"")
        self._usual = memoryview(b"")
        self._into: list[memoryview] = []

    @override
    def _make_rooms(self, document: dict[str, Any], size: int) -> None:
        self._agree(document)
        self._memory = np.zeros(size, np.uint8)
        self._rooms = [np.zeros(document["room"], np.uint8) for _ in range(2)]
        self._into = [room.data for room in self._rooms]
        sizes = {name: size_of(self._connectors[name]) for name in self._names}
        self._parts = [
            (self._memory.data[begin : begin + sizes[name]], padding(sizes[name]))
            for name, begin in document["inputs"].items()
        ]

    @override
    def _prepare(self) -> None:
        super()._prepare()
        self._head = self._command.data[_FRAME.size :]
        self._flags = self._head[HEADER_SIZE + 1 :][: len(self._names)]
        usual = np.frombuffer(self._link.usual, np.uint8)
        self._usual = usual.data[_FRAME.size :]  # the engine numbers it

    def _say(self) -> None:
        """Send the command, with the inputs that changed."""
        try:
            parts: list[Buffer] = [self._head]
            for part, is_new in zip(self._parts, self._flags.tobytes(), strict=True):
                if is_new:
                    parts += part
            self._dialogue.say(b"".join(parts))
        except LinkLostError:
            pass  # whoever waits for the reply hears of it
        except BaseException as error:
            self._raised = error

    def _hear(self) -> int:
        """Wait for the reply, but not for long; whether it is the usual one."""
        if self._raised is not None:
            return False
        try:
            raw = self._dialogue.hear(SLICE)
        except (TimeoutError, LinkLostError):
            return False
        except BaseException as error:
            self._raised = error
            return False
        if not self._is_usual(raw):
            self._came = raw
            return False
        self._into[self._command[_ROOM]][:] = memoryview(raw)[HEADER_SIZE + len(PACKED) :]
        return True

    def _is_usual(self, raw: bytes) -> bool:
        """Whether it answers the last command with packed outputs and nothing else."""
        head = HEADER_SIZE + len(PACKED)
        return (
            len(raw) == head + len(self._into[0])
            and raw[:HEADER_SIZE] == self._usual
            and raw[HEADER_SIZE:head] == PACKED
        )

    @override
    def _hand_over(self) -> None:
        is_news = self._link.is_begun and not self._link.is_handed
        super()._hand_over()
        if is_news and self._came is not None:
            came, self._came = self._came, None
            self._dialogue.take_in(came)

    @override
    def complete_step(self, status: int, t: Time, h: Duration) -> None:
        super().complete_step(status, t, h)
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised

    @override
    def outputs_in(self, raw: bytes, offset: int) -> Signals | None:
        if raw[offset : offset + len(PACKED)] != PACKED:
            return None
        begin = offset + len(PACKED)
        if len(raw) - begin != len(self._rooms[0]):
            raise WireError(f"outputs of {len(raw) - begin} bytes, not {len(self._rooms[0])}")
        return self._views(raw, begin)


def linked_steps(
    dialogue: Dialogue, connectors: Mapping[str, Connector], **settings: Any
) -> LinkedSteps | None:
    """Steps in the way that suits the link; `None` if none does. See `LinkedSteps`."""
    if dialogue.descriptor is not None:
        return SharedSteps(dialogue, connectors, dialogue.descriptor, **settings)
    return PackedSteps(dialogue, connectors, **settings) if dialogue.packs else None


def can_be_laid_out(connectors: Mapping[str, Connector]) -> bool:
    """Whether all values are numbers, as many in each step, and not too many."""
    return (
        all(
            not c.is_binary
            and np.dtype(c.dtype) in layouts.TYPES
            and all(isinstance(length, int) for length in c.shape)
            for c in connectors.values()
        )
        and sum(map(size_of, connectors.values())) <= _MOST
    )


def _aligned(size: int) -> int:
    return -(-size // _ALIGNED) * _ALIGNED
