"""Drives the channel FMU: scenes and packets in, receptions and transmissions out."""

import itertools
from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np

from fmus.messages.records import (
    BSM,
    NO_VEHICLE,
    NOISE,
    OUTCOMES,
    PACKET,
    RECEPTION,
    TRANSMISSION,
    frame,
    unframe,
)
from orchestrator.signal import Array
from tests.fmus.driver import Instance, Library
from tests.fmus.scene import Scene, Vehicle

US: Final = 1_000
MS: Final = 1_000_000
AIRTIME: Final = 368 * US
"""Of 200 bytes and 38 of headers at 6 Mbit/s: 41 symbols of 8 us after 40 us [ns]."""
LIGHT_SPEED: Final = 299_792_458.0
NO_OBSTACLES: Final = {"vehicle_shadowing": False, "building_shadowing": False}
BACKGROUND, BEST_EFFORT, VIDEO, VOICE = range(4)


def packet(
    number: int,
    source: int,
    *,
    time: int = 0,
    to: int = NO_VEHICLE,
    via: Sequence[int] = (),
    size: int = 200,
    category: int = VOICE,
    power_offset: float = 0.0,
    duration: int = 0,
    kind: int = BSM,
) -> Array:
    """One PACKET record."""
    route = (*via, NO_VEHICLE, NO_VEHICLE)[:2]
    return np.array(
        (number, time, source, to, route, duration, power_offset, size, category, kind, 0), PACKET
    )


def noise(
    number: int,
    source: int,
    *,
    time: int,
    duration: int,
    power_offset: float = 0.0,
    channel_offset: int = 0,
) -> Array:
    """One PACKET record of kind NOISE."""
    record = packet(number, source, time=time, power_offset=power_offset, duration=duration)
    record["kind"], record["channel_offset"] = NOISE, channel_offset
    return record


def packets(records: Iterable[Array]) -> bytes:
    """The `packets` signal with these records."""
    return frame("PKTS", np.array(list(records), PACKET))


class Channel(Instance):
    """One instance, ready to step."""

    def __init__(
        self, library: Library, scene: Scene, *, start: float = 0.0, **parameters: float
    ) -> None:
        super().__init__(library)
        for name, value in parameters.items():
            self.set(name, np.array(value))
        self.resize(**scene.lengths())
        self.enter_initialization(start)
        self._set_inputs(scene)
        self.call("ExitInitializationMode")

    def _set_inputs(self, scene: Scene) -> None:
        for name, value in scene.inputs(self.library).items():
            self.set(name, value)

    def change(self, scene: Scene) -> None:
        """Another scene, with another number of vehicles perhaps."""
        self.resize(**scene.lengths())
        self._set_inputs(scene)

    def send(self, data: bytes) -> None:
        """Set the packets."""
        self.set("packets", data)

    def step(self, t: float, h: float, records: Iterable[Array] | None = None) -> Array:
        """Advance from t to t + h; the receptions. Without records the input stays."""
        if records is not None:
            self.send(packets(records))
        self.do_step(t, h)
        return unframe("RCPT", self.receptions(), RECEPTION)

    def receptions(self) -> bytes:
        """The output."""
        return self.get_binary("receptions")

    def transmissions(self) -> Array:
        """What was sent or given up in the last step."""
        return unframe("SENT", self.get_binary("transmissions"), TRANSMISSION)


def row_of_cars(distances: Sequence[float]) -> Scene:
    """Cars side by side with vehicle 0, at these distances from it along x, 3 m apart along y."""
    cars = [Vehicle(id=0)]
    cars += [
        Vehicle(id=k, position=(distance, 3.0 * k, 0.0))
        for k, distance in enumerate(distances, start=1)
    ]
    return Scene(vehicles=cars)


def outcomes(records: Array) -> dict[tuple[int, int], str]:
    """The letter of each outcome, by packet and receiver."""
    return {(int(r["packet"]), int(r["receiver"])): OUTCOMES[r["outcome"]] for r in records}


def one_frame(library: Library, scene: Scene, record: Array, **parameters: float) -> dict[int, Any]:
    """The receptions of one packet, by receiver."""
    with Channel(library, scene, **parameters) as channel:
        received = channel.step(0.0, 0.1, [record])
        return {int(r["receiver"]): r for r in received if r["hop"] == 0}


def reception_ratio(library: Library, scene: Scene, frames: int, **parameters: float) -> Array:
    """The share of vehicle 0's frames that each other vehicle receives (PRR)."""
    with Channel(library, scene, **parameters) as channel:
        records = [packet(k, 0, time=k * MS) for k in range(frames)]  # one after the other
        received = channel.step(0.0, frames * 1e-3 + 1, records)
    good = received[received["outcome"] == OUTCOMES.index("R")]
    counts = [np.count_nonzero(good["receiver"] == v.id) for v in scene.vehicles[1:]]
    return np.array(counts) / frames


def run(
    channel: Channel, cuts: Sequence[float], records: Sequence[Array]
) -> tuple[Array, list[bytes]]:
    """All receptions of steps between neighbouring `cuts` [s], and each step's output.

    Each packet is handed over in the last step that begins before its time or with it.
    """
    outputs = []
    for t, end in itertools.pairwise(cuts):
        begin, stop = round(t * 1e9), round(end * 1e9)
        channel.step(t, end - t, [r for r in records if begin <= r["time"] < stop])
        outputs.append(channel.receptions())
    return np.concatenate([unframe("RCPT", data, RECEPTION) for data in outputs]), outputs
