"""What the ways of sharing send in one scan, in bytes above the lower layers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from fmus.facilities.answers import ANSWER_HEADER, DemandedAnswers
from fmus.facilities.cpm import Cpm, encode
from fmus.facilities.demand_driven import Facilities
from fmus.facilities.inputs import BlindZones
from fmus.facilities.zones import NOWHERE, ZONE_SIZE
from fmus.messages.apm import Apm, decode, read_header
from fmus.physics.boxes import Boxes
from orchestrator.signal import Array
from studies.verification.perception.scene import Scene
from studies.verification.perception.session import Match, Scans
from studies.verification.perception.truth import Truth

FEATURES: Final = 67_072
"""Features of one scan [byte]: 128 key points with 3 coordinates and 128 channels in single
precision (Cui et al., COOPERNAUT, CVPR 2022)."""
SMALL_FEATURES: Final = 33_152
"""Features of one scan at half the size [byte]: the 128 channels of each key point in half
precision, its coordinates in one byte each."""
RAW_POINT: Final = 16
"""One lidar point [byte]: three coordinates and the intensity in single precision."""
_RANGE: Final = 50.0
"""Range of the sensor that the messages state [m]."""


def cpm_sizes(scene: Scene, objects: Array) -> Mapping[int, int]:
    """Encode the collective perception message of each equipped vehicle: sizes [byte], by its id.

    Every object that a vehicle detects is in its message, as in the first one after it was found.

    Args:
        scene: has their positions.
        objects: OBJECT records of all that they detect, shape (object,).
    """
    sizes = {}
    for sender in scene.equipped:
        own = objects[objects["sensor"] == sender]
        vehicle = scene.by_id[sender]
        message = Cpm(
            station=sender,
            time=0,
            position=np.array(vehicle.position),
            heading=vehicle.heading,
            objects=own,
            ages=np.zeros(len(own), np.int64),
            perceived=len(own),
            sensor_range=_RANGE,
        )
        sizes[sender] = len(encode(message))
    return sizes


REQUEST: Final = Facilities.Parameters().request_size
"""A request without blind zones [byte]; the default of `facilities`."""


class Matrices:
    """The APM messages of a scene, decoded when they are wanted.

    Args:
        messages: of all equipped vehicles.
    """

    def __init__(self, messages: Sequence[bytes]) -> None:
        self.size = sum(map(len, messages))
        """Size of all messages [byte]."""
        self._messages = {int(read_header(one)["vehicle"]): one for one in messages}
        self._decoded: dict[int, Apm] = {}

    def message(self, vehicle: int) -> bytes:
        """The message of one equipped vehicle."""
        return self._messages[vehicle]

    def heading(self, vehicle: int) -> float:
        """The heading that one equipped vehicle believes to have [rad]."""
        return float(read_header(self._messages[vehicle])["heading"])

    def of(self, vehicle: int) -> Apm:
        """The decoded message of one equipped vehicle."""
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
    """Find out what a match with a trigger asks its first sharer for, and gets.

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
    told = set(np.array(found, np.int64)[zones.reached_by(_boxes(scene, found))].tolist())
    return Demanded(
        zones=len(zones),
        share=zones.share_of(matrices.of(sharer)),
        points=int(shapely.contains_xy(area, points[:, 0], points[:, 1]).sum()),
        all_points=len(points),
        area=float(shapely.intersection(truth.revealed[sharer], area).area),
        vehicles=len(told | ({sharer} & set(found))),
    )


def _boxes(scene: Scene, vehicles: Sequence[int]) -> Boxes:
    """The footprints of vehicles."""
    found = [scene.by_id[one] for one in vehicles]
    return Boxes(
        np.array([one.position for one in found]).reshape(-1, 2),
        np.array([one.heading for one in found], np.float64),
        np.array([one.size[:2] for one in found]).reshape(-1, 2),
    )
