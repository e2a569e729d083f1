"""The ego vehicle, as driving policies know it."""

from dataclasses import dataclass

import numpy as np

from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Ego:
    """The ego vehicle.

    Attributes:
        vehicle: its number, -1 once it has left.
        position: centre of the body [m], shape (2,).
        heading: counter-clockwise from east [rad].
        speed: along the heading [m/s].
        length, width: of the body [m].
        route: centre line of the route, from the body's centre on [m], shape (vertex, 2); empty
            once it has left.
    """

    vehicle: int
    position: Array
    heading: float
    speed: float
    length: float
    width: float
    route: Array

    @property
    def has_route(self) -> bool:
        """Whether the route leads anywhere."""
        return len(self.route) > 1 and bool((np.ptp(self.route, axis=0) > 0).any())
