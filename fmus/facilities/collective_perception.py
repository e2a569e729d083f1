"""Collective perception: CPMs by the generation rules of ETSI TS 103 324."""

import bisect
import math
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from fmus.facilities import cpm
from fmus.facilities.cpm_rules import InclusionRules, Station
from fmus.facilities.inputs import Inputs
from fmus.facilities.layer import FacilitiesLayer, LayerParameters
from fmus.facilities.lower_layers import LowerLayers
from fmus.facilities.outbox import Arrival, Message
from fmus.facilities.received import Received
from fmus.facilities.sharing import Scans, Sharing
from fmus.facilities.streams import Streams
from fmus.messages.records import SENSOR_DATA
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time, nanoseconds


class CpmFacilities(FacilitiesLayer):
    """V2X facilities: BSMs, and collective perception messages of ETSI TS 103 324, over packets.

    Every equipped vehicle broadcasts BSMs; every vehicle with a lidar broadcasts the objects it
    tracks when they are new, have moved or changed their motion, or were not sent for a
    second. There are no APMs, requests, relays and features. `received.objects` has what the ego
    read from the messages that arrived, in the resolution of the messages.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(LayerParameters):
        """Generation rules, with the defaults of TS 103 324 V2.1.1, table F.1; lower layers."""

        maximum_age: float = parameter(
            1.5,
            unit="s",
            minimum=0.01,
            doc="age at which received contents are forgotten; objects at rest come once a second",
        )
        generation_period: float = parameter(
            0.1, unit="s", minimum=0.1, maximum=1.0, doc="time between generation events, T_GenCpm"
        )
        longest_period: float = parameter(
            1.0,
            unit="s",
            minimum=0.1,
            maximum=10.0,
            doc="time after which an object is included again, T_GenCpmMax",
        )
        sensor_information_period: float = parameter(
            1.0,
            unit="s",
            minimum=0.1,
            maximum=10.0,
            doc="time between sensor informations, T_AddSensorInformation",
        )
        position_change: float = parameter(
            4.0, unit="m", minimum=0.0, doc="an object that moved further is included"
        )
        speed_change: float = parameter(
            0.5, unit="m/s", minimum=0.0, doc="an object whose speed changed more is included"
        )
        orientation_change: float = parameter(
            4.0,
            unit="deg",
            minimum=0.0,
            maximum=180.0,
            doc="an object whose velocity turned more is included",
        )
        orientation_speed: float = parameter(
            0.5, unit="m/s", minimum=0.0, doc="slower objects have no direction of velocity"
        )
        sensor_range: float = parameter(
            50.0, unit="m", minimum=0.1, maximum=409.5, doc="range of the lidars, as announced"
        )
        signed: bool = parameter(True, doc="whether messages are signed (ETSI TS 103 097)")  # noqa: FBT003
        certificate_size: int = parameter(
            157, unit="B", minimum=1, maximum=65535, doc="size of a certificate"
        )
        certificate_period: float = parameter(
            1.0, unit="s", minimum=0.01, doc="time between certificates; else their digest is sent"
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters)
        cpm.require_codec()
        self._parameters = parameters
        self._lower = LowerLayers(
            signed=parameters.signed, certificate_size=parameters.certificate_size
        )
        self._capacity = _capacity(self._lower, parameters.fragment_size)

    @override
    def _sharing(self, start: Time, streams: Streams) -> Sharing:
        return CollectivePerception(self._parameters, self._lower, self._capacity, streams)


def _capacity(lower: LowerLayers, longest: int) -> int:
    """Objects that fit into a packet of `longest` bytes beside all else that a CPM can carry."""

    def packet(objects: int) -> int:
        return lower.size(cpm.longest(objects), certificate=True)

    if packet(1) > longest:
        raise ComponentTypeError(
            f"`fragment_size` is {longest} B; a collective perception message is not cut, and one "
            f"with a single object has up to {packet(1)} B"
        )
    return bisect.bisect_right(range(cpm.MOST_OBJECTS + 1), longest, key=packet) - 1


@dataclass(slots=True)
class _Sender:
    """One vehicle's service: its generation events and what it has sent."""

    phase: Duration
    station: Station
    next_information: Time
    next_certificate: Time


class CollectivePerception(Sharing):
    """CPMs of all vehicles with a lidar and a radio."""

    def __init__(
        self,
        parameters: CpmFacilities.Parameters,
        lower: LowerLayers,
        capacity: int,
        streams: Streams,
    ) -> None:
        self._period = nanoseconds(parameters.generation_period)
        self._information_period = nanoseconds(parameters.sensor_information_period)
        self._certificate_period = nanoseconds(parameters.certificate_period)
        self._sensor_range = parameters.sensor_range
        self._lower = lower
        self._capacity = capacity
        self._streams = streams
        self._rules = InclusionRules(
            longest=nanoseconds(parameters.longest_period),
            position_change=parameters.position_change,
            speed_change=parameters.speed_change,
            orientation_change=math.radians(parameters.orientation_change),
            orientation_speed=parameters.orientation_speed,
        )
        self._scans = Scans()
        self._senders: dict[int, _Sender] = {}

    @override
    def messages(self, inputs: Inputs, now: Time, h: Duration) -> list[Message]:
        self._scans.update(inputs)
        made: list[Message] = []
        for vehicle in self._scans.senders(inputs.vehicles):
            sender = self._sender(vehicle, now)
            event = now + (sender.phase - now) % self._period
            if event < now + h:
                made += self._generate(inputs, vehicle, sender, event)
        return made

    @override
    def receive(self, arrival: Arrival, received: Received) -> None:
        match arrival.message.content:
            case bytes() as encoded:
                received.update_objects(arrival.message.source, cpm.decode(encoded).objects)

    def _sender(self, vehicle: int, now: Time) -> _Sender:
        if vehicle not in self._senders:
            phase = int(self._streams.of(vehicle).integers(self._period))
            self._senders[vehicle] = _Sender(phase, Station(self._rules), now, now)
        return self._senders[vehicle]

    def _generate(
        self, inputs: Inputs, vehicle: int, sender: _Sender, event: Time
    ) -> list[Message]:
        """The messages of one generation event: none, one, or one per segment."""
        objects = self._scans.objects_of(vehicle)
        most = self._capacity * cpm.MOST_SEGMENTS
        chosen = objects[sender.station.select(objects, event, most)]
        informs = event >= sender.next_information
        if not informs and len(chosen) == 0:
            return []
        if informs:
            sender.next_information = event + self._information_period
        row = int(np.flatnonzero(inputs.vehicles.id == vehicle)[0])
        shift, angle = inputs.errors.of(vehicle) or (0.0, 0.0)
        parts = self._parts(chosen)
        return [
            self._message(
                sender,
                cpm.Cpm(
                    station=vehicle,
                    time=event,
                    position=inputs.vehicles.position[row, :2] + shift,
                    heading=float(inputs.vehicles.heading[row]) + angle,
                    objects=part,
                    ages=sender.station.ages(part, event),
                    perceived=len(objects),
                    sensor_range=self._sensor_range if informs and k == 0 else None,
                    segment=cpm.Segment(number=k + 1, total=len(parts)) if len(parts) > 1 else None,
                ),
            )
            for k, part in enumerate(parts)
        ]

    def _parts(self, objects: Array) -> list[Array]:
        """The objects of each segment; one empty segment if there are none."""
        starts = range(0, max(len(objects), 1), self._capacity)
        return [objects[start : start + self._capacity] for start in starts]

    def _message(self, sender: _Sender, content: cpm.Cpm) -> Message:
        certified = content.time >= sender.next_certificate
        if certified:
            sender.next_certificate = content.time + self._certificate_period
        encoded = cpm.encode(content)
        return Message(
            kind=SENSOR_DATA,
            time=content.time,
            source=content.station,
            size=self._lower.size(len(encoded), certificate=certified),
            content=encoded,
            access_category=2,
        )
