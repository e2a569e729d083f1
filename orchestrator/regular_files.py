"""Files that users name, read with a bound: devices and pipes never end."""

import os
import stat
from pathlib import Path
from typing import Final

from orchestrator.errors import CosimError

_KINDS: Final = {
    stat.S_ISFIFO: "a pipe",
    stat.S_ISSOCK: "a socket",
    stat.S_ISCHR: "a device",
    stat.S_ISBLK: "a device",
}


class NoFileError(CosimError):
    """What a user names is no file, or more than can be meant. Exit code 2."""


def read_file(path: Path, maximum: int) -> bytes:
    """The content of a file.

    Args:
        path: of the file.
        maximum: bytes that it may have.

    Raises:
        OSError: it is not there, or cannot be read.
        NoFileError: it is a directory, a pipe or a device, or larger; the message says which.
    """
    kind = "a directory" if path.is_dir() else endless(path)
    if kind:
        raise NoFileError(f"it is {kind}, not a file")
    with path.open("rb") as file:
        content = file.read(maximum + 1)
    if len(content) > maximum:
        raise NoFileError(f"it has {path.stat().st_size} bytes; {maximum} are the most")
    return content


def why_no_file(path: Path) -> str:
    """Why a path that stands in a file names no file; empty if it names one."""
    kind = ""
    try:
        if path.is_file():
            return ""
        kind = endless(path)
    except (OSError, ValueError):  # nothing is there; it is too long, or has a null byte
        pass
    absolute = os.path.normpath(path.absolute())
    if kind:
        return f"{absolute} is {kind}, not a file"
    return f"there is no file {absolute} (the path is relative to this file)"


def endless(path: Path) -> str:
    """What there is at `path` that may never end, in words; empty if it is a file or a directory.

    Raises:
        OSError: there is nothing, or it cannot be asked.
    """
    mode = path.stat().st_mode
    return next((words for is_kind, words in _KINDS.items() if is_kind(mode)), "")
