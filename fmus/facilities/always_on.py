"""Always-on sharing: every sensor's data to everybody, after every scan."""

from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.facilities.layer import FacilitiesLayer
from fmus.facilities.load import LoadParameters
from fmus.facilities.outbox import Message
from fmus.facilities.received import Received
from fmus.facilities.sharing import Scans, Sharing
from fmus.records import SENSOR_DATA
from orchestrator.signal import Signals
from orchestrator.timebase import Duration, Time


class AlwaysOnFacilities(FacilitiesLayer):
    """V2X facilities: BSMs, and the sensor data of every scan to everybody, over packets.

    Every equipped vehicle broadcasts BSMs; every vehicle with a lidar broadcasts its sensor
    data after each scan, whoever needs them. There are no APMs, requests and relays.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(LoadParameters):
        """Message sizes and rates; defaults are the paper's Table I, as on demand."""

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        self._size = parameters.scan_size

    @override
    def _sharing(self, start: Time, rng: np.random.Generator) -> Sharing:
        return AlwaysOn(self._size)


class AlwaysOn(Sharing):
    """Broadcasts of sensor data.

    Args:
        size: of the sensor data of one scan [byte].
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._scans = Scans()

    @override
    def messages(self, inputs: Signals, now: Time, h: Duration) -> list[Message]:
        if not self._scans.update(inputs):
            return []
        return [
            Message(
                kind=SENSOR_DATA,
                time=now,
                source=vehicle,
                size=self._size,
                content=self._scans.objects_of(vehicle),
                access_category=2,
            )
            for vehicle in self._scans.senders(inputs)
        ]

    @override
    def receive(self, message: Message, receiver: int, received: Received) -> None:
        match message.content:
            case np.ndarray() as objects:
                received.replace_objects(message.source, message.time, objects)
