"""Table II under every reading, from tables of runs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from orchestrator.intervals import Estimate
from studies.method import records
from studies.method.estimates import Sample, differences, mean_of, share_of

BASE: Final = "relay_runs.csv"
"""The runs of the study of Table II."""
POLICIES: Final = "relay_readings_runs.csv"
"""Runs in its scene, with other readings of the discovery."""
SCENES: Final = "relay_scenes_runs.csv"
"""Runs in scenes with another reading of what stands there, or of the link budget."""
BUDGET: Final = "relay_map_budget_runs.csv"
"""Runs of MoHeD and of signal strength by the own hop, in the same scenes and in others."""
AHEAD: Final = "relay_ahead_runs.csv"
"""Runs of MoHeD with predicted trajectories, in the same scenes."""
FORESIGHT: Final = "relay_foresight_runs.csv"
"""Runs with predicted trajectories in the scene of Table II, among others."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run of one of the tables; a metric without anything to measure is `None`.

    Attributes:
        levels: by factor, and the columns that are nothing of what follows.
        seed: of the run.
        prr: packet reception rate, 0 to 1.
        direct_prr: that of the direct link alone.
        relay_switches: how often the relay changed.
        collision_rate: whether the ego vehicle collided.
        error: why the run failed.
    """

    levels: Mapping[str, str]
    seed: int
    prr: float | None
    relay_switches: float | None
    direct_prr: float | None = None
    collision_rate: bool | None = None
    error: str | None = None


@dataclass(frozen=True, slots=True)
class Where:
    """Which runs are meant: a table, and levels of its factors."""

    table: str
    levels: Mapping[str, str]


@dataclass(frozen=True, slots=True, kw_only=True)
class Reading:
    """A reading of the paper, and which runs are its methods.

    Attributes:
        name: of the reading.
        rule: by what signal strength chooses.
        fitted: the end of the run, `time.stop`, which fits the direct link.
        mohed, strength, random, direct: the runs of the paper's four methods.
    """

    name: str
    rule: str
    fitted: str
    mohed: Where
    strength: Where
    random: Where
    direct: Where


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingResult:
    """What came out under a reading: rates, 0 to 1, and differences, all of the same seeds.

    Attributes:
        reading, rule, fitted: as in `Reading`.
        n: the number of seeds that all four methods have, of which everything else is.
        mohed, strength, random: packet reception rates.
        direct_per: packet error rate of the direct link.
        mohed_switches, strength_switches, random_switches: numbers of changes of the relay.
        mohed_collisions, strength_collisions, random_collisions: shares of runs with a collision;
            `None` if that was not recorded.
        over_strength: PRR of MoHeD minus that of signal strength.
        over_random: PRR of MoHeD minus that of random.
        random_over_strength: PRR of random minus that of signal strength.
    """

    reading: str
    rule: str
    fitted: str
    n: int
    mohed: Estimate | None
    strength: Estimate | None
    random: Estimate | None
    direct_per: Estimate | None
    mohed_switches: Estimate | None
    strength_switches: Estimate | None
    random_switches: Estimate | None
    mohed_collisions: Estimate | None
    strength_collisions: Estimate | None
    random_collisions: Estimate | None
    over_strength: Estimate | None
    over_random: Estimate | None
    random_over_strength: Estimate | None


def base(method: str) -> Where:
    """The runs of a method in the study of Table II."""
    return Where(BASE, {"method": method, "density": "30 m", "speed": "30 km/h"})


def policy(reading: str, method: str) -> Where:
    """The runs of a method under another reading of the discovery."""
    return Where(POLICIES, {"reading": reading, "method": method})


STOP: Final = "13.2 s"
"""The end of the run that fits the direct link in the study of Table II."""


def _here(name: str, rule: str, strength: Where, random: Where | None = None) -> Reading:
    """A reading in the scene of Table II; MoHeD and the direct link are those of the study."""
    return Reading(
        name=name,
        rule=rule,
        fitted=STOP,
        mohed=base("mohed"),
        strength=strength,
        random=base("random") if random is None else random,
        direct=base("direct"),
    )


def _few(rule: str, method: str) -> Reading:
    level = "few candidates"
    return Reading(
        name="some 11 candidates",
        rule=rule,
        fitted=STOP,
        mohed=policy(level, "mohed"),
        strength=policy(level, method),
        random=policy(level, "random"),
        direct=base("direct"),
    )


def _there(scene: str, tall: str, exponent: str, stop: str) -> Iterator[Reading]:
    """A scene of its own, with both rules of signal strength."""

    def cell(method: str) -> Where:
        return Where(
            BUDGET, {"tall_vehicles": tall, "path-loss_exponent": exponent, "method": method}
        )

    def other(method: str) -> Where:
        return Where(SCENES, {"scene": scene, "method": method})

    strengths = {"sum": other("signal-strength"), "own hop": cell("signal-strength-own")}
    for rule, strength in strengths.items():
        yield Reading(
            name=scene,
            rule=rule,
            fitted=stop,
            mohed=cell("mohed"),
            strength=strength,
            random=other("random"),
            direct=other("direct"),
        )


READINGS: Final = (
    _here("as in the study", "sum", base("signal-strength")),
    _here("as in the study", "weaker hop", base("signal-strength-min")),
    _here("one hop", "own hop", policy("one hop", "signal-strength-own")),
    _here("one hop, blind", "own hop", policy("one hop, blind", "signal-strength-own")),
    _here("thresholds", "Release 18", policy("thresholds", "signal-strength-rel18")),
    _here(
        "on demand",
        "Release 18",
        policy("on demand", "signal-strength-rel18"),
        policy("on demand", "random"),
    ),
    _few("sum", "signal-strength"),
    _few("own hop", "signal-strength-own"),
    *_there("30 % tall", "30 %", "2", STOP),
    *_there("exponent 2.75", "13 %", "2.75", "14 s"),
    *_there("exponent 3", "13 %", "3", "15.6 s"),
    *_there("30 % tall, exponent 2.75", "30 %", "2.75", "14 s"),
)
"""All readings, in the order of the page."""


class Runs:
    """The tables of runs in a folder; one that is not there has no runs.

    Args:
        folder: with the tables.
    """

    def __init__(self, folder: Path) -> None:
        self._tables = {
            name: records.read(folder / name, Run) if (folder / name).is_file() else []
            for name in (BASE, POLICIES, SCENES, BUDGET, AHEAD, FORESIGHT)
        }

    def sample(self, where: Where, metric: str) -> Sample:
        """A metric by seed, of the runs that did not fail and had something to measure."""
        return {
            run.seed: float(value)
            for run in self._tables[where.table]
            if not run.error
            and where.levels.items() <= run.levels.items()
            and (value := getattr(run, metric)) is not None
        }


def results(runs: Runs, readings: Sequence[Reading] = READINGS) -> list[ReadingResult]:
    """What came out under each reading of which there are runs of all methods."""
    found = [_result(runs, reading) for reading in readings]
    return [each for each in found if each.n > 0]


def _result(runs: Runs, reading: Reading) -> ReadingResult:
    every = [
        runs.sample(where, "prr")
        for where in (reading.mohed, reading.strength, reading.random, reading.direct)
    ]
    common = sorted(set.intersection(*map(set, every)))
    mohed, strength, random, direct = ({seed: sample[seed] for seed in common} for sample in every)

    def switches(where: Where) -> Estimate | None:
        found = runs.sample(where, "relay_switches")
        return mean_of([found[seed] for seed in common if seed in found])

    def collisions(where: Where) -> Estimate | None:
        found = runs.sample(where, "collision_rate")
        return share_of([bool(found[seed]) for seed in common if seed in found])

    return ReadingResult(
        reading=reading.name,
        rule=reading.rule,
        fitted=reading.fitted,
        n=len(common),
        mohed=mean_of(list(mohed.values())),
        strength=mean_of(list(strength.values())),
        random=mean_of(list(random.values())),
        direct_per=mean_of([1.0 - value for value in direct.values()]),
        mohed_switches=switches(reading.mohed),
        strength_switches=switches(reading.strength),
        random_switches=switches(reading.random),
        mohed_collisions=collisions(reading.mohed),
        strength_collisions=collisions(reading.strength),
        random_collisions=collisions(reading.random),
        over_strength=mean_of(differences(mohed, strength)),
        over_random=mean_of(differences(mohed, random)),
        random_over_strength=mean_of(differences(random, strength)),
    )
