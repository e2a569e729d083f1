"""One run of a scenario, in a directory of its own.

manifest.json   the resolved scenario, the order of turns, versions, digests of the files that
                components read, host, how the run ended and where the time went
signals/        the recording; see `orchestrator.recording.layout`
metrics.json    what the scenario's report and measures found in it
measures/       tables of measures
measures.svg    their page of panels
figure.png      the report's figure
log.txt         what components and the orchestrator logged
"""

import itertools
import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from orchestrator.early_end import EarlyEnd
from orchestrator.errors import CosimError
from orchestrator.findings import make_report
from orchestrator.last_call import LastCall, noting
from orchestrator.log import run_log
from orchestrator.observer import Observer, WallTime
from orchestrator.output_files import FileWritingComponent
from orchestrator.placement import placement, placing
from orchestrator.provenance import provenance
from orchestrator.questions import Questions
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.recorder import Recorder
from orchestrator.scenario.inputs import check_inputs, digests
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import Assembly, assemble
from orchestrator.simulation import simulate
from orchestrator.timebase import seconds

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOutcome:
    """A run that came to its end.

    Attributes:
        directory: of the run.
        fingerprint: of everything that was recorded.
        simulated: simulated time [s].
        wall_time: where the time of the simulation went.
        speed: simulated seconds per second of wall time.
        metrics: of the scenario's report; empty without one.
        summary: the report's lines for the terminal; empty without one.
        recorded: what each recorded signal takes on disk [byte], largest first.
        early_end: why it ended before its stop time; `None` if it did not.
        coupling: what the coupling algorithm counted; empty if it counts nothing.
    """

    directory: Path
    fingerprint: str
    simulated: float
    wall_time: WallTime
    speed: float
    metrics: Mapping[str, Any]
    summary: str
    recorded: Mapping[str, int]
    early_end: EarlyEnd | None = None
    coupling: Mapping[str, int] = field(default_factory=dict)


class RunFailedError(CosimError):
    """A run ended early; the cause is chained.

    Attributes:
        directory: what was recorded until then can be read there.
    """

    def __init__(self, message: str, directory: Path) -> None:
        super().__init__(message)
        self.directory = directory


class ReportFailedError(RunFailedError):
    """The run is complete; its report is at fault."""


class RunInterrupted(KeyboardInterrupt):
    """A run was interrupted from outside.

    Attributes:
        directory: what was recorded until then can be read there.
    """

    def __init__(self, directory: Path) -> None:
        super().__init__("interrupted")
        self.directory = directory


def new_directory(parent: Path, name: str) -> Path:
    """Create a directory called `name`, or `name-2`, `name-3`, ... if that exists."""
    for number in itertools.count(1):
        directory = parent / (name if number == 1 else f"{name}-{number}")
        try:
            directory.mkdir(parents=True)
        except FileExistsError:
            continue
        return directory
    raise AssertionError  # count() does not end


def claim_directory(directory: Path) -> Path:
    """Create `directory`, or take it if it is empty.

    Raises:
        RecordingError: there is something in it, or it cannot be created.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        is_empty = not any(directory.iterdir())
    except OSError as error:
        raise RecordingError(f"`{directory}` cannot be created: {error.strerror}") from error
    if not is_empty:
        raise RecordingError(f"`{directory}` is not empty; choose another directory")
    return directory


def _to_nobody(directory: Path) -> None:
    del directory


def run_scenario(
    scenario: Scenario,
    directory: Path | None = None,
    *,
    transport: str | None = None,
    observers: Sequence[Observer] = (),
    echo_warnings: bool = False,
    figure: bool = True,
    default_measures: bool = False,
    announce: Callable[[Path], None] = _to_nobody,
) -> RunOutcome:
    """Run `scenario` and write everything about it to a directory.

    Args:
        scenario: as `load_scenario` returns it.
        directory: empty or to be created; by default `runs/<scenario>-<seed>`, numbered.
        transport: how components marked `process` are reached, see `orchestrator.placement`;
            `None`: those that are marked so always are in processes of their own.
        observers: watch the run, after the recorder.
        echo_warnings: whether what is logged as a warning appears on standard error, too.
        figure: whether report and measures draw.
        default_measures: whether a scenario that does not speak of measures asks all whose signals
            are recorded, as `nlosim run` does.
        announce: called with the directory once it is there, before anything is simulated.

    Raises:
        ScenarioError: the components do not fit together, or files that they read are wrong. No
            directory was created.
        RecordingError: the directory cannot be used.
        RunFailedError: the run ended early.
        ReportFailedError: the run is complete, but its report failed.
        RunInterrupted: something raised `KeyboardInterrupt`; the run was ended in good order.
    """
    remarks = check_inputs(scenario, thorough=False)
    placed = placement(transport, scenario)
    scenario = replace(scenario, remarks=(*scenario.remarks, *remarks, *placed.remarks))
    with placing(placed) as place:
        assembly = assemble(scenario, place)
        scenario = replace(scenario, remarks=(*scenario.remarks, *assembly.remarks))
        try:
            if directory is None:
                directory = new_directory(Path("runs"), f"{scenario.name}-{scenario.seed}")
            else:
                directory = claim_directory(directory)
        except BaseException:
            assembly.close()
            raise
        announce(directory)
        whole = directory.absolute()  # a component may change the working directory
        for component in assembly.system.components.values():
            if isinstance(component, FileWritingComponent):
                component.write_into(whole)
        try:
            with (
                _staying(),
                run_log(whole, echo=echo_warnings),
                noting(whole, tuple(assembly.system.components)) as last_call,
            ):
                outcome = _run(
                    scenario,
                    assembly,
                    whole,
                    placed.transport,
                    observers,
                    asked=scenario.asked(every_run=default_measures),
                    figure=figure,
                    last_call=last_call,
                )
        except (RunFailedError, RunInterrupted) as error:
            error.directory = directory
            raise
        return replace(outcome, directory=directory)


@contextmanager
def _staying() -> Iterator[None]:
    """Be in the same working directory after the block, whatever components do to it."""
    here = Path.cwd()
    try:
        yield
    finally:
        os.chdir(here)


def _run(
    scenario: Scenario,
    assembly: Assembly,
    directory: Path,
    transport: str,
    observers: Sequence[Observer],
    *,
    asked: Questions,
    figure: bool,
    last_call: LastCall,
) -> RunOutcome:
    """Simulate, record and report; the log is open."""
    recorder = Recorder(
        directory,
        include=scenario.include,
        exclude=scenario.exclude,
        manifest=_manifest(scenario, assembly.turns, transport),
    )
    logger.info("running %s with seed %d", scenario.path, scenario.seed)
    for remark in scenario.remarks:
        logger.warning("%s", remark)
    try:
        result = simulate(
            assembly.system,
            assembly.algorithm,
            start=scenario.start,
            stop=scenario.stop,
            seed=scenario.seed,
            observers=(recorder, *observers),
            until=scenario.until,
            last_call=last_call,
        )
    except BaseException as error:
        logger.info("the run ended early: %r", error, exc_info=error)
        _report_anyway(asked, directory)
        if isinstance(error, KeyboardInterrupt):
            raise RunInterrupted(directory) from error
        raise RunFailedError(str(error), directory) from error
    last_call.nobody()
    if result.early_end is not None:
        logger.info("%s", result.early_end.text)
    logger.info("done; fingerprint %s", recorder.fingerprint)
    try:
        findings = make_report(asked, directory, figure=figure)
    except Exception as error:  # a report is a plug-in and may raise anything
        logger.info("the report failed: %r", error, exc_info=error)
        reason = f"{type(error).__name__}: {error}"
        what = (getattr(error, "__notes__", None) or [f"report `{_name(scenario)}`"])[0]
        message = f"the run is complete; its {what} failed: {reason}"
        raise ReportFailedError(message, directory) from error
    return RunOutcome(
        directory=directory,
        fingerprint=recorder.fingerprint,
        simulated=seconds(result.time - result.start),
        wall_time=result.wall_time,
        speed=result.speed,
        metrics=findings.metrics,
        summary=findings.summary,
        recorded=recorder.sizes,
        early_end=result.early_end,
        coupling=result.coupling,
    )


def _manifest(scenario: Scenario, turns: Sequence[str], transport: str) -> Mapping[str, Any]:
    return {
        **provenance(),
        "scenario_file": str(scenario.path.absolute()),
        "overrides": list(scenario.overrides),
        "seed": scenario.seed,
        "transport": transport,
        "turns": list(turns),
        "files": digests(scenario),
        "scenario": scenario.resolved(),
    }


def _name(scenario: Scenario) -> str | None:
    return None if scenario.report is None else scenario.report.type_name


def _report_anyway(asked: Questions, directory: Path) -> None:
    """Metrics of what there is; what ended the run matters more than a report that fails.

    The figure can wait for `nlosim report`: whoever watches wants to know why it ended.
    """
    try:
        make_report(asked, directory, figure=False)
    except Exception as error:
        logger.info("no report of the truncated recording: %r", error)
