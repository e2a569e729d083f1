"""The arguments of `nlosim resume`, and how far apart checkpoints are."""

import argparse
from typing import Any, Final

from orchestrator.cli.command import command

_RESUME: Final = """\
The run ends as if nobody had cut it off: with the same fingerprint, recording and metrics. It goes
on from its newest checkpoint that is sound (`nlosim run --checkpoint`); without one it is made
again from its start. Components that can save their state are restored, all others step again with
the inputs that they had. If the scenario, a file that it reads or a version is not what it was, the
command says what changed and does nothing. See docs/resuming.md.

examples:
  nlosim run red_light --checkpoint 10s --out long
  nlosim resume long"""


def interval(text: str) -> int:
    """A time between two checkpoints [ns].

    Raises:
        argparse.ArgumentTypeError: it is none.
    """
    from orchestrator.scenario.units import duration  # noqa: PLC0415 - takes a while

    try:
        found = duration(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    if found <= 0:
        raise argparse.ArgumentTypeError(f"{text} is not a time between two points, such as 10s")
    return found


def add_resume(commands: Any) -> argparse.ArgumentParser:
    """Add `resume` to the subparsers of the command line; its parser."""
    resume = command(commands, "resume", "go on with a run that was cut off", _RESUME)
    resume.add_argument("directory", metavar="DIR", help="of the run")
    resume.add_argument(
        "--transport", metavar="NAME", help="as of `nlosim run` (default: as the run was asked for)"
    )
    resume.add_argument(
        "--from-start", action="store_true", help="make all of the run again, whatever there is"
    )
    resume.add_argument(
        "--no-figure", action="store_true", help="draw nothing: no figures, and no index.html"
    )
    resume.add_argument("--no-page", action="store_true", help="do not write index.html")
    resume.add_argument("--quiet", action="store_true", help="no progress bar, no warnings")
    return resume
