"""Blind zones against the hidden part of the road."""

from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.session import Match
from studies.verification.perception.truth import Truth


@dataclass(frozen=True, slots=True, kw_only=True)
class ZoneAreas:
    """Areas within the area of interest [m^2].

    Attributes:
        zones: in a blind zone.
        hidden: hidden in truth.
        both: in a blind zone, and hidden in truth.
    """

    zones: float
    hidden: float
    both: float

    def __add__(self, other: "ZoneAreas") -> "ZoneAreas":
        """The areas of two scenes together."""
        return ZoneAreas(
            zones=self.zones + other.zones,
            hidden=self.hidden + other.hidden,
            both=self.both + other.both,
        )

    @property
    def precision(self) -> float:
        """Share of the zones that is hidden; NaN without zones."""
        return self.both / self.zones if self.zones else float("nan")

    @property
    def recall(self) -> float:
        """Share of what is hidden that is in zones; NaN if nothing is hidden."""
        return self.both / self.hidden if self.hidden else float("nan")

    @property
    def iou(self) -> float:
        """Intersection over union; NaN if both are empty."""
        union = self.zones + self.hidden - self.both
        return self.both / union if union else float("nan")


def zone_area(match: Match, heading: float) -> BaseGeometry:
    """The union of the blind zones.

    Args:
        match: has their centres and ranges.
        heading: that the ego vehicle believes to have, along which the squares are turned [rad].
    """
    if len(match.ranges) == 0:
        return Polygon()  # of a known dimension, unlike the union of nothing
    forward = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-forward[1], forward[0]])
    square = np.stack([-forward - left, forward - left, forward + left, left - forward])
    rings = match.centers[:, None] + match.ranges[:, None, None] * square
    return shapely.union_all(shapely.polygons(rings))


def compare_zones(area: BaseGeometry, truth: Truth) -> ZoneAreas:
    """The areas of one scene; `area` is the union of its blind zones."""
    zones = shapely.intersection(area, truth.interest)
    return ZoneAreas(
        zones=float(zones.area),
        hidden=float(truth.hidden.area),
        both=float(shapely.intersection(zones, truth.hidden).area),
    )
