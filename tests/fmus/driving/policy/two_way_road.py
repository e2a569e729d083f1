"""A straight two-way road to the east, on which the expert drives among others at constant speeds.

Its own lane is in the middle of the coordinates, y = 0; the lane of oncoming traffic is at 3.5 m.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from adapters.sumo.ego import Command, EgoState, advance
from adapters.traffic.geometry import Boxes, box_distance
from fmus.driving.policy import Expert, Inputs
from fmus.driving.policy.expert import EXPERT_READS, ExpertParameters
from fmus.driving.policy.overtaking_parameters import Overtaking
from orchestrator.signal import Array, Signal
from tests.fmus.dynamics import DYNAMICS

CRUISE: Final = 10.0
SIZE: Final = (4.93, 1.86)
TRUCK: Final = (8.0, 2.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class Other:
    """Another vehicle: its centre at the start [m], and its speeds [m/s], constant."""

    x: float
    y: float = 0.0
    speed: float = 0.0
    aside: float = 0.0
    size: tuple[float, float] = SIZE

    def after(self, time: float) -> "Other":
        return replace(self, x=self.x + self.speed * time, y=self.y + self.aside * time)


def truck(gap: float, speed: float = 4.0) -> Other:
    """Its rear is `gap` [m] before the front of an ego whose centre is at x = 0."""
    return Other(x=0.5 * SIZE[0] + gap + 0.5 * TRUCK[0], speed=speed, size=TRUCK)


def oncoming(gap: float, speed: float) -> Other:
    """Its front is `gap` [m] before that of an ego whose centre is at x = 0."""
    return Other(x=SIZE[0] + gap, y=3.5, speed=-speed)


def signals(ego: EgoState, vehicles: tuple[Other, ...], turn: float) -> Mapping[str, Signal]:
    """The road turned by an angle [rad]; the ego is number 4, the others are 5, 6, ..."""
    ahead, left = np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])

    def turned(x: Array, y: Array) -> Array:
        return np.outer(x, ahead) + np.outer(y, left)

    center = turned(
        np.array([ego.x, *(v.x for v in vehicles)]), np.array([ego.y, *(v.y for v in vehicles)])
    )
    velocity = turned(
        np.array([ego.speed, *(v.speed for v in vehicles)]),
        np.array([0.0, *(v.aside for v in vehicles)]),
    )
    size = np.array([SIZE, *(v.size for v in vehicles)])
    count = len(center)
    return {
        "ego.id": np.array(4),
        "ego.position": center[0],
        "ego.heading": np.array(ego.heading + turn),
        "ego.speed": np.array(ego.speed),
        "ego.size": np.append(SIZE, 1.5),
        "ego.route": turned(np.array([ego.x, ego.x + 300.0]), np.zeros(2)),
        "vehicle.id": 4 + np.arange(count),
        "vehicle.position": np.column_stack([center, np.zeros(count)]),
        "vehicle.heading": np.append(ego.heading + turn, np.full(count - 1, turn)),
        "vehicle.velocity": velocity,
        "vehicle.size": np.column_stack([size, np.full(count, 1.5)]),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class Trip:
    """What the ego did, every 50 ms.

    Attributes:
        states: of the ego.
        gap: to the nearest body [m], (state,).
        vehicles: at the end.
    """

    states: tuple[EgoState, ...]
    gap: Array
    vehicles: tuple[Other, ...]

    @property
    def offset(self) -> Array:
        """From the middle of the ego's own lane [m], (state,)."""
        return np.array([state.y for state in self.states])

    def time(self, rows: Array) -> float:
        """When something first holds [s]."""
        return 0.05 * float(np.argmax(rows))


def trip(
    seconds: float,
    *vehicles: Other,
    speed: float = 4.0,
    turn: float = 0.0,
    appears: tuple[float, Other] | None = None,
    **wanted: Any,
) -> Trip:
    """Drive for a while from x = 0.

    Args:
        seconds: for how long.
        vehicles: others, at the start.
        speed: of the ego at the start [m/s].
        turn: of the road, from the east [rad].
        appears: from when on [s] the ego knows of another one, who is where it would be then.
        wanted: parameters of overtaking.
    """
    policy = Expert(ExpertParameters(cruise_speed=CRUISE, overtaking=Overtaking(**wanted)))
    policy.begin(0, np.random.default_rng(0))
    state, states, gaps = EgoState(x=0.0, y=0.0, heading=0.0, speed=speed), [], []
    now = vehicles
    for k in range(round(seconds / 0.05)):
        time = 0.05 * k
        there = vehicles
        if appears is not None and time >= appears[0]:
            there = (*vehicles, appears[1])
        now = tuple(vehicle.after(time) for vehicle in there)
        states.append(state)
        gaps.append(_gap(state, now))
        inputs = Inputs.read(signals(state, now, turn), EXPERT_READS)
        command = policy.drive(inputs, 50_000_000 * (k + 1)).signals()["command"]
        for _ in range(5):
            state = advance(state, Command.of(np.asarray(command)), DYNAMICS, 0.01)
    return Trip(states=tuple(states), gap=np.array(gaps), vehicles=now)


def _gap(state: EgoState, vehicles: tuple[Other, ...]) -> float:
    body = Boxes(
        center=np.array([state.x, state.y]), heading=np.array(state.heading), size=np.array(SIZE)
    )
    theirs = Boxes(
        center=np.array([(v.x, v.y) for v in vehicles]),
        heading=np.zeros(len(vehicles)),
        size=np.array([v.size for v in vehicles]),
    )
    return float(box_distance(body, theirs).min())
