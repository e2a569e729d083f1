"""Going on with a run that was cut off, to the same end as if it had not been."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from orchestrator.hosts_file import read_hosts
from orchestrator.manifest import distributions
from orchestrator.observer import Observer
from orchestrator.placement import on_hosts
from orchestrator.provenance import versions
from orchestrator.resuming.changes import check_places, check_unchanged
from orchestrator.resuming.continuation import Continuation, continuation_of, manifest_of, told
from orchestrator.run import no_line, run_scenario, to_nobody
from orchestrator.run_outcome import RunOutcome
from orchestrator.scenario.build import load_scenario


def unfinished(
    directory: Path, *, from_start: bool = False
) -> tuple[Continuation | None, dict[str, Any]]:
    """Where the run in `directory` can be gone on with, `None` if it is done; and its manifest.

    Args:
        directory: of the run.
        from_start: leave checkpoints alone.

    Raises:
        RecordingError: there is no run that could be gone on with.
    """
    manifest = manifest_of(directory)
    if manifest.get("status") == "done":
        return None, manifest
    return continuation_of(directory, manifest, from_start=from_start), manifest


def go_on(
    continuation: Continuation,
    manifest: dict[str, Any],
    *,
    transport: str | None = None,
    hosts: Path | None = None,
    figure: bool = True,
    page: bool = True,
    tell: Callable[[str], None] = no_line,
    observers: Sequence[Observer] = (),
    echo_warnings: bool = False,
    announce: Callable[[Path], None] = to_nobody,
) -> RunOutcome:
    """Go on with a run in its directory; what it comes to is what it would have come to.

    Args:
        continuation: as `unfinished` found it.
        manifest: of the run.
        transport: in place of that of the run; the results do not depend on it.
        hosts: a hosts file in place of that of the run.
        figure: whether report and measures draw, if the run was to.
        page: whether `index.html` is written, if the run was to.
        tell: is called with each line of what there is to say before.
        observers: watch the run from there on.
        echo_warnings: whether what is logged as a warning appears on standard error, too.
        announce: called with the directory before anything is simulated.

    Raises:
        ChangedError: the scenario, a file or a version is not what it was.
        ScenarioError, RunFailedError, RunInterrupted: as `run_scenario`.
    """
    scenario = load_scenario(Path(manifest["scenario_file"]), manifest["overrides"])
    settings = continuation.settings
    file = settings.hosts if hosts is None else hosts
    given = None if file is None else read_hosts(file)
    installed = versions(distributions(scenario, manifest["transport"]))
    away = on_hosts(scenario, given)
    check_places(manifest.get("hosts", {}), away)
    check_unchanged(scenario, manifest, installed, without=away)
    for line in told(continuation):
        tell(line)
    is_same = transport in {None, settings.transport}  # else others may be in this process
    return run_scenario(
        scenario,
        continuation.directory,
        transport=settings.transport if transport is None else transport,
        hosts=given,
        tell=tell,
        observers=observers,
        echo_warnings=echo_warnings,
        figure=settings.figure and figure,
        page=settings.page and page,
        default_measures=settings.default_measures,
        announce=announce,
        checkpoint=settings.every,
        continuation=replace(continuation, compiled=is_same or continuation.found is None),
    )
