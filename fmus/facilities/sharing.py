"""The ways of sharing perception, as the facilities layer sees them."""

import abc
from collections.abc import Set

import numpy as np

from fmus.facilities.outbox import Arrival, Message
from fmus.facilities.received import Received
from fmus.messages.apm import split
from fmus.messages.records import APM_HEADER, OBJECT, unframe
from orchestrator.signal import Array, Signal, Signals
from orchestrator.timebase import Duration, Time


class Sharing(abc.ABC):
    """What the vehicles send besides BSMs, and what a receiver makes of it."""

    @abc.abstractmethod
    def messages(self, inputs: Signals, now: Time, h: Duration) -> list[Message]:
        """The messages that applications hand over in [`now`, `now + h`).

        Args:
            inputs: of the facilities layer, at `now`.
            now: the communication point [ns].
            h: until the next one [ns].

        Returns:
            Messages whose `time` is that of their contents; the time that the vehicle's
            computer takes is added by the layer.
        """

    @abc.abstractmethod
    def receive(self, arrival: Arrival, received: Received) -> None:
        """Take in what arrived of a message.

        Args:
            arrival: of one of `messages`, at the ego or whoever received a request; parts of it
                only if its granularity says so.
            received: what the ego knows, to be updated.
        """


class Changes:
    """Tells which message-like inputs are new; they hold their value until the next one."""

    def __init__(self) -> None:
        self._last: dict[str, Signal] = {}

    def is_new(self, name: str, inputs: Signals) -> bool:
        """Whether the input changed since this was last asked."""
        value = inputs[name]
        changed = self._last.get(name) != value
        self._last[name] = value
        return changed


class Scans:
    """What the perception unit made of the last scans of all lidars, read once per scan.

    A vehicle has a lidar if there is an APM, or an object, of its scan.
    """

    def __init__(self) -> None:
        self._changes = Changes()
        self._objects: dict[int, Array] = {}
        self._lidars: frozenset[int] = frozenset()

    def update(self, inputs: Signals) -> bool:
        """Read the inputs `apms` and `objects`; whether there were new scans."""
        new_apms = self._changes.is_new("apms", inputs)
        new_objects = self._changes.is_new("objects", inputs)
        if not (new_apms or new_objects):
            return False
        table = unframe("OBJS", bytes(inputs["objects"]), OBJECT)
        self._objects = {int(s): table[table["sensor"] == s] for s in np.unique(table["sensor"])}
        apms = split(bytes(inputs["apms"]))
        sources = {int(np.frombuffer(apm, APM_HEADER, 1)[0]["vehicle"]) for apm in apms}
        self._lidars = frozenset(sources | self._objects.keys())
        return True

    def senders(self, inputs: Signals, others: Set[int] = frozenset()) -> list[int]:
        """The vehicles with a lidar and a radio, ascending; `others` have a lidar too."""
        radios = np.asarray(inputs["vehicle.equipped"])
        lidars = self._lidars | others
        return sorted(lidars.intersection(np.asarray(inputs["vehicle.id"])[radios].tolist()))

    def objects_of(self, vehicle: int) -> Array:
        """`OBJECT` records of the last scan of one vehicle."""
        found = self._objects.get(vehicle)
        return _NOTHING if found is None else found


_NOTHING = np.empty(0, OBJECT)
