"""What all facilities components have in common: BSMs, packets, reception, `received.*`."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from typing_extensions import override

from fmus.facilities.bsm import Bsm, Bsms, BsmSender, Neighbourhood
from fmus.facilities.connectors import CONNECTORS, OUTPUTS
from fmus.facilities.inputs import Inputs, Vehicles
from fmus.facilities.link_power import Announcements, Measurements
from fmus.facilities.outbox import Broadcasts, Message, Outbox
from fmus.facilities.received import Received
from fmus.facilities.sharing import Change, Sharing
from fmus.messages.records import (
    BSM,
    NO_VEHICLE,
    OUTCOMES,
    REQUEST,
    SENSOR_DATA,
)
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time, nanoseconds

_RECEIVED = OUTCOMES.index("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class LayerParameters:
    """Parameters of every facilities component; defaults are the paper's Table I."""

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


class FacilitiesLayer(Component):
    """The V2X facilities layer of all vehicles, whatever they share.

    Every equipped vehicle broadcasts BSMs; a `Sharing` decides about all other messages. Only
    what the channel reports as received has any effect: all packets of a message, unless its
    granularity says otherwise. Messages become ready in the step after the one that makes them.

    Args:
        parameters: of the component.
        received_scans: most scans of one source in `received.features`.
    """

    def __init__(self, parameters: LayerParameters, received_scans: int = 1) -> None:
        self._common = parameters
        self._received_scans = received_scans

    @abc.abstractmethod
    def _sharing(self, start: Time, rng: np.random.Generator) -> Sharing:
        """The way of sharing, at the start of a run."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        given = self._common
        maximum_age = nanoseconds(given.maximum_age)
        self._processing_time = nanoseconds(given.processing_time)
        self._rng = rng
        self._bsm = BsmSender(nanoseconds(given.bsm_period), rng)
        self._neighbourhood = Neighbourhood(maximum_age)
        self._measurements = Measurements(given.power_filter, maximum_age)
        self._announcements = Announcements(maximum_age)
        self._outbox = Outbox(given.fragment_size, 2 * maximum_age)
        self._received = Received(maximum_age, self._received_scans)
        self._sensor_data = np.array(0, np.int64)
        self._receptions = Change()
        self._ways = self._sharing(start, rng)
        self._outputs: Signals = {
            name: connector.start_value() for name, connector in OUTPUTS.items()
        }

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        given, now = Inputs.read(inputs), t + h
        self._receive(given)
        self._measurements.forget(now)
        shared = self._ways.messages(given, now, h)
        safety = self._safety_messages(given.vehicles, now, h)
        messages = list(map(self._processed, shared))
        self._outbox.forget(now)
        links = self._announcements.links(now, given.sharers[given.sharers != NO_VEHICLE])
        self._outputs = {
            "packets": self._outbox.send(messages, [safety]),
            **self._received.outputs(now),
            "received.sensor_data.count": self._sensor_data,
            **self._neighbourhood.outputs(now, given.ego),
            **links.outputs(given.ego, self._measurements.by(given.ego)),
        }

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _receive(self, inputs: Inputs) -> None:
        """Take in what arrived."""
        if not self._receptions.is_new(inputs.receptions):
            return
        rows = inputs.reception_records()
        rows = rows.compress((rows["outcome"] == _RECEIVED) & (rows["addressed"] == 1))
        self._measurements.measure(rows.compress(rows["kind"] == BSM))
        rows = rows.compress((rows["receiver"] == inputs.ego) | (rows["kind"] == REQUEST))
        # sensor data addressed to the ego are for it: nobody else asks for any
        sensor_data = (rows["kind"] == SENSOR_DATA) & (rows["receiver"] == inputs.ego)
        if sensor_data.any():
            self._sensor_data = np.array(self._sensor_data + np.count_nonzero(sensor_data))
        for arrival in self._outbox.arrivals(rows):
            message = arrival.message
            if message.destination not in {arrival.receiver, NO_VEHICLE}:
                continue  # a relay has it; the ego may be one
            match message.content:
                case Bsm() as bsm:
                    self._neighbourhood.receive(bsm.state)
                    self._announcements.receive(message.source, message.time, bsm.heard)
                case _:
                    self._ways.receive(arrival, self._received)

    def _safety_messages(self, vehicles: Vehicles, now: Time, h: Duration) -> Broadcasts:
        times, states = self._bsm.due(vehicles, now, now + h)
        heard = self._measurements.table(states["id"]).announced()
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
        taken = int(self._rng.integers(self._processing_time + 1))
        return replace(message, time=message.time + taken)
