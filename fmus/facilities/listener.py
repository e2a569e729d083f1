"""What one ego vehicle knows from messages."""

import numpy as np

from fmus.facilities.bsm import Bsm, Neighbourhood
from fmus.facilities.clocks import Clocks
from fmus.facilities.inputs import EgoInputs
from fmus.facilities.link_power import Announcements, Powers
from fmus.facilities.outbox import Message
from fmus.facilities.received import Received
from fmus.messages.records import NO_VEHICLE
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time


class Listener:
    """What reached one ego: BSMs, powers that its neighbours announce, and what is shared.

    While the ego is not there nothing reaches it, and what did is forgotten when it is too old.

    Args:
        maximum_age: when things are forgotten [ns].
        received_scans: most scans of one source in `received.features`.
        clocks: of all vehicles.

    Attributes:
        received: what others shared.
    """

    def __init__(self, maximum_age: Duration, received_scans: int, clocks: Clocks) -> None:
        self._clocks = clocks
        self._vehicle = NO_VEHICLE
        self.received = Received(maximum_age, received_scans, self._lead)
        self._neighbourhood = Neighbourhood(maximum_age)
        self._announcements = Announcements(maximum_age)
        self._sensor_data = np.array(0, np.int64)

    def assign(self, vehicle: int) -> None:
        """Say which vehicle the ego is now; `NO_VEHICLE` while it is not there."""
        self._vehicle = vehicle

    def _lead(self, source: int) -> Duration:
        """How far the clock of `source` is ahead of the ego's [ns]."""
        return self._clocks.lead(source, self._vehicle)

    def receive_bsm(self, message: Message, bsm: Bsm) -> None:
        """Take in `bsm`, the contents of `message`."""
        self._neighbourhood.receive(bsm.state)
        self._announcements.receive(message.source, message.time, bsm.heard)

    def count_sensor_data(self, packets: int) -> None:
        """So many packets of sensor data reached it."""
        if packets:
            self._sensor_data = np.array(self._sensor_data + packets)

    def outputs(self, ego: EgoInputs, measured: Powers, now: Time) -> Signals:
        """The connectors `received.*` of an ego that is not named.

        Args:
            ego: what concerns it at `now`.
            measured: what its radio measures.
            now: the communication point [ns].
        """
        links = self._announcements.links(now, ego.sharers[ego.sharers != NO_VEHICLE])
        return {
            **self.received.outputs(now),
            "received.sensor_data.count": self._sensor_data,
            **self._neighbourhood.outputs(now, ego.vehicle),
            **links.outputs(ego.vehicle, measured),
        }
