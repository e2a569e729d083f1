"""From the arguments of `nlosim train` to its outcome."""

import shlex
import sys
import tempfile
from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from orchestrator.campaign.conduct import Interrupted, Options, StoppedShortError
from orchestrator.campaign.workers import local_pool, require
from orchestrator.cli.failures import stopped_short
from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.errors import CosimError
from orchestrator.experiment.schema import seeds as parsed_seeds
from studies.training.collection import Collection
from studies.training.conduct import TrainingOutcome, conduct_training
from studies.training.load import load_training
from studies.training.plan import Training
from studies.training.schema import MAXIMUM_SEED
from studies.training.several import (
    SEEDS,
    SPREAD,
    Trained,
    by_seed,
    conduct_several,
    spread,
    trainings,
)


def execute(arguments: Namespace) -> Outcome:
    """Load, check, train, tell."""
    _check_options(arguments)
    training = _changed(load_training(arguments.training), arguments)
    _check_place(training.checkpoint)
    require("distributed")
    collection = None if arguments.cache is None else Collection(Path(arguments.cache).absolute())
    seeds = _seeds(arguments)
    with stopping() as stop:
        options = _options(arguments, stop.check)
        try:
            if seeds is not None:
                trained = conduct_several(training, seeds, options, collection)
                return _all_done(training, arguments, trained)
            outcome = conduct_training(training, options, collection)
        except Interrupted as error:
            return _interrupted(arguments, error.outcome)
        except StoppedShortError as error:
            out = error.directory if seeds is None else Path(arguments.out)
            return stopped_short(error.cause, out, _resuming(arguments, str(out)))
    return _done(training, arguments, outcome)


def _check_options(arguments: Namespace) -> None:
    if arguments.resume and arguments.out is None:
        raise CosimError("--resume needs --out DIR, the directory of the training to go on with")
    if arguments.workers is not None and arguments.workers < 1:
        raise CosimError(f"--workers must be at least 1, got {arguments.workers}")
    seed = arguments.seed
    if seed is not None and not 0 <= seed <= MAXIMUM_SEED:
        raise CosimError(f"--seed must be between 0 and {MAXIMUM_SEED}, got {seed}")
    if arguments.seeds is not None and seed is not None:
        raise CosimError("--seed and --seeds exclude each other")
    if arguments.seeds is not None and arguments.out is None:
        raise CosimError("--seeds needs --out DIR, the directory of all trainings")
    _seeds(arguments)


def _seeds(arguments: Namespace) -> tuple[int, ...] | None:
    """The seeds of several trainings; `None`: there is one."""
    text = arguments.seeds
    if text is None:
        return None
    try:
        found = parsed_seeds(int(text) if text.isdecimal() else text)
    except ValueError as error:
        raise CosimError(f"--seeds: {error}") from error
    if max(found) > MAXIMUM_SEED:
        raise CosimError(f"--seeds: must be at most {MAXIMUM_SEED}, got {max(found)}")
    return found


def _options(arguments: Namespace, check: Callable[[], None]) -> Options:
    return Options(
        out=None if arguments.out is None else Path(arguments.out),
        pool=partial(local_pool, arguments.workers, "train"),
        resume=arguments.resume,
        progress=not arguments.quiet and sys.stderr.isatty(),
        command=_command(arguments, arguments.out),
        check=check,
    )


def _changed(training: Training, arguments: Namespace) -> Training:
    """The training with the options that stand for values of the file."""
    if arguments.seed is not None:
        training = replace(training, seed=arguments.seed)
    if arguments.device is not None:
        training = replace(training, device=arguments.device)
    if arguments.checkpoint is not None:
        checkpoint = Path(arguments.checkpoint).absolute()
        if checkpoint.is_dir() or not checkpoint.parent.is_dir():
            raise CosimError(
                f"--checkpoint {arguments.checkpoint}: the folder must exist, the file need not"
            )
        training = replace(training, checkpoint=checkpoint)
    return training


def _check_place(checkpoint: Path) -> None:
    """Whether the network can be written, before it is learned for hours."""
    try:
        with tempfile.TemporaryFile(dir=checkpoint.parent):
            pass
    except OSError as error:
        what = f"the network cannot be written to `{checkpoint}`: {error.strerror}"
        raise CosimError(f"{what}; choose another place with --checkpoint FILE") from None


def _command(arguments: Namespace, out: str | None) -> str:
    """What decides on the results; not how they are computed."""
    words = ["nlosim", "train", str(arguments.training)]
    for name in ("seed", "seeds", "checkpoint", "device"):
        value = getattr(arguments, name)
        words += [f"--{name}", str(value)] if value is not None else []
    words += ["--out", out] if out is not None else []
    return shlex.join(words)


def _resuming(arguments: Namespace, out: str) -> str:
    """The command that goes on, computing as this one does."""
    words = []
    for name in ("cache", "workers"):
        value = getattr(arguments, name)
        words += [f"--{name}", str(value)] if value is not None else []
    return shlex.join([*shlex.split(_command(arguments, out)), *words, "--resume"])


def _data(outcome: TrainingOutcome) -> dict[str, Any]:
    found = outcome.findings
    failed = [
        {
            "phase": run.phase,
            "seed": run.seed,
            "message": run.result.error,
            "command": command,
        }
        for run, command in outcome.failed
    ]
    return {
        "out": str(outcome.directory),
        "round": found.chosen,
        "failed": failed,
        "tables": {"epochs": list(found.epochs), "phases": list(found.phases)},
    }


def _interrupted(arguments: Namespace, outcome: TrainingOutcome) -> Outcome:
    out = outcome.directory if arguments.seeds is None else arguments.out
    text = f"interrupted; what was done is in {out}\n"
    text += f"go on with: {_resuming(arguments, str(out))}"
    return failure("interrupted", Exit.INTERRUPTED, "interrupted", text=text, **_data(outcome))


def _failures(outcome: TrainingOutcome) -> list[str]:
    lines = []
    for run, command in outcome.failed:
        lines += [f"failed twice: {run.phase}, seed {run.seed}: {run.result.error}"]
        lines += [f"  repeat it with: {command}"]
    return lines


def _all_done(training: Training, arguments: Namespace, trained: Sequence[Trained]) -> Outcome:
    """Join what each training says alone, the tables over all seeds, and the worst exit code."""
    single = [
        _done(each, arguments, done.outcome)
        for each, done in zip(
            trainings(training, [t.seed for t in trained], Path(arguments.out)),
            trained,
            strict=True,
        )
    ]
    rows = by_seed(trained)
    lines = [f"seed {t.seed}\n{done.text}" for t, done in zip(trained, single, strict=True)]
    lines += [f"{SEEDS} and {SPREAD} in {arguments.out} have what differs between the seeds"]
    return Outcome(
        text="\n".join(lines),
        data={
            "out": arguments.out,
            "seeds": [{"seed": t.seed, **one.data} for t, one in zip(trained, single, strict=True)],
            "tables": {"seeds": rows, "spread": spread(rows)},
        },
        exit_code=max((each.exit_code for each in single), default=Exit.DONE),
    )


def _done(training: Training, arguments: Namespace, outcome: TrainingOutcome) -> Outcome:
    out = outcome.directory
    if outcome.error is not None:
        text = f"error: {outcome.error}\nwhat was done is in {out}; once the cause is mended, "
        text += f"go on with: {_resuming(arguments, str(out))}"
        message, code = str(outcome.error), Exit.COMPONENT_FAILED
        return failure("runs", code, message, text=text, **_data(outcome))
    lines = [outcome.summary, *_failures(outcome)]
    lines += [f"the network of round {outcome.findings.chosen} is in {training.checkpoint}"]
    lines += [f"log, tables and figure are in {out}"]
    return Outcome(
        text="\n".join(lines),
        data={**_data(outcome), "checkpoint": str(training.checkpoint)},
        exit_code=Exit.COMPONENT_FAILED if outcome.failed else Exit.DONE,
    )
