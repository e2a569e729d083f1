"""A town full of radios, and traffic that leaves out nothing that the channel can do."""

from typing import Final

import numpy as np

from orchestrator.signal import Array
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import MS, US, noise, packet


def town(seed: int = 1, cars: int = 20) -> Scene:
    """Cars between two houses; every fifth has no radio."""
    rng = np.random.default_rng(seed)
    return Scene(
        vehicles=[
            Vehicle(
                id=3 * k,
                position=(*rng.uniform(-300, 300, 2), 0.0),
                heading=rng.uniform(0, 7),
                size=(5.0, 2.0, rng.uniform(1.4, 3.5)),
                equipped=bool(k % 5),
            )
            for k in range(cars)
        ],
        buildings=[
            Building(ring=rectangle(60, 60, 80, 80)),
            Building(ring=rectangle(-60, 0, 40, 9)),
        ],
    )


def by_time(records: list[Array]) -> list[Array]:
    """In the order of the `packets` signal."""
    return sorted(records, key=lambda r: (int(r["time"]), int(r["id"])))


TOWN: Final = town()
RADIOS: Final = [v.id for v in TOWN.vehicles if v.equipped]

WEAK: Final = {"transmit_power": 2.0, "sensitivity": -97.0}
"""So that about half of the frames are lost."""

BUSY: Final = {
    **WEAK, "transmit_power": 8.0, "fading": 2.0, "cca_threshold": -80.0, "queue_limit": 3.0,
    "packet_lifetime": 8e-3, "busy_window": 0.011,
}  # fmt: skip
"""For `busy_traffic`: all fates of frames occur."""


def light_traffic(packets: int = 60) -> list[Array]:
    """Broadcasts and routed packets, many at the same time, some near the ends of steps."""
    rng = np.random.default_rng(2)
    records = []
    for number in range(packets):
        source, relay, other, end = (int(v) for v in rng.choice(RADIOS, 4, replace=False))
        time = int(rng.integers(0, 100)) * MS // 2
        via = [[], [relay], [relay, other]][number % 3]
        records.append(packet(number, source, time=time, to=end if via else -1, via=via))
    return by_time(records)


def busy_traffic(packets: int = 300, duration: int = 50 * MS) -> list[Array]:
    """Packets of all categories and sizes, routed or not, and noise, more than the air can take."""
    rng = np.random.default_rng(3)
    records = []
    for number in range(packets):
        source, relay, other, end = (int(v) for v in rng.choice(RADIOS, 4, replace=False))
        time = int(rng.integers(0, duration // (100 * US))) * 100 * US
        offset = float(rng.uniform(-10, 10))
        if number % 10 == 0:
            width, beside = int(rng.integers(1, 700)) * US, int(rng.integers(-3, 4))
            records.append(
                noise(number, source, time=time, duration=width, power_offset=offset,
                      channel_offset=beside)
            )  # fmt: skip
            continue
        via = [[], [relay], [relay, other]][number % 3]
        records.append(
            packet(number, source, time=time, to=end if via else -1, via=via,
                   size=int(rng.integers(0, 600)), category=int(rng.integers(0, 4)),
                   power_offset=offset)
        )  # fmt: skip
    return by_time(records)
