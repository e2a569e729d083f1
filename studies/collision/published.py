"""What others publish about collisions of cooperative driving in the red-light scene."""

from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class Published:
    """A row of COOPERNAUT's table, each with its ± (three trained networks).

    Attributes:
        name: what the table calls the policy.
        success, success_sd: success rate and its ± [%].
        sct, sct_sd: success weighted by completion time and its ± [%].
        collisions, collisions_sd: collision rate and its ± [%].
    """

    name: str
    success: float
    success_sd: float
    sct: float
    sct_sd: float
    collisions: float
    collisions_sd: float


COOPERNAUT: Final = {
    "blind": Published("no V2V", 47.3, 18.7, 46.1, 18.4, 51.4, 17.4),
    "early-fusion": Published("early fusion", 78.6, 11.8, 75.8, 9.1, 17.7, 15.2),
    "cooperative-16": Published("COOPERNAUT", 80.7, 7.6, 77.8, 7.1, 17.7, 7.8),
}
"""The rows of red-light violation, by our policy of the same kind: Cui, Qiu, Chen, Stone, Zhu,
"COOPERNAUT: End-to-End Driving with Cooperative Perception for Networked Vehicles", CVPR 2022,
table 2. In CARLA, 30 background vehicles, lidars read without loss; an ego that stands for long
fails, too."""

MOHED_RATE: Final = 0.01
"""Collision rate with MoHeD is below it ("NLOS Dies Twice", section "Results & Analysis")."""

MOHED_PER: Final = 0.1202
"""The packet error rate at which `MOHED_RATE` is meant (ibidem)."""

COMPRESSION_32_RATE: Final = 0.40
"""Collision rate at compression 32 "even under perfect wireless connection", approximately."""
