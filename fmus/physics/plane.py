"""Frames in the plane, and turns whose bits do not depend on the machine.

Sine and cosine come from libraries that differ in the last bit. Here they are polynomials,
evaluated by additions and multiplications of doubles only, which IEEE 754 defines to the bit.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.signal import Array

_QUARTER: Final = math.pi / 2.0
_SINE: Final = tuple((-1) ** k / math.factorial(2 * k + 1) for k in range(10))
_COSINE: Final = tuple((-1) ** k / math.factorial(2 * k) for k in range(11))


def cosine_sine(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle [rad].

    They are exact to 2e-15 where it is below 10, and to 2e-10 where it is below 1e6:
    Taylor series about the next multiple of a quarter turn; at most an eighth of a turn away,
    the terms left out are below 1e-20.
    """
    quarters = round(angle / _QUARTER)
    rest = angle - quarters * _QUARTER
    square = rest * rest
    sine = cosine = 0.0
    for factor in reversed(_SINE):
        sine = sine * square + factor
    for factor in reversed(_COSINE):
        cosine = cosine * square + factor
    sine *= rest
    turns = ((cosine, sine), (-sine, cosine), (-cosine, -sine), (sine, -cosine))
    return turns[quarters % 4]


def turned(x: Array, y: Array, angle: float) -> tuple[Array, Array]:
    """Vectors turned counter-clockwise.

    Args:
        x: first coordinates of the vectors, any shape and unit.
        y: second coordinates, of the same shape and unit.
        angle: by which they are turned [rad].

    Returns:
        The turned x and y, of the same shape and unit.
    """
    cosine, sine = cosine_sine(angle)
    return x * cosine - y * sine, x * sine + y * cosine


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """A motion of the plane: what is turned and then shifted keeps its shape.

    Attributes:
        about: the place about which it is turned [m], shape (2,).
        shift: of that place [m], shape (2,).
        angle: by which it is turned, counter-clockwise [rad].
    """

    about: Array
    shift: Array
    angle: float

    def moved(self, places: Array) -> Array:
        """Where places come to be [m], shape (..., 2) both."""
        return np.asarray(self.about + self.shift + self.turned(places - self.about))

    def turned(self, vectors: Array) -> Array:
        """Vectors of any unit, turned; shape (..., 2) both."""
        return np.stack(turned(vectors[..., 0], vectors[..., 1], self.angle), axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Frame:
    """A place in the plane and a heading.

    Attributes:
        x, y: of the origin, world frame [m].
        heading: of the first axis, counter-clockwise from east [rad].
    """

    x: float
    y: float
    heading: float

    @classmethod
    def at(cls, position: Array, heading: float) -> "Frame":
        """The frame at the first two coordinates of `position` [m], shape (2,) or (3,)."""
        return cls(x=float(position[0]), y=float(position[1]), heading=heading)

    def to(self, other: "Frame", x: Array, y: Array) -> tuple[Array, Array]:
        """The places of points of this frame in another one.

        Args:
            other: the other frame.
            x: of the points in this frame [m], any shape.
            y: of the same shape [m].

        Returns:
            The x and y in `other` [m], of the same shape.
        """
        ahead, left = turned(x, y, self.heading - other.heading)
        offset_x, offset_y = self.x - other.x, self.y - other.y
        shift_x, shift_y = turned_back(offset_x, offset_y, other.heading)
        return ahead + shift_x, left + shift_y

    def turn(self, other: "Frame") -> float:
        """The angle by which vectors of this frame are turned to be in `other` [rad]."""
        return self.heading - other.heading


def turned_back(x: float, y: float, angle: float) -> tuple[float, float]:
    """A vector turned clockwise by `angle` [rad]."""
    cosine, sine = cosine_sine(angle)
    return x * cosine + y * sine, y * cosine - x * sine
