"""`knife_edge_profile.json`: loss over given heights at given distances along a link.

Each edge becomes the front of a thin body across the link. Distances are meant along the line
between the antennas, in space, and both antennas have their own heights: the bodies stand where
that line has covered the distance.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from typing_extensions import override

from orchestrator.signal import Array
from studies.verification.channel import scene
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison, Series
from studies.verification.channel.json_document import Node, read_json
from studies.verification.channel.progress import Progress
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.tolerances import LOSS, Tolerance

NAME: Final = "knife_edge_profile.json"
_THICKNESS: Final = 1e-3
"""Of the bodies [m]. Veins' edge is at the face nearest to the transmitter, whatever is behind."""


@dataclass(frozen=True, slots=True)
class _Profile:
    frequency: float
    points: Array  # distance and height [m], shape (n, 2)
    golden: float
    place: str

    def inputs(self) -> dict[str, Array]:
        """Bodies and a link along x."""
        distance, height = self.points[:, 0], self.points[:, 1]
        length = distance[-1]  # in space
        ground = np.sqrt(length**2 - (height[-1] - height[0]) ** 2)
        edges = len(self.points) - 2
        front = distance[1:-1] * (ground / length)
        size = np.stack([np.full(edges, _THICKNESS), np.full(edges, 2.0), height[1:-1]], axis=-1)
        bodies = scene.vehicles(
            range(edges),
            np.stack([front, np.zeros(edges)], axis=-1),
            np.full(edges, np.pi),  # towards the transmitter, so that the front is the near face
            size,
        )
        return {**bodies, **scene.links([0.0, 0.0, height[0]], [ground, 0.0, height[-1]])}


@dataclass(frozen=True, slots=True)
class KnifeEdgeCheck(Check):
    """The profiles of the file."""

    profiles: tuple[_Profile, ...]

    @property
    @override
    def tolerance(self) -> Tolerance:
        return LOSS

    @property
    @override
    def work(self) -> int:
        return len(self._frequencies())

    def _frequencies(self) -> list[float]:
        return sorted({profile.frequency for profile in self.profiles})

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        places, golden, ours = [], [], []
        for frequency in self._frequencies():
            parameters = {"model": "veins", "carrier_frequency": frequency}
            with channel.start(parameters, {}) as session:
                for profile in (p for p in self.profiles if p.frequency == frequency):
                    session.step(profile.inputs())
                    places.append(profile.place)
                    golden.append(profile.golden)
                    ours.append(float(session.probed("vehicle_loss")[0]))
            progress.advance()
        series = Series(label="given profiles", golden=np.array(golden), ours=np.array(ours))
        return Comparison.of_values(LOSS, places, [series])


def read(path: Path) -> KnifeEdgeCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    return KnifeEdgeCheck(tuple(map(_profile, read_json(path, NAME).filled())))


def _profile(node: Node) -> _Profile:
    points = np.array([point.numbers(2) for point in node["profile"]])
    if len(points) < 2:
        raise node["profile"].problem("needs two points at least, the antennas")
    distance, height = points[:, 0], points[:, 1]
    if distance[0] != 0 or (np.diff(distance) <= 0).any():
        raise node["profile"].problem("distances must start at 0 and ascend")
    if abs(height[-1] - height[0]) >= distance[-1]:
        raise node["profile"].problem("the antennas are closer than their heights differ")
    return _Profile(
        frequency=node["freq_hz"].positive(),
        points=points,
        golden=node["loss_db"].number(),
        place=f"{NAME}: {node.place} (id {node['id'].value if 'id' in node else '?'})",
    )
