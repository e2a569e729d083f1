"""One training with several seeds: what the recipe makes, and what is luck.

Everything random but the expert's runs depends on the seed, if `expert.seed` is written: initial
weights, order of the samples, losses of messages, and what the network gets into when it drives.

seeds.csv   how the network of each seed drove: a row per seed, encounter and variant
spread.csv  over the seeds: a row per encounter and variant
"""

import statistics
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from orchestrator.campaign.conduct import Options
from orchestrator.run_directory import claim_directory
from studies.training.collection import Collection
from studies.training.conduct import TrainingOutcome, conduct_training
from studies.training.journal import IDENTITY
from studies.training.plan import Training
from studies.training.results import OUTCOMES, Row, write_csv

SEEDS: Final = "seeds.csv"
SPREAD: Final = "spread.csv"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trained:
    """What the training with one seed came to.

    Attributes:
        seed: of the training.
        outcome: of it.
    """

    seed: int
    outcome: TrainingOutcome


def trainings(training: Training, seeds: Sequence[int], directory: Path) -> Iterator[Training]:
    """One training for each seed.

    Args:
        training: whose checkpoint is that of the first seed.
        seeds: of the trainings.
        directory: of all results; it has the other checkpoints.
    """
    for k, seed in enumerate(seeds):
        checkpoint = training.checkpoint
        if k > 0:
            checkpoint = directory / folder(seed) / training.checkpoint.name
        yield replace(training, seed=seed, checkpoint=checkpoint)


def folder(seed: int) -> str:
    """The folder of the training with a seed, in that of all."""
    return f"seed-{seed}"


def conduct_several(
    training: Training,
    seeds: Sequence[int],
    options: Options,
    collection: Collection | None,
) -> list[Trained]:
    """Train with each seed what is not trained yet, one after the other; write both tables.

    It ends early with the first training that does.

    Args:
        training: its own seed does not count.
        seeds: of the trainings.
        options: how; `out` is there, the directory of all results.
        collection: of runs of the expert.

    Raises:
        As `conduct_training`.
    """
    if options.out is None:
        raise ValueError("trainings with several seeds need a directory")
    directory = options.out if options.resume else claim_directory(options.out)
    found: list[Trained] = []
    for each in trainings(training, seeds, directory):
        out = directory / folder(each.seed)
        is_begun = options.resume and (out / IDENTITY).is_file()
        own = replace(options, out=out, resume=is_begun)
        outcome = conduct_training(each, own, collection)
        found.append(Trained(seed=each.seed, outcome=outcome))
        write(directory, found)
        if outcome.error is not None:
            break
    return found


def write(directory: Path, trained: Sequence[Trained]) -> None:
    """Write both tables, if anybody drove alone."""
    rows = by_seed(trained)
    if not rows:
        return
    write_csv(directory / SEEDS, rows)
    write_csv(directory / SPREAD, spread(rows))


def by_seed(trained: Sequence[Trained]) -> list[Row]:
    """Rows of `seeds.csv`; of trainings without an evaluation their last drives."""
    rows: list[Row] = []
    for each in trained:
        found = each.outcome.findings
        last = [r for r in found.phases if r["phase"] == f"drive-{found.chosen}"]
        plain = [{"encounter": "", "held_out": False, **_ends(r)} for r in last]
        evaluated = [
            {"encounter": r["encounter"], "held_out": r["held_out"], **_ends(r)}
            for r in found.evaluation
        ]
        chosen = {"seed": each.seed, "round": found.chosen}
        rows += [{**chosen, **row} for row in (evaluated or plain)]
    return rows


def _ends(row: Row) -> Row:
    names = [f"{name}{end}" for name in OUTCOMES for end in ("", "_low", "_high")]
    return {name: row[name] for name in ("runs", "failed", *names)}


def spread(rows: Sequence[Row]) -> list[Row]:
    """Rows of `spread.csv`: mean, least, greatest and standard deviation over the seeds.

    Args:
        rows: of `seeds.csv`.
    """
    by_place: defaultdict[tuple[str, bool], list[Row]] = defaultdict(list)
    for row in rows:
        by_place[row["encounter"], row["held_out"]].append(row)
    return [
        {
            "encounter": encounter,
            "held_out": held_out,
            "seeds": len(each),
            **{k: v for name in OUTCOMES for k, v in _over_seeds(name, each).items()},
        }
        for (encounter, held_out), each in by_place.items()
    ]


def _over_seeds(name: str, rows: Sequence[Row]) -> Mapping[str, Any]:
    values = [row[name] for row in rows if row[name] is not None]
    return {
        f"{name}_mean": statistics.fmean(values) if values else None,
        f"{name}_least": min(values, default=None),
        f"{name}_greatest": max(values, default=None),
        f"{name}_deviation": statistics.stdev(values) if len(values) > 1 else None,
    }
