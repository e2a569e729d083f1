"""Rule-based driving: keep the speed, brake for predicted conflicts."""

import math
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.driving.policy.base import DrivingPolicy
from fmus.driving.policy.command import Command, Hazard
from fmus.driving.policy.conflict import Bodies, Prediction
from fmus.driving.policy.connectors import EGO
from fmus.driving.policy.driving import DrivingParameters, lateral_planner
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.steering import follow
from fmus.physics.boxes import corners
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from orchestrator.timebase import Time

_BLIND: Final = EGO | {"objects"}
_RULE_BASED: Final = EGO | {"objects", "received.objects"}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Meeting:
    """How far ahead of the ego's front [m] it meets what."""

    distance: float
    hazard: Hazard


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters(DrivingParameters):
    """Parameters of the rule-based policies."""

    horizon: float = parameter(4.0, unit="s", minimum=0.1, doc="how far to predict")
    stop_margin: float = parameter(
        2.0, unit="m", minimum=0.0, doc="where to stop before a conflict"
    )
    braking: float = parameter(
        8.0, unit="m/s^2", minimum=0.1, doc="deceleration of full brake; the actuator's limit"
    )
    comfortable: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, doc="braking starts when the conflict needs this much"
    )
    moving: float = parameter(
        1.0, unit="m/s", minimum=0.0, doc="slower tracks count as standing (tracking noise)"
    )
    confirmations: int = parameter(
        2, minimum=1, doc="consecutive steps with a conflict before the brake is used"
    )


class _Driver:
    """Makes commands of objects; it remembers for how long there has been a conflict."""

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._prediction = Prediction(
            horizon=parameters.horizon,
            step=parameters.prediction_step,
            lateral_margin=parameters.lateral_margin,
            longitudinal_margin=parameters.longitudinal_margin,
            acceleration=parameters.acceleration,
            cruise=parameters.cruise_speed,
        )
        self._lateral = lateral_planner(parameters)
        self._confirmed = 0

    def drive(self, inputs: Inputs, now: Time) -> Command:
        """The command at `now` [ns]."""
        ego, limit, yields_to = inputs.ego, math.inf, None
        objects = np.concatenate([inputs.seen, inputs.received])
        bodies = self._moved(objects, now)
        if ego.has_route:
            plan = self._lateral.plan(ego, bodies.corners, bodies.velocity, now)
            ego, limit, yields_to = replace(ego, route=plan.path), plan.limit, plan.yields_to
        steer = follow(ego, self._parameters)
        meeting = self._worst(ego, objects, bodies, now) if ego.has_route else None
        self._confirmed = self._confirmed + 1 if meeting else 0
        if meeting and self._confirmed >= self._parameters.confirmations:
            demand = self._deceleration(ego, meeting.distance)
            if demand >= self._parameters.comfortable or ego.speed < self._parameters.moving:
                brake = min(max(demand, -limit) / self._parameters.braking, 1.0)
                return Command(brake=brake, steer=steer, hazard=meeting.hazard)
        wanted = (self._parameters.cruise_speed - ego.speed) / 1.0  # within one second
        hazard = None
        if limit < wanted:
            wanted = limit
            hazard = None if yields_to is None else _hazard(objects[yields_to], now)
        accelerate = min(max(0.0, wanted) / self._parameters.acceleration, 1.0)
        brake = min(max(0.0, -wanted) / self._parameters.braking, 1.0)
        return Command(accelerate=accelerate, brake=brake, steer=steer, hazard=hazard)

    def _deceleration(self, ego: Ego, distance: float) -> float:
        """What it takes to stop `stop_margin` before a conflict [m/s^2]."""
        room = max(distance - self._parameters.stop_margin, 0.1)
        return max(ego.speed**2 / (2.0 * room), self._parameters.comfortable / 2.0)

    def _moved(self, objects: Array, now: Time) -> Bodies:
        """Where the objects are at `now`."""
        age = (now - objects["time"]) / 1e9
        standing = np.hypot(*objects["velocity"].T) < self._parameters.moving
        velocity = np.where(standing[:, None], 0.0, objects["velocity"])
        moved = age[:, None] * velocity
        place = objects["position"] + moved
        return Bodies(corners=corners(place, objects["angle"], objects["size"]), velocity=velocity)

    def _worst(self, ego: Ego, objects: Array, bodies: Bodies, now: Time) -> _Meeting | None:
        """The object whose conflict comes first; `bodies` are the objects at `now`."""
        if len(objects) == 0:
            return None
        conflicts = self._prediction.first_conflicts(ego, bodies)
        first = int(np.argmin(conflicts.time))
        if np.isinf(conflicts.time[first]):
            return None
        return _Meeting(
            distance=float(conflicts.distance[first]), hazard=_hazard(objects[first], now)
        )


def _hazard(record: Array, now: Time) -> Hazard:
    """That object, an `OBJECT` record of shape (), as what is braked for at `now` [ns]."""
    return Hazard(
        instance=int(record["instance"]),
        sensor=int(record["sensor"]),
        age=float((now - record["time"]) / 1e9),
    )


class _RulePolicy(DrivingPolicy):
    """What the rule-based policies share: all but the objects that they know."""

    Parameters: TypeAlias = Parameters

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters

    @override
    def begin(self, start: Time, rng: np.random.Generator) -> None:
        self._driver = _Driver(self._parameters)

    @override
    def drive(self, inputs: Inputs, now: Time) -> Command:
        return self._driver.drive(inputs, now)


class RuleBased(_RulePolicy):
    """Drives along the route and brakes for what the ego sees and what it received.

    Every object is predicted with constant velocity, shared ones from the time of their
    scan; a conflict with the ego's own motion is braked for when it needs more than a
    comfortable deceleration.
    """

    @property
    @override
    def reads(self) -> frozenset[str]:
        return _RULE_BASED


class Blind(_RulePolicy):
    """The rule-based policy without V2X: it brakes for what the ego's own lidar sees."""

    @property
    @override
    def reads(self) -> frozenset[str]:
        return _BLIND
