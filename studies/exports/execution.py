"""From the arguments of `nlosim export` to its outcome."""

from argparse import Namespace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Final

from orchestrator.cli.outcome import Outcome
from orchestrator.recording.crash import CRASHED
from orchestrator.recording.layout import INDEX, RecordingError
from orchestrator.recording.reader import Recording
from orchestrator.timebase import seconds
from studies.exports.export import Asked, Exported, Format
from studies.exports.outputs import ExportError, refuse_existing, written_whole

_MODULES: Final = {
    "csv": "tables",
    "parquet": "tables",
    "fcd": "fcd",
    "mcap": "mcap",
    "rerun": "rrd",
    "osi": "osi",
}
"""Where the format of each name is, as `FORMATS[name]`."""

_FOLDER: Final = "export"
"""Where exports are in the directory of a run."""


def execute(arguments: Namespace) -> Outcome:
    """Write a run in a format."""
    name: str = arguments.format
    if arguments.signals and name not in ("csv", "parquet"):
        raise ExportError(f"--signal chooses among tables; --{name} has none: leave it out")
    if arguments.geo and name != "fcd":
        raise ExportError(f"--geo is about --fcd; leave it out with --{name}")
    format_: Format = import_module(f"studies.exports.{_MODULES[name]}").FORMATS[name]
    format_.check()
    directory: Path = arguments.directory
    asked = Asked(
        recording=opened(directory),
        directory=directory,
        signals=arguments.signals,
        is_geographic=arguments.geo,
    )
    out = arguments.out or directory / _FOLDER / _named(asked.name, format_.suffix)
    refuse_existing(out, force=arguments.force)
    status = partial(_unfinished, asked.recording)
    with written_whole(out) as draft:
        exported = format_.write(asked, draft)
    return _outcome(out, exported, status())


def opened(directory: Path) -> Recording:
    """The recording in the directory of a run.

    Raises:
        RecordingError: there is none.
        ExportError: it is the directory of an experiment.
    """
    if (directory / "experiment.json").exists() and not (directory / INDEX).exists():
        raise ExportError(
            f"`{directory}` is an experiment, not a run; export one of the runs in it that "
            "--keep-runs kept, or read its `runs.parquet`"
        )
    return Recording(directory)


def _named(run: str, suffix: str) -> str:
    return f"{run}{suffix}" if suffix.startswith(".") else suffix


def _unfinished(recording: Recording) -> list[str]:
    """That the run did not come to its end, if so."""
    try:
        manifest = recording.manifest
    except RecordingError as error:
        return [f"{error}; what was run is not known"]
    status, reached = manifest.get("status"), manifest.get("reached_ns")
    until = "" if reached is None else f" at {seconds(reached):g} s"
    if status == "running":
        return ["the run goes on; what it has recorded so far is exported"]
    if status == CRASHED:
        return [f"the run ended early{until}: {manifest.get('error')}"]
    if status in ("failed", "interrupted"):
        return [f"the run is {status}{until}; what it had recorded is exported"]
    return []


def _outcome(out: Path, exported: Exported, status: list[str]) -> Outcome:
    width = max((len(name) for name in exported.files), default=0)
    lines = [f"  {name:{width}}  {what}".rstrip() for name, what in exported.files.items()]
    remarks = [*status, *exported.left_out]
    text = "\n".join([*lines, *(f"note: {each}" for each in remarks), f"wrote {out}"])
    data = {
        "out": str(out),
        "files": list(exported.files),
        "left_out": list(exported.left_out),
        "notes": status,
        **exported.more,
    }
    return Outcome(text=text, data=data)
