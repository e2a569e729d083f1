"""Checkpoints on disk: each is a file that is there as a whole or not at all.

checkpoints/run.json            how the run was asked for
checkpoints/<time in ns>.state  a checkpoint: magic, SHA-256 of what follows, and that: one
                                frame of Zstandard with packed values (`orchestrator.packing`)
checkpoints/<component>.steps   what a component was asked to do (`orchestrator.resuming.steps`)
"""

import hashlib
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from orchestrator.disk import naming
from orchestrator.packing import PackingError, packed, unpacked
from orchestrator.recording.layout import RecordingError
from orchestrator.timebase import Time
from orchestrator.zstd import Compressor, ZstdError, decompressed

FOLDER: Final = "checkpoints"
SETTINGS: Final = f"{FOLDER}/run.json"

_MAGIC: Final = b"nlosim checkpoint 1\n"
_DIGEST: Final = 32
_KEPT: Final = 2
"""So many of them stay: should the newest be damaged, there is the one before."""


_WINDOW_LOG: Final = 25
"""What several components hold, such as points that one makes and another reads, is there once."""


class CheckpointError(RecordingError):
    """A checkpoint is damaged. Exit code 2."""


def checkpoints_of(directory: Path) -> tuple[Path, ...]:
    """The files of the checkpoints in a run directory, newest first."""
    found = [each for each in (directory / FOLDER).glob("*.state") if each.stem.isdecimal()]
    return tuple(sorted(found, key=lambda each: -int(each.stem)))


def write_checkpoint(directory: Path, t: Time, content: Mapping[str, Any]) -> int:
    """Write the checkpoint of the time `t` [ns]; older ones but one go when it is on disk.

    Returns:
        Its size [byte].

    Raises:
        OSError: it cannot be written; it names the file. Those before are still there.
    """
    path = directory / FOLDER / f"{t}.state"
    data = Compressor(1, window_log=_WINDOW_LOG).frame(packed(content))
    draft = path.with_suffix(".draft")
    try:
        with naming(path):
            with draft.open("wb") as file:
                file.write(_MAGIC + hashlib.sha256(data).digest() + data)
                file.flush()
                os.fsync(file.fileno())
            draft.replace(path)
            _settle(path.parent)
    except OSError:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        raise
    for old in checkpoints_of(directory)[_KEPT:]:
        old.unlink()
    return len(data)


def read_checkpoint(path: Path) -> Any:
    """What `write_checkpoint` wrote.

    Raises:
        CheckpointError: it is damaged, or of another version.
    """
    content = path.read_bytes()
    start = len(_MAGIC) + _DIGEST
    data = content[start:]
    if content[: len(_MAGIC)] != _MAGIC:
        raise CheckpointError(f"`{path}` is no checkpoint of this version")
    if hashlib.sha256(data).digest() != content[len(_MAGIC) : start]:
        raise CheckpointError(f"`{path}` is damaged: its checksum is another one")
    try:
        return unpacked(decompressed(data))
    except (PackingError, ZstdError) as error:
        raise CheckpointError(f"`{path}` is damaged: {error}") from error


def _settle(folder: Path) -> None:
    """Let what was renamed in `folder` be on disk, where the system can say so."""
    if os.name != "posix":
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)
