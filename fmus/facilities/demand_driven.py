"""Demand-driven sharing by abstract perception matrix matching (the paper)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

from typing_extensions import override

from fmus.facilities.answers import Answers, DemandedAnswers, WholeAnswers
from fmus.facilities.inputs import EgoInputs, Inputs
from fmus.facilities.layer import FacilitiesLayer
from fmus.facilities.load import Load, LoadParameters
from fmus.facilities.outbox import Arrival, Message
from fmus.facilities.received import Received
from fmus.facilities.sensor_data import ScanFeatures, SensorData
from fmus.facilities.sharing import Change, Sharing
from fmus.facilities.streams import Streams
from fmus.facilities.zones import ZONE_SIZE, Zones
from fmus.messages.apm import read_header
from fmus.messages.records import APM, NO_VEHICLE, REQUEST, SENSOR_DATA
from orchestrator.parameters import parameter
from orchestrator.timebase import Duration, Time, nanoseconds


class Facilities(FacilitiesLayer):
    """V2X facilities: BSMs, APM broadcasts and sensor sharing on demand, over packets.

    Every equipped vehicle broadcasts BSMs; every vehicle with a lidar broadcasts its APM
    after each scan. When a match triggers sensor fusion, the ego requests the data of the
    best sharer along the chosen route; a sharer that received a request sends one message
    per scan, and its APM again, along that route until the request expires. With `answer:
    demanded` a request says where the ego is blind, and the answer has only what is there. Only
    what the channel reports as received has any effect. Messages become ready in the step after
    the one that makes them.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(LoadParameters):
        """Message sizes and rates; defaults are the paper's Table I."""

        answer: Literal["all", "demanded"] = parameter(
            "all", doc="what a sharer sends of a scan: all, or what is demanded: the blind zones"
        )
        request_size: int = parameter(
            100, unit="B", minimum=1, doc="size of a request, without blind zones of 12 B each"
        )
        request_period: float = parameter(
            0.1, unit="s", minimum=0.01, doc="time between requests while fusion is triggered"
        )
        session: float = parameter(
            2.0, unit="s", minimum=0.01, doc="how long a sharer sends after a request"
        )

    def __init__(self, parameters: Parameters) -> None:
        super().__init__(parameters, received_scans=parameters.received_scans)
        self._parameters = parameters
        self._load = Load(parameters)

    @override
    def _sharing(self, start: Time, streams: Streams) -> Sharing:
        return DemandDriven(self._parameters, self._load, start)


@dataclass(slots=True)
class _Session:
    """An ego's request, as a sharer heard it: send sensor data along `route` until `end`.

    `number` is that of the ego among all egos, `ego` that of its vehicle.
    """

    end: Time
    number: int
    ego: int
    route: tuple[int, ...]
    zones: Zones


class DemandDriven(Sharing):
    """APMs to all, sensor data to who asked for them; each ego asks, and is answered, by itself."""

    def __init__(self, parameters: Facilities.Parameters, load: Load, start: Time) -> None:
        self._parameters = parameters
        self._load = load
        self._request_period = nanoseconds(parameters.request_period)
        self._session = nanoseconds(parameters.session)
        self._start = start
        self._next_request: dict[int, Time] = {}  # by number of the ego
        self._answers = _answers(parameters.answer, load)
        self._sessions: dict[tuple[int, int], _Session] = {}  # by sharer and number of the ego
        self._scanned: dict[int, bytes] = {}
        self._apms, self._objects = Change(), Change()
        self._features = ScanFeatures(load)

    @override
    def messages(self, inputs: Inputs, now: Time, h: Duration) -> list[Message]:
        self._sessions = {key: s for key, s in self._sessions.items() if s.end > now}
        new_apms = self._apms.is_new(inputs.apms)
        new_objects = self._objects.is_new(inputs.objects)
        self._features.update(inputs)
        due = [
            key
            for key in sorted(self._sessions)
            if self._answers.is_due(
                new_apms=new_apms,
                new_data=self._features.is_new_scan(key[0], new_objects=new_objects),
            )
        ]
        return [
            *(self._broadcasts(inputs, now) if new_apms else []),
            *(
                self._request(number, ego, now)
                for number, ego in enumerate(inputs.egos)
                if self._asks(number, ego, now)
            ),
            *(self._sensor_data(due, inputs, now) if due else []),
        ]

    @override
    def receive(self, arrival: Arrival, received: Received) -> None:
        message = arrival.message
        match message.content:
            case bytes() as apm:
                received.keep_apm(message.source, message.time, apm)
            case SensorData() as data:
                data.take_in(arrival, received)

    @override
    def receive_request(self, arrival: Arrival) -> None:
        match arrival.message.content:
            case _Session() as heard:
                key = (arrival.receiver, heard.number)
                self._sessions[key] = _with_newest_zones(self._sessions.get(key), heard)

    def _broadcasts(self, inputs: Inputs, now: Time) -> list[Message]:
        """A broadcast of every APM, and a copy along the route of each session.

        Obstacles that call for a relay keep the broadcast from the ego too; without the copy
        the match, and with it the session, would end.
        """
        equipped = set(inputs.vehicles.with_radio())
        self._scanned = {int(read_header(apm)["vehicle"]): apm for apm in inputs.apm_messages()}
        broadcasts = [
            Message(
                kind=APM,
                time=now,
                source=vehicle,
                size=len(apm),
                content=apm,
                access_category=2,
            )
            for vehicle, apm in self._scanned.items()
            if vehicle in equipped
        ]
        routed = [
            replace(message, destination=session.ego, route=session.route)
            for message in broadcasts
            for (sharer, _), session in sorted(self._sessions.items(), key=lambda item: item[0])
            if sharer == message.source and session.route
        ]
        return broadcasts + routed

    def _asks(self, number: int, ego: EgoInputs, now: Time) -> bool:
        if not ego.trigger or ego.vehicle == NO_VEHICLE:
            return False
        return now >= self._next_request.get(number, self._start)

    def _request(self, number: int, ego: EgoInputs, now: Time) -> Message:
        self._next_request[number] = now + self._request_period
        sharer = int(ego.sharers[0])
        route = () if ego.relay in {NO_VEHICLE, sharer, ego.vehicle} else (ego.relay,)
        end = now + self._session
        own = self._scanned.get(ego.vehicle)
        heading = None if own is None else float(read_header(own)["heading"])
        zones = self._answers.asked(ego.blind_zones, heading)
        return Message(
            kind=REQUEST,
            time=now,
            source=ego.vehicle,
            destination=sharer,
            route=route,
            size=self._parameters.request_size + ZONE_SIZE * len(zones),
            content=_Session(end, number, ego.vehicle, route, zones),
        )

    def _sensor_data(
        self, due: Sequence[tuple[int, int]], inputs: Inputs, now: Time
    ) -> list[Message]:
        objects = inputs.object_records()
        made = []
        for sharer, number in due:
            session = self._sessions[sharer, number]
            data = SensorData(
                objects=objects[objects["sensor"] == sharer], features=self._features.of(sharer)
            )
            answer = self._answers.answer(session.zones, self._scanned.get(sharer), data)
            made.append(
                Message(
                    kind=SENSOR_DATA,
                    time=now,
                    source=sharer,
                    destination=session.ego,
                    route=session.route,
                    size=answer.size,
                    content=answer.data,
                    access_category=2,
                    granularity=self._load.granularity(answer.data.features),
                )
            )
        return made


def _with_newest_zones(known: _Session | None, heard: _Session) -> _Session:
    """`heard`, with the zones of an earlier arrival that was asked for later."""
    is_older = known is not None and known.end > heard.end
    return replace(heard, zones=known.zones) if known and is_older else heard


def _answers(answer: Literal["all", "demanded"], load: Load) -> Answers:
    return DemandedAnswers(load.size(None)) if answer == "demanded" else WholeAnswers(load)
