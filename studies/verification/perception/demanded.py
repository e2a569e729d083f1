"""What the chosen sharer sends if the ego vehicle asks for its blind zones only."""

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from fmus.facilities.answers import ANSWER_HEADER, DemandedAnswers
from fmus.facilities.demand_driven import Facilities
from fmus.facilities.inputs import BlindZones
from fmus.facilities.zones import NOWHERE, ZONE_SIZE
from fmus.messages.apm import Apm, decode, read_header
from studies.verification.perception.bytes_on_air import RAW_POINT
from studies.verification.perception.scene import Float, Scene
from studies.verification.perception.session import Match, Scans
from studies.verification.perception.truth import Truth

REQUEST: Final = Facilities.Parameters().request_size
"""A request without blind zones [byte]; the default of `facilities`."""


class Matrices:
    """The APM messages of a scene, decoded when they are wanted.

    Args:
        messages: of all equipped vehicles.
    """

    def __init__(self, messages: Sequence[bytes]) -> None:
        self.size = sum(map(len, messages))
        """Of all messages [byte]."""
        self._messages = {int(read_header(one)["vehicle"]): one for one in messages}
        self._decoded: dict[int, Apm] = {}

    def message(self, vehicle: int) -> bytes:
        """That of one equipped vehicle."""
        return self._messages[vehicle]

    def heading(self, vehicle: int) -> float:
        """That one equipped vehicle believes to have [rad]."""
        return float(read_header(self._messages[vehicle])["heading"])

    def of(self, vehicle: int) -> Apm:
        """What one equipped vehicle sent."""
        if vehicle not in self._decoded:
            self._decoded[vehicle] = decode(self._messages[vehicle])
        return self._decoded[vehicle]


@dataclass(frozen=True, slots=True, kw_only=True)
class Demanded:
    """A request with blind zones, and its answer.

    Attributes:
        zones: in the request.
        share: of the sharer's index that lies in them, as the sharer computes it.
        points: of the sharer's scan, in them.
        all_points: of the sharer's scan.
        area: hidden road in them that the sharer knows [m^2].
        vehicles: hidden ones of which the ego vehicle learns: those that the sharer sees whose
            boxes overlap or touch a zone, and the sharer itself.
    """

    zones: int
    share: Fraction
    points: int
    all_points: int
    area: float
    vehicles: int

    @property
    def request(self) -> int:
        """Size of the request [byte]."""
        return REQUEST + ZONE_SIZE * self.zones

    def answer(self, data: int) -> int:
        """Size of the answer [byte].

        Args:
            data: bytes of the sensor data of one scan, sent by the share of the index; 0: raw
                points, so many as there are in the zones.
        """
        if data == 0:
            return ANSWER_HEADER + RAW_POINT * self.points
        return DemandedAnswers(data).size_of(self.share)

    def answer_by_points(self, data: int) -> int:
        """Size of the answer if data were sent by the share of the points in the zones [byte]."""
        share = Fraction(self.points, max(self.all_points, 1))
        return DemandedAnswers(data).size_of(share)


def demand(
    scene: Scene,
    truth: Truth,
    scans: Scans,
    matrices: Matrices,
    match: Match,
    *,
    area: BaseGeometry,
) -> Demanded:
    """What a match with a trigger asks its first sharer for, and gets.

    Args:
        scene: what there is.
        truth: what is so.
        scans: of all equipped vehicles.
        matrices: those that the match was made of.
        match: has a sharer.
        area: the union of its blind zones.
    """
    sharer = match.sharers[0]
    zones = NOWHERE
    if len(match.ranges):
        blind_zones = BlindZones(centers=match.centers, ranges=match.ranges)
        zones = DemandedAnswers(0).asked(blind_zones, matrices.heading(scene.ego))
    points = scans.on_ground(sharer)
    shapely.prepare(area)
    found = sorted(truth.found_by(sharer))
    minimum, maximum = _boxes(scene, found)
    told = set(np.array(found, np.int64)[zones.reached_by(minimum, maximum)].tolist())
    return Demanded(
        zones=len(zones),
        share=zones.share_of(matrices.of(sharer)),
        points=int(shapely.contains_xy(area, points[:, 0], points[:, 1]).sum()),
        all_points=len(points),
        area=float(shapely.intersection(truth.revealed[sharer], area).area),
        vehicles=len(told | ({sharer} & set(found))),
    )


def _boxes(scene: Scene, vehicles: Sequence[int]) -> tuple[Float, Float]:
    """Lower and upper corners of what vehicles take [m], shape (vehicle, 2) both."""
    bounds = np.array([scene.by_id[one].footprint.bounds for one in vehicles]).reshape(-1, 4)
    return bounds[:, :2], bounds[:, 2:]
