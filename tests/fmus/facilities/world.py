"""A small world for facilities components: ego, sharer, relay, and a channel that tells all."""

from typing import Any

import numpy as np

from fmus.facilities.connectors import CONNECTORS
from fmus.messages.apm import encode
from fmus.messages.features import FeaturesMessage
from fmus.messages.records import OBJECT, OUTCOMES, PACKET, RECEPTION, frame, unframe
from orchestrator.component import Component
from orchestrator.signal import Array, Causality, Signal
from tests.fmus.messages.apm import apms

EGO, SHARER, RELAY = 10, 20, 30
H = 10_000_000


def world(**changes: Signal) -> dict[str, Signal]:
    """The inputs with ego, sharer and relay on the scene, all equipped."""
    values: dict[str, Signal] = {
        name: connector.start_value()
        for name, connector in CONNECTORS.items()
        if connector.causality is Causality.INPUT
    }
    values |= {
        "vehicle.id": np.array([EGO, SHARER, RELAY], np.int64),
        "vehicle.position": np.array([[0.0, 0, 0], [50, 0, 0], [20, 20, 0]]),
        "vehicle.heading": np.zeros(3),
        "vehicle.velocity": np.array([[8.0, 0], [0, 0], [1, 2]]),
        "vehicle.size": np.tile([4.5, 1.8, 1.5], (3, 1)),
        "vehicle.antenna_height": np.array([1.5, 1.6, 1.7]),
        "vehicle.equipped": np.ones(3, bool),
        "ego.id": np.array(EGO),
        "match.sharer": np.array([SHARER], np.int64),
    }
    return values | changes


def delivered(packets: Any, receiver: int, outcome: str = "R", addressed: int = 1) -> bytes:
    """The channel's report that `receiver` had `outcome` with every one of `packets`."""
    rows = np.zeros(len(packets), RECEPTION)
    rows["packet"], rows["kind"], rows["time"] = packets["id"], packets["kind"], packets["time"]
    rows["transmitter"], rows["receiver"] = packets["source"], receiver
    rows["outcome"], rows["addressed"] = OUTCOMES.index(outcome), addressed
    return frame("RCPT", rows)


class Run:
    """Steps a facilities component and keeps the clock."""

    def __init__(self, component: Component, seed: int = 3) -> None:
        self.component = component
        self.component.setup(0, np.random.default_rng(seed))
        self.t = 0

    def step(self, **changes: Signal) -> Any:
        names = {name.replace("__", "."): value for name, value in changes.items()}
        self.component.step(world(**names), self.t, H)
        self.t += H
        return unframe("PKTS", bytes(self.component.outputs()["packets"]), PACKET)

    def output(self, name: str) -> Any:
        return self.component.outputs()[name]


def apm_of(vehicle: int, time: int = 0, cells: Array | None = None, heading: float = 0.0) -> bytes:
    """20 x 20 cells of 5 m around the origin, empty if not given."""
    return encode(apms.apm_of(cells, vehicle=vehicle, time=time, heading=heading))


def objects_of(sensor: int, time: int = 0) -> bytes:
    rows = np.zeros(2, OBJECT)
    rows["sensor"], rows["time"], rows["instance"] = sensor, time, (99, 98)
    return frame("OBJS", rows)


def features_of(
    vehicle: int, time: int = 0, *, sent: int = 6, capacity: int = 8, dimensions: int = 2
) -> FeaturesMessage:
    """`sent` keypoints whose first number says which one it is, and whose second says when."""
    keypoints = np.zeros((sent, 3 + dimensions), np.float32)
    keypoints[:, 0], keypoints[:, 1] = np.arange(sent), time / 1e6
    return FeaturesMessage(
        vehicle=vehicle,
        time=time,
        position=np.array([1.0, 2.0, 3.0]),
        heading=0.25,
        capacity=capacity,
        dimensions=dimensions,
        keypoints=keypoints,
        encoder=vehicle + 1,
    )
