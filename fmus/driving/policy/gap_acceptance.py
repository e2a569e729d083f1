r"""When there is time to overtake on a road with oncoming traffic.

The model is that of J. C. Glennon (New and improved model of passing sight distance on two-lane
highways, Transportation Research Record 1195, 1988, pp. 132-137): who passes can, at any time, go
on and complete the pass, or abort it and drop back behind the one ahead; both leave some clearance
to whoever comes. At the *critical position* both leave the same; before it the abort leaves more,
beyond it completing does. A pass may begin if completing it leaves enough, and goes on while it
leaves half of that; then what leaves more is done. One second is enough, for who comes and for the
one that is passed, and who drops back brakes with 3.4 m/s^2 (AASHTO, A Policy on Geometric Design
of Highways and Streets, 6th edition, 2011, section 3.2.4).

Clearances are times here: how long after the ego is back in its lane the two would be side by side.
"""

import math


def time_to_gain(
    distance: float, speed: float, other: float, *, acceleration: float, cruise: float
) -> float:
    """How long it takes to get ahead by a distance of somebody who keeps his speed.

    Args:
        distance: to gain [m].
        speed: now, along the road [m/s]; one above `cruise` is kept.
        other: the speed of the other one [m/s].
        acceleration: with which the speed is taken up [m/s^2].
        cruise: the speed that is taken up [m/s].

    Returns:
        The time [s]: 0 if nothing is left to gain, infinite if the other one is not slower.
    """
    if distance <= 0.0:
        return 0.0
    faster = speed - other
    ramp = max(cruise - speed, 0.0) / acceleration
    gained = faster * ramp + 0.5 * acceleration * ramp * ramp
    if gained >= distance:
        return (-faster + math.sqrt(faster * faster + 2.0 * acceleration * distance)) / acceleration
    top = max(cruise, speed) - other
    return ramp + (distance - gained) / top if top > 0.0 else math.inf


def time_to_lose(distance: float, speed: float, other: float, *, braking: float) -> float:
    """How long it takes to fall back by a distance behind somebody who keeps his speed.

    Args:
        distance: to lose [m].
        speed: now, along the road [m/s].
        other: the speed of the other one [m/s].
        braking: deceleration, down to a standstill [m/s^2].

    Returns:
        The time [s]: 0 if nothing is left to lose, infinite if the other one stands and is not
        ahead enough where the brakes end.
    """
    if distance <= 0.0:
        return 0.0
    faster, stop = speed - other, speed / braking
    lost = 0.5 * braking * stop * stop - faster * stop
    if lost >= distance:
        return (faster + math.sqrt(faster * faster + 2.0 * braking * distance)) / braking
    return stop + (distance - lost) / other if other > 0.0 else math.inf


def clearance(gap: float, approach: float, *, way: float, speed: float, time: float) -> float:
    """How long after `time` two that approach each other would be side by side.

    Args:
        gap: between their fronts now [m].
        approach: the speed of the one that comes, towards the other [m/s]; negative if it drives
            away.
        way: that the other one comes until `time` [m].
        speed: that it has then [m/s].
        time: [s].

    Returns:
        The clearance [s], negative if they meet before; infinite if they never meet.
    """
    left, closing = gap - way - approach * time, speed + approach
    if closing > 0.0:
        return left / closing
    return math.inf if left > 0.0 else -math.inf
