"""The tables that the page of the study is made of."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from orchestrator.intervals import Estimate
from studies.method import records
from studies.method.origin import Origin
from studies.sharing.report import PROVENANCE

METHODS: Final = "sharing_methods"
ERRORS: Final = "sharing_errors"
EGOS: Final = "sharing_egos"
LOAD: Final = "sharing_load"
MOMENTS: Final = "moments"
"""The names of the experiments, and of the moments of traffic, as their files have them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """What a way of sharing costs and brings under a condition: means over runs.

    Attributes:
        method: the level of the factor `method`.
        n: the number of runs.
        lidars: the level of the factor `lidars`; `None` without it.
        errors: likewise of the factor `errors`.
        collision: share of the runs in which the ego vehicle collided.
        min_gap_m: smallest distance between its body and that of the hidden car [m].
        told_s: when it was first told of the hidden car [s].
        seen_s: when its own sensor first saw it [s].
        brake_s: when it first braked for a hazard [s].
        brake_age_s: how old the data were that it braked for [s].
        candidates: vehicles with lidars that could see some of its area of interest.
        heard: share of them whose matrices it had.
        right: share of the looks at which the chosen sharer reveals 95 % of what the best does.
        missed: share at which nobody was chosen.
        regret: share of what the best sharer reveals that the chosen one does not.
        regret_unheard: the same of the best one that was heard.
        apm_kbyte_s: matrices on the air [kB/s].
        request_kbyte_s: requests on the air [kB/s].
        data_kbyte_s: sensor data or CPMs on the air [kB/s].
        sharing_kbyte_s: all of these together [kB/s].
        cbr: mean channel busy ratio.
        regret_south, regret_follower, regret_north: of several ego vehicles each.
        right_south, right_follower, right_north: likewise.
    """

    method: str
    n: int
    lidars: str | None = None
    errors: str | None = None
    collision: Estimate | None = None
    min_gap_m: Estimate | None = None
    told_s: Estimate | None = None
    seen_s: Estimate | None = None
    brake_s: Estimate | None = None
    brake_age_s: Estimate | None = None
    candidates: Estimate | None = None
    heard: Estimate | None = None
    right: Estimate | None = None
    missed: Estimate | None = None
    regret: Estimate | None = None
    regret_unheard: Estimate | None = None
    apm_kbyte_s: Estimate | None = None
    request_kbyte_s: Estimate | None = None
    data_kbyte_s: Estimate | None = None
    sharing_kbyte_s: Estimate | None = None
    cbr: Estimate | None = None
    regret_south: Estimate | None = None
    regret_follower: Estimate | None = None
    regret_north: Estimate | None = None
    right_south: Estimate | None = None
    right_follower: Estimate | None = None
    right_north: Estimate | None = None


def is_there(folder: Path, name: str) -> bool:
    """Whether an experiment was run and its tables are in `folder`."""
    return (folder / f"{name}.csv").is_file()


def results(folder: Path, name: str) -> Sequence[Result]:
    """The conditions of an experiment of which there are runs.

    Raises:
        FileNotFoundError: it was not run.
        ValueError: the file is not what the report wrote.
    """
    return [row for row in records.read(folder / f"{name}.csv", Result) if row.n]


def origin(folder: Path, name: str) -> Origin:
    """Where the tables of an experiment come from.

    Raises:
        FileNotFoundError: it was not run.
        ValueError: the file does not say it.
    """
    return records.read_json(folder / f"{name}{PROVENANCE}", Origin)
