"""How much of the oracle's lead is foresight, and how much is luck: a part of the page.

`python -m studies.relay.foresight DIR EXPERIMENT...` adds to the results of the relay study in DIR
what is finished of these experiments (their directories, as `nlosim experiment --out` writes them):

relay_foresight_runs.csv          every run: method, seed, metrics
relay_foresight_provenance.json   commands, commits, machine, versions of each experiment
"""

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from orchestrator.recording.layout import write_json
from studies.method import records
from studies.method.estimates import Sample, differences, mean_of
from studies.method.origin import Origin, seeds_text, session_of
from studies.method.page import made
from studies.method.style import method_name
from studies.method.text import markdown, percent_shown, shown
from studies.relay.conditions import METHOD

RUNS: Final = "relay_foresight_runs.csv"
PROVENANCE: Final = "relay_foresight_provenance.json"
_STUDY: Final = "relay_runs.csv"
_BASE: Final = {"density": "30 m", "speed": "30 km/h"}

_PAIRS: Final = (
    ("oracle", "fair-oracle", "luck"),
    ("fair-oracle", "expected-prr", "what knowing the world to come adds to the policy"),
    ("fair-oracle", "signal-strength", "the same of signal strength"),
    ("fair-oracle", "mohed", "the same of MoHeD"),
    ("mohed-trajectories", "mohed", "what predicted trajectories add to MoHeD"),
    ("mohed-trajectories", "signal-strength", ""),
    ("mohed-trajectories", "expected-prr", ""),
    ("mohed-trajectories-ties", "mohed", "the same, without keeping the relay among equals"),
    ("mohed-trajectories-ties", "expected-prr", ""),
)

_TEXT: Final = """\
The *fair oracle* (`relay-oracle` with `draws: 4` and `alternatives: 16`) tries alternatives in the
world to come, with random draws that are not those of the run. Differences of PRR by the same
seeds, with those of the other methods of Table II. `make paper-oracle` runs
[relay_fair_oracle.yaml](../studies/relay/experiments/relay_fair_oracle.yaml) and
[relay_trajectories.yaml](../studies/relay/experiments/relay_trajectories.yaml).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run at the base condition.

    Attributes:
        method: the level of the factor `method`.
        seed: of the run.
        prr: packet reception rate, 0 to 1; `None` if there was nothing to receive.
        relay_switches: number of changes of the relay.
    """

    method: str
    seed: int
    prr: float | None
    relay_switches: int


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """Where a run of the study was made."""

    density: str
    speed: str


def finished(directory: Path) -> tuple[list[Run], Origin]:
    """What is finished of an experiment with the factor `method`, and where it comes from.

    Args:
        directory: of its results.

    Raises:
        FileNotFoundError: there is no experiment.
    """
    plan = json.loads((directory / "experiment.json").read_text(encoding="utf-8"))
    methods = [str(each["levels"][METHOD]) for each in plan["combinations"]]
    lines = (directory / "runs.jsonl").read_text(encoding="utf-8").splitlines()
    notes = [json.loads(line) for line in lines]
    last = {(note["seed"], note["combination"]): note for note in notes}
    done = {key: note["metrics"] for key, note in last.items() if note["error"] is None}
    runs = [
        Run(
            method=methods[combination],
            seed=seed,
            prr=metrics["prr"]["end_to_end"],
            relay_switches=metrics["relay_switches"],
        )
        for (seed, combination), metrics in sorted(done.items())
    ]
    origin = Origin(
        experiment=f"studies/relay/experiments/{Path(plan['file']).name}",
        seeds=seeds_text(sorted({run.seed for run in runs})),
        planned=len(plan["seeds"]) * len(methods),
        runs=len(last),
        failed=len(last) - len(done),
        sessions=tuple(map(session_of, plan["sessions"])),
    )
    return runs, origin


def part(folder: Path, link: str) -> list[str]:
    """The part of the page, if the experiments were run.

    Args:
        folder: with the results of the study and of these experiments.
        link: the path of `folder` from the page.
    """
    if not (folder / RUNS).is_file():
        return []
    runs = [*_base_runs(folder), *records.read(folder / RUNS, Run)]
    methods = list(dict.fromkeys(run.method for run in runs))
    samples = {method: _prr(runs, method) for method in methods}
    pairs = [
        [
            f"{method_name(a)} minus {method_name(b)}",
            str(len(found)),
            percent_shown(mean_of(found)),
            meaning,
        ]
        for a, b, meaning in _PAIRS
        if a in samples and b in samples and (found := differences(samples[a], samples[b]))
    ]
    common = {*samples.get("fair-oracle", {})}
    each = [list(_row(runs, method, common)) for method in methods]
    origins = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))["experiments"]
    made_by = [made(records.from_json(each, Origin)) for each in origins]
    return [
        f"## Foresight and luck\n\n{_TEXT}",
        "".join(made_by),
        markdown(("difference", "seeds", "points", "it is"), pairs) + "\n",
        f"The same seeds as the fair oracle; [every run]({link}/{RUNS}):\n",
        markdown(("method", "runs", "PRR [%]", "relay switches"), each) + "\n",
    ]


def _base_runs(folder: Path) -> Iterator[Run]:
    """The runs of Table II."""
    runs = records.read(folder / _STUDY, Run)
    for run, place in zip(runs, records.read(folder / _STUDY, _Place), strict=True):
        if asdict(place) == _BASE:
            yield run


def _prr(runs: Sequence[Run], method: str) -> Sample:
    return {run.seed: run.prr for run in runs if run.method == method and run.prr is not None}


def _row(runs: Sequence[Run], method: str, seeds: set[int]) -> Iterator[str]:
    """A method at these seeds."""
    there = [run for run in runs if run.method == method and run.seed in seeds]
    yield method_name(method)
    yield str(len(there))
    yield percent_shown(mean_of([run.prr for run in there if run.prr is not None]))
    yield shown(mean_of([float(run.relay_switches) for run in there]), ".2f")


def write(folder: Path, directories: Sequence[Path]) -> None:
    """Write the tables of what is finished.

    Args:
        folder: of the results of the study.
        directories: of the experiments.

    Raises:
        FileNotFoundError: there is no experiment.
    """
    found = [finished(directory) for directory in directories]
    records.write(folder / RUNS, records.rows(run for runs, _ in found for run in runs))
    origins = [asdict(origin) for _, origin in found]
    write_json(folder / PROVENANCE, {"experiments": origins})


def main() -> None:
    """Add what is finished to the results of the study."""
    parser = argparse.ArgumentParser(prog="python -m studies.relay.foresight")
    parser.add_argument("folder", type=Path, help="of the results of the relay study")
    parser.add_argument("experiments", type=Path, nargs="+", help="their directories")
    given = parser.parse_args()
    try:
        write(given.folder, given.experiments)
    except FileNotFoundError as error:
        parser.error(f"there is no `{error.filename}`; `make paper-oracle` makes it")


if __name__ == "__main__":
    main()
