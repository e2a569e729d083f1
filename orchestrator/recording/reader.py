"""Recordings: what a `Recorder` wrote, read back."""

import hashlib
import logging
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.recording.crash import CRASHED, as_ended
from orchestrator.recording.fingerprint import PartDigest, fingerprint
from orchestrator.recording.layout import (
    INDEX,
    MANIFEST,
    Files,
    Layout,
    RecordingError,
    SignalType,
    read_json,
)
from orchestrator.recording.samples import Samples, load, parts, read_samples
from orchestrator.recording.stored import Stored, damage_of
from orchestrator.signal import Array, Signal
from orchestrator.suggestion import suggestion
from orchestrator.system import Endpoint
from orchestrator.timebase import Time, seconds

logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Series:
    """The samples of one signal over time.

    `series[k]` is sample `k`, counted from the start or, if negative, from the end; iterating
    yields all samples. Arrays are read-only. A sample is decompressed, with those around it, when
    it is asked for.

    Attributes:
        name: `component.connector`.
        kind: the declared type, e.g. `float64[vehicle, 3]`.
        unit: of the values.
        times: when each sample was published [ns]; int64, ascending.
    """

    name: str
    kind: str
    unit: str
    times: Array
    _samples: Samples

    def __len__(self) -> int:
        return len(self.times)

    def __getitem__(self, k: int) -> Signal:
        if not -len(self) <= k < len(self):
            raise IndexError(f"`{self.name}` has {len(self)} samples, there is no sample {k}")
        return self._samples[k % len(self)]

    def __iter__(self) -> Iterator[Signal]:
        return map(self._samples.__getitem__, range(len(self)))

    def at(self, t: Time) -> Signal:
        """The newest value at or before `t` [ns].

        Raises:
            RecordingError: there is none yet.
        """
        k = int(np.searchsorted(self.times, t, side="right")) - 1
        if k < 0:
            first = (
                f"the first is at {seconds(int(self.times[0]))} s" if len(self) else "it is empty"
            )
            raise RecordingError(f"`{self.name}` has no value at {seconds(t)} s; {first}")
        return self._samples[k]

    def between(self, first: int, end: int) -> Array:
        """Samples `first` to `end` - 1 of a signal of constant shape, shape (sample, ...).

        Read in turn, a long series takes no more memory than a few blocks.
        """
        ends = self._samples.ends
        return self._samples.values[int(ends[first]) : int(ends[end])]

    @property
    def values(self) -> Array:
        """All samples in one array.

        Stacked, shape (samples, ...), if their shape is constant; otherwise joined along their
        first axis or, if other axes vary too, flattened.
        """
        return self._samples.values[0 : int(self._samples.ends[len(self)])]


class Recording:
    """The recording in a run directory.

    It can be read while the run goes on and after it was killed; what is complete on disk when
    a series is opened is in it. Blocks are decompressed when something in them is asked for. Of a
    file that is cut or damaged, the rest is read; what was lost raises an error that says where.

    Raises:
        RecordingError: `directory` holds none.
    """

    def __init__(self, directory: Path) -> None:
        self._directory = Path(directory)
        path = self._directory / INDEX
        try:
            index = read_json(path)
        except FileNotFoundError:
            raise RecordingError(f"`{directory}` holds no recording: no `{INDEX}`") from None
        self._types = {name: SignalType.read(path, name, fields) for name, fields in index.items()}

    @property
    def signals(self) -> tuple[str, ...]:
        """The recorded signals, `component.connector`, sorted."""
        return tuple(self._types)

    @cached_property
    def manifest(self) -> dict[str, Any]:
        """What was run, and what became of it, as it was when first asked for.

        Raises:
            RecordingError: it is missing or damaged.
        """
        path = self._directory / MANIFEST
        try:
            return as_ended(self._directory, read_json(path))
        except FileNotFoundError:
            raise RecordingError(f"`{path}` is missing") from None

    def __contains__(self, name: str) -> bool:
        return name in self._types

    def kind(self, name: str) -> str:
        """The declared type of a recorded signal, e.g. `float64[vehicle, 3]`."""
        return self._types[name].kind

    def __getitem__(self, name: str) -> Series:
        """The series of the signal `component.connector`.

        Raises:
            RecordingError: it was not recorded.
        """
        if name not in self._types:
            hint = suggestion(name, self._types)
            raise RecordingError(f"`{self._directory}` has no signal `{name}`; {hint}")
        kind = self._types[name]
        files = self._files(name)
        samples = read_samples(files, Layout(kind.layout))
        times = load(files.times)
        count = min(len(samples), len(times))
        wrong = (*samples.values.damage, *samples.values.cut)
        if wrong and self._has_ended():
            logger.warning("%s", "; ".join(wrong))
        return Series(name, kind.kind, kind.unit, times[:count], samples)

    @property
    def damage(self) -> tuple[str, ...]:
        """What is cut or damaged, each with file and place [byte]; what is whole can be read.

        Everything is read for it.
        """
        files = dict.fromkeys(
            path
            for name, kind in self._types.items()
            for path in (
                self._files(name).times,
                *parts(self._files(name), Layout(kind.layout)),
            )
        )
        ended = self._has_ended()
        return tuple(found for path in files for found in damage_of(path, ended=ended))

    def fingerprint(self) -> str:
        """The fingerprint of the files as they are, for comparison with the manifest's.

        Raises:
            RecordingError: a file is missing or damaged.
        """
        return fingerprint(self._digests())

    def faults(self) -> tuple[str, ...]:
        """Why this is not what the run recorded: damage, or another fingerprint.

        Everything is read for it. A run that did not come to its end has no fingerprint: of it,
        only damage is found.
        """
        found = list(self.damage)
        try:
            expected = self.manifest.get("fingerprint")
            if not found and expected is not None and self.fingerprint() != expected:
                found.append(
                    f"the signals in `{self._directory}` are whole, but not those of its "
                    f"`{MANIFEST}`: the fingerprints differ"
                )
        except RecordingError as error:
            found.append(str(error))
        return tuple(found)

    def _has_ended(self) -> bool:
        """Whether the run came to its end; if not, files may end anywhere."""
        try:
            manifest = read_json(self._directory / MANIFEST)
        except (FileNotFoundError, RecordingError):
            return True
        return manifest.get("status") not in ("running", CRASHED)

    def _files(self, name: str) -> Files:
        end = Endpoint.parse(name)
        return Files(self._directory, end.component, end.connector)

    def _digests(self) -> Iterator[PartDigest]:
        times = {self._files(name).times for name in self._types}
        yield from (self._digest(path, "") for path in times)
        for name, kind in self._types.items():
            values, *lengths = parts(self._files(name), Layout(kind.layout))
            yield self._digest(values, kind.kind)
            yield from (self._digest(path, "") for path in lengths)

    def _digest(self, path: Path, kind: str) -> PartDigest:
        digest = hashlib.sha256()
        for rows in Stored.open(path).blocks():
            digest.update(np.ascontiguousarray(rows).reshape(-1).view(np.uint8).data)
        name = Files(self._directory, "", "").name_of(path)
        return PartDigest(name, kind, digest.hexdigest())
