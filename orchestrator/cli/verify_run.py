"""`nlosim verify run`, found by the entry point group `orchestrator.verifications`."""

import argparse
from pathlib import Path
from typing import Any, Final

from orchestrator.cli.command import command
from orchestrator.cli.outcome import Exit, Outcome

_EPILOG: Final = """\
Every file is read, every checksum compared, and the fingerprint of what is there with that in
manifest.json. A run that did not come to its end has none: then only damage is found. Exit codes:
  0  it is what the run recorded
  1  it is not; each damaged file is named, with the place
  2  there is no recording

examples:
  nlosim verify run runs/red_light-1
  nlosim verify run runs/red_light-1 --json"""


def add_unit(units: Any) -> None:
    """Add `run` to the subparsers of `nlosim verify`."""
    run = command(
        units,
        "run",
        "a recording against the fingerprint in its manifest",
        _EPILOG,
        description="Say whether a recording is, byte for byte, what the run recorded.",
        execute=execute,
    )
    run.add_argument("directory", type=Path, metavar="DIR", help="of a run")


def execute(arguments: argparse.Namespace) -> Outcome:
    """Read everything, and compare."""
    from orchestrator.recording.reader import Recording  # noqa: PLC0415 - NumPy takes a while

    directory: Path = arguments.directory
    recording = Recording(directory)
    faults = recording.faults()
    signals = len(recording.signals)
    if faults:
        return Outcome(
            text="\n".join(faults),
            data={"out": str(directory), "signals": signals, "faults": list(faults)},
            exit_code=Exit.NOT_PASSED,
        )
    expected = recording.manifest.get("fingerprint")
    said = (
        "no file is damaged; the run did not come to its end, so there is no fingerprint"
        if expected is None
        else f"no file is damaged, and the fingerprint is that of the manifest:\n{expected}"
    )
    return Outcome(
        text=f"{signals} signals: {said}",
        data={
            "out": str(directory),
            "signals": signals,
            "faults": [],
            "fingerprint": expected,
        },
    )
