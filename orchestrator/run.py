"""One run of a scenario, in a directory of its own.

manifest.json   the resolved scenario, the order of turns, versions, digests of the files that
                components read, host, how the run ended and where the time went
signals/        the recording; see `orchestrator.recording.layout`
metrics.json    what the scenario's report and measures found in it
measures/       tables of measures
measures.svg    their page of panels
figure.png      the report's figure
index.html      all of it to look at, in a browser
log.txt         what components and the orchestrator logged
checkpoints/    from where it can be gone on with, until it is done
"""

import logging
import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from orchestrator.checkpoints import NO_CHECKPOINTS, Checkpoints
from orchestrator.errors import CosimError, defects, in_words
from orchestrator.findings import NotAnsweredError, make_report
from orchestrator.hosts_file import Hosts
from orchestrator.known_numbers import checks
from orchestrator.last_call import LastCall, noting
from orchestrator.log import run_log
from orchestrator.manifest import manifest_of, private_wording
from orchestrator.observer import Observer
from orchestrator.output_files import FileWritingComponent
from orchestrator.page.page import make_page
from orchestrator.placement import on_hosts, placement, placing
from orchestrator.questions import Questions
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.resuming.changes import check_hosts
from orchestrator.resuming.continuation import Continuation, Settings, told
from orchestrator.resuming.files import FOLDER
from orchestrator.resuming.keeper import Keeper
from orchestrator.run_directory import claim_directory, new_directory
from orchestrator.run_outcome import ReportFailedError, RunFailedError, RunInterrupted, RunOutcome
from orchestrator.scenario.cautions import cautions
from orchestrator.scenario.inputs import check_inputs
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import Assembly, assemble
from orchestrator.scratch import sweep
from orchestrator.simulation import simulate
from orchestrator.timebase import Duration, seconds
from orchestrator.wording import Openly, Wording

logger = logging.getLogger(__name__)


def to_nobody(directory: Path) -> None:
    """Nobody wants to know the directory of a run."""
    del directory


def no_line(line: str) -> None:
    """Nobody wants to read that."""
    del line


def run_scenario(
    scenario: Scenario,
    directory: Path | None = None,
    *,
    transport: str | None = None,
    hosts: Hosts | None = None,
    tell: Callable[[str], None] = no_line,
    observers: Sequence[Observer] = (),
    echo_warnings: bool = False,
    figure: bool = True,
    page: bool = False,
    default_measures: bool = False,
    announce: Callable[[Path], None] = to_nobody,
    checkpoint: Duration | None = None,
    continuation: Continuation | None = None,
    private: bool = False,
    more: Mapping[str, Any] | None = None,
) -> RunOutcome:
    """Run `scenario` and write everything about it to a directory.

    Temporary folders of processes that were killed are removed first.

    Args:
        scenario: as `load_scenario` returns it.
        directory: empty or to be created; by default `runs/<scenario>-<seed>`, numbered.
        transport: how components marked `process` are reached, see `orchestrator.placement`;
            `None`: those that are marked so always are in processes of their own.
        hosts: where the hosts are that the scenario names; `None`: their components run here.
        tell: is called with a line whenever hosts are waited for.
        observers: watch the run, after the recorder.
        echo_warnings: whether what is logged as a warning appears on standard error, too.
        figure: whether report and measures draw.
        page: whether `index.html` is written, to look at the run in a browser.
        default_measures: whether a scenario that does not speak of measures asks all whose signals
            are recorded, as `nlosim run` does.
        announce: called with the directory once it is there, before anything is simulated.
        checkpoint: simulated time between two checkpoints, at least [ns]; `None`: there are none.
        continuation: a run of `scenario` that is gone on with, in its directory.
        private: whether the files of the run say nothing of this host and its folders.
        more: what its manifest says beside what it always does.

    Raises:
        ScenarioError: the components do not fit together, or files that they read are wrong. No
            directory was created.
        RecordingError: the directory cannot be used.
        RunFailedError: the run ended early.
        ReportFailedError: the run is complete, but its report failed.
        RunInterrupted: something raised `KeyboardInterrupt`; the run was ended in good order.
    """
    sweep()
    remarks = check_inputs(scenario, thorough=False, without=on_hosts(scenario, hosts))
    placed = placement(transport, scenario, hosts)
    scenario = replace(scenario, remarks=(*scenario.remarks, *remarks, *placed.remarks))
    with placing(placed, tell) as places:
        if continuation is not None:
            check_hosts(continuation.hosts, places.found)
        assembly = assemble(scenario, places.create)
        scenario = replace(scenario, remarks=(*scenario.remarks, *assembly.remarks))
        try:
            if continuation is not None:
                directory = continuation.directory
                continuation.clear()
            elif directory is None:
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
        asking = Settings(
            every=checkpoint,
            transport=transport,
            figure=figure,
            page=page,
            hosts=None if hosts is None else hosts.path.absolute(),
            default_measures=default_measures,
        )
        wording = private_wording(scenario, whole) if private else Openly()
        manifest = manifest_of(
            scenario,
            assembly.turns,
            placed,
            found=places.found,
            asked=asking,
            wording=wording,
        )
        manifest |= more or {}
        if continuation is not None:
            manifest["created"] = continuation.created
        try:
            with (
                _staying(),
                run_log(whole, echo=echo_warnings, wording=wording),
                noting(whole, tuple(assembly.system.components)) as last_call,
            ):
                outcome = _run(
                    scenario,
                    assembly,
                    whole,
                    observers,
                    manifest=manifest,
                    wording=wording,
                    asking=asking,
                    continuation=continuation,
                    last_call=last_call,
                )
        except (RunFailedError, RunInterrupted) as error:
            error.directory = directory
            raise
        shown = None if outcome.page is None else directory / outcome.page.name
        return replace(outcome, directory=directory, page=shown)


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
    observers: Sequence[Observer],
    *,
    manifest: Mapping[str, Any],
    wording: Wording,
    asking: Settings,
    continuation: Continuation | None,
    last_call: LastCall,
) -> RunOutcome:
    """Simulate, record and report; the log is open."""
    asked = scenario.asked(every_run=asking.default_measures)
    recorder = Recorder(
        directory,
        include=scenario.include,
        exclude=scenario.exclude,
        manifest=manifest,
        wording=wording,
        again=None if continuation is None else continuation.again,
    )
    checkpoints = _checkpoints(directory, asking, recorder, continuation)
    is_begun = continuation is not None and continuation.found is not None
    before = Recording(directory) if is_begun else None
    logger.info("running %s with seed %d", scenario.path, scenario.seed)
    for remark in scenario.remarks:
        logger.warning("%s", remark)
    for caution in cautions(scenario):
        logger.info("biased: %s", caution)
    try:
        result = simulate(
            assembly.system,
            assembly.algorithm,
            start=scenario.start,
            stop=scenario.stop,
            seed=scenario.seed,
            observers=(recorder, *checks(assembly.system, before), *observers),
            until=scenario.until,
            compiled=continuation is None or continuation.compiled,
            last_call=last_call,
            checkpoints=checkpoints,
        )
    except BaseException as error:
        logger.info("the run ended early: %r", error, exc_info=error)
        if isinstance(error, KeyboardInterrupt):
            _report_anyway(scenario.asked(every_run=False), directory)
            raise RunInterrupted(directory) from error
        _report_anyway(asked, directory)
        reason = str(error) if isinstance(error, CosimError) else in_words(error)
        raise RunFailedError(reason, directory) from error
    last_call.nobody()
    if result.early_end is not None:
        logger.info("%s", result.early_end.text)
    logger.info("done; fingerprint %s", recorder.fingerprint)
    shutil.rmtree(directory / FOLDER, ignore_errors=True)
    try:
        findings = make_report(asked, directory, figure=asking.figure)
    except NotAnsweredError as error:
        logger.info("the report failed: %r", error, exc_info=error)
        if asking.page:
            _page(directory)
        message = f"the run is complete; its {error}"
        raise ReportFailedError(message, directory) from error
    except (CosimError, OSError) as error:
        message = f"the run is complete; its report failed: {in_words(error)}"
        raise ReportFailedError(message, directory) from error
    shown = _page(directory) if asking.page else None
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
        page=shown,
        cautions=cautions(scenario),
    )


def _checkpoints(
    directory: Path, asking: Settings, recorder: Recorder, continuation: Continuation | None
) -> Checkpoints:
    """Where the run begins, and what it writes to be gone on with."""
    for line in [] if continuation is None else told(continuation):
        logger.info("%s", line)
    if asking.every is None:
        return NO_CHECKPOINTS
    asking.write(directory)
    found = None if continuation is None else continuation.found
    return Keeper(directory, asking.every, recorder, found)


def _page(directory: Path) -> Path:
    """Write the page; the run is complete without it."""
    try:
        return make_page(directory)
    except defects() as error:  # what is recorded may be of plug-ins
        logger.info("the page failed: %r", error, exc_info=error)
        message = f"the run is complete; its page failed: {in_words(error)}"
        raise ReportFailedError(message, directory) from error


def _report_anyway(asked: Questions, directory: Path) -> None:
    """Metrics of what there is; what ended the run matters more than a report that fails.

    The figure can wait for `nlosim report`: whoever watches wants to know why it ended. So can,
    where he ended it himself, all that the scenario does not ask for.
    """
    try:
        make_report(asked, directory, figure=False)
    except defects() as error:
        logger.info("no report of the truncated recording: %r", error)
