"""Keeping a distance to somebody who is slower: the intelligent driver model."""

import math


def following(
    speed: float,
    gap: float,
    other: float,
    *,
    acceleration: float,
    braking: float,
    headway: float,
    standstill: float,
) -> float:
    r"""The acceleration that keeps a distance to the vehicle ahead.

    $$ \dot v = a \left(1 - \left(\frac{s^*}{s}\right)^2\right), \quad
       s^* = s_0 + \max\left(0,\; v T + \frac{v\, \Delta v}{2 \sqrt{a b}}\right) $$

    (M. Treiber, A. Hennecke, D. Helbing, Phys. Rev. E 62, 2000, equations (2) and (3), without the
    term of the wanted speed, which the policy has itself). Behind somebody who keeps his speed it
    comes to rest at the gap $s_0 + v T$.

    Args:
        speed: [m/s].
        gap: bumper to bumper [m]; touching counts as 0.1 m.
        other: the speed of the vehicle ahead [m/s].
        acceleration: the largest [m/s^2].
        braking: the comfortable deceleration [m/s^2].
        headway: the time headway that is kept [s].
        standstill: the gap that is kept at standstill [m].

    Returns:
        Acceleration [m/s^2], below `acceleration` and without a lower bound.
    """
    approach = speed * (speed - other) / (2.0 * math.sqrt(acceleration * braking))
    wanted = standstill + max(0.0, speed * headway + approach)
    return acceleration * (1.0 - (wanted / max(gap, 0.1)) ** 2)
