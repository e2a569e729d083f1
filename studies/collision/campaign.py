"""All experiments of the campaign together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeVar

from studies.collision.condition import (
    CONSTANT,
    COOPERATIVE,
    SIMULATED,
    USUAL_AGE,
)
from studies.collision.curves import is_usual
from studies.collision.runs import SUFFIX, Point, read

T = TypeVar("T")

POLICIES: Final = "collision_policies"
CONSTANT_PER: Final = "collision_constant_per"
SPEED: Final = "collision_speed"
MEMORY: Final = "collision_memory"
RELAY: Final = "collision_relay"
RADIO: Final = "collision_radio"
LOAD: Final = "collision_load"

EXPERIMENTS: Final[Mapping[str, str]] = {
    POLICIES: "driving policies under perfect communication",
    CONSTANT_PER: "constant packet error rates",
    SPEED: "constant packet error rates at 25 km/h",
    MEMORY: "constant packet error rates for a policy that forgets",
    RELAY: "relay methods over the simulated channel",
    RADIO: "weaker radios",
    LOAD: "loads and loss granularities",
}
"""By the name of the experiment file, which is that of the files of its report."""


_LIKE: Final = ("policy", "relay", "compression", "speed_kmh")


def beside_relay(table: Sequence[Mapping[str, T]], experiment: str) -> list[Mapping[str, T]]:
    """Rows of the table of all conditions that show what `LOAD` or `RADIO` changed.

    The relay experiment has the runs with a single packet for a message and the usual power; they
    come first, as far as others are there to be compared with them.
    """
    others = [row for row in table if row["experiment"] == experiment]
    wanted = [[row[name] for name in _LIKE] for row in others]
    single = [
        row
        for row in table
        if row["experiment"] == RELAY and [row[name] for name in _LIKE] in wanted
    ]
    return [*single, *others]


@dataclass(frozen=True, slots=True)
class Campaign:
    """What was run.

    Attributes:
        points: of all experiments.
        missing: experiments that were not run.
    """

    points: Sequence[Point]
    missing: Sequence[str]

    @staticmethod
    def read(folder: Path) -> "Campaign":
        """Whatever of the experiments the reports wrote to `folder`.

        Raises:
            FileNotFoundError: there is nothing of any experiment.
            ValueError: a file is not what a report wrote.
        """
        missing = [name for name in EXPERIMENTS if not (folder / f"{name}{SUFFIX}").is_file()]
        if len(missing) == len(EXPERIMENTS):
            raise FileNotFoundError(2, "nothing", str(folder / f"{POLICIES}{SUFFIX}"))
        there = [name for name in EXPERIMENTS if name not in missing]
        return Campaign([point for name in there for point in read(folder, name)], missing)

    def perfect(self, policy: str, compression: int | None = None) -> Point | None:
        """A policy that gets every packet, at the speed of most runs."""
        return self._find(policy=policy, compression=compression, channel=CONSTANT, per=0.0)

    def relayed(self, relay: str, compression: int, speed_kmh: float) -> Point | None:
        """The cooperative policy over the simulated channel."""
        wanted = {"policy": COOPERATIVE, "channel": SIMULATED, "relay": relay}
        return self._find(**wanted, compression=compression, speed_kmh=speed_kmh)

    def _find(self, **wanted: Any) -> Point | None:
        """The one with the most runs; loads and what a policy remembers are as usual."""
        found = [
            point
            for point in self.points
            if all(getattr(point.condition, name) == value for name, value in wanted.items())
            and (point.condition.policy != COOPERATIVE or is_usual(point.condition))
            and point.condition.maximum_age in (None, USUAL_AGE)
            and point.runs
        ]
        return max(found, key=lambda point: len(point.runs), default=None)
