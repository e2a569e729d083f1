"""`nlosim run`."""

from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path

from orchestrator.cli.failures import bug, outcome_of, plugin_failed
from orchestrator.cli.fitting import fitted
from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.streams import tell_line
from orchestrator.cli.watch import WATCH
from orchestrator.errors import CosimError
from orchestrator.findings import NotAnsweredError
from orchestrator.hosts_file import read_hosts
from orchestrator.observer import NoProgress, WallTime, progress_meter
from orchestrator.run import run_scenario
from orchestrator.run_outcome import ReportFailedError, RunFailedError, RunInterrupted, RunOutcome
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.installed import scenario_path
from orchestrator.tap.server import Tap


def execute(arguments: Namespace) -> Outcome:
    """Load, run, report."""
    if arguments.private and arguments.checkpoint is not None:
        raise CosimError(
            "--private leaves out where the scenario is, so nobody could go on from a checkpoint; "
            "leave --private or --checkpoint out"
        )
    overrides = list(arguments.overrides)
    if arguments.seed is not None:
        overrides.append(f"seed={arguments.seed}")
    meter = NoProgress() if arguments.quiet else progress_meter()
    with stopping() as stop, Tap() as tap:

        def announce(directory: Path) -> None:
            WATCH.begin(directory, private=arguments.private)
            if arguments.tap:
                tap.listen(directory)

        scenario = load_scenario(scenario_path(arguments.scenario), overrides)
        hosts = None if arguments.hosts is None else read_hosts(Path(arguments.hosts))
        stop.check()
        try:
            outcome = run_scenario(
                scenario,
                None if arguments.out is None else Path(arguments.out),
                transport=arguments.transport,
                hosts=hosts,
                tell=to_nobody if arguments.quiet else tell_line,
                observers=(meter, *([tap] if arguments.tap else []), stop),
                echo_warnings=not arguments.quiet,
                figure=not arguments.no_figure,
                page=not (arguments.no_page or arguments.no_figure),
                default_measures=True,
                announce=announce,
                checkpoint=arguments.checkpoint,
                private=arguments.private,
            )
        except (RunInterrupted, RunFailedError) as error:
            return unsuccessful(error)
    return success(outcome)


def unsuccessful(error: RunInterrupted | RunFailedError) -> Outcome:
    """What a command says of a run that did not come to its end, or whose report failed."""
    if isinstance(error, ReportFailedError):
        return _report_failed(error)
    cause = error if isinstance(error, RunInterrupted) else error.__cause__ or error
    return outcome_of(cause, error.directory)


def to_nobody(line: str) -> None:
    """Nobody wants to read that."""
    del line


def _report_failed(error: ReportFailedError) -> Outcome:
    """A report that says why it cannot be made is in its right, and a disk may be full."""
    cause = error.__cause__
    if isinstance(cause, NotAnsweredError) and not cause.says_why:
        return plugin_failed(cause, error.directory, str(error))
    if isinstance(cause, CosimError | OSError):
        out = str(error.directory)
        text = f"error: {error}\nrecorded in: {out}"
        return failure("report", Exit.WRONG_INPUT, str(error), text=text, out=out)
    return bug(str(error), error, error.directory)


def success(outcome: RunOutcome) -> Outcome:
    """What a command says of a run that is done."""
    wall, early = outcome.wall_time, outcome.early_end
    speed = f"{outcome.simulated:g} s simulated in {wall.total:.2f} s"
    speed += f" ({outcome.speed:.3g} simulated seconds per second)"
    lines = [
        *([outcome.summary.rstrip(), ""] if outcome.summary else []),
        *(f"biased       {caution}" for caution in outcome.cautions),
        *([] if early is None else [f"ended early: {early.text}"]),
        speed,
        *_time_table(wall),
        *_coupling(outcome.coupling),
        _recorded(outcome.recorded),
        f"fingerprint  {outcome.fingerprint}",
        f"recorded in  {outcome.directory}",
        *([] if outcome.page is None else [f"to look at   {outcome.page}"]),
    ]
    return Outcome(
        text=fitted("\n".join(lines)),
        data={
            "fingerprint": outcome.fingerprint,
            "out": str(outcome.directory),
            "page": None if outcome.page is None else str(outcome.page),
            "sim_seconds_per_wall_second": outcome.speed,
            "simulated_s": outcome.simulated,
            "ended_early": None if early is None else {"by": early.by, "why": early.text},
            "wall_s": wall.total,
            "wall_time_s": _shares(wall),
            "metrics": dict(outcome.metrics),
            "cautions": list(outcome.cautions),
            "recorded_bytes": dict(outcome.recorded),
            **({"coupling": dict(outcome.coupling)} if outcome.coupling else {}),
        },
    )


def _coupling(counts: Mapping[str, int]) -> list[str]:
    told = ", ".join(f"{name} {count}" for name, count in counts.items())
    return [f"coupling     {told}"] if told else []


def _recorded(sizes: Mapping[str, int]) -> str:
    """How large the recording is, and what to exclude for a smaller one."""
    total = sum(sizes.values())
    most = [f"{name} {size / 1e6:.1f} MB" for name, size in sizes.items() if size >= 5e4]
    named = f", most of it {', '.join(most[:3])}" if most else ""
    return f"recording    {total / 1e6:.1f} MB{named}"


def _shares(wall: WallTime) -> dict[str, float]:
    return {
        **wall.components,
        "(recording)": wall.observers,
        "(orchestrator)": wall.orchestrator,
    }


def _time_table(wall: WallTime) -> list[str]:
    """The time of each component, longest first."""
    total = max(wall.total, 1e-9)
    shares = sorted(_shares(wall).items(), key=lambda share: -share[1])
    width = max(len(name) for name, _ in shares)
    return [f"  {name:{width}}  {time:7.2f} s  {time / total:4.0%}" for name, time in shares]
