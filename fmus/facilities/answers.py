"""What the ego asks a sharer for, and what the sharer answers."""

import abc
import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from typing_extensions import override

from fmus.facilities.inputs import BlindZones
from fmus.facilities.load import Load
from fmus.facilities.sensor_data import SensorData
from fmus.facilities.zones import NOWHERE, Zones, zones_in
from fmus.messages.apm import decode
from fmus.physics.boxes import Boxes

ANSWER_HEADER: Final = 16
"""Header of an answer to a request with zones [byte]: the time of that request and the time of the
scan, 8 each. An answer without data so says where and when nothing was there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The sensor data that a sharer sends.

    Attributes:
        size: [byte].
        data: what the receiver learns.
    """

    size: int
    data: SensorData


class Answers(abc.ABC):
    """How much of a scan is asked for and sent."""

    @abc.abstractmethod
    def asked(self, blind_zones: BlindZones, heading: float | None) -> Zones:
        """What a request says beside its route.

        Args:
            blind_zones: where the ego is blind.
            heading: of the ego vehicle's newest APM [rad]; None if it has none.

        Raises:
            ValueError: they are no zones, and why.
        """

    @abc.abstractmethod
    def is_due(self, *, new_apms: bool, new_data: bool) -> bool:
        """Whether a sharer sends now: its APM, or what it can share of its scan, is new."""

    @abc.abstractmethod
    def answer(self, zones: Zones, apm: bytes | None, data: SensorData) -> Answer:
        """What a sharer sends of its last scan.

        Args:
            zones: of the newest request that reached it.
            apm: the message with its newest APM; None if it has none.
            data: all of the scan.
        """


class WholeAnswers(Answers):
    """All that the sharer saw, wherever it is (the paper).

    Args:
        load: how large it is.
    """

    def __init__(self, load: Load) -> None:
        self._load = load

    @override
    def asked(self, blind_zones: BlindZones, heading: float | None) -> Zones:
        return NOWHERE

    @override
    def is_due(self, *, new_apms: bool, new_data: bool) -> bool:
        return new_data

    @override
    def answer(self, zones: Zones, apm: bytes | None, data: SensorData) -> Answer:
        return Answer(size=self._load.size(data.features), data=data)


class DemandedAnswers(Answers):
    """What the sharer saw in the ego's blind zones.

    Sensor data, raw points or features of them, are so many bytes per point; so the size is
    that of a scan times the share of the sharer's index in the zones, rounded up, and a header.
    An object is sent, whole, if its box reaches into a zone. Features are paid for and not sent: an
    encoder makes them of a whole scan.

    Args:
        size: of the sensor data of one scan [byte].
    """

    def __init__(self, size: int) -> None:
        self._size = size

    @override
    def asked(self, blind_zones: BlindZones, heading: float | None) -> Zones:
        """The zones lie along the ego vehicle's heading; without a scan there are none."""
        return NOWHERE if heading is None else zones_in(blind_zones, heading)

    @override
    def is_due(self, *, new_apms: bool, new_data: bool) -> bool:
        """After each scan, which is a new APM even where no object is seen."""
        return new_apms

    @override
    def answer(self, zones: Zones, apm: bytes | None, data: SensorData) -> Answer:
        share = Fraction(0) if apm is None else zones.share_of(decode(apm))
        objects = data.objects
        boxes = Boxes(objects["position"], objects["angle"], objects["size"])
        reached = zones.reached_by(boxes)
        return Answer(size=self.size_of(share), data=SensorData(objects=objects[reached]))

    def size_of(self, share: Fraction) -> int:
        """Size of an answer with this share of a scan [byte]."""
        return ANSWER_HEADER + math.ceil(share * self._size)
