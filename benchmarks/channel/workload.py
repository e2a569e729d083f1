"""What the channel is given: scenes and packets, one of each per communication step."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from benchmarks.channel.beacons import INTERVAL, Beacons
from benchmarks.channel.growth import grid_of
from benchmarks.channel.layout import DATA, Layout, there_and_back
from fmus.messages.records import PACKET, unframe
from orchestrator.signal import Array, Signal, Signals
from orchestrator.timebase import CommunicationGrid, Duration, nanoseconds

ROOF_TO_ANTENNA: Final = 0.1
"""Height of an antenna above the roof [m]; Veins has all of them at 1.895 m instead."""

BUILDING_HEIGHT: Final = 20.0
"""Height of all buildings [m], above every antenna. Buildings of Veins have no upper end."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Workload:
    """Vehicles that drive and send for a while.

    Attributes:
        name: the first part of the names of its cases.
        layout: where they drive.
        jitter: of the times between packets [s].
        duration: how long [ns], a whole number of scenes.
    """

    name: str
    layout: Layout
    jitter: float
    duration: Duration

    @property
    def grid(self) -> CommunicationGrid:
        """One step per scene."""
        return CommunicationGrid.over(0, self.duration, INTERVAL)

    @cached_property
    def packets(self) -> Sequence[bytes]:
        """The signal `packets` of each step."""
        return Beacons(vehicles=self.layout.vehicles, jitter=self.jitter).packets(self.grid)

    @property
    def sent(self) -> int:
        """How many packets that are."""
        return sum(len(unframe("PKTS", each, PACKET)) for each in self.packets)

    @cached_property
    def scenes(self) -> Sequence[Mapping[str, Array]]:
        """The signals `vehicle.*` and `building.*` of each step, in the units of these connectors.

        Those of vehicles have shape (vehicle, ...), `building.vertex` (corner, 2),
        `building.index` (corner,) and `building.height` (building,).

        What does not change is the same object every time, as in a run. The first scene is shown
        twice: the recordings begin at 0.1 s, when the first packets are sent.
        """
        layout = self.layout
        shown = [0, *there_and_back(layout.scenes, self.grid.count - 1)]
        still = self._what_stays()
        ground = np.zeros((layout.scenes, layout.vehicles, 1))
        position = np.concatenate([layout.centre(), ground], axis=-1)
        return [
            still
            | {
                "vehicle.position": _read_only(position[k]),
                "vehicle.heading": _read_only(layout.heading[k]),
            }
            for k in shown
        ]

    def _what_stays(self) -> dict[str, Array]:
        layout = self.layout
        return {
            "vehicle.id": _read_only(np.arange(layout.vehicles, dtype=np.int64)),
            "vehicle.size": _read_only(layout.size),
            "vehicle.antenna_height": _read_only(layout.size[:, 2] + ROOF_TO_ANTENNA),
            "vehicle.equipped": _read_only(np.ones(layout.vehicles, np.bool_)),
            "building.vertex": _read_only(layout.vertex),
            "building.index": _read_only(layout.index),
            "building.height": _read_only(np.full(layout.buildings, BUILDING_HEIGHT)),
        }

    def inputs(self, start_values: Mapping[str, Signal], *, silent: bool) -> Iterator[Signals]:
        """The inputs of each step.

        Args:
            start_values: of all inputs of the component; those of the scene and the packets are
                replaced, others stay.
            silent: nobody sends.
        """
        for scene, packets in zip(self.scenes, self.packets, strict=True):
            known: dict[str, Signal] = {**scene, "packets": b"" if silent else packets}
            yield {name: known.get(name, value) for name, value in start_values.items()}


def cross44() -> Workload:
    """A crossing with 44 vehicles, 20 s, as Veins ran it."""
    return _as_in_veins("cross44", jitter=0.0, duration="20")


def grid200() -> Workload:
    """A grid of streets with 200 vehicles, 5 s, as Veins ran it."""
    return _as_in_veins("grid200", jitter=0.01, duration="5")


def _as_in_veins(name: str, jitter: float, duration: str) -> Workload:
    """The vehicles of a recorded run; `duration` in seconds."""
    layout = Layout.read(DATA / f"{name}.npz")
    return Workload(name=name, layout=layout, jitter=jitter, duration=nanoseconds(duration))


def grid(count: int) -> Workload:
    """A part of an endless grid of streets with `count` vehicles, 2 s."""
    return Workload(
        name=f"grid/{count}",
        layout=grid_of(Layout.read(DATA / "grid200.npz"), count),
        jitter=0.01,
        duration=nanoseconds("2"),
    )


def _read_only(array: Array) -> Array:
    found = np.ascontiguousarray(array)
    found.flags.writeable = False
    return found
