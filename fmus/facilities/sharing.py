"""The ways of sharing perception, as the facilities layer sees them."""

import abc
from collections.abc import Set

import numpy as np

from fmus.facilities.inputs import Inputs, Vehicles
from fmus.facilities.outbox import Arrival, Message
from fmus.facilities.received import Received
from fmus.messages.apm import read_header
from fmus.messages.records import OBJECT
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time


class Sharing(abc.ABC):
    """What the vehicles send besides BSMs, and what a receiver makes of it."""

    @abc.abstractmethod
    def messages(self, inputs: Inputs, now: Time, h: Duration) -> list[Message]:
        """The messages that applications hand over in [`now`, `now + h`).

        Args:
            inputs: those of the facilities layer, at `now`.
            now: the communication point [ns].
            h: until the next one [ns].

        Returns:
            Messages whose `time` is that of their contents; the time that the vehicle's
            computer takes is added by the layer.
        """

    @abc.abstractmethod
    def receive(self, arrival: Arrival, received: Received) -> None:
        """Take in what arrived of a message at an ego.

        Args:
            arrival: of one of `messages`, other than requests; parts of it only if its
                granularity says so.
            received: what that ego knows, to be updated.
        """

    def receive_request(self, arrival: Arrival) -> None:
        """Take in a request at the vehicle that it asks; without requests nothing is to be done.

        Args:
            arrival: of one of `messages` of the kind `REQUEST`.
        """
        del arrival


class Change:
    """Tells when a message-like input is new; it holds its value until the next one."""

    def __init__(self) -> None:
        self._last: bytes | None = None

    def is_new(self, signal: bytes) -> bool:
        """Whether the signal changed since this was last asked."""
        changed = self._last != signal
        self._last = signal
        return changed


class Scans:
    """What the perception unit made of the last scans of all lidars, read once per scan.

    A vehicle has a lidar if there is an APM, or an object, of its scan.
    """

    def __init__(self) -> None:
        self._apms, self._tables = Change(), Change()
        self._objects: dict[int, Array] = {}
        self._lidars: frozenset[int] = frozenset()

    def update(self, inputs: Inputs) -> bool:
        """Read the inputs `apms` and `objects`; whether there were new scans."""
        new_apms = self._apms.is_new(inputs.apms)
        new_objects = self._tables.is_new(inputs.objects)
        if not (new_apms or new_objects):
            return False
        table = inputs.object_records()
        self._objects = {int(s): table[table["sensor"] == s] for s in np.unique(table["sensor"])}
        sources = {int(read_header(apm)["vehicle"]) for apm in inputs.apm_messages()}
        self._lidars = frozenset(sources | self._objects.keys())
        return True

    def senders(self, vehicles: Vehicles, others: Set[int] = frozenset()) -> list[int]:
        """The vehicles with a lidar and a radio, ascending; `others` have a lidar too."""
        return sorted((self._lidars | others).intersection(vehicles.with_radio()))

    def objects_of(self, vehicle: int) -> Array:
        """The objects in the last scan of one vehicle, `OBJECT` records of shape (object,)."""
        found = self._objects.get(vehicle)
        return _NOTHING if found is None else found


_NOTHING = np.empty(0, OBJECT)
