"""Parameters of `SumoTraffic`."""

from dataclasses import dataclass
from pathlib import Path

from adapters.sumo.actuation import Actuation
from adapters.sumo.ego import EgoDynamics
from adapters.sumo.encounter import SpeedControl
from adapters.sumo.spawning import Demand
from orchestrator.parameters import parameter
from orchestrator.timebase import NANOSECONDS_PER_SECOND


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficParameters:
    """Parameters of `SumoTraffic`; the defaults are those of the scene `red_light`."""

    scene: Path = parameter(doc="SUMO configuration (*.sumocfg): net, types, buildings")
    step_length: float = parameter(
        0.05, unit="s", minimum=0.001, maximum=1.0, doc="SUMO's own step; divides the step size"
    )
    collision_step: float = parameter(
        0.01, unit="s", minimum=0.001, maximum=1.0, doc="interval of the ego's motion and checks"
    )

    # ---- background traffic
    spacing: float = parameter(
        30.0, unit="m", minimum=15.0, doc="one background vehicle per this many metres and lane"
    )
    turning_share: float = parameter(
        0.2, minimum=0.0, maximum=1.0, doc="of the vehicles on lanes that allow it, those turning"
    )
    equipped_share: float = parameter(
        1.0, minimum=0.0, maximum=1.0, doc="of the background vehicles, those with a V2X radio"
    )
    lidar_share: float = parameter(
        0.1, minimum=0.0, maximum=1.0, doc="of the background vehicles, those with a lidar"
    )
    lidar_limit: int = parameter(4, minimum=0, doc="largest number of background lidars at a time")

    # ---- the ego vehicle
    ego_lane: str = parameter("south_in_1", doc="lane the ego vehicle starts on; it goes straight")
    ego_type: str = parameter("sedan", doc="vehicle type of the ego vehicle")
    ego_speed: float = parameter(
        30 / 3.6, unit="m/s", minimum=1.0, maximum=40.0, doc="of the ego vehicle at the start"
    )
    ego_start: float = parameter(
        135.0, unit="m", minimum=0.0, doc="from its front bumper to the stop line at the start"
    )
    wheelbase: float = parameter(2.85, unit="m", minimum=1.0, maximum=8.0, doc="of the ego vehicle")
    max_acceleration: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, maximum=15.0, doc="of the ego at full accelerator"
    )
    max_braking: float = parameter(
        8.0, unit="m/s^2", minimum=0.1, maximum=15.0, doc="of the ego at full brake"
    )
    actuator_lag: float = parameter(
        0.1, unit="s", minimum=0.001, maximum=2.0, doc="time constant of the ego's acceleration"
    )
    pedal_delay: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=5.0,
        doc="dead time from the ego's command to its pedals, before the lag",
    )
    steering_delay: float = parameter(
        0.0,
        unit="s",
        minimum=0.0,
        maximum=5.0,
        doc="dead time from the ego's command to its steering",
    )
    max_steering: float = parameter(
        0.6, unit="rad", minimum=0.0, maximum=1.2, doc="largest road-wheel angle of the ego"
    )
    max_steering_rate: float = parameter(
        0.8, unit="rad/s", minimum=0.0, maximum=10.0, doc="of the ego's road-wheel angle"
    )

    # ---- the encounter
    finish_distance: float = parameter(
        15.0,
        unit="m",
        minimum=0.0,
        doc="from the conflict point (without an encounter: the junction) to the ego's rear bumper "
        "when it has completed",
    )
    encounter: bool = parameter(default=True, doc="whether the collision vehicle is there")
    collider_lane: str = parameter("west_in_0", doc="lane the collision vehicle starts on")
    collider_type: str = parameter("compact", doc="vehicle type of the collision vehicle")
    collider_speed: float = parameter(
        30 / 3.6, unit="m/s", minimum=1.0, maximum=40.0, doc="of the collision vehicle at the start"
    )
    collider_spread: float = parameter(
        5 / 3.6,
        unit="m/s",
        minimum=0.0,
        maximum=10.0,
        doc="its speed differs by up to this (drawn)",
    )
    collider_min_speed: float = parameter(
        20 / 3.6, unit="m/s", minimum=0.1, maximum=40.0, doc="when it waits for the ego vehicle"
    )
    collider_max_speed: float = parameter(
        60 / 3.6, unit="m/s", minimum=0.1, maximum=40.0, doc="when it catches up with it"
    )
    collider_max_acceleration: float = parameter(
        3.0, unit="m/s^2", minimum=0.1, maximum=10.0, doc="of the collision vehicle, both ways"
    )
    hold_distance: float = parameter(
        25.0, unit="m", minimum=0.0, doc="to the conflict point; from there it keeps its speed"
    )

    # ---- the sharing node and the blocking vehicles
    sharer_lane: str = parameter("north_in_2", doc="lane at whose stop line the sharing node waits")
    sharer_type: str = parameter("mpv", doc="vehicle type of the lidar sharing node")
    blocking_lane: str = parameter("south_in_2", doc="lane the blocking vehicles wait on")
    blocking_type: str = parameter("box_truck", doc="vehicle type of the blocking vehicles")
    blocking_count: int = parameter(4, minimum=0, maximum=50, doc="number of blocking vehicles")
    blocking_gap: float = parameter(
        1.5, unit="m", minimum=0.5, doc="between blocking vehicles, bumper to bumper"
    )
    blocking_equipped: bool = parameter(
        default=False, doc="whether blocking vehicles have a V2X radio and could relay"
    )

    # ---- roadside units
    rsu_positions: tuple[tuple[float, ...], ...] = parameter(
        (), unit="m", doc="of roadside units that could relay, [x, y] each: [[14 m, 9 m]] is one"
    )
    rsu_antenna_height: float = parameter(
        5.0, unit="m", minimum=1.0, maximum=100.0, doc="of roadside units; TR 37.885, table 6.1.4-1"
    )

    @property
    def dynamics(self) -> EgoDynamics:
        """The dynamics of the ego vehicle."""
        return EgoDynamics(
            wheelbase=self.wheelbase,
            max_acceleration=self.max_acceleration,
            max_braking=self.max_braking,
            actuator_lag=self.actuator_lag,
            max_steering=self.max_steering,
            max_steering_rate=self.max_steering_rate,
        )

    @property
    def actuation(self) -> Actuation:
        """The ego's actuation before the first command; dead times to the nanosecond."""
        return Actuation(
            round(self.pedal_delay * NANOSECONDS_PER_SECOND),
            round(self.steering_delay * NANOSECONDS_PER_SECOND),
        )

    @property
    def demand(self) -> Demand:
        """The demand of the background traffic."""
        return Demand(
            spacing=self.spacing,
            turning_share=self.turning_share,
            equipped_share=self.equipped_share,
            lidar_share=self.lidar_share,
            lidar_limit=self.lidar_limit,
        )

    @property
    def speed_control(self) -> SpeedControl:
        """The speed control of the collision vehicle."""
        return SpeedControl(
            hold_distance=self.hold_distance,
            min_speed=self.collider_min_speed,
            max_speed=self.collider_max_speed,
            max_acceleration=self.collider_max_acceleration,
        )
