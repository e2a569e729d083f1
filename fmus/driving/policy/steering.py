r"""Following the route: pure pursuit.

The rear axle drives on the circular arc that leads, tangentially to the heading, to a point of the
route ahead. At a distance $d$ and an angle $\alpha$ from the heading that arc has the curvature
$2 \sin\alpha / d$ (R. C. Coulter, Implementation of the Pure Pursuit Path Tracking Algorithm,
CMU-RI-TR-92-01, 1992, section 2), for which a kinematic single track of wheelbase $l$ needs the
road-wheel angle $\delta = \arctan(2 l \sin\alpha / d)$.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.policy.ego import Ego
from fmus.driving.policy.route import Segments
from orchestrator.parameters import parameter

_DIGITS: Final = 9
"""The command is rounded to so many decimals: the last of them is far above rounding errors, which
must not steer, and below any effect."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteeringParameters:
    """How a policy follows the route; vehicle and actuator as in `sumo-traffic`."""

    wheelbase: float = parameter(2.85, unit="m", minimum=0.1, doc="of the ego vehicle")
    max_steering: float = parameter(
        0.6, unit="rad", minimum=0.01, maximum=1.2, doc="road-wheel angle of a full command"
    )
    lookahead: float = parameter(
        5.0, unit="m", minimum=0.5, doc="it steers to the route this far ahead of its rear axle"
    )
    lookahead_time: float = parameter(
        0.8, unit="s", minimum=0.0, doc="or as far as it comes in this time, if that is farther"
    )


_USUAL: Final = SteeringParameters()


def follow(ego: Ego, parameters: SteeringParameters = _USUAL) -> float:
    """The steering command, -1 (right) to 1 (left), that leads to the route and along it.

    It depends on the ego's present pose, speed and route only. The route is continued straight
    beyond its ends. A vehicle that drives away from the point ahead turns as sharply as it can.

    Args:
        ego: where it is, how fast, and its route; its axles are assumed to lie symmetrically to
            the body's centre.
        parameters: of the vehicle, and how far to look; by default those of the ego vehicle in
            `sumo-traffic`.

    Returns:
        The command; exactly 0 on a straight route without offset, and without a route.
    """
    if not ego.has_route:
        return 0.0
    ahead = np.array([math.cos(ego.heading), math.sin(ego.heading)])
    rear = ego.position - 0.5 * parameters.wheelbase * ahead
    line = Segments.of(ego.route)
    distance = max(parameters.lookahead, parameters.lookahead_time * ego.speed)
    target = line.at(float(line.project(rear)[0]) + distance)
    x, y = (target - rear).tolist()
    forward, left = ahead[0] * x + ahead[1] * y, ahead[0] * y - ahead[1] * x
    if forward <= 0.0:
        return math.copysign(1.0, left)
    angle = math.atan2(2.0 * parameters.wheelbase * left, forward * forward + left * left)
    command = round(angle / parameters.max_steering, _DIGITS) + 0.0  # no negative zero
    return min(max(command, -1.0), 1.0)
