"""The peer of the encoders: the point transformer in COOPERNAUT's published shape, in PyTorch."""

import importlib.util
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from time import process_time_ns
from typing import TYPE_CHECKING, Final

import numpy as np
from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.policy.scans import EARLIER, Moment
from benchmarks.policy.step import NS_PER_MS

if TYPE_CHECKING:
    from fmus.driving.point_transformer import PointTransformerEncoder

_COARSE: Final = 128
"""Keypoints of its message with two blocks; with three they are 32."""


def is_torch_installed() -> bool:
    """Whether the peer is there."""
    return importlib.util.find_spec("torch") is not None


def blocks_for(keypoints: int) -> int:
    """Down-sampling blocks of the point transformer with the nearest size of messages."""
    return 2 if keypoints >= _COARSE else 3


@dataclass(frozen=True, kw_only=True, eq=False)
class TransformerRun(Case):
    """Scans of a drive, encoded by the peer; what comes behind the encoders is left out.

    Attributes:
        moments: of the drive, `EARLIER` ones first that are not looked at.
        blocks: down-sampling blocks.
    """

    moments: Sequence[Moment]
    blocks: int

    @override
    def measure(self) -> Measurement:
        """Encode the scans of both vehicles, on one thread.

        Returns:
            `sharer_ms`, `ego_ms` and, both, `step_ms`: CPU time per scan.
        """
        import torch  # noqa: PLC0415 - optional

        threads = torch.get_num_threads()
        torch.set_num_threads(1)
        try:
            self._encode(self.moments[0])  # the memory is there, and warm
            laps = [self._encode(moment) for moment in self.moments[EARLIER:]]
        finally:
            torch.set_num_threads(threads)
        ego, sharer = (sum(lap[k] for lap in laps) / len(laps) / NS_PER_MS for k in range(2))
        return {"step_ms": sharer + ego, "sharer_ms": sharer, "ego_ms": ego}

    def _encode(self, moment: Moment) -> tuple[int, int]:
        """CPU times of the ego vehicle's scan and of the sharer's [ns]."""
        import torch  # noqa: PLC0415 - optional

        from fmus.driving.point_transformer import Crop, encode  # noqa: PLC0415 - needs PyTorch

        times = []
        for cloud in moment.scans():
            begin = process_time_ns()
            points = torch.from_numpy(np.stack([cloud.x, cloud.y, cloud.z], axis=1))
            encode(self._encoder, points, crop=Crop(), rng=np.random.default_rng(1))
            times.append(process_time_ns() - begin)
        return times[0], times[1]

    @cached_property
    def _encoder(self) -> "PointTransformerEncoder":
        from fmus.driving.point_transformer import PointTransformerEncoder  # noqa: PLC0415 - needs PyTorch

        return PointTransformerEncoder(blocks=self.blocks).eval()
