"""Recordings that are gone on with: what is on disk of a part, compared with what was there."""

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeAlias

from orchestrator.recording.layout import SUFFIX, RecordingError
from orchestrator.recording.stored import Stored


@dataclass(frozen=True, slots=True, eq=False)
class Reopened:
    """A part as it was at a checkpoint.

    Attributes:
        memory: what `Part.memory` told then.
        sha256: of all rows until then.
        held: those rows of them that were in no block yet.
    """

    memory: Mapping[str, Any]
    sha256: Any
    held: bytes


Again: TypeAlias = Mapping[str, Reopened]
"""Parts by name."""

NOTHING: Final[Again] = MappingProxyType({})
"""A recording that is new."""


def reopened(directory: Path, memories: Mapping[str, Mapping[str, Any]]) -> Again:
    """The parts of the recording in `directory` as they were at a checkpoint.

    All rows until then are read and compared with what they were. Nothing is changed.

    Args:
        directory: of the run.
        memories: what `Recorder.memory` told at the checkpoint.

    Raises:
        RecordingError: something is missing, damaged, or not what it was.
    """
    return MappingProxyType(
        {name: _reopened(_path_of(directory, name), memory) for name, memory in memories.items()}
    )


def _path_of(directory: Path, name: str) -> Path:
    return directory / f"{name.removesuffix('.npy')}{SUFFIX}"


def _reopened(path: Path, memory: Mapping[str, Any]) -> Reopened:
    stored, in_blocks = Stored.open(path), memory["stored"]["rows"]
    total, at = in_blocks + memory["rows"], 0
    sha256, held = hashlib.sha256(), bytearray()
    if total:
        for block in stored.blocks():
            rows = block[: total - at]
            sha256.update(rows.tobytes())
            held += rows[max(in_blocks - at, 0) :].tobytes()
            at += len(rows)
            if at >= total:
                break
    if at < total or sha256.hexdigest() != memory["sha256"]:
        raise RecordingError(f"`{path}` does not hold what it held at the checkpoint")
    return Reopened(memory, sha256, bytes(held))
