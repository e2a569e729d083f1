"""Errors of vehicles about their poses: the signals `pose_error.*`."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PoseErrors:
    """The error of each vehicle that may be wrong.

    Attributes:
        vehicle: their numbers, ascending, int64, shape (vehicle,).
        position: where each believes to be less where it is [m], float64, shape (vehicle, 2).
        heading: the heading it believes less its own [rad], float64, shape (vehicle,).
    """

    vehicle: Array
    position: Array
    heading: Array

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The errors in the inputs of a step."""
        return cls(
            vehicle=np.asarray(signals["pose_error.vehicle"], np.int64),
            position=np.asarray(signals["pose_error.position"], np.float64),
            heading=np.asarray(signals["pose_error.heading"], np.float64),
        )

    def of(self, vehicle: int) -> tuple[Array, float] | None:
        """The errors of one vehicle: [m], shape (2,), and [rad]; `None` if it is not wrong."""
        row = int(self.vehicle.searchsorted(vehicle))
        if row == len(self.vehicle) or self.vehicle[row] != vehicle:
            return None
        shift, angle = self.position[row], float(self.heading[row])
        return (shift, angle) if shift.any() or angle else None

    def is_same(self, other: "PoseErrors") -> bool:
        """Whether all arrays are the very objects of `other`."""
        return (
            self.vehicle is other.vehicle
            and self.position is other.position
            and self.heading is other.heading
        )
