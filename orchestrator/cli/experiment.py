"""`nlosim experiment`."""

import shlex
import sys
from argparse import Namespace
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from orchestrator import tables
from orchestrator.campaign.conduct import Interrupted, Options, StoppedShortError
from orchestrator.campaign.workers import local_pool, scheduled_workers
from orchestrator.cli.failures import bug, plugin_failed, said, stopped_short
from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.run import to_nobody
from orchestrator.cli.streams import tell_line
from orchestrator.errors import CosimError, PluginError, in_words
from orchestrator.experiment.conduct import ExperimentOutcome, conduct_experiment
from orchestrator.experiment.load import load_experiment
from orchestrator.experiment.plan import Experiment
from orchestrator.experiment.schema import seeds
from orchestrator.hosts_file import read_hosts


def execute(arguments: Namespace) -> Outcome:
    """Load, check every combination, run, tabulate."""
    _check_options(arguments)
    given = None if arguments.seeds is None else _seeds(arguments.seeds)
    experiment = load_experiment(
        Path(arguments.experiment),
        arguments.transport,
        hosts=None if arguments.hosts is None else read_hosts(Path(arguments.hosts)),
        tell=to_nobody if arguments.quiet else tell_line,
    )
    experiment = replace(experiment, private=arguments.private)
    if given is not None:
        experiment = replace(experiment, seeds=given)
    with stopping() as stop:
        try:
            options, keep = _options(arguments, stop.check), arguments.keep_runs
            page = not arguments.no_page
            outcome = conduct_experiment(experiment, options, keep_runs=keep, page=page)
        except Interrupted as error:
            return _interrupted(experiment, arguments, error.outcome)
        except StoppedShortError as error:
            out = error.directory
            return stopped_short(error.cause, out, _resuming(arguments, str(out)))
    if outcome.report_error is not None and not outcome.failed:
        return _report_failed(experiment, outcome, outcome.report_error)
    return _done(experiment, outcome)


def _check_options(arguments: Namespace) -> None:
    if arguments.resume and arguments.out is None:
        raise CosimError("--resume needs --out DIR, the directory of the experiment to go on with")
    if arguments.scheduler is not None and arguments.workers is not None:
        raise CosimError("--scheduler has workers of its own; leave --workers out")
    if arguments.hosts is not None and (arguments.scheduler or (arguments.workers or 1) > 1):
        given = "--workers" if arguments.scheduler is None else "--scheduler"
        raise CosimError(f"a host serves one run at a time; with --hosts leave {given} out")
    if arguments.workers is not None and arguments.workers < 1:
        raise CosimError(f"--workers must be at least 1, got {arguments.workers}")


def _options(arguments: Namespace, check: Callable[[], None]) -> Options:
    return Options(
        out=None if arguments.out is None else Path(arguments.out),
        pool=partial(local_pool, arguments.workers if arguments.hosts is None else 1, "experiment")
        if arguments.scheduler is None
        else partial(scheduled_workers, arguments.scheduler),
        resume=arguments.resume,
        progress=not arguments.quiet and sys.stderr.isatty(),
        command=_command(arguments, arguments.out),
        check=check,
    )


def _seeds(text: str) -> tuple[int, ...]:
    try:
        return seeds(int(text) if text.isdecimal() else text)
    except ValueError as error:
        raise CosimError(f"--seeds: {error}") from error


def _command(arguments: Namespace, out: str | None) -> str:
    """What decides on the results, and what has to be there; not how they are computed."""
    words = ["nlosim", "experiment", arguments.experiment]
    words += ["--seeds", arguments.seeds] if arguments.seeds is not None else []
    words += ["--hosts", arguments.hosts] if arguments.hosts is not None else []
    words += ["--out", out] if out is not None else []
    words += ["--private"] if arguments.private else []
    return shlex.join(words)


def _resuming(arguments: Namespace, out: str) -> str:
    """The command that goes on."""
    return f"{_command(arguments, out)} --resume"


def _data(experiment: Experiment, outcome: ExperimentOutcome) -> dict[str, Any]:
    failed = [
        {
            "seed": key.seed,
            **experiment.combinations[key.combination].levels,
            "message": message,
            "command": experiment.command(key),
        }
        for key, message in outcome.failed.items()
    ]
    return {
        "out": str(outcome.directory),
        "page": None if outcome.page is None else str(outcome.page),
        "runs": outcome.runs,
        "failed": failed,
        "units": dict(outcome.units),
        **({"remarks": list(experiment.remarks)} if experiment.remarks else {}),
        "tables": {**outcome.report.tables, "summary": outcome.summary},
    }


def _why_no_report(error: BaseException) -> str:
    known = isinstance(error, CosimError | ValueError | OSError)
    return f"the report cannot be made: {said(error) if known else in_words(error)}"


def _report_failed(
    experiment: Experiment, outcome: ExperimentOutcome, error: BaseException
) -> Outcome:
    """A report that says why it cannot be made is in its right, and a disk may be full."""
    message = f"{_why_no_report(error)}; the results are in {outcome.directory}"
    if isinstance(error, PluginError):
        failed = plugin_failed(error, None, message)
        details = {**_data(experiment, outcome), **failed.data["error"]}
        return replace(failed, data={"error": details})
    if isinstance(error, CosimError | ValueError | OSError):
        data = _data(experiment, outcome)
        return failure("report", Exit.WRONG_INPUT, message, **data)
    return bug(message, error, None)


def _interrupted(
    experiment: Experiment, arguments: Namespace, outcome: ExperimentOutcome
) -> Outcome:
    out, total = outcome.directory, len(experiment.runs())
    text = f"interrupted after {outcome.runs} of {total} runs; they are in {out}\n"
    if outcome.report_error is not None:
        text += f"{_why_no_report(outcome.report_error)}\n"
    text += f"go on with: {_resuming(arguments, str(out))}"
    return failure(
        "interrupted", Exit.INTERRUPTED, "interrupted", text=text, **_data(experiment, outcome)
    )


def _done(experiment: Experiment, outcome: ExperimentOutcome) -> Outcome:
    lines = [*_table(experiment, outcome), ""]
    if outcome.report.text:
        lines += [outcome.report.text.rstrip(), ""]
    for key, message in outcome.failed.items():
        lines += [f"failed twice: {experiment.name(key)}: {message}"]
        lines += [f"  repeat it with: {experiment.command(key)}"]
    if outcome.report_error is not None:
        lines += [_why_no_report(outcome.report_error)]
    lines += [f"{remark} (a remark)" for remark in experiment.remarks]
    lines += [f"{outcome.runs} runs, {len(outcome.failed)} failed; in {outcome.directory}"]
    if outcome.page is not None:
        lines += [f"to look at   {outcome.page}"]
    return Outcome(
        text="\n".join(lines),
        data=_data(experiment, outcome),
        exit_code=Exit.COMPONENT_FAILED if outcome.failed else Exit.DONE,
    )


def _table(experiment: Experiment, outcome: ExperimentOutcome) -> list[str]:
    """Means or shares with their intervals of 95 %."""
    body = [
        [*(str(row[name]) for name in (*experiment.factors, "n")), *_cells(experiment, row)]
        for row in outcome.summary
    ]
    metrics = [
        f"{name} [{outcome.units[name]}]" if name in outcome.units else name
        for name in experiment.metrics
    ]
    return tables.text(tables.left(*experiment.factors, "n", *metrics), body)


def _cells(experiment: Experiment, row: dict[str, Any]) -> list[str]:
    cells = []
    for name in experiment.metrics:
        value, low, high = (row[key] for key in (name, f"{name}_low", f"{name}_high"))
        if value is None:
            cells.append("-")
        else:
            cells.append(f"{value:.4g}" if low is None else f"{value:.4g} [{low:.4g}, {high:.4g}]")
    return cells
