"""How many bytes of sensor data a scan makes: a probe, or the features that a network shares."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final, Literal

from fmus.facilities.layer import LayerParameters
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

    @property
    def scan_size(self) -> int:
        """Size of the sensor data of one scan [byte].

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
        if self.sensor_data_size:
            return self.sensor_data_size
        return PROBE_SIZE if self.load == "probe" else FEATURE_SIZES[self.compression]
