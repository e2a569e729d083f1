"""The runs of the collision campaign that are those of this study.

Its experiment `collision_policies` is the red light as the networks were trained in it, without
losses and with nothing else on the air: the variation `as trained` here. A policy that has runs
there is counted by them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from studies.generalisation.runs import SUFFIX, Run
from studies.method import records

EXPERIMENT: Final = "collision_policies"
AS_TRAINED: Final = "as trained"
"""The variation that the campaign's scene is."""

TRAINED: Final = ("blind", "early-fusion", "bev-16", "bev-32")
"""The networks that were trained in that scene."""

_NAMES: Final[Mapping[tuple[str, int | None], str]] = {
    ("cooperative", 16): "bev-16",
    ("cooperative", 32): "bev-32",
}
"""Policies that the campaign calls otherwise, with their compression."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A run as the campaign recorded it; see `Run`."""

    policy: str
    compression: int | None
    seed: int
    collision: bool | None
    collision_partner: str | None
    success: bool | None
    completion_time: float | None
    min_gap_m: float | None
    wall_s: float
    error: str | None
    cpu_s: float | None = None

    @property
    def run(self) -> Run:
        """The run of this study that it is."""
        policy = _NAMES.get((self.policy, self.compression), self.policy)
        return Run(
            policy=policy,
            variation=AS_TRAINED,
            trained=policy in TRAINED,
            seed=self.seed,
            collision=self.collision,
            collision_partner=self.collision_partner,
            success=self.success,
            completion_time=self.completion_time,
            min_gap_m=self.min_gap_m,
            wall_s=self.wall_s,
            error=self.error,
            cpu_s=self.cpu_s,
        )


def with_campaign(folder: Path, runs: Sequence[Run]) -> list[Run]:
    """`runs` of the red light, and instead of those as trained the campaign's, if they are there.

    Policies of which a run that both made came out differently keep their own.

    Args:
        folder: with what the reports of both studies wrote.
        runs: in the order of their variations; the policies keep theirs, new ones come last.

    Raises:
        ValueError: the file is not what its report wrote.
    """
    others = different(folder, runs)
    theirs = [run for run in _theirs(folder) if run.policy not in others]
    known = {(run.policy, run.seed) for run in theirs}
    own = [run for run in runs if run.variation == AS_TRAINED]
    order = list(dict.fromkeys([run.policy for run in own] + [run.policy for run in theirs]))
    rest = [run for run in own if (run.policy, run.seed) not in known]
    mine = sorted([*theirs, *rest], key=lambda run: order.index(run.policy))
    return [*mine, *(run for run in runs if run.variation != AS_TRAINED)]


def different(folder: Path, runs: Sequence[Run]) -> Mapping[str, int]:
    """The policies of which a run came out differently in the campaign: it ran other code.

    Args:
        folder: with what the reports of both studies wrote.
        runs: of the red light.

    Returns:
        By policy, the first seed of such a run.

    Raises:
        ValueError: the file is not what its report wrote.
    """
    known = {(run.policy, run.seed): _outcome(run) for run in _theirs(folder)}
    found: dict[str, int] = {}
    for run in runs:
        key = (run.policy, run.seed)
        if run.variation == AS_TRAINED and known.get(key, _outcome(run)) != _outcome(run):
            found[run.policy] = min(run.seed, found.get(run.policy, run.seed))
    return found


def _theirs(folder: Path) -> list[Run]:
    path = folder / f"{EXPERIMENT}{SUFFIX}"
    return [row.run for row in records.read(path, Row)] if path.is_file() else []


def _outcome(run: Run) -> tuple[object, ...]:
    """What does not depend on the machine."""
    ended = (run.collision, run.collision_partner, run.success)
    return (*ended, run.completion_time, run.min_gap_m, run.error)
