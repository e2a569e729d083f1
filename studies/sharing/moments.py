"""How often the match is right in traffic, from moments: `python -m studies.sharing.moments DIR`.

Traffic of the red light and of the city, with lidars on a share of the vehicles that the seed
draws, is simulated alone. At moments of it every vehicle that could see some of the requester's
area of interest scans once, and the lidar and the perception unit that are installed choose whom
to ask, as in `nlosim verify perception`. All matrices reach the requester, so that what the radio
loses is not in it. Who was chosen is compared with exact geometry.

Writes to DIR:

moments_looks.csv         every choice: scene, share of lidars, seed, parameters, what who reveals
moments.csv               means over seeds with their intervals, per scene, share and parameters
moments_provenance.json   command, commit, machine, versions
"""

import argparse
import math
import os
import platform
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from importlib.metadata import version
from itertools import groupby
from pathlib import Path
from typing import Final

import numpy as np
from tqdm import tqdm

from fmus.messages.records import NO_VEHICLE
from orchestrator import machine
from orchestrator.intervals import Estimate
from orchestrator.recording.layout import write_json
from orchestrator.recording.reader import Recording
from orchestrator.registry import component_type
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.signal import Signals
from orchestrator.timebase import Time
from studies.method import records
from studies.method.estimates import mean_of
from studies.method.origin import Machine, Origin, Session, seeds_text
from studies.sharing.choice import RIGHT, Moment, compare
from studies.sharing.coverage import Source, Surroundings, nearest_of, scene_at
from studies.verification.perception.parameter_set import PAPER, RECOMMENDED, ParameterSet
from studies.verification.perception.session import UnitsUnderTest
from studies.verification.perception.truth import Interest, find_truth

HORIZON: Final = 50.0
"""How far the requester looks [m]."""
DEMAND: Final = 25.0
"""Where nobody reveals so much there is nothing to choose [m^2]."""
SHARES: Final = (0.1, 0.2, 0.3)
"""The share of vehicles that have lidars."""
LOOKS: Final = {"red_light": (1, 2, 3, 4, 5, 6, 7, 8), "city": (2, 4, 6, 8, 10, 12, 14, 16)}
"""Moments of each scene [s]."""

_BASE: Final = 0.2
APMM: Final = RECOMMENDED.but("apmm", window_largest=16, horizon=HORIZON)
"""The match of red_light_sharers.yaml."""
PLAIN: Final = PAPER.but("apmm-paper", horizon=HORIZON, benefit_threshold=100.0)
"""The paper's: an index of points, cells of 5 m, no map."""


def _with_errors(position: float, heading: float) -> ParameterSet:
    name = f"apmm, pose {position:g} m, {heading:g} deg"
    return APMM.mislocated(name, position=position, heading=math.radians(heading))


ERRORS: Final = tuple(_with_errors(*each) for each in ((0.5, 0.5), (1.0, 1.0), (1.5, 2.0)))
"""What poses are off by, at a fifth of lidars; standard deviations [m] and [deg]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """A choice at a moment.

    Attributes:
        scene: whose traffic.
        share: of the vehicles, those with lidars.
        seed: of the traffic.
        parameters: the name of the parameters of the perception unit.
        moment: the choice beside what is so.
    """

    scene: str
    share: float
    seed: int
    parameters: str
    moment: Moment


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Choices of one kind: means over seeds of the means of each seed, with intervals.

    Attributes:
        scene, share, parameters: of which kind.
        seeds: in how many there was something to choose.
        looks: how often that was.
        candidates: vehicles with lidars that could see some of the area of interest.
        most: what the best candidate reveals [m^2].
        best: share of the looks at which the best one was chosen.
        right: share at which one was chosen that reveals 95 % of what the best one does.
        missed: share at which nobody was.
        regret: share of what the best one reveals that the chosen one does not.
        regret_nearest: the same of the nearest candidate.
        regret_random: the same of a random one.
    """

    scene: str
    share: float
    parameters: str
    seeds: int
    looks: int
    candidates: Estimate | None
    most: Estimate | None
    best: Estimate | None
    right: Estimate | None
    missed: Estimate | None
    regret: Estimate | None
    regret_nearest: Estimate | None
    regret_random: Estimate | None


def choices(scene: str, share: float, seed: int, units: UnitsUnderTest) -> Iterator[Choice]:
    """Let the units choose at the moments of a scene.

    Args:
        scene: a name of `LOOKS`.
        share: of the vehicles, those with lidars.
        seed: of the traffic.
        units: the lidar and the perception unit.
    """
    path = Path(__file__).parent / "scenes" / f"{scene}.yaml"
    given = [f"components.traffic.parameters.equipment.all.lidar={share}", f"seed={seed}"]
    with tempfile.TemporaryDirectory() as folder:
        run_scenario(load_scenario(path, given), Path(folder) / "run", figure=False)
        stage = _Stage.of(Recording(Path(folder) / "run"))
        for second in LOOKS[scene]:
            number = seed * 1000 + second
            sets = (APMM, PLAIN, *(ERRORS if share == _BASE else ()))
            for one, moment in stage.looks(second * 1_000_000_000, units, sets, number):
                yield Choice(scene=scene, share=share, seed=seed, parameters=one, moment=moment)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stage:
    """A run of traffic, and where the requester looks in it."""

    recording: Recording
    source: Source
    surroundings: Surroundings

    @classmethod
    def of(cls, recording: Recording) -> "_Stage":
        interest = Interest(corridor=25.0, horizon=HORIZON)
        return cls(
            recording=recording,
            source=Source(vehicle="traffic.vehicle", ego="traffic.ego", interest=interest),
            surroundings=Surroundings.of(recording, "traffic.road", "traffic.building"),
        )

    @property
    def road(self) -> Signals:
        return {f"road.{n}": self.recording[f"traffic.road.{n}"][0] for n in ("vertex", "index")}

    def looks(
        self, time: Time, units: UnitsUnderTest, sets: Sequence[ParameterSet], number: int
    ) -> Iterator[tuple[str, Moment]]:
        """The choice of each parameter set at `time` [ns]; none if there is nothing to choose.

        `number` selects the noise of the lidars and the errors of poses.
        """
        scene = scene_at(self.recording, self.source, self.surroundings, time)
        if scene is None or not scene.candidates:
            return
        truth = find_truth(scene, self.source.interest)
        if truth.best < DEMAND:
            return
        everybody = list(scene.candidates)
        nearest = nearest_of(self.recording, self.source, time, everybody)
        scans = units.scan(scene, number)
        for one in sets:
            believed = scans.believed(one.accuracy, number)
            messages, _ = units.apms(scene, believed, one.matrix)
            match = units.match(scene, believed, messages, one, self.road)
            chosen = match.sharers[0] if match.trigger else NO_VEHICLE
            yield one.name, compare(time, truth, chosen=chosen, heard=everybody, nearest=nearest)


def scores(found: Sequence[Choice]) -> list[Score]:
    """Summarise choices, by scene, share and parameters."""

    def kind(one: Choice) -> tuple[str, float, str]:
        return one.scene, one.share, one.parameters

    order = {name: k for k, name in enumerate(LOOKS)}
    ordered = sorted(found, key=lambda one: (order[one.scene], one.share, one.parameters))
    return [_score(*name, list(group)) for name, group in groupby(ordered, key=kind)]


def _score(scene: str, share: float, parameters: str, group: Sequence[Choice]) -> Score:
    by_seed: dict[int, list[Moment]] = {}
    for one in group:
        by_seed.setdefault(one.seed, []).append(one.moment)

    def over_seeds(value: Callable[[Moment], float]) -> Estimate | None:
        return mean_of([float(np.mean([value(m) for m in each])) for each in by_seed.values()])

    return Score(
        scene=scene,
        share=share,
        parameters=parameters,
        seeds=len(by_seed),
        looks=len(group),
        candidates=over_seeds(lambda m: m.candidates),
        most=over_seeds(lambda m: m.most),
        best=over_seeds(lambda m: m.revealed >= m.most),
        right=over_seeds(lambda m: m.revealed >= RIGHT * m.most),
        missed=over_seeds(lambda m: m.chosen == NO_VEHICLE),
        regret=over_seeds(lambda m: 1 - m.revealed / m.most),
        regret_nearest=over_seeds(lambda m: 1 - m.nearest / m.most),
        regret_random=over_seeds(lambda m: 1 - m.mean / m.most),
    )


def _session(planned: int) -> Session:
    """What runs here, asked before anything is written into the checkout."""
    host = Machine(
        cpu=machine.cpu(),
        cpus=os.cpu_count(),
        memory_gib=machine.memory_gib(),
        platform=platform.platform(),
    )
    return Session(
        command=f"python -m studies.sharing.moments docs/results --seeds {planned}",
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        commit=machine.commit(),
        versions={name: version(name) for name in ("nlosim", "numpy", "libsumo", "shapely")},
        machine=host,
    )


def _origin(seeds: Sequence[int], planned: int, session: Session) -> Origin:
    """Where the numbers come from."""
    kinds = len(LOOKS) * len(SHARES)
    return Origin(
        experiment="studies/sharing/moments.py",
        seeds=seeds_text(seeds),
        planned=planned * kinds,
        runs=len(seeds) * kinds,
        failed=0,
        sessions=(session,),
    )


def write(directory: Path, found: Sequence[Choice], origin: Origin) -> None:
    """Write both tables, and where they come from, to `directory`."""
    write_json(directory / "moments_provenance.json", asdict(origin))
    rows = [
        {"scene": o.scene, "share": o.share, "seed": o.seed, "parameters": o.parameters}
        | asdict(o.moment)
        for o in found
    ]
    records.write(directory / "moments_looks.csv", rows)
    records.write(directory / "moments.csv", records.rows(scores(found)))


def main() -> None:
    """Simulate, choose, and write the tables."""
    parser = argparse.ArgumentParser(prog="python -m studies.sharing.moments")
    parser.add_argument("directory", type=Path, help="where the tables go")
    parser.add_argument("--seeds", type=int, default=10, help="how many, from 1 on (default: 10)")
    given = parser.parse_args()
    given.directory.mkdir(parents=True, exist_ok=True)
    units = UnitsUnderTest(component_type("lidar"), component_type("perception"))
    session = _session(given.seeds)
    found: list[Choice] = []
    for seed in tqdm(range(1, given.seeds + 1), unit="seed", disable=None):
        for scene in LOOKS:
            for share in SHARES:
                found += choices(scene, share, seed, units)
        write(given.directory, found, _origin(range(1, seed + 1), given.seeds, session))


if __name__ == "__main__":
    main()
