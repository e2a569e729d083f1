"""What every export is given and gives back."""

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording
from studies.exports.outputs import ExportError


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What is to be exported.

    Attributes:
        recording: of the run.
        directory: of the run.
        signals: patterns of the signals of tables; none: all.
        is_geographic: whether positions are to be longitude and latitude.
    """

    recording: Recording
    directory: Path
    signals: Sequence[str] = ()
    is_geographic: bool = False

    @property
    def manifest(self) -> dict[str, Any]:
        """What was run."""
        return self.recording.manifest

    @property
    def name(self) -> str:
        """What the run is called."""
        return self.directory.resolve().name


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """What came of an export.

    Attributes:
        files: that were written, relative to the output if that is a folder, with how much each
            holds, for people.
        left_out: what is not in them, and why; a sentence each.
        more: further numbers, by name.
    """

    files: dict[str, str]
    left_out: Sequence[str] = ()
    more: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Format:
    """A format.

    Attributes:
        suffix: of the output beneath `export`; a folder of this name if it has no dot.
        write: writes a draft at a path, and says what is in it.
        check: says what is missing for it before anything is read.
    """

    suffix: str
    write: Callable[[Asked, Path], Exported]
    check: Callable[[], None] = lambda: None


def described(asked: Asked) -> dict[str, str]:
    """What was run, as pairs of text."""
    try:
        manifest = asked.manifest
    except RecordingError:
        return {"run": asked.name}
    said = {
        "run": asked.name,
        "title": manifest.get("scenario", {}).get("title"),
        "seed": manifest.get("seed"),
        "status": manifest.get("status"),
        "fingerprint": manifest.get("fingerprint"),
    }
    return {key: str(value) for key, value in said.items() if value is not None}


def module_for(module: str, what: str, extra: str) -> ModuleType:
    """A module that comes with an extra of this package.

    Args:
        module: to import.
        what: needs it.
        extra: with which it comes.

    Raises:
        ExportError: it is not installed, or cannot be imported.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        is_absent = isinstance(error, ModuleNotFoundError) and error.name == package
        why = "which is not installed" if is_absent else f"which cannot be loaded ({error})"
        raise ExportError(
            f"{what} needs `{package}`, {why}: pip install 'nlosim[{extra}]'"
        ) from None
