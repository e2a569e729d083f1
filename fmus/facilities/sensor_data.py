"""Sensor data: the objects and the features of one scan, sent and received."""

from collections.abc import Set
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.facilities.inputs import Inputs
from fmus.facilities.load import Load
from fmus.facilities.outbox import Arrival
from fmus.facilities.received import Received
from fmus.facilities.sharing import Change
from fmus.messages.features import FeaturesMessage
from orchestrator.signal import Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorData:
    """What a message of sensor data says.

    Attributes:
        objects: those in the scan, `OBJECT` records, shape (object,).
        features: those of the scan, as sent; None without any.
    """

    objects: Array
    features: FeaturesMessage | None = None

    def take_in(self, arrival: Arrival, received: Received) -> None:
        """Update what the ego knows by what arrived of the message with these data.

        The objects arrive when nothing is missing; keypoints with the packets that carry them.
        """
        message, features = arrival.message, self.features
        if arrival.is_whole:
            received.replace_objects(message.source, message.time, self.objects)
        if features is None:
            return
        arrived = np.ones(len(features.keypoints), np.bool_)
        if not arrival.is_whole:
            arrived = arrival.grains()[: len(arrived)]
        if arrival.is_whole or arrived.any():
            received.add_keypoints(features, arrived)


_NONE: Final[Set[int]] = frozenset()


class ScanFeatures:
    """The features of the last scans of all sharers, read once per scan.

    Args:
        load: against which they are checked.
    """

    def __init__(self, load: Load) -> None:
        self._load = load
        self._signal = Change()
        self._newest: dict[int, FeaturesMessage] = {}
        self._new: Set[int] = _NONE

    def update(self, inputs: Inputs) -> bool:
        """Read the input `features`; whether there were new scans.

        Raises:
            ValueError: it is not such a signal, has two messages of one vehicle, or contradicts
                the load.
        """
        self._new = _NONE
        if not self._signal.is_new(inputs.features):
            return False
        known, self._newest, new = self._newest, {}, set()
        for message in inputs.feature_messages():
            vehicle = message.vehicle
            if vehicle in self._newest:
                raise ValueError(f"`features` has two messages of vehicle {vehicle}")
            self._load.check(message)
            self._newest[vehicle] = message
            if vehicle not in known or known[vehicle].time != message.time:
                new.add(vehicle)
        self._new = new
        return bool(new)

    def of(self, vehicle: int) -> FeaturesMessage | None:
        """The features of the last scan of one vehicle; None if there are none."""
        return self._newest.get(vehicle)

    def vehicles(self) -> Set[int]:
        """The vehicles whose features are known."""
        return self._newest.keys()

    def is_new_scan(self, vehicle: int, *, new_objects: bool) -> bool:
        """Whether there is something to send: new features, or without any `new_objects`."""
        return vehicle in self._new if vehicle in self._newest else new_objects
