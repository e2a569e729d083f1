"""What COOPERNAUT published of its three scenes.

Cui, Qiu, Chen, Stone, Zhu, "COOPERNAUT: End-to-End Driving with Cooperative Perception for
Networked Vehicles", CVPR 2022, table 2; each number with its ± over three trained networks. In
CARLA, lidars read without loss; an ego that stands for long fails, too.
"""

from dataclasses import dataclass
from typing import Final

from typing_extensions import override


@dataclass(frozen=True, slots=True)
class Number:
    """A rate [%] and its ±."""

    value: float
    deviation: float

    @override
    def __str__(self) -> str:
        return f"{self.value:g} ± {self.deviation:g}"


@dataclass(frozen=True, slots=True)
class Published:
    """A model in a scene.

    Attributes:
        success: rate of success [%].
        sct: success weighted by completion time [%].
        collisions: rate of collision [%].
    """

    success: Number
    sct: Number
    collisions: Number


def _row(*numbers: float) -> Published:
    first, second, third = (Number(*numbers[k : k + 2]) for k in (0, 2, 4))
    return Published(first, second, third)


COOPERNAUT: Final = {
    ("overtaking", "no V2V"): _row(45.3, 0.6, 43.6, 0.7, 35.8, 3.6),
    ("overtaking", "early fusion"): _row(81.9, 7.2, 81.2, 5.2, 11.9, 5.1),
    ("overtaking", "voxel GNN"): _row(70.0, 4.8, 67.8, 4.2, 16.1, 3.6),
    ("overtaking", "COOPERNAUT"): _row(90.5, 1.2, 88.4, 1.1, 4.5, 3.1),
    ("left turn", "no V2V"): _row(40.3, 5.9, 37.8, 4.6, 55.6, 9.6),
    ("left turn", "early fusion"): _row(72.8, 8.6, 68.8, 8.9, 26.3, 8.1),
    ("left turn", "voxel GNN"): _row(53.5, 6.9, 51.0, 6.9, 33.3, 7.3),
    ("left turn", "COOPERNAUT"): _row(80.7, 5.2, 76.2, 3.9, 18.1, 6.2),
    ("red light", "no V2V"): _row(47.3, 18.7, 46.1, 18.4, 51.4, 17.4),
    ("red light", "early fusion"): _row(78.6, 11.8, 75.8, 9.1, 17.7, 15.2),
    ("red light", "voxel GNN"): _row(64.2, 25.3, 62.0, 24.8, 35.0, 25.9),
    ("red light", "COOPERNAUT"): _row(80.7, 7.6, 77.8, 7.1, 17.7, 7.8),
}
"""The published rows, by scene and model."""

MODELS: Final = {
    "blind": "no V2V",
    "blind-rule": "no V2V",
    "general-blind": "no V2V",
    "general-blind, brake held": "no V2V",
    "overtaking-blind": "no V2V",
    "early-fusion": "early fusion",
    "general-early-fusion": "early fusion",
    "general-early-fusion, brake held": "early fusion",
    "bev-16": "COOPERNAUT",
    "general-16, brake held": "COOPERNAUT",
    "general-16 seed 2, brake held": "COOPERNAUT",
    "general-16 seed 3, brake held": "COOPERNAUT",
    "point-transformer-16": "COOPERNAUT",
}
"""Theirs of the same kind, by our policy: what is sent, and how much of it."""
