"""How a policy overtakes."""

from dataclasses import dataclass
from typing import Literal

from orchestrator.parameters import parameter


@dataclass(frozen=True, slots=True, kw_only=True)
class Overtaking:
    """When to pass who is slower, on the lane of oncoming traffic, and how."""

    offset: float = parameter(
        3.5,
        unit="m",
        minimum=1.5,
        maximum=10.0,
        doc="from the middle of its lane to that of the lane on which it passes",
    )
    side: Literal["left", "right"] = parameter(
        "left", doc="on which that lane is: right where one keeps to the left"
    )
    patience: float = parameter(
        1.0,
        unit="s",
        minimum=0.0,
        doc="it passes when it has been held up, and the way has been free, for so long",
    )
    advantage: float = parameter(
        10 / 3.6,
        unit="m/s",
        minimum=0.1,
        doc="who is slower than `cruise_speed` by this holds it up",
    )
    clearance: float = parameter(
        1.0,
        unit="s",
        minimum=0.0,
        doc="how long after it is back in its lane it may meet somebody on the other, at the least",
    )
    headway: float = parameter(
        1.0, unit="s", minimum=0.0, doc="to who is ahead, and of who is behind when it returns"
    )
    standstill: float = parameter(
        2.0, unit="m", minimum=0.5, doc="gap in addition to `headway`, bumper to bumper"
    )
    braking: float = parameter(
        3.4, unit="m/s^2", minimum=0.1, doc="deceleration with which it drops back"
    )
    lateral_acceleration: float = parameter(
        2.5, unit="m/s^2", minimum=0.1, maximum=8.0, doc="of a change of lanes, at the most"
    )
