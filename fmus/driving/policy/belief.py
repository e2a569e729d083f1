"""Where the ego vehicle believes to be, and all else with it."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from fmus.driving.network.plane import cosine_sine
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.occupancy import Vehicles
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Belief:
    """The motion of the plane that takes the ego from where it is to where it believes to be.

    Attributes:
        about: where the ego is [m], shape (2,); what turns, turns about it.
        shift: from there to where it believes to be [m], shape (2,).
        angle: by which it believes to be turned [rad].
    """

    about: Array
    shift: Array
    angle: float

    @classmethod
    def of(cls, ego: Ego, signals: Signals) -> Self | None:
        """What `pose_error` says of the ego; `None` if it is not wrong.

        Args:
            ego: where it is.
            signals: have `pose_error.vehicle`, `pose_error.position` and `pose_error.heading`.
        """
        (rows,) = np.nonzero(np.asarray(signals["pose_error.vehicle"]) == ego.vehicle)
        if len(rows) == 0:
            return None
        shift = np.asarray(signals["pose_error.position"], np.float64)[rows[0]]
        angle = float(np.asarray(signals["pose_error.heading"], np.float64)[rows[0]])
        if not shift.any() and not angle:
            return None
        return cls(about=ego.position, shift=shift, angle=angle)

    def ego(self, ego: Ego) -> Ego:
        """The ego where it believes to be; its route goes with it, for it follows its lane."""
        return replace(
            ego,
            position=self._moved(ego.position),
            heading=ego.heading + self.angle,
            route=self._moved(ego.route),
        )

    def vehicles(self, vehicles: Vehicles) -> Vehicles:
        """Others, where they are for one who believes that."""
        return replace(
            vehicles,
            center=self._moved(vehicles.center),
            heading=vehicles.heading + self.angle,
            velocity=self._turned(vehicles.velocity),
        )

    def _moved(self, places: Array) -> Array:
        """Places [m], shape (..., 2)."""
        return np.asarray(self.about + self.shift + self._turned(places - self.about))

    def _turned(self, vectors: Array) -> Array:
        """Vectors of any unit, shape (..., 2)."""
        cosine, sine = cosine_sine(self.angle)
        x, y = vectors[..., 0], vectors[..., 1]
        return np.stack([x * cosine - y * sine, x * sine + y * cosine], axis=-1)
