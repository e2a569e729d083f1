"""Where the ego vehicle believes to be, and all else with it."""

from dataclasses import replace
from typing import Self

from fmus.driving.policy.ego import Ego
from fmus.driving.policy.occupancy import Vehicles
from fmus.messages.pose_errors import PoseErrors
from fmus.physics.plane import Motion
from orchestrator.signal import Signals


class Belief(Motion):
    """The motion of the plane that takes the ego from where it is to where it believes to be."""

    __slots__ = ()

    @classmethod
    def of(cls, ego: Ego, signals: Signals) -> Self | None:
        """What `pose_error` says of the ego; `None` if it is not wrong.

        Args:
            ego: where it is.
            signals: have `pose_error.vehicle`, `pose_error.position` and `pose_error.heading`.
        """
        error = PoseErrors.read(signals).of(ego.vehicle)
        if error is None:
            return None
        return cls(about=ego.position, shift=error[0], angle=error[1])

    def ego(self, ego: Ego) -> Ego:
        """The ego where it believes to be; its route goes with it, for it follows its lane."""
        return replace(
            ego,
            position=self.moved(ego.position),
            heading=ego.heading + self.angle,
            route=self.moved(ego.route),
        )

    def vehicles(self, vehicles: Vehicles) -> Vehicles:
        """Others, where they are for one who believes that."""
        return replace(
            vehicles,
            center=self.moved(vehicles.center),
            heading=vehicles.heading + self.angle,
            velocity=self.turned(vehicles.velocity),
        )
