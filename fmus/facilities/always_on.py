"""Always-on sharing: every sensor's data to everybody, after every scan."""

from dataclasses import dataclass

from typing_extensions import override

from fmus.facilities.inputs import Inputs
from fmus.facilities.layer import FacilitiesLayer
from fmus.facilities.load import Load, LoadParameters
from fmus.facilities.outbox import Arrival, Message
from fmus.facilities.received import Received
from fmus.facilities.sensor_data import ScanFeatures, SensorData
from fmus.facilities.sharing import Scans, Sharing
from fmus.facilities.streams import Streams
from fmus.messages.records import SENSOR_DATA
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
        super().__init__(parameters, received_scans=parameters.received_scans)
        self._load = Load(parameters)

    @override
    def _sharing(self, start: Time, streams: Streams) -> Sharing:
        return AlwaysOn(self._load)


class AlwaysOn(Sharing):
    """Broadcasts of sensor data.

    Args:
        load: how they become messages.
    """

    def __init__(self, load: Load) -> None:
        self._load = load
        self._scans = Scans()
        self._features = ScanFeatures(load)

    @override
    def messages(self, inputs: Inputs, now: Time, h: Duration) -> list[Message]:
        new_objects = self._scans.update(inputs)
        if not self._features.update(inputs) and not new_objects:
            return []
        return [
            self._message(vehicle, now)
            for vehicle in self._scans.senders(inputs.vehicles, self._features.vehicles())
            if self._features.is_new_scan(vehicle, new_objects=new_objects)
        ]

    @override
    def receive(self, arrival: Arrival, received: Received) -> None:
        match arrival.message.content:
            case SensorData() as data:
                data.take_in(arrival, received)

    def _message(self, vehicle: int, now: Time) -> Message:
        features = self._features.of(vehicle)
        return Message(
            kind=SENSOR_DATA,
            time=now,
            source=vehicle,
            size=self._load.size(features),
            content=SensorData(objects=self._scans.objects_of(vehicle), features=features),
            access_category=2,
            granularity=self._load.granularity(features),
        )
