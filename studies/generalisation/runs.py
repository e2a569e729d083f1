"""The runs of the study, and the files that carry them to its page."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from orchestrator.experiment.report import Results
from orchestrator.experiment.tables import TIMES

METRICS: Final = ("collision", "collision_partner", "success", "completion_time", "min_gap_m")
"""Columns that an experiment needs; the metrics of a run that they usually are have these names."""

POLICY, VARIATION = "policy", "variation"
"""The factors that an experiment needs."""

PREFIX: Final = "generalisation_"
"""The beginning of the name of an experiment file, before that of the encounter."""

SUFFIX: Final = "_runs.csv"
"""The end of the name of the file of runs, after that of the experiment."""

ADDED: Final[Mapping[str, str]] = {
    "_general": "networks of several encounters",
    "_held": "networks of several encounters that keep to their brake",
    "_seeds": "their other training seeds, which keep to their brake",
    "_many": "the best of their training seeds, which keeps to its brake, in many runs",
    "_compression": "the network of several encounters at compression 16, which keeps to its brake",
    "_seeds_16": "its other training seeds, which keep to their brake",
    "_alone": "the network of several encounters that has nothing but its own lidar",
    "_early": "the network of several encounters that receives points as they are",
    "_one_side": "a network that learned from one side only",
    "_overtaker": "the network that learned to overtake",
    "_overtaker_blind": "the network that learned to overtake with nothing but its own lidar",
    "_elsewhere": "the network that learned to overtake",
    "_elsewhere_blind": "the network that learned to overtake with nothing but its own lidar",
    "_point": "the point transformer",
}
"""Whose runs are in experiment files of their own, by the end of their names."""

ENCOUNTERS: Final[Mapping[str, str]] = {
    "red_light": "red light",
    "left_turn": "left turn",
    "overtaking": "overtaking",
    "pedestrian": "pedestrian",
    "platoon": "platoon",
}
"""What encounters are called, by the rest of that name."""

DRIVEN: Final = ("red_light", "left_turn", "pedestrian", "platoon")
"""Those of them, by that rest, that ask of a network to follow its route."""

LEARNED: Final = ("red_light", "left_turn", "pedestrian")
"""Those in which the networks of several encounters were trained."""

ADDITIONS: Final = (
    *((each, end) for end in ("_general", "_held", "_compression") for each in DRIVEN),
    *((each, end) for end in ("_alone", "_early", "_elsewhere", "_point") for each in DRIVEN),
    *((each, end) for end in ("_seeds", "_many", "_seeds_16") for each in LEARNED),
    ("red_light", "_one_side"),
    ("overtaking", "_overtaker"),
    ("overtaking", "_overtaker_blind"),
    *((each, "_elsewhere_blind") for each in DRIVEN),
)
"""The encounters with such files, and the ends of their names."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run as its experiment recorded it.

    The metrics are those of `METRICS`, `None` where there was nothing to measure.

    Attributes:
        policy, variation: the levels of these factors.
        trained: whether the policy is a network that was trained in such scenes.
        seed: the seed of the run.
        collision: whether the ego collided.
        collision_partner: with what, as a role.
        success: whether the ego completed its way without a collision.
        completion_time: when it had [s].
        min_gap_m: the smallest distance to the danger [m].
        wall_s: the wall time of the run [s].
        error: why it failed; `None` if it did not.
        cpu_s: the processor time of the run [s]; `None` if it was not noted.
    """

    policy: str
    variation: str
    trained: bool
    seed: int
    collision: bool | None
    collision_partner: str | None
    success: bool | None
    completion_time: float | None
    min_gap_m: float | None
    wall_s: float
    error: str | None
    cpu_s: float | None = None


def runs_of(results: Results, trained: Mapping[str, Sequence[str]]) -> list[Run]:
    """Every run of an experiment.

    Args:
        results: what the experiment found.
        trained: by variation, the networks that were trained in it.
    """
    names = ("seed", *METRICS, *TIMES, "error")
    return [
        Run(
            policy=row[POLICY],
            variation=row[VARIATION],
            trained=row[POLICY] in trained.get(row[VARIATION], ()),
            **{name: row[name] for name in names},
        )
        for row in results.rows
    ]
