"""Drives the stand-ins for the channel: scenes and packets in, receptions out."""

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np

from fmus.channel.stand_ins.component import LinkModelComponent
from fmus.channel.stand_ins.connectors import CONNECTORS
from fmus.messages.records import (
    FATES,
    OUTCOMES,
    RECEPTION,
    TRANSMISSION,
    unframe,
)
from orchestrator.signal import Array, Causality, Signal
from tests.fmus.channel.harness import MS

SENT: Final = FATES.index("sent")

Positions = Mapping[int, tuple[float, float]]


def scene(positions: Positions, equipped: Sequence[int] | None = None) -> dict[str, Signal]:
    """The inputs with vehicles at `positions` [m], antennas 1.5 m high; no packets."""
    ids = sorted(positions)
    values = {
        name: connector.start_value()
        for name, connector in CONNECTORS.items()
        if connector.causality is Causality.INPUT
    }
    return values | {
        "vehicle.id": np.array(ids, np.int64),
        "vehicle.position": np.array([(*positions[v], 0.0) for v in ids]).reshape(-1, 3),
        "vehicle.heading": np.zeros(len(ids)),
        "vehicle.size": np.tile([4.5, 1.8, 1.5], (len(ids), 1)),
        "vehicle.antenna_height": np.full(len(ids), 1.5),
        "vehicle.equipped": np.array([equipped is None or v in equipped for v in ids], bool),
    }


def row_of(count: int, gap: float = 10.0) -> Positions:
    """Vehicles 0, 1, ... in a row along x [m]."""
    return {v: (gap * v, 0.0) for v in range(count)}


class Run:
    """Steps a component and collects what it tells."""

    def __init__(self, component: LinkModelComponent, seed: int = 7) -> None:
        self.component = component
        self.component.setup(0, np.random.default_rng(seed))
        self.t = 0
        self.receptions: Array = np.empty(0, RECEPTION)
        self.transmissions: Array = np.empty(0, TRANSMISSION)

    def step(self, inputs: Mapping[str, Signal], sent: bytes = b"", h: int = 10 * MS) -> Array:
        """Take one step; its receptions."""
        self.component.step({**inputs, "packets": sent}, self.t, h)
        self.t += h
        outputs = self.component.outputs()
        received = unframe("RCPT", bytes(outputs["receptions"]), RECEPTION)
        told = unframe("SENT", bytes(outputs["transmissions"]), TRANSMISSION)
        self.receptions = np.concatenate([self.receptions, received])
        self.transmissions = np.concatenate([self.transmissions, told])
        return received

    def busy_ratio(self) -> Array:
        """The output `busy_ratio`."""
        return np.asarray(self.component.outputs()["busy_ratio"])

    def steps(
        self, inputs: Mapping[str, Signal], sent: bytes, *, h: int, until: int
    ) -> tuple[Array, Array]:
        """Send packets in the first of the steps to `until` [ns]; all that is told."""
        while self.t < until:
            self.step(inputs, sent if self.t == 0 else b"", h)
        return self.receptions, self.transmissions


def outcomes(receptions: Array) -> dict[tuple[int, int, int], str]:
    """Letters by packet, hop and receiver."""
    return {
        (int(r["packet"]), int(r["hop"]), int(r["receiver"])): OUTCOMES[r["outcome"]]
        for r in receptions
    }


def by_time(receptions: Array) -> Any:
    """The order that the contract of the receptions demands."""
    return np.lexsort([receptions[k] for k in ("receiver", "hop", "packet", "time")])
