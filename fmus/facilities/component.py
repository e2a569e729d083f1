"""The facilities component: generates the messages of all vehicles and receives the ego's."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import override

from fmus.apm import decode, join, split
from fmus.facilities.bsm import BsmSender, Neighbourhood
from fmus.facilities.connectors import CONNECTORS
from fmus.facilities.held import HeldSignal
from fmus.facilities.outbox import Message, Outbox
from fmus.records import (
    APM,
    BSM,
    NO_VEHICLE,
    OBJECT,
    OUTCOMES,
    RECEPTION,
    REQUEST,
    SENSOR_DATA,
    frame,
    unframe,
)
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Array, Connector, Signal, Signals
from orchestrator.timebase import Duration, Time, nanoseconds

_RECEIVED = OUTCOMES.index("R")


@dataclass(slots=True)
class _Session:
    """The ego's request, as a sharer heard it: send sensor data along `route` until `end`."""

    end: Time
    ego: int
    route: tuple[int, ...]


class Facilities(Component):
    """V2X facilities: BSMs, APM broadcasts and sensor sharing of all vehicles, over packets.

    Every equipped vehicle broadcasts BSMs; every vehicle with a lidar broadcasts its APM
    after each scan. When a match triggers sensor fusion, the ego requests the data of the
    best sharer along the chosen route; a sharer that received a request sends one message
    per scan, and its APM again, along that route until the request expires. Only what the
    channel reports as received has any effect. Messages become ready in the step after the one
    that makes them.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """Message sizes and rates; defaults are the paper's Table I."""

        bsm_period: float = parameter(0.1, unit="s", minimum=0.01, doc="time between BSMs")
        bsm_size: int = parameter(200, unit="B", minimum=1, doc="size of a BSM")
        sensor_data_size: int = parameter(
            200, unit="B", minimum=1, doc="size of the sensor data sent after each scan"
        )
        request_size: int = parameter(100, unit="B", minimum=1, doc="size of a request")
        request_period: float = parameter(
            0.1, unit="s", minimum=0.01, doc="time between requests while fusion is triggered"
        )
        session: float = parameter(
            2.0, unit="s", minimum=0.01, doc="how long a sharer sends after a request"
        )
        fragment_size: int = parameter(
            1400, unit="B", minimum=1, doc="longest packet; longer messages are cut"
        )
        maximum_age: float = parameter(
            1.0, unit="s", minimum=0.01, doc="age at which received contents are forgotten"
        )
        processing_time: float = parameter(
            0.01,
            unit="s",
            minimum=0.0,
            doc="at most this long after its scan a message reaches the radio; drawn uniformly",
        )

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        given = self._parameters
        self._now = start
        self._maximum_age = nanoseconds(given.maximum_age)
        self._request_period = nanoseconds(given.request_period)
        self._bsm = BsmSender(nanoseconds(given.bsm_period), rng)
        self._rng = rng
        self._neighbourhood = Neighbourhood(self._maximum_age)
        self._outbox = Outbox(given.fragment_size, 2 * self._maximum_age)
        self._sessions: dict[int, _Session] = {}
        self._next_request = start
        self._last: dict[str, Signal] = {}
        self._apms: dict[int, tuple[Time, bytes]] = {}
        self._objects: dict[int, Array] = {}
        self._apms_signal = HeldSignal(join)
        self._objects_signal = HeldSignal(_objects_frame)
        self._outputs: Signals = {
            name: connector.start_value()
            for name, connector in CONNECTORS.items()
            if name.startswith(("packets", "received"))
        }

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._now = t + h
        ego = int(np.asarray(inputs["ego.id"]))
        self._receive(inputs, ego)
        self._sessions = {v: s for v, s in self._sessions.items() if s.end > self._now}
        made = [
            *self._apms_sent(inputs),
            *self._requests(inputs, ego),
            *self._sensor_data(inputs),
        ]
        messages = [*self._safety_messages(inputs, h), *map(self._processed, made)]
        self._outbox.forget(self._now)
        self._outputs = {
            "packets": self._outbox.send(messages),
            "received.apms": self._received_apms(),
            "received.objects": self._shared_objects(),
            **self._neighbourhood.outputs(self._now, ego),
        }

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _receive(self, inputs: Signals, ego: int) -> None:
        """Take in what arrived."""
        if not self._is_new("receptions", inputs):
            return
        rows = unframe("RCPT", bytes(inputs["receptions"]), RECEPTION)
        good = (rows["outcome"] == _RECEIVED) & (rows["addressed"] == 1)
        wanted = (rows["receiver"] == ego) | (rows["kind"] == REQUEST)
        for message, receiver in self._outbox.arrivals(rows[good & wanted]):
            if message.destination not in {receiver, NO_VEHICLE}:
                continue  # a relay has it; the ego may be one
            match message.content:
                case np.void() as bsm if message.kind == BSM:
                    self._neighbourhood.receive(bsm)
                case bytes() as apm:
                    self._apms[message.source] = (message.time, apm)
                case np.ndarray() as objects:
                    self._keep_objects(message, objects)
                case _Session() as session:
                    self._sessions[receiver] = session

    def _keep_objects(self, message: Message, objects: Array) -> None:
        known = self._objects.get(message.source)
        if known is None or len(objects) == 0 or known["time"][0] < objects["time"][0]:
            self._objects[message.source] = objects

    def _safety_messages(self, inputs: Signals, h: Duration) -> list[Message]:
        times, contents = self._bsm.due(inputs, self._now, self._now + h)
        return [
            Message(
                kind=BSM,
                time=int(time),
                source=int(content["id"]),
                size=self._parameters.bsm_size,
                content=content,
            )
            for time, content in zip(times, contents, strict=True)
        ]

    def _processed(self, message: Message) -> Message:
        """`message` when its vehicle's computer is done with it.

        All sensors scan at the same instant here. Computers that also answered at the same
        instant would let the radios collide every time, which they do not on the road.
        """
        longest = nanoseconds(self._parameters.processing_time)
        return replace(message, time=message.time + int(self._rng.integers(longest + 1)))

    def _apms_sent(self, inputs: Signals) -> list[Message]:
        """A broadcast of every APM, and a copy along the route where there is a session.

        Obstacles that call for a relay keep the broadcast from the ego too; without the copy
        the match, and with it the session, would end.
        """
        if not self._is_new("apms", inputs):
            return []
        radios = np.asarray(inputs["vehicle.equipped"])
        equipped = set(np.asarray(inputs["vehicle.id"])[radios].tolist())
        sources = {decode(apm).vehicle: apm for apm in split(bytes(inputs["apms"]))}
        broadcasts = [
            Message(
                kind=APM,
                time=self._now,
                source=vehicle,
                size=len(apm),
                content=apm,
                access_category=2,
            )
            for vehicle, apm in sources.items()
            if vehicle in equipped
        ]
        routed = [
            replace(message, destination=session.ego, route=session.route)
            for message in broadcasts
            if (session := self._sessions.get(message.source)) and session.route
        ]
        return broadcasts + routed

    def _requests(self, inputs: Signals, ego: int) -> list[Message]:
        sharers = np.asarray(inputs["match.sharer"])
        if not inputs["match.trigger"] or ego == NO_VEHICLE or self._now < self._next_request:
            return []
        self._next_request = self._now + self._request_period
        sharer, relay = int(sharers[0]), int(np.asarray(inputs["relay"]))
        route = () if relay in {NO_VEHICLE, sharer, ego} else (relay,)
        end = self._now + nanoseconds(self._parameters.session)
        return [
            Message(
                kind=REQUEST,
                time=self._now,
                source=ego,
                destination=sharer,
                route=route,
                size=self._parameters.request_size,
                content=_Session(end, ego, route),
            )
        ]

    def _sensor_data(self, inputs: Signals) -> list[Message]:
        if not self._is_new("objects", inputs) or not self._sessions:
            return []
        objects = unframe("OBJS", bytes(inputs["objects"]), OBJECT)
        return [
            Message(
                kind=SENSOR_DATA,
                time=self._now,
                source=sharer,
                destination=session.ego,
                route=session.route,
                size=self._parameters.sensor_data_size,
                content=objects[objects["sensor"] == sharer],
                access_category=2,
            )
            for sharer, session in sorted(self._sessions.items())
        ]

    def _received_apms(self) -> bytes:
        """The newest APM of each source while it is fresh; held, so slow readers miss none."""
        self._apms = {
            source: (time, apm)
            for source, (time, apm) in self._apms.items()
            if self._now - time <= self._maximum_age
        }
        return self._apms_signal.of([apm for _, (_, apm) in sorted(self._apms.items())])

    def _shared_objects(self) -> bytes:
        self._objects = {
            sharer: objects
            for sharer, objects in self._objects.items()
            if len(objects) and self._now - int(objects["time"][0]) <= self._maximum_age
        }
        return self._objects_signal.of([self._objects[s] for s in sorted(self._objects)])

    def _is_new(self, name: str, inputs: Signals) -> bool:
        """Whether a message-like input changed since this was last asked."""
        value = inputs[name]
        changed = self._last.get(name) != value
        self._last[name] = value
        return changed


def _objects_frame(tables: Sequence[Array]) -> bytes:
    return frame("OBJS", np.concatenate(tables) if tables else np.empty(0, OBJECT))
