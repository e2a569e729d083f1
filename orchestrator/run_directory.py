"""Directories for runs: a new one, or one that is empty."""

import itertools
from pathlib import Path

from orchestrator.recording.layout import RecordingError


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
