"""`nlosim rerun`."""

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.interruption import stopping
from orchestrator.cli.outcome import Exit, Outcome, failure
from orchestrator.cli.run import to_nobody, unsuccessful
from orchestrator.cli.streams import tell_line
from orchestrator.cli.watch import WATCH
from orchestrator.observer import NoProgress, progress_meter
from orchestrator.recording.difference import Difference
from orchestrator.rerunning.repeat import Plan, Repeated, RerunError, planned, repeat
from orchestrator.run_outcome import RunFailedError, RunInterrupted

_NAMED: Final = 5
"""Signals that are named after the first."""


def execute(arguments: Namespace) -> Outcome:
    """Repeat a run, and compare."""
    directory = Path(arguments.directory)
    inputs = None if arguments.inputs is None else Path(arguments.inputs)
    meter = NoProgress() if arguments.quiet else progress_meter()
    with stopping() as stop:
        try:
            plan = planned(directory, inputs, anyway=arguments.anyway)
        except RerunError as error:
            return failure("rerun", Exit.WRONG_INPUT, str(error), reasons=list(error.reasons))
        stop.check()
        is_private = arguments.private or plan.is_private
        try:
            found = repeat(
                plan,
                None if arguments.out is None else Path(arguments.out),
                transport=arguments.transport,
                private=is_private,
                tell=to_nobody if arguments.quiet else tell_line,
                observers=(meter, stop),
                echo_warnings=not arguments.quiet,
                announce=partial(WATCH.begin, private=is_private),
            )
        except (RunInterrupted, RunFailedError) as error:
            return unsuccessful(error)
    return _said(plan, found)


def _said(plan: Plan, found: Repeated) -> Outcome:
    out = found.outcome.directory
    first = found.differing[0] if found.differing else None
    lines = [
        *_headline(found, first),
        *(f"not as it was: {each}" for each in (*plan.changed, *plan.versions)),
        f"fingerprint then  {found.fingerprint}",
        f"fingerprint now   {found.outcome.fingerprint}",
        f"recorded in       {out}",
    ]
    return Outcome(
        text="\n".join(lines),
        data={
            "equal": found.is_equal,
            "out": str(out),
            "fingerprint_then": found.fingerprint,
            "fingerprint": found.outcome.fingerprint,
            "first_difference": None if first is None else _document(first),
            "differing_signals": [each.signal for each in found.differing],
            "faults": list(found.faults),
            "changed_inputs": list(plan.changed),
            "changed_versions": list(plan.versions),
        },
        exit_code=Exit.DONE if found.is_equal else Exit.NOT_PASSED,
    )


def _headline(found: Repeated, first: Difference | None) -> list[str]:
    if found.is_equal:
        return ["the run is repeated: every byte that was recorded is the same"]
    if first is None:
        said = "the run comes out differently; where cannot be said of what is left of the first"
        return [said, *(f"  {fault}" for fault in found.faults)]
    rest = [f"`{each.signal}`" for each in found.differing[1 : _NAMED + 1]]
    more = len(found.differing) - 1 - len(rest)
    others = f"; then {', '.join(rest)}{f' and {more} more' if more else ''}" if rest else ""
    return [f"the run comes out differently: {first}{others}"]


def _document(first: Difference) -> dict[str, Any]:
    return {
        "signal": first.signal,
        "element": list(first.element),
        "time_ns": first.time,
        "then": first.then,
        "now": first.now,
    }
