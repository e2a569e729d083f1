"""What the ego asks a sharer for, and what the sharer answers."""

import abc
import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from typing_extensions import override

from fmus.apm import decode
from fmus.facilities.zones import NOWHERE, Zones, zones_in
from orchestrator.signal import Array, Signals

ANSWER_HEADER: Final = 16
"""Of an answer to a request with zones [byte]: the time of that request and the time of the scan,
8 each. An answer without data so says where and when nothing was there."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The sensor data that a sharer sends.

    Attributes:
        size: [byte].
        objects: what the receiver learns, `OBJECT` records.
    """

    size: int
    objects: Array


class Answers(abc.ABC):
    """How much of a scan is asked for and sent."""

    @abc.abstractmethod
    def asked(self, inputs: Signals, heading: float | None) -> Zones:
        """What a request says beside its route.

        Args:
            inputs: of the facilities layer.
            heading: of the ego vehicle's newest APM [rad]; None if it has none.

        Raises:
            ValueError: the inputs are not zones, and why.
        """

    @abc.abstractmethod
    def is_due(self, *, new_apms: bool, new_objects: bool) -> bool:
        """Whether sharers send now."""

    @abc.abstractmethod
    def answer(self, zones: Zones, apm: bytes | None, objects: Array) -> Answer:
        """What a sharer sends of its last scan.

        Args:
            zones: of the newest request that reached it.
            apm: the message with its newest APM; None if it has none.
            objects: that it saw, `OBJECT` records.
        """


class WholeAnswers(Answers):
    """All that the sharer saw, wherever it is (the paper).

    Args:
        size: of the sensor data of one scan [byte].
    """

    def __init__(self, size: int) -> None:
        self._size = size

    @override
    def asked(self, inputs: Signals, heading: float | None) -> Zones:
        return NOWHERE

    @override
    def is_due(self, *, new_apms: bool, new_objects: bool) -> bool:
        return new_objects

    @override
    def answer(self, zones: Zones, apm: bytes | None, objects: Array) -> Answer:
        return Answer(size=self._size, objects=objects)


class DemandedAnswers(Answers):
    """What the sharer saw in the ego's blind zones.

    Sensor data, raw points or features of them, are so many bytes per point; so the size is
    that of a scan times the share of the sharer's index in the zones, rounded up, and a header.
    An object is sent, whole, if its box reaches into a zone.

    Args:
        size: of the sensor data of one scan [byte].
    """

    def __init__(self, size: int) -> None:
        self._size = size

    @override
    def asked(self, inputs: Signals, heading: float | None) -> Zones:
        """The zones lie along the ego vehicle's heading; without a scan there are none."""
        return NOWHERE if heading is None else zones_in(inputs, heading)

    @override
    def is_due(self, *, new_apms: bool, new_objects: bool) -> bool:
        """After each scan, which is a new APM even where no object is seen."""
        return new_apms

    @override
    def answer(self, zones: Zones, apm: bytes | None, objects: Array) -> Answer:
        share = Fraction(0) if apm is None else zones.share_of(decode(apm))
        return Answer(
            size=self.size_of(share),
            objects=objects[zones.reached_by(objects["minimum"], objects["maximum"])],
        )

    def size_of(self, share: Fraction) -> int:
        """Size of an answer with this share of a scan [byte]."""
        return ANSWER_HEADER + math.ceil(share * self._size)
