"""The samples of a run: taken from its recording, kept in one compressed file.

`samples/PHASE-SEED.npz` has the arrays `bytes` (uint8, all samples joined) and `ends` (int64, where
each of them ends).
"""

import io
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from orchestrator.errors import in_words
from orchestrator.recording.layout import RecordingError
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
        RecordingError: the file is missing or damaged; it is named.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            joined, ends = arrays["bytes"].tobytes(), arrays["ends"].tolist()
    except Exception as error:  # zipfile and zlib raise a dozen kinds, depending on the byte
        raise RecordingError(f"`{path}` cannot be read: {in_words(error)}") from error
    borders = [0, *ends]
    if borders != sorted(borders) or borders[-1] != len(joined):
        raise RecordingError(f"`{path}` cannot be read: its samples do not end where it says")
    return tuple(joined[i:k] for i, k in pairwise(borders))
