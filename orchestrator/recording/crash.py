"""Runs that were cut off: what their directories say of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from orchestrator.last_call import FILE, CutOff, cut_off
from orchestrator.recording.layout import MANIFEST, read_json, write_manifest

CRASHED: Final = "crashed"
"""The status of such a run."""


@dataclass(frozen=True, slots=True)
class Crash:
    """The end of a run that was cut off.

    Attributes:
        last: what it did last.
        text: that, and how the process ended, if that is known.
    """

    last: CutOff
    text: str


def crash_of(directory: Path, how: str = "", what: str = "crash") -> Crash | None:
    """How the run in `directory` was cut off; `None` if it was not.

    Args:
        directory: of the run.
        how: its process ended, if that is known.
        what: cut it off, if that is known.
    """
    last = cut_off(directory)
    if last is None:
        return None
    if how:
        return Crash(last, f"{what} in process: {last} ({how})")
    return Crash(last, f"the run was cut off, by a crash or from outside: {last}")


def is_crash(manifest: Mapping[str, Any]) -> bool:
    """Whether the manifest is that of a run that was cut off."""
    return bool(manifest.get("status") == CRASHED)


def as_ended(directory: Path, manifest: dict[str, Any]) -> dict[str, Any]:
    """The manifest of the run in `directory`, with its end if the run could not write it."""
    crash = crash_of(directory) if manifest.get("status") == "running" else None
    return manifest if crash is None else {**manifest, **_said(crash)}


def _said(crash: Crash) -> dict[str, Any]:
    return {"status": CRASHED, "error": crash.text, "reached_ns": crash.last.time}


def conclude(directory: Path, how: str, what: str) -> Crash | None:
    """Say in the manifest of a run how it was cut off; `None` if it was not.

    Args:
        directory: of the run.
        how: its process ended.
        what: cut it off, a `crash` or a `hang`.
    """
    crash = crash_of(directory, how, what)
    path = directory / MANIFEST
    if crash is not None and path.is_file():
        write_manifest(directory, {**read_json(path), **_said(crash)})
    if crash is not None:
        (directory / FILE).unlink(missing_ok=True)
    return crash
