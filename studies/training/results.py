"""Tables and a summary of a training, from its journal.

training.csv    a row per epoch: losses and time
phases.csv      a row per phase of driving: who drove, and how it went
evaluation.csv  a row per encounter and variant that is held out: how the chosen network drove
"""

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

from orchestrator import tables
from orchestrator.intervals import share
from studies.training.journal import Journal, Run
from studies.training.plan import Phase, Training
from studies.training.rounds import named_losses

Row: TypeAlias = Mapping[str, Any]

EPOCHS, PHASES, SUMMARY = "training.csv", "phases.csv", "summary.txt"
EVALUATION: Final = "evaluation.csv"

OUTCOMES: Final = ("collision", "success")
"""Metrics of a run that say how the drive ended, if the scenario's report has them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What is known of a training.

    Attributes:
        epochs: rows of `training.csv`.
        phases: rows of `phases.csv`.
        evaluation: rows of `evaluation.csv`; without any there is no such file.
        chosen: the round whose network is the result, of those finished until now, if there is one.
    """

    epochs: Sequence[Row]
    phases: Sequence[Row]
    evaluation: Sequence[Row] = ()
    chosen: int | None


def findings(training: Training, journal: Journal) -> Findings:
    """Everything that the tables say, of a training that may not be finished."""
    chosen = chosen_round(training, journal)
    return Findings(
        epochs=[row for number in sorted(journal.epochs) for row in _epochs(journal, number)],
        phases=[
            _phase(phase, runs)
            for phase in training.phases()
            if (runs := [r for s in phase.seeds if (r := journal.runs.get((phase.name, s)))])
        ],
        evaluation=[
            _evaluated(phase, runs)
            for phase in ([] if chosen is None else training.evaluation(chosen))
            if (runs := [r for s in phase.seeds if (r := journal.runs.get((phase.name, s)))])
        ],
        chosen=chosen,
    )


def chosen_round(training: Training, journal: Journal) -> int | None:
    """The finished round with the best drives; without drives, the last finished one.

    Most successes, then fewest collisions, each as a share of the drives that did not fail (who
    never moves does not collide); of equal rounds the later one, which has seen more.
    """
    if not training.drives:
        return max(journal.rounds, default=None)
    driven = [number for number in journal.rounds if training.drive(number).name in journal.phases]
    return max(driven, key=lambda n: (*_quality(training, journal, n), n), default=None)


def _quality(training: Training, journal: Journal, number: int) -> tuple[float, float]:
    phase = training.drive(number)
    runs = [journal.runs[phase.name, seed] for seed in phase.seeds]
    row = _phase(phase, runs)
    collision, success = row["collision"], row["success"]
    return (0.0 if success is None else success, -1.0 if collision is None else -collision)


def _epochs(journal: Journal, number: int) -> Iterable[Row]:
    kept = journal.rounds.get(number)
    for each in journal.epochs[number]:
        yield {
            "round": number,
            "epoch": each.epoch,
            **named_losses(each.result),
            "seconds": round(each.seconds, 3),
            "kept": each.epoch == kept,
        }


def _phase(phase: Phase, runs: Sequence[Run]) -> Row:
    done = [run for run in runs if run.result.error is None]
    row: dict[str, Any] = {
        "phase": phase.name,
        "driver": "expert" if phase.driver is None else f"round {phase.driver}",
        "beta": phase.beta,
        "runs": len(done),
        "failed": len(runs) - len(done),
        "samples": sum(run.samples for run in done),
    }
    row |= _outcomes(done)
    return {**row, "wall_s": round(sum(run.result.wall for run in runs), 3)}


def _evaluated(phase: Phase, runs: Sequence[Run]) -> Row:
    done = [run for run in runs if run.result.error is None]
    where = phase.encounter
    return {
        "encounter": "" if where is None else where.name,
        "held_out": where is not None and where.is_held_out,
        "driver": f"round {phase.driver}",
        "runs": len(done),
        "failed": len(runs) - len(done),
        **_outcomes(done),
    }


def _outcomes(done: Sequence[Run]) -> Row:
    """Shares of the runs that ended in each way, with intervals of 95 % (Wilson)."""
    row: dict[str, Any] = {}
    for name in OUTCOMES:
        values = [v for run in done if isinstance(v := run.result.metrics.get(name), bool)]
        found = share(values) if values else None
        row[name] = None if found is None else found.value
        row[f"{name}_low"] = None if found is None else found.low
        row[f"{name}_high"] = None if found is None else found.high
    return row


def write(directory: Path, found: Findings) -> str:
    """Write the tables and the summary; the summary."""
    write_csv(directory / EPOCHS, found.epochs)
    write_csv(directory / PHASES, found.phases)
    if found.evaluation:
        write_csv(directory / EVALUATION, found.evaluation)
    text = summary(found)
    (directory / SUMMARY).write_text(f"{text}\n", encoding="utf-8")
    return text


def read(directory: Path, prefix: str = "") -> Findings:
    """The tables that `write` wrote, whose names begin with `prefix`; nothing of the chosen round.

    Raises:
        FileNotFoundError: they are not there.
    """
    epochs, phases = (_read_csv(directory / f"{prefix}{name}") for name in (EPOCHS, PHASES))
    return Findings(epochs=epochs, phases=phases, chosen=None)


def _read_csv(path: Path) -> list[Row]:
    with path.open(encoding="utf-8", newline="") as file:
        return [{key: _value(cell) for key, cell in row.items()} for row in csv.DictReader(file)]


def _value(cell: str) -> Any:
    """What was written: a number, a truth, nothing, or a word."""
    if cell in ("True", "False", ""):
        return {"True": True, "False": False, "": None}[cell]
    for kind in (int, float):
        try:
            return kind(cell)
        except ValueError:
            continue
    return cell


def write_csv(path: Path, rows: Sequence[Row]) -> None:
    """Write the columns of all rows, in the order of their appearance."""
    names = list(dict.fromkeys(name for row in rows for name in row))
    draft = path.with_name(f"{path.name}.draft")
    with draft.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    draft.replace(path)


def summary(found: Findings) -> str:
    """Phases and rounds in two tables, for people."""
    names = ["phase", "driver", "beta", "runs", "failed", "samples", *OUTCOMES]
    drives = [[_cell(row, name) for name in names] for row in found.phases]
    lines = ["driving", *tables.text(tables.left(*names), drives)]
    rounds = {row["round"]: row for row in found.epochs if row["kept"]}
    counts = {n: sum(row["round"] == n for row in found.epochs) for n in rounds}
    learned = [
        [
            str(n),
            str(counts[n]),
            str(row["epoch"]),
            _loss(row, "training"),
            _loss(row, "validation"),
        ]
        for n, row in rounds.items()
    ]
    heads = tables.left("round", "epochs", "kept", "training loss", "validation loss")
    lines += ["learning", *tables.text(heads, learned)]
    if found.evaluation:
        names = ["encounter", "held_out", "runs", "failed", *OUTCOMES]
        driven = [[_cell(row, name) for name in names] for row in found.evaluation]
        lines += ["evaluation", *tables.text(tables.left(*names), driven)]
    return "\n".join(lines)


def _loss(row: Row, which: str) -> str:
    return f"{row[f'{which}_loss']:.4g}"


def _cell(row: Row, name: str) -> str:
    value = row[name]
    if value is None:
        return "-"
    if name in OUTCOMES:
        return f"{value:.3f} [{row[f'{name}_low']:.3f}, {row[f'{name}_high']:.3f}]"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
