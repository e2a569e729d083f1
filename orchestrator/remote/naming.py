"""Values that are named instead of sent, because they are where they are to go already.

Components that one `nlosim serve` has give their outputs to it before the run gets them. When the
run then has one of these values as an input of another component there, it says whose output it
is, and the server fills it in: an array goes over the network once, and not there and back.
"""

import struct
from collections.abc import Iterable, Mapping
from typing import Final, NamedTuple

from orchestrator.remote.block import WireError
from orchestrator.remote.protocol import Message
from orchestrator.signal import Signal, Signals

LEAST: Final = 256
"""Smaller values travel: a name is not much shorter [byte]."""

_NAME: Final = struct.Struct("<IIQ")


class Name(NamedTuple):
    """Which value is meant.

    Attributes:
        component: whose output it is.
        output: the number of the output, in the order of its connectors.
        epoch: of the reply that it came with.
        sequence: of that reply.
    """

    component: str
    output: int
    epoch: int
    sequence: int

    def encode(self) -> bytes:
        """The name as bytes."""
        head = _NAME.pack(self.output, self.epoch, self.sequence)
        return head + self.component.encode()

    @classmethod
    def decode(cls, raw: bytes) -> "Name":
        """The name that `encode` wrote.

        Raises:
            WireError: it is none.
        """
        try:
            output, epoch, sequence = _NAME.unpack_from(raw)
            return cls(raw[_NAME.size :].decode(), output, epoch, sequence)
        except (struct.error, UnicodeDecodeError) as error:
            raise WireError(f"this is no name of a value: {error}") from None


class Origins:
    """The values that components of one server gave last; older ones may be gone there."""

    def __init__(self) -> None:
        self._names: dict[int, tuple[Signal, bytes]] = {}
        self._newest: dict[tuple[str, str], Signal] = {}
        self._numbers: dict[str, Mapping[str, int]] = {}

    def begin(self, component: str, outputs: Iterable[str]) -> None:
        """Have a component here that has given nothing yet.

        Args:
            component: its name.
            outputs: their names, in the order of its connectors.
        """
        self._numbers[component] = {name: number for number, name in enumerate(outputs)}

    def note(self, component: str, values: Signals, reply: Message) -> None:
        """Note what a component gave.

        Args:
            component: its name.
            values: its outputs.
            reply: with which they came.
        """
        numbers = self._numbers[component]
        for output, value in values.items():
            key = component, output
            if self._newest.get(key) is value:
                continue
            self._drop(key)
            if _size(value) >= LEAST:
                self._newest[key] = value
                name = Name(component, numbers[output], reply.epoch, reply.sequence)
                self._names[id(value)] = value, name.encode()

    def forget(self, component: str) -> None:
        """Forget what a component gave: it starts anew, perhaps somewhere else."""
        for key in [key for key in self._newest if key[0] == component]:
            self._drop(key)

    def name_of(self, value: Signal) -> bytes | None:
        """The name of this very object; `None` if it has none."""
        found = self._names.get(id(value))
        return None if found is None else found[1]

    def _drop(self, key: tuple[str, str]) -> None:
        value = self._newest.pop(key, None)
        if value is not None:
            del self._names[id(value)]


class Sites:
    """Where the components of a run are, as far as values can be named there."""

    def __init__(self) -> None:
        self._origins: dict[str, Origins] = {}

    def come_to(self, site: str, component: str, outputs: Iterable[str]) -> Origins:
        """What is known at the site where a component begins; what it gave before is forgotten.

        Args:
            site: see `Link.site`; where it is empty, the component is alone.
            component: its name.
            outputs: their names, in the order of its connectors.
        """
        for origins in self._origins.values():
            origins.forget(component)
        found = self._origins.setdefault(site, Origins()) if site else Origins()
        found.begin(component, outputs)
        return found


def _size(value: Signal) -> int:
    return len(value) if isinstance(value, bytes) else int(value.nbytes)
