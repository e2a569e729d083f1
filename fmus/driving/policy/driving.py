"""What driving by rules, with full knowledge or without, has in common."""

from dataclasses import dataclass

from fmus.driving.policy.lateral import LaneKeeping, LateralPlanner
from fmus.driving.policy.overtaking import Overtaker
from fmus.driving.policy.overtaking_parameters import Overtaking
from fmus.driving.policy.passing import Drive
from fmus.driving.policy.steering import SteeringParameters
from orchestrator.parameters import parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivingParameters(SteeringParameters):
    """How fast a policy drives, and how it predicts who would be in its way."""

    cruise_speed: float = parameter(30.0 / 3.6, unit="m/s", minimum=0.1, doc="speed to keep")
    acceleration: float = parameter(2.0, unit="m/s^2", minimum=0.1, doc="taking up speed")
    prediction_step: float = parameter(0.1, unit="s", minimum=0.01, doc="of the prediction")
    lateral_margin: float = parameter(
        0.4, unit="m", minimum=0.0, doc="room to keep beside the ego's body"
    )
    longitudinal_margin: float = parameter(
        2.0, unit="m", minimum=0.0, doc="room to keep before and behind the ego's body"
    )
    overtaking: Overtaking | None = parameter(
        None, doc="when to pass on the lane of oncoming traffic; null: it never leaves its lane"
    )


def lateral_planner(parameters: DrivingParameters) -> LateralPlanner:
    """What decides on the lane of a policy with these parameters, for one run."""
    if parameters.overtaking is None:
        return LaneKeeping()
    drive = Drive(
        cruise=parameters.cruise_speed,
        acceleration=parameters.acceleration,
        lateral_margin=parameters.lateral_margin,
    )
    return Overtaker(parameters.overtaking, drive)
