"""Expert driving: full knowledge of all vehicles, no memory. The teacher of trained policies."""

import math
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from typing_extensions import override

from fmus.driving.policy.base import DrivingPolicy
from fmus.driving.policy.command import Command, Hazard
from fmus.driving.policy.conflict import taking_up_speed
from fmus.driving.policy.connectors import EGO, VEHICLES
from fmus.driving.policy.driving import DrivingParameters, lateral_planner
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.inputs import Inputs
from fmus.driving.policy.occupancy import Vehicles, occupancy, others, reaching
from fmus.driving.policy.route import Segments
from fmus.driving.policy.steering import follow
from fmus.messages.records import NO_VEHICLE
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.signal import Array
from orchestrator.timebase import Time

EXPERT_READS: Final = EGO | VEHICLES
"""Names of the inputs that the expert reads."""
_REACTION: Final = 1.0
"""Speeds are taken up within this time [s], if accelerations allow."""
_CLOSEST: Final = 0.1
"""The needed deceleration does not grow any more when there is less room than this [m]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertParameters(DrivingParameters):
    """Parameters of the expert; vehicle and actuators as in `sumo-traffic`."""

    comfortable: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, doc="deceleration with which it brakes for a conflict"
    )
    onset: float = parameter(
        2.0, unit="m/s^2", minimum=0.0, doc="needed deceleration at which it begins to brake"
    )
    max_acceleration: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, doc="of the ego at full accelerator"
    )
    max_braking: float = parameter(8.0, unit="m/s^2", minimum=0.1, doc="of the ego at full brake")
    horizon: float = parameter(6.0, unit="s", minimum=0.2, doc="how far to predict")
    stop_margin: float = parameter(
        3.0, unit="m", minimum=0.0, doc="where to stop before a conflict"
    )
    headway: float = parameter(
        1.0, unit="s", minimum=0.0, doc="to a vehicle that drives ahead on the route"
    )
    haste: float = parameter(
        0.3, minimum=0.0, doc="others may get ahead faster than predicted by this share"
    )
    delay: float = parameter(
        0.1, minimum=0.0, maximum=0.9, doc="others may get ahead slower by this share"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Margins:
    """How much room to keep: beside the ego, before and behind it [m], and shares of time."""

    lateral: float
    longitudinal: float
    haste: float
    delay: float


_LEAST: Final = _Margins(lateral=0.2, longitudinal=0.3, haste=0.0, delay=0.0)
"""Enough not to touch anybody."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Threats:
    """Vehicles that the ego would meet if it took up its speed now.

    Attributes:
        number: (threat,).
        room: for the ego to stop, or to slow down to their pace [m], (threat,).
        pace: with which they get ahead along the route [m/s], (threat,).
    """

    number: Array
    room: Array
    pace: Array


class ExpertDriver:
    """Decides from the truth at one time alone: equal inputs make equal outputs.

    Every vehicle is predicted with constant velocity, and as well a share faster and a share
    slower, as an oriented box. If the ego, taking up its cruising speed now, came into its way,
    the vehicle is a threat: the ego's speed is limited to what lets it stop comfortably before
    the part of the route that the vehicle takes up. That limit is far above any speed as long as
    the vehicle is far away, where the forecast may still change. When the way is clear, or would
    be by the time the ego came there, it goes on. Where it cannot stop any more it goes on if
    the way is free without margins, and brakes otherwise.
    """

    def __init__(self, parameters: ExpertParameters) -> None:
        self._parameters = parameters
        self._wide = _Margins(
            lateral=parameters.lateral_margin,
            longitudinal=parameters.longitudinal_margin,
            haste=parameters.haste,
            delay=parameters.delay,
        )
        steps = max(round(parameters.horizon / parameters.prediction_step), 1)
        self._times = parameters.prediction_step * np.arange(steps + 1)

    def drive(self, inputs: Inputs, limit: float = math.inf) -> Command:
        """The command; it depends on the ego, its route, and the true vehicles.

        Args:
            inputs: the ego and all vehicles.
            limit: the highest acceleration [m/s^2].

        Raises:
            ValueError: the ego is not among the vehicles.
        """
        ego, comfortable = inputs.ego, self._parameters.comfortable
        wanted = (self._parameters.cruise_speed - ego.speed) / _REACTION
        wanted = min(max(wanted, -comfortable), self._parameters.acceleration, limit)
        hazard = None
        if ego.has_route:
            wanted, hazard = self._yielding(ego, others(inputs.vehicles, ego.vehicle), wanted)
        return Command(
            accelerate=min(max(0.0, wanted) / self._parameters.max_acceleration, 1.0),
            brake=min(max(0.0, -wanted) / self._parameters.max_braking, 1.0),
            steer=follow(ego, self._parameters),
            hazard=hazard,
        )

    def _yielding(self, ego: Ego, vehicles: Vehicles, wanted: float) -> tuple[float, Hazard | None]:
        """The acceleration [m/s^2], at most `wanted`, that yields to others; who is braked for."""
        threats = self._threats(ego, vehicles, self._wide)
        if len(threats.number) == 0 or self._better_goes_on(ego, vehicles, threats):
            return wanted, None
        accelerations = [
            self._before(ego.speed, room, pace, wanted)
            for room, pace in zip(threats.room.tolist(), threats.pace.tolist(), strict=True)
        ]
        least = min(accelerations)
        if least >= min(wanted, 0.0):
            return min(least, wanted), None
        number = int(threats.number[accelerations.index(least)])
        return least, Hazard(instance=number, sensor=NO_VEHICLE, age=0.0)

    def _before(self, speed: float, room: float, pace: float, wanted: float) -> float:
        """The acceleration [m/s^2] with which the ego comes to `pace` within `room`.

        It tracks the speed from which a deceleration of `onset` is enough. The needed
        deceleration itself takes its place as it grows from `onset` to `comfortable`.
        """
        onset, comfortable = self._parameters.onset, self._parameters.comfortable
        if room > 0.0:
            target = math.sqrt(pace * pace + 2.0 * onset * room)
        else:
            target = max(pace + room / _REACTION, 0.0)
        tracking = min(max((target - speed) / _REACTION, -comfortable), wanted)
        least = max(_CLOSEST, 0.5 * self._parameters.headway * pace)
        needed = max(speed * speed - pace * pace, 0.0) / (2.0 * max(room, least))
        share = min(max((needed - onset) / (comfortable - onset), 0.0), 1.0)
        return (1.0 - share) * tracking - share * min(needed, self._parameters.max_braking)

    def _better_goes_on(self, ego: Ego, vehicles: Vehicles, threats: _Threats) -> bool:
        """Whether the ego cannot stop before a threat any more, but touches nobody if it goes."""
        room = np.maximum(threats.room + self._parameters.stop_margin, 0.0)
        fastest = threats.pace**2 + 2.0 * self._parameters.max_braking * room
        if (ego.speed**2 <= fastest).all():
            return False
        return len(self._threats(ego, vehicles, _LEAST).number) == 0

    def _threats(self, ego: Ego, vehicles: Vehicles, margins: _Margins) -> _Threats:
        line, half = Segments.of(ego.route), 0.5 * ego.length
        side, reach = 0.5 * ego.width + margins.lateral, half + margins.longitudinal
        early = self._travelled(ego, self._times / (1.0 + margins.haste))
        late = self._travelled(ego, self._times / (1.0 - margins.delay))
        place = line.box(-half, float(late[-1]) + reach, side)
        near = vehicles.only(reaching(vehicles, self._times, place))
        taken = occupancy(line, near, self._times, side)
        met = (taken.rear <= late + reach) & (taken.front >= early - reach)
        rows = met.any(axis=1) & (line.project(near.corners())[0].max(axis=-1) >= -half)
        pace = taken.pace[rows]
        beginning = (taken.rear[rows] - pace[:, None] * self._times).min(axis=1, initial=np.inf)
        kept = half + self._parameters.stop_margin + self._parameters.headway * pace
        return _Threats(number=near.number[rows], room=beginning - kept, pace=pace)

    def _travelled(self, ego: Ego, times: Array) -> Array:
        wanted = self._parameters
        return taking_up_speed(ego, wanted.cruise_speed, wanted.acceleration, times)


class Expert(DrivingPolicy):
    """Drives with full knowledge of all vehicles: the teacher of trained policies, and a bound.

    Outputs depend on the present inputs only, so that the command can be learned from what a
    vehicle sees at one time; while it overtakes, on how far it has got, too. It reads the truth, no
    sensor and no message.
    """

    Parameters: TypeAlias = ExpertParameters

    def __init__(self, parameters: ExpertParameters) -> None:
        _check(parameters)
        self._parameters = parameters
        self._driver = ExpertDriver(parameters)

    @override
    def begin(self, start: Time, rng: np.random.Generator) -> None:
        self._lateral = lateral_planner(self._parameters)

    @property
    @override
    def reads(self) -> frozenset[str]:
        return EXPERT_READS

    @override
    def drive(self, inputs: Inputs, now: Time) -> Command:
        ego = inputs.ego
        if not ego.has_route:
            return self._driver.drive(inputs)
        around = others(inputs.vehicles, ego.vehicle)
        plan = self._lateral.plan(ego, around.corners(), around.velocity, now)
        command = self._driver.drive(replace(inputs, ego=replace(ego, route=plan.path)), plan.limit)
        if plan.yields_to is None or command.hazard is not None:
            return command
        number = int(around.number[plan.yields_to])
        return replace(command, hazard=Hazard(instance=number, sensor=NO_VEHICLE, age=0.0))


def _check(parameters: ExpertParameters) -> None:
    """Refuse parameters that do not fit together.

    Raises:
        ComponentTypeError: the brakes are weaker than comfortable, or that is below its onset.
    """
    if not parameters.onset < parameters.comfortable <= parameters.max_braking:
        raise ComponentTypeError(
            f"`onset` ({parameters.onset:g} m/s^2) must be below `comfortable` "
            f"({parameters.comfortable:g} m/s^2), and that not above `max_braking` "
            f"({parameters.max_braking:g} m/s^2)"
        )
