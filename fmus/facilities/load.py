"""Sensor data as messages: how many bytes a scan makes, and what a lost packet costs."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from fmus.facilities.granularity import ALL_PACKETS, EachGrain, FirstPacket, Granularity
from fmus.facilities.layer import LayerParameters
from fmus.messages.features import COORDINATES, FeaturesMessage
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter

PROBE_SIZE: Final = 200
"""One packet of the paper's Table I [byte]."""

FEATURE_SIZES: Final[Mapping[int, int]] = MappingProxyType(
    {
        16: 4 * 128 * (3 + 128),  # two down-sampling blocks: 128 key points
        32: 4 * 32 * (3 + 256),  # three: 32 key points
    }
)
"""Features of one scan [byte], by compression: each key point has 3 coordinates and its features,
numbers of 4 bytes. 16 is the published network of COOPERNAUT (Cui et al., CVPR 2022), 5.1 Mbit/s at
10 Hz; 32 has one more block of its kind. docs/physics-relay.md, "Messages"."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LoadParameters(LayerParameters):
    """Parameters of facilities that share sensor data: how large they are."""

    load: Literal["probe", "full"] = parameter(
        "probe", doc="sensor data of a scan: a packet of 200 B, or features in all their packets"
    )
    compression: int = parameter(
        32, doc="of the features in `load: full`: 32 (33152 B per scan) or 16 (67072 B)"
    )
    sensor_data_size: int = parameter(
        0, unit="B", minimum=0, doc="size of the sensor data of a scan; 0: what `load` says"
    )
    loss_granularity: Literal["frame", "packets", "keypoint"] = parameter(
        "packets",
        doc="of sensor data: the first packet stands for all; all are needed; or, of features in "
        "`load: full`, each packet brings whole keypoints",
    )
    received_scans: int = parameter(
        3, minimum=1, doc="most scans of one sharer whose features are in `received.features`"
    )

    @property
    def scan_size(self) -> int:
        """Size of the sensor data of one scan without features, or with features unknown [byte].

        Raises:
            ComponentTypeError: the parameters contradict each other.
        """
        if self.compression not in FEATURE_SIZES:
            raise ComponentTypeError(
                f"`compression` is {self.compression}; it can be 32 or 16; set `sensor_data_size` "
                "for features of another size"
            )
        if self.load == "full" and self.sensor_data_size:
            raise ComponentTypeError(
                f"`load: full` and `sensor_data_size`, {self.sensor_data_size} B, both say how "
                "large sensor data are; leave one of them out"
            )
        if self.loss_granularity == "keypoint" and self.sensor_data_size:
            raise ComponentTypeError(
                f"`loss_granularity: keypoint` and `sensor_data_size`, {self.sensor_data_size} B: "
                "packets of another size than the features carry no keypoints; use `load: full`"
            )
        if self.sensor_data_size:
            return self.sensor_data_size
        return PROBE_SIZE if self.load == "probe" else FEATURE_SIZES[self.compression]


class Load:
    """How the sensor data of a scan become a message."""

    def __init__(self, parameters: LoadParameters) -> None:
        self._parameters = parameters
        self._scan_size = parameters.scan_size

    def size(self, features: FeaturesMessage | None) -> int:
        """Bytes of a message with all of a scan.

        Args:
            features: of the scan, if there are any.
        """
        carried = self._carried(features)
        return self._scan_size if carried is None else carried.size

    def granularity(self, features: FeaturesMessage | None) -> Granularity:
        """What a lost packet costs of a message with these features, or with none."""
        carried = self._carried(features)
        match self._parameters.loss_granularity:
            case "frame":
                return FirstPacket()
            case "keypoint" if carried is not None:
                return EachGrain(carried.keypoint_size)
            case _:
                return ALL_PACKETS

    def check(self, features: FeaturesMessage) -> None:
        """Refuse features of the other `compression`.

        Raises:
            ValueError: they contradict the parameters.
        """
        carried, given = self._carried(features), self._parameters.compression
        for compression, size in FEATURE_SIZES.items():
            if carried is not None and carried.size == size and compression != given:
                raise ValueError(
                    f"`features` of vehicle {carried.vehicle} have {carried.capacity} keypoints of "
                    f"{COORDINATES} + {carried.dimensions} numbers, {size} B: that is "
                    f"`compression: {compression}`, and the parameter is {given}; set it to "
                    f"{compression}"
                )

    def _carried(self, features: FeaturesMessage | None) -> FeaturesMessage | None:
        """The features, if the packets really have their bytes and do not stand for them."""
        return features if self._parameters.load == "full" else None
