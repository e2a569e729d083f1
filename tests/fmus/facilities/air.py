"""Facilities of several egos, and a channel that loses nothing among those that can hear."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from fmus.facilities.connectors import of_ego
from fmus.facilities.layer import FacilitiesLayer
from fmus.messages.apm import join
from fmus.messages.records import NO_VEHICLE, OBJECT, OUTCOMES, PACKET, RECEPTION, frame, unframe
from orchestrator.signal import Array, Causality, Signal, Signals
from tests.fmus.facilities.world import H, apm_of

Hears = Callable[[int, int], bool]
"""Whether the first vehicle hears the second."""


def everybody(receiver: int, source: int) -> bool:
    """No link is shadowed."""
    return receiver != source


def received(packets: Array, vehicles: Sequence[int], hears: Hears) -> bytes:
    """What the channel reports of packets: at everybody, or at the relays and the destination."""
    rows = []
    for packet in packets:
        route = [int(v) for v in packet["route"] if v != NO_VEHICLE]
        destination = int(packet["destination"])
        broadcast = [v for v in vehicles if hears(v, int(packet["source"]))]
        for hop, receiver in enumerate(
            broadcast if destination == NO_VEHICLE else [*route, destination]
        ):
            row = np.zeros((), RECEPTION)
            row["packet"], row["kind"], row["time"] = packet["id"], packet["kind"], packet["time"]
            row["transmitter"], row["receiver"] = packet["source"], receiver
            row["hop"] = 0 if destination == NO_VEHICLE else hop
            row["outcome"], row["addressed"] = OUTCOMES.index("R"), 1
            row["power_dbm"] = -60.0 - receiver
            if hears(receiver, int(packet["source"])):
                rows.append(row)
    return frame("RCPT", np.array(rows, RECEPTION))


class Town:
    """Steps a facilities component with so many vehicles, all with a radio and a lidar.

    Args:
        component: with these egos, or none.
        vehicles: their numbers, ascending.
        hears: what the channel delivers, one step later.
    """

    def __init__(
        self, component: FacilitiesLayer, vehicles: Sequence[int], hears: Hears = everybody
    ) -> None:
        self.component, self.vehicles, self.hears = component, vehicles, hears
        self.component.setup(0, np.random.default_rng(3))
        self.t = 0
        self._packets: Array = np.empty(0, PACKET)

    def step(self, egos: Mapping[str, Signals]) -> Array:
        """One step; `egos` has what each ego's own inputs are, by name. Returns the packets."""
        values = self._inputs()
        for ego, signals in egos.items():
            values |= {of_ego(ego, name): value for name, value in signals.items()}
        self.component.step(values, self.t, H)
        self.t += H
        self._packets = unframe("PKTS", bytes(self.component.outputs()["packets"]), PACKET)
        return self._packets

    def received(self, ego: str) -> dict[str, Signal]:
        """What one ego received, by the names that connectors have without names of egos."""
        prefix = f"{ego}." if ego else ""
        return {
            name.removeprefix(prefix): value
            for name, value in self.component.outputs().items()
            if name.startswith(f"{prefix}received.")
        }

    def objects(self, ego: str) -> Any:
        """Sensors whose objects one ego received."""
        table = unframe("OBJS", bytes(self.received(ego)["received.objects"]), OBJECT)
        return table["sensor"].tolist()

    def _inputs(self) -> dict[str, Signal]:
        count, scan = len(self.vehicles), self.t // 100_000_000 * 100_000_000
        objects = np.zeros(count, OBJECT)
        objects["sensor"], objects["time"], objects["instance"] = self.vehicles, scan, 7
        objects["position"] = scan / 2e8  # they move: a CPM tells them again
        values = {
            name: connector.start_value()
            for name, connector in self.component.connectors.items()
            if connector.causality is Causality.INPUT
        }
        return values | {
            "vehicle.id": np.array(self.vehicles, np.int64),
            "vehicle.position": np.arange(3.0 * count).reshape(count, 3),
            "vehicle.heading": np.zeros(count),
            "vehicle.velocity": np.ones((count, 2)),
            "vehicle.size": np.tile([4.5, 1.8, 1.5], (count, 1)),
            "vehicle.antenna_height": np.full(count, 1.5),
            "vehicle.equipped": np.ones(count, bool),
            "apms": join([apm_of(vehicle, scan) for vehicle in self.vehicles]),
            "objects": frame("OBJS", objects),
            "receptions": received(self._packets, self.vehicles, self.hears),
        }


def asking(vehicle: int, sharer: int = NO_VEHICLE, relay: int = NO_VEHICLE) -> dict[str, Signal]:
    """An ego's inputs: it asks a sharer, over a relay or not; without a sharer it asks nobody."""
    return {
        "ego.id": np.array(vehicle),
        "match.sharer": np.array([sharer], np.int64),
        "match.trigger": np.array(sharer != NO_VEHICLE),
        "blind_zone.center": np.array([[4.0, 4.0]]),
        "blind_zone.range": np.array([5.0]),
        "relay": np.array(relay),
    }
