"""Samples of a small world: an ego vehicle and a sharer see a street with moving vehicles."""

from typing import Final

import numpy as np

from fmus.driving.network.architecture import EGO
from fmus.driving.network.scan import scan_of
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from studies.training.learner import RecordedRun
from studies.training.learning.sample import BODY, Sample, write_sample
from tests.fmus.driving.network.world import PERIOD, seen_from, street

EGO_ID: Final = 4
SHARER: Final = 9
SPEED: Final = 5.0
"""Of the vehicle that moves; see `street` [m/s]."""


def bodies(k: int) -> Array:
    """The vehicles of `street` at the time number `k`, and the two that carry sensors."""
    rows = np.zeros(5, BODY)
    rows["number"] = (EGO_ID, SHARER, 1, 2, 3)
    rows["place"][:, :2] = [
        (0.8 * k, 0.0),
        (30.0, 1.0),
        (12.0, 3.4),
        (20.0, -3.3),
        (25.0 - 0.1 * SPEED * k, 0.4),
    ]
    rows["place"][:2, 2] = (0.1, 2.0)
    rows["size"] = [(4.4, 1.8), (4.4, 1.8), (4.4, 1.8), (9.0, 2.4), (4.4, 1.8)]
    rows["velocity"][0] = (8.0, 0.0)
    rows["velocity"][4] = (-SPEED, 0.0)
    return rows


def sample(k: int, seed: int = 0, sharers: tuple[int, ...] = (SHARER,)) -> Sample:
    """Of the time number `k`; the expert brakes the more, the nearer the moving vehicle is."""
    rng = np.random.default_rng([seed, k])
    world = street(seed, moved=0.1 * SPEED * k)
    places = {EGO_ID: ((0.8 * k, 0.0), 0.1)}
    for number, sharer in enumerate(sharers):
        places[sharer] = ((30.0, 1.0 + number), 2.0)
    near = min(max((k - 5) / 10, 0.0), 1.0)
    return Sample(
        time=k * PERIOD,
        ego=EGO_ID,
        frame=Frame(x=0.8 * k, y=0.0, heading=0.1),
        numbers=rng.normal(size=EGO),
        expert=np.array([0.5 * (1.0 - near), near, 0.1]),
        threat=3 if near > 0.0 else -1,
        scans=tuple(
            scan_of(seen_from(at, heading, world, vehicle=vehicle, time=k * PERIOD))
            for vehicle, (at, heading) in places.items()
        ),
        bodies=bodies(k),
        most_points=0,
        points=(),
    )


def run(seed: int, length: int = 15) -> RecordedRun:
    """Samples as the collecting policy records them."""
    return RecordedRun(
        seed=seed,
        levels={},
        samples=tuple(write_sample(sample(k, seed)) for k in range(1, length + 1)),
    )
