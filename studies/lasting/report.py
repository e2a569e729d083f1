"""The files of the study: those of one experiment, and those of all of them together.

The report `lasting-study` writes what the report `collision-study` writes, and, where NAME is that
of the experiment file:

NAME_decisions.csv      every run: condition, seed, what was there at the point of no return

`write_study` makes of them:

lasting.csv             per condition of all scenes: collisions with intervals, and more
lasting_had.csv         per condition: what was there at the point of no return
lasting_doses.csv       collisions over the share of the last second's scans that was there, and
                        over the age of the newest one
lasting_pairs.csv       pairs of relay methods by the same seeds
lasting_claims.csv      the paper's claims and ours, with verdicts
lasting_critical.csv    packet error rates at which the collision rate crosses 1, 10 and 50 %
lasting_partners.csv    with whom the ego collided
lasting_figure9_10.*    collision rate over packet error rate: points (CSV), picture (SVG, PNG)
lasting_doses.svg       collision rate over the share of scans; and PNG
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final, TypeVar

from typing_extensions import override

from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.report import ExperimentFindings, ExperimentReport, Results
from orchestrator.parameters import ParameterProblem
from studies.collision import CollisionStudy, statistics
from studies.collision.conditions import COOPERATIVE, POLICY
from studies.collision.curves import CriticalPoint, critical_points, curves
from studies.collision.statistics import Partner, Result, partners
from studies.lasting.claims import claims
from studies.lasting.decisions import METRICS, SUFFIX, Dose, Had, decisions, doses, had, read
from studies.lasting.pairs import Pair, pairs
from studies.lasting.scenes import EXPERIMENTS, SCENES, TURNING
from studies.method import records
from studies.method.claims import Judgement, judge
from studies.method.report import missing, parameters

FIGURE: Final = "lasting_figure9_10"
DOSES: Final = "lasting_doses"
"""The names of the files of the figures of all experiments together."""

FEWEST: Final = 20
"""Seeds from which on a curve has critical points: a bootstrap over fewer says too little of what
it does not know."""

_TABLES: Final[Mapping[type, str]] = {
    Result: "lasting",
    Had: "lasting_had",
    Dose: DOSES,
    Judgement: "lasting_claims",
    CriticalPoint: "lasting_critical",
    Partner: "lasting_partners",
    Pair: "lasting_pairs",
}
"""The names of the tables of all experiments together, by the type of their rows."""

Row = TypeVar("Row")


def read_table(folder: Path, row: type[Row]) -> list[Row]:
    """The table of all experiments together with rows of this type, as `write_study` wrote it.

    Raises:
        FileNotFoundError: it did not.
        ValueError: a cell is not what it should be; names the file and its line.
    """
    return records.read(folder / f"{_TABLES[row]}.csv", row)


class LastingStudy(ExperimentReport):
    """Collisions under every condition, and what was there when the ego had to decide.

    It is the report `collision-study` with its parameters and metrics, and needs the numbers of the
    measure `decision` besides (`METRICS`).
    """

    def __init__(self) -> None:
        self._collisions = CollisionStudy()

    @override
    def check(self, experiment: Experiment) -> Iterator[ParameterProblem]:
        yield from self._collisions.check(experiment)
        needed = {name: f"{name}: {path}" for name, path in METRICS.items()}
        yield from missing("lasting study", "metric", needed, experiment.metrics)

    @override
    def write(self, results: Results, directory: Path) -> ExperimentFindings:
        policy = str(parameters(results.experiment).get(POLICY, COOPERATIVE))
        rows = records.rows(decisions(results, policy))
        records.write(directory / f"{results.experiment.path.stem}{SUFFIX}", rows)
        return self._collisions.write(results, directory)


def write_study(folder: Path) -> None:
    """Write tables and figures of the experiments whose reports are in `folder`.

    Raises:
        FileNotFoundError: there is nothing of any experiment.
        ValueError: a file is not what a report wrote.
    """
    campaigns = {scene.name: scene.read(folder) for scene in SCENES}
    table = [row for each in campaigns.values() for row in statistics.results(each.points)]
    if not table:
        raise FileNotFoundError(2, "nothing", str(folder / f"{next(iter(EXPERIMENTS))}_runs.csv"))
    found = read(folder, EXPERIMENTS)
    first = campaigns[TURNING.name].points
    on_curves = [point for each in curves(first).values() for point in each]
    over_per = statistics.results(on_curves)
    dosed = doses(found)
    tables: dict[str, Sequence[object]] = {
        _TABLES[Result]: table,
        _TABLES[Had]: had(found),
        _TABLES[Dose]: dosed,
        _TABLES[Judgement]: judge(claims(campaigns)),
        _TABLES[CriticalPoint]: [one for one in critical_points(first) if one.seeds >= FEWEST],
        _TABLES[Pair]: pairs(found),
        _TABLES[Partner]: [row for each in campaigns.values() for row in partners(each.points)],
        FIGURE: over_per,
    }
    for name, rows in tables.items():
        records.write(folder / f"{name}.csv", records.rows(rows))
    _draw(over_per, dosed, folder)


def _draw(over_per: Sequence[Result], dosed: Sequence[Dose], folder: Path) -> None:
    from studies.collision.figures import draw_over_per  # noqa: PLC0415 - matplotlib is slow
    from studies.lasting.figures import draw_doses  # noqa: PLC0415

    if over_per:
        draw_over_per(over_per, folder / FIGURE)
    if dosed:
        draw_doses(dosed, folder / DOSES)
