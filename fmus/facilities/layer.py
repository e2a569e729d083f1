"""What all facilities components have in common: BSMs, packets, reception, `received.*`."""

import abc
import functools
import operator
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import override

from fmus.facilities.bsm import Bsm, Bsms, BsmSender
from fmus.facilities.clocks import Clocks
from fmus.facilities.connectors import UNNAMED, connectors, of_ego
from fmus.facilities.inputs import Inputs
from fmus.facilities.link_power import Measurements
from fmus.facilities.listener import Listener
from fmus.facilities.outbox import Broadcasts, Message, Outbox
from fmus.facilities.sharing import Change, Sharing
from fmus.facilities.streams import Streams
from fmus.messages.records import (
    BSM,
    NO_VEHICLE,
    OUTCOMES,
    REQUEST,
    SENSOR_DATA,
)
from orchestrator.capabilities import Redrawing
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Array, Causality, Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds

_RECEIVED = OUTCOMES.index("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerParameters:
    """Parameters of every facilities component; defaults are the paper's Table I."""

    egos: tuple[str, ...] = parameter(
        (),
        doc="names of the egos, whose connectors lie beneath them; none: one, `ego.id` and so on",
    )
    bsm_period: float = parameter(0.1, unit="s", minimum=0.01, doc="time between BSMs")
    bsm_size: int = parameter(200, unit="B", minimum=1, doc="size of a BSM")
    announced_power_size: int = parameter(
        0,
        unit="B",
        minimum=0,
        doc="added to the size of a BSM for each neighbour whose power it announces",
    )
    power_filter: int = parameter(
        4, minimum=0, maximum=19, doc="filter coefficient k of received powers, TS 38.331"
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
    clock_error: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=10.0,
        doc="standard deviation of the constant error of each vehicle's clock",
    )


class FacilitiesLayer(Component, Redrawing):
    """The V2X facilities layer of all vehicles, whatever they share.

    Every equipped vehicle broadcasts BSMs; a `Sharing` decides about all other messages. Only
    what the channel reports as received has any effect: all packets of a message, unless its
    granularity says otherwise. Messages become ready in the step after the one that makes them.

    There may be several egos. What they receive, ask for and are answered is each ego's own; BSMs,
    packets and the powers that radios measure are of all vehicles. `Streams` says why an ego that
    reaches nobody leaves the messages of the first one as they are, byte for byte.

    Args:
        parameters: of the component.
        received_scans: most scans of one source in `received.features`.
    """

    def __init__(self, parameters: LayerParameters, received_scans: int = 1) -> None:
        self._common = parameters
        self._received_scans = received_scans
        self._egos = parameters.egos or (UNNAMED,)
        self._connectors = connectors(parameters.egos)

    @abc.abstractmethod
    def _sharing(self, start: Time, streams: Streams) -> Sharing:
        """The way of sharing, at the start of a run."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        given = self._common
        maximum_age = nanoseconds(given.maximum_age)
        self._processing_time = nanoseconds(given.processing_time)
        self._streams = Streams(rng, self._egos)
        self._bsm = BsmSender(nanoseconds(given.bsm_period), self._streams)
        self._measurements = Measurements(given.power_filter, maximum_age)
        self._outbox = Outbox(given.fragment_size, 2 * maximum_age)
        clocks = Clocks(rng, given.clock_error)
        self._listeners = [Listener(maximum_age, self._received_scans, clocks) for _ in self._egos]
        self._receptions = Change()
        self._ways = self._sharing(start, self._streams)
        self._outputs: Signals = {
            name: connector.start_value()
            for name, connector in self._connectors.items()
            if connector.causality is Causality.OUTPUT
        }

    @override
    def redraw(self, rng: np.random.Generator) -> None:
        self._streams.renew(rng)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        given, now = Inputs.read(inputs, self._egos), t + h
        self._check(given)
        self._streams.assign([ego.vehicle for ego in given.egos])
        for listener, ego in zip(self._listeners, given.egos, strict=True):
            listener.assign(ego.vehicle)
        self._receive(given)
        self._measurements.forget(now)
        shared = self._ways.messages(given, now, h)
        safety = self._safety_messages(given, now, h)
        messages = list(map(self._processed, shared))
        self._outbox.forget(now)
        self._outputs = {
            "packets": self._outbox.send(messages, [safety]),
            **self._received(given, now),
        }

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _check(self, inputs: Inputs) -> None:
        """Refuse egos that are one vehicle.

        Raises:
            ValueError: two have the same number, which is not `NO_VEHICLE`.
        """
        names: dict[int, str] = {}
        for name, ego in zip(self._egos, inputs.egos, strict=True):
            if ego.vehicle != NO_VEHICLE and names.setdefault(ego.vehicle, name) != name:
                raise ValueError(
                    f"`{names[ego.vehicle]}.id` and `{name}.id` are both vehicle {ego.vehicle}; "
                    "connect each ego's own number"
                )

    def _received(self, inputs: Inputs, now: Time) -> Signals:
        """The connectors `received.*` of all egos."""
        return {
            of_ego(name, signal): value
            for name, listener, ego in zip(self._egos, self._listeners, inputs.egos, strict=True)
            for signal, value in listener.outputs(
                ego, self._measurements.by(ego.vehicle), now
            ).items()
        }

    def _receive(self, inputs: Inputs) -> None:
        """Take in what arrived."""
        if not self._receptions.is_new(inputs.receptions):
            return
        rows = inputs.reception_records()
        rows = rows.compress((rows["outcome"] == _RECEIVED) & (rows["addressed"] == 1))
        self._measurements.meet(inputs.vehicles.id[inputs.vehicles.equipped])
        self._measurements.measure(rows.compress(rows["kind"] == BSM))
        egos = {ego.vehicle: k for ego, k in zip(inputs.egos, self._listeners, strict=True)}
        receiver, kind = rows["receiver"], rows["kind"]
        is_at_ego = functools.reduce(operator.or_, (receiver == ego for ego in egos))
        is_counted = is_at_ego & (kind == SENSOR_DATA)
        if is_counted.any():
            self._count_sensor_data(rows.compress(is_counted), egos)
        rows = rows.compress(is_at_ego | (kind == REQUEST))
        for arrival in self._outbox.arrivals(rows):
            message = arrival.message
            if message.destination not in {arrival.receiver, NO_VEHICLE}:
                continue  # a relay has it; an ego may be one
            if message.kind == REQUEST:
                self._ways.receive_request(arrival)
                continue
            match message.content:
                case Bsm() as bsm:
                    egos[arrival.receiver].receive_bsm(message, bsm)
                case _:
                    self._ways.receive(arrival, egos[arrival.receiver].received)

    def _count_sensor_data(self, rows: Array, egos: Mapping[int, Listener]) -> None:
        """Count packets of sensor data at the egos that they are for."""
        for packet, receiver in zip(
            rows["packet"].tolist(), rows["receiver"].tolist(), strict=True
        ):
            egos[receiver].count_sensor_data(int(self._outbox.is_for(packet, receiver)))

    def _safety_messages(self, inputs: Inputs, now: Time, h: Duration) -> Broadcasts:
        times, states = self._bsm.due(inputs.vehicles, inputs.errors, now, now + h)
        heard = self._measurements.table(states["id"])
        size = np.full(len(times), self._common.bsm_size)
        if self._common.announced_power_size:
            entries = np.count_nonzero(~np.isnan(heard.power), axis=1)
            size += self._common.announced_power_size * entries
        return Broadcasts(
            kind=BSM,
            time=times,
            source=states["id"],
            size=size,
            content=Bsms(states=states, heard=heard).message,
        )

    def _processed(self, message: Message) -> Message:
        """`message` when its vehicle's computer is done with it.

        All sensors scan at the same instant here. Computers that also answered at the same
        instant would let the radios collide every time, which they do not on the road.
        """
        is_asked = message.kind != REQUEST and message.destination != NO_VEHICLE
        stream = self._streams.of(message.destination if is_asked else message.source)
        taken = int(stream.integers(self._processing_time + 1))
        return replace(message, time=message.time + taken)
