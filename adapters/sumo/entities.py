"""Declarations of who takes part besides SUMO's own traffic, in the words of ASAM OpenSCENARIO.

OpenSCENARIO XML 1.3 calls them entities: an object with an initial state (position, speed,
route), a controller, and actions that triggers start. What is called differently here is said
where it is declared.
"""

from dataclasses import dataclass
from typing import Final, Literal

from adapters.sumo.ego import EgoDynamics
from orchestrator.distribution import Constant, Distribution
from orchestrator.parameters import parameter

ROADSIDE_UNIT: Final = "roadside_unit"
"""The type of entities that are no vehicles but radios on masts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Where an entity is at the start: on a lane (LanePosition), or anywhere (WorldPosition)."""

    lane: str = parameter("", doc="the lane; empty: `x` and `y` say where")
    s: float | None = parameter(
        None, unit="m", minimum=0.0, doc="from the start of the lane to its front bumper"
    )
    to_end: float | None = parameter(
        None, unit="m", minimum=0.0, doc="instead: from its front bumper to the end of the lane"
    )
    x: float | None = parameter(None, unit="m", doc="of the body's centre, east")
    y: float | None = parameter(None, unit="m", doc="of the body's centre, north")
    h: float = parameter(0.0, unit="rad", doc="heading there, counter-clockwise from east")


@dataclass(frozen=True, slots=True, kw_only=True)
class Synchronise:
    """Reach a place when another entity does (SynchronizeAction)."""

    entity: str = parameter(doc="the other one (masterEntityRef)")
    x: float | None = parameter(
        None, unit="m", doc="of the place, east; default: where the ways of both first cross"
    )
    y: float | None = parameter(None, unit="m", doc="of the place, north")
    hold_distance: float = parameter(
        25.0, unit="m", minimum=0.0, doc="to the place; from there it keeps its speed"
    )
    min_speed: float = parameter(
        20 / 3.6, unit="m/s", minimum=0.1, maximum=70.0, doc="when it waits for the other one"
    )
    max_speed: float = parameter(
        60 / 3.6, unit="m/s", minimum=0.1, maximum=70.0, doc="when it catches up with it"
    )
    max_acceleration: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, maximum=10.0, doc="both ways"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """When an action begins: once all that is said here holds (ConditionGroup)."""

    after: float = parameter(
        0.0, unit="s", minimum=0.0, doc="time since the start (SimulationTimeCondition)"
    )
    entity: str = parameter("", doc="another entity; empty: nobody")
    closer_than: float | None = parameter(
        None, unit="m", minimum=0.0, doc="to `entity`, between centres (RelativeDistanceCondition)"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedPoint:
    """A point of a speed profile; between two of them the speed changes evenly."""

    time: float = parameter(unit="s", minimum=0.0, doc="since the action began")
    speed: float = parameter(unit="m/s", minimum=0.0, maximum=70.0, doc="from then on")


@dataclass(frozen=True, slots=True, kw_only=True)
class Vertex:
    """A point of a trajectory; between two of them it moves straight and evenly."""

    time: float = parameter(unit="s", minimum=0.0, doc="since the action began")
    x: float = parameter(unit="m", doc="of the body's centre, east")
    y: float = parameter(unit="m", doc="of the body's centre, north")


@dataclass(frozen=True, slots=True, kw_only=True)
class Finish:
    """When a driven entity is through (a stop condition)."""

    distance: float = parameter(
        15.0, unit="m", minimum=0.0, doc="of its rear bumper beyond what the other keys say"
    )
    crossing: str = parameter(
        "",
        doc="an entity: where the ways cross; if that does not take part, or for nobody: where the "
        "first junction ends",
    )
    x: float | None = parameter(None, unit="m", doc="instead: the place of the way nearest to x, y")
    y: float | None = parameter(None, unit="m", doc="see `x`")


@dataclass(frozen=True, slots=True, kw_only=True)
class Dynamics:
    """How a driven entity answers to pedals and steering wheel."""

    wheelbase: float = parameter(2.85, unit="m", minimum=1.0, maximum=8.0, doc="between the axles")
    max_acceleration: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, maximum=15.0, doc="at full accelerator"
    )
    max_braking: float = parameter(
        8.0, unit="m/s^2", minimum=0.1, maximum=15.0, doc="at full brake"
    )
    actuator_lag: float = parameter(
        0.1, unit="s", minimum=0.001, maximum=2.0, doc="time constant of the acceleration"
    )
    pedal_delay: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=5.0,
        doc="dead time from the command to the pedals, before the lag",
    )
    steering_delay: float = parameter(
        0.0, unit="s", minimum=0.0, maximum=5.0, doc="dead time from the command to the steering"
    )
    max_steering: float = parameter(
        0.6, unit="rad", minimum=0.0, maximum=1.2, doc="largest road-wheel angle"
    )
    max_steering_rate: float = parameter(
        0.8, unit="rad/s", minimum=0.0, maximum=10.0, doc="of the road-wheel angle"
    )

    @property
    def single_track(self) -> EgoDynamics:
        """The constants of the equations of motion."""
        return EgoDynamics(
            wheelbase=self.wheelbase,
            max_acceleration=self.max_acceleration,
            max_braking=self.max_braking,
            actuator_lag=self.actuator_lag,
            max_steering=self.max_steering,
            max_steering_rate=self.max_steering_rate,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """Somebody who takes part: what, where, how it moves and what it carries."""

    type: str = parameter(
        doc="vehicle type of the scene, or `roadside_unit`: a radio on a mast, without a body"
    )
    position: Position = parameter(doc="at the start")
    presence: float = parameter(
        1.0, minimum=0.0, maximum=1.0, doc="probability that it takes part (drawn)"
    )
    enters: float = parameter(
        0.0, unit="s", minimum=0.0, doc="how long after the start (AddEntityAction)"
    )
    speed: Distribution = parameter(
        Constant(0.0), unit="m/s", minimum=0.0, maximum=70.0, doc="at the start (drawn)"
    )
    route: tuple[str, ...] = parameter(
        (),
        doc="edges after its first one; default: straight on while one way leads on "
        "(AssignRouteAction)",
    )
    to: str = parameter("", doc="instead: the edge that it goes to, the fastest way")
    count: int = parameter(
        1, minimum=0, maximum=50, doc="that many in a row behind each other, a queue"
    )
    gap: float | None = parameter(
        None,
        unit="m",
        minimum=0.5,
        doc="in the queue, bumper to bumper; default: `minGap` of its type, the least",
    )
    parked: bool = parameter(default=False, doc="whether it stands beside its lane for good")
    controller: Literal["sumo", "policy"] = parameter(
        "sumo",
        doc="who drives it: SUMO, or whoever is connected to `<name>.command`; actions override "
        "SUMO (AssignControllerAction)",
    )
    synchronise: Synchronise | None = parameter(
        None, doc="reach a place when another entity does, whatever lights and others say"
    )
    speed_profile: tuple[SpeedPoint, ...] = parameter(
        (), doc="keep these speeds on its way, whatever lights and others say (SpeedProfileAction)"
    )
    trajectory: tuple[Vertex, ...] = parameter(
        (), doc="follow these points, on the road or beside it (FollowTrajectoryAction)"
    )
    trigger: Trigger = parameter(Trigger(), doc="starts `speed_profile` and `trajectory`")
    changes_lanes: bool = parameter(default=False, doc="whether SUMO may let it change lanes")
    radio: bool = parameter(default=True, doc="whether it has a V2X radio")
    lidar: bool = parameter(default=False, doc="whether it carries a lidar")
    antenna_height: float | None = parameter(
        None,
        unit="m",
        minimum=0.1,
        maximum=100.0,
        doc="above the ground; default: of its type; of roadside units 5 m (TR 37.885, "
        "table 6.1.4-1)",
    )
    dynamics: Dynamics = parameter(Dynamics(), doc="with the controller `policy`")
    finish: Finish | None = parameter(
        None, doc="when it is through, with the controller `policy`; default: when it leaves"
    )
    shown: Literal["route", "exactly"] = parameter(
        "route",
        doc="where SUMO's drivers see it, with the controller `policy`: on the lane of its route, "
        "or exactly there, also on oncoming lanes",
    )
    keeps_clear: Literal["behind", "lane", "edge"] = parameter(
        "behind",
        doc="where no background vehicle starts: before it on its lane; on its whole lane; on its "
        "whole edge, and none turns into the lane that it takes beyond the junction",
    )

    @property
    def is_driven(self) -> bool:
        """Whether a policy of the system drives it: it is an ego vehicle."""
        return self.controller == "policy"

    @property
    def is_moved_here(self) -> bool:
        """Whether it is moved here, so that SUMO only shows it to other drivers."""
        beside = self.position.x is not None and not self.is_roadside_unit
        return self.ignores_lights or bool(self.trajectory) or beside

    @property
    def ignores_lights(self) -> bool:
        """Whether it drives on its way whatever lights and others say."""
        return self.is_driven or self.synchronise is not None or bool(self.speed_profile)

    @property
    def is_roadside_unit(self) -> bool:
        """Whether it is a radio on a mast and no vehicle."""
        return self.type == ROADSIDE_UNIT
