"""The samples of a run: taken from its recording, kept in one compressed file.

`samples/PHASE-SEED.npz` has the arrays `bytes` (uint8, all samples joined) and `ends` (int64, where
each of them ends).
"""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from orchestrator.recording.reader import Recording
from studies.training import files
from studies.training.plan import COMPONENT, SAMPLE


def recorded_samples(directory: Path) -> list[bytes]:
    """The samples in the run directory `directory`, in the order of time, empty ones left out.

    Raises:
        RecordingError: there are none.
    """
    series = Recording(directory)[f"{COMPONENT}.{SAMPLE}"]
    return [data for value in series if (data := bytes(value))]


def write_samples(path: Path, samples: Sequence[bytes]) -> None:
    """Write `samples`; when this returns, they are on the disk."""
    joined = np.frombuffer(b"".join(samples), dtype=np.uint8)
    ends = np.cumsum([len(each) for each in samples], dtype=np.int64)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, bytes=joined, ends=ends)
    files.write(path, buffer.getvalue())


def read_samples(path: Path) -> tuple[bytes, ...]:
    """What `write_samples` wrote.

    Raises:
        OSError, ValueError: the file cannot be read.
    """
    with np.load(path, allow_pickle=False) as arrays:
        joined, ends = arrays["bytes"].tobytes(), arrays["ends"].tolist()
    return tuple(joined[i:k] for i, k in zip([0, *ends], ends, strict=False))
