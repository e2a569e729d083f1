"""The scenes of the study, and the experiments in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from studies.collision.conditions import COOPERATIVE
from studies.collision.runs import Campaign

POLICIES: Final = "policies"
RELAY: Final = "relay"
"""The ends of the names of experiments that every scene has."""

AHEAD: Final = "ahead"
"""The end of the name of an experiment with MoHeD along predicted trajectories."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """A red light whose obstruction lasts through the decision.

    Attributes:
        name: of its experiments; the scenario is `red_light_NAME`.
        title: what readers call it.
        obstruction: what is in the direct link, in words.
        policy: the driving policy of its relay experiment.
        experiments: what is varied, by the end of the name of the experiment file.
    """

    name: str
    title: str
    obstruction: str
    policy: str
    experiments: Mapping[str, str]

    def experiment(self, end: str) -> str:
        """The name of one of its experiments."""
        return f"lasting_{self.name}_{end}"

    @property
    def files(self) -> Mapping[str, str]:
        """What is varied, by the name of the experiment file."""
        return {
            self.experiment(end): f"{what}, {self.title}" for end, what in self.experiments.items()
        }

    def read(self, folder: Path) -> Campaign:
        """Whatever of its experiments the reports wrote to `folder`, which may be nothing.

        Raises:
            ValueError: a file is not what a report wrote.
        """
        try:
            return Campaign.read(folder, self.files)
        except FileNotFoundError:
            return Campaign((), tuple(self.files))


_EVERYWHERE: Final = MappingProxyType(
    {
        POLICIES: "driving policies under perfect communication",
        RELAY: "relay methods over the simulated channel",
    }
)

_AHEAD: Final = MappingProxyType(
    {**_EVERYWHERE, AHEAD: "MoHeD along predicted trajectories over the simulated channel"}
)

TURNING: Final = Scene(
    name="turning",
    title="a truck turns",
    obstruction="the first truck of the queue turns left and waits inside the crossing; "
    "the next ones move up beside the ego vehicle",
    policy=COOPERATIVE,
    experiments=MappingProxyType(
        {
            **_AHEAD,
            "constant": "constant packet error rates",
            "memory": "constant packet error rates for a policy that forgets",
            "held": "relay methods for a policy that keeps to its brake",
        }
    ),
)
"""The scene of the claims and of the figure: the shipped networks drive in it."""

BESIDE: Final = Scene(
    name="beside",
    title="trucks beside",
    obstruction="trucks drive beside the ego vehicle to their red arrow; one that turned before "
    "them waits inside the crossing",
    policy=COOPERATIVE,
    experiments=_EVERYWHERE,
)
OPPOSING: Final = Scene(
    name="opposing",
    title="trucks opposite",
    obstruction="trucks opposite wait to turn left, the first one inside the crossing; the sharing "
    "node stands beside them, where the networks do not know one",
    policy="rule-based",
    experiments=_AHEAD,
)

SCENES: Final[Sequence[Scene]] = (TURNING, BESIDE, OPPOSING)

EXPERIMENTS: Final[Mapping[str, str]] = {
    name: what for scene in SCENES for name, what in scene.files.items()
}
"""What is varied, by the name of the experiment file, of all scenes."""
