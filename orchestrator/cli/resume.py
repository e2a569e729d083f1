"""`nlosim resume`."""

from argparse import Namespace
from dataclasses import replace
from pathlib import Path

from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Outcome
from orchestrator.cli.run import success, to_nobody, unsuccessful
from orchestrator.cli.streams import tell_line
from orchestrator.cli.watch import WATCH
from orchestrator.observer import NoProgress, progress_meter
from orchestrator.resume import go_on, unfinished
from orchestrator.resuming.continuation import told
from orchestrator.run_outcome import RunFailedError, RunInterrupted


def execute(arguments: Namespace) -> Outcome:
    """Go on with a run, if it is not done."""
    directory = Path(arguments.directory)
    meter = NoProgress() if arguments.quiet else progress_meter()
    with stopping() as stop:
        continuation, manifest = unfinished(directory, from_start=arguments.from_start)
        if continuation is None:
            fingerprint = manifest.get("fingerprint")
            text = f"{directory}: the run is done; there is nothing to resume"
            data = {"out": str(directory), "fingerprint": fingerprint, "resumed_at_s": None}
            return Outcome(text=f"{text}\nfingerprint  {fingerprint}", data=data)
        stop.check()
        try:
            outcome = go_on(
                continuation,
                manifest,
                transport=arguments.transport,
                hosts=None if arguments.hosts is None else Path(arguments.hosts),
                figure=not arguments.no_figure,
                page=not (arguments.no_page or arguments.no_figure),
                tell=to_nobody if arguments.quiet else tell_line,
                observers=(meter, stop),
                echo_warnings=not arguments.quiet,
                announce=WATCH.begin,
            )
        except (RunInterrupted, RunFailedError) as error:
            return unsuccessful(error)
    said = list(told(continuation))
    found = success(outcome)
    at = 0.0 if continuation.time is None else continuation.time / 1e9
    data = {**found.data, "resumed_at_s": at, "resumed": said}
    untold = [*said, ""] if arguments.quiet else []  # otherwise it was told at the beginning
    return replace(found, text="\n".join([*untold, found.text]), data=data)
