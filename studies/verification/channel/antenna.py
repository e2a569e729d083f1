"""`antenna_gain.json`: gain of a sampled antenna pattern in a direction.

The channel gives the gain of both ends of a link, with one pattern for all. The other end is
turned so that its sample at azimuth 0 points along the link; that sample is taken off.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

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

NAME: Final = "antenna_gain.json"
_SIZE: Final = (4.0, 2.0, 1.5)


@dataclass(frozen=True, slots=True)
class _Direction:
    gains: tuple[float, ...]
    inputs: Mapping[str, Array]
    golden: float
    place: str


@dataclass(frozen=True, slots=True)
class AntennaCheck(Check):
    """The directions of the file."""

    directions: tuple[_Direction, ...]

    @property
    @override
    def tolerance(self) -> Tolerance:
        return LOSS

    @property
    @override
    def work(self) -> int:
        return len(self.directions)

    @override
    def run(self, channel: ChannelUnderTest, progress: Progress) -> Comparison:
        ours = []
        for one in self.directions:
            parameters: dict[str, Any] = {
                "model": "veins",
                "n_antenna_gain": len(one.gains),
                "antenna.gain": one.gains,
            }
            with channel.start(parameters, one.inputs) as session:
                ours.append(float(session.probed("antenna_gain")[0]) - one.gains[0])
            progress.advance()
        golden = np.array([one.golden for one in self.directions])
        series = Series(label="azimuth patterns", golden=golden, ours=np.array(ours))
        return Comparison.of_values(LOSS, [one.place for one in self.directions], [series])


def read(path: Path) -> AntennaCheck:
    """Read the file.

    Raises:
        GoldenError: it is malformed.
    """
    return AntennaCheck(tuple(map(_direction, read_json(path, NAME).filled())))


def _direction(node: Node) -> _Direction:
    own, other = (np.array(node[name].numbers(2)) for name in ("own", "other"))
    towards = np.array(node["orientation"].numbers(2))
    if not towards.any() or (own == other).all():
        raise node.problem("the direction has no length")
    back = own - other
    heading = [np.arctan2(towards[1], towards[0]), np.arctan2(back[1], back[0])]
    gains = tuple(node["gains_db"].numbers())
    if not gains:
        raise node["gains_db"].problem("must not be empty")
    height = scene.VEINS_ANTENNA_HEIGHT
    bodies = scene.vehicles([0, 1], [own, other], heading, [_SIZE, _SIZE])
    link = scene.links([*own, height], [*other, height], [0, 1])
    place = f"{NAME}: {node.place} (id {node['id'].value if 'id' in node else '?'})"
    return _Direction(gains, {**bodies, **link}, node["gain_db"].number(), place)
