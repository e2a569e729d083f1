"""Recordings: what a `Recorder` wrote, read back."""

import hashlib
import logging
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from orchestrator.recording.crash import CRASHED, as_ended
from orchestrator.recording.declared import declared_shape, element_type
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
from orchestrator.recording.samples import Samples, load, other, parts, read_samples
from orchestrator.recording.stored import Stored, damage_of
from orchestrator.signal import Array, Signal
from orchestrator.suggestion import suggestion
from orchestrator.system import Endpoint
from orchestrator.timebase import Time, seconds

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

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

    @property
    def lengths(self) -> Array:
        """Rows of each sample along its first axis, or bytes or elements where more varies.

        int64, shape (sample,); 1 for each sample of a signal of constant shape.
        """
        return np.diff(np.asarray(self._samples.ends, np.int64))[: len(self)]

    def between(self, first: int, end: int) -> Array:
        """Samples `first` to `end` - 1 of a signal of constant shape, shape (sample, ...).

        Of other signals they are joined, as in `values`. Read in turn, a long series takes no more
        memory than a few blocks.
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
            if not self._directory.is_dir():
                raise RecordingError(f"there is no directory `{directory}`") from None
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

    def __iter__(self) -> Iterator[str]:
        """The names of the recorded signals, as `signals` has them."""
        return iter(self._types)

    def __len__(self) -> int:
        """How many signals are recorded."""
        return len(self._types)

    def kind(self, name: str) -> str:
        """The declared type of a recorded signal, e.g. `float64[vehicle, 3]`."""
        return self._types[name].kind

    def unit(self, name: str) -> str:
        """The unit of a recorded signal."""
        return self._types[name].unit

    def is_fixed(self, name: str) -> bool:
        """Whether a recorded signal is declared fixed, so that there is one sample only."""
        return self._types[name].fixed

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
        _check_rows(files.values, samples.values, kind)
        times = load(files.times)
        count = min(len(samples), len(times))
        wrong = (*samples.values.damage, *samples.values.cut)
        if wrong and self._has_ended():
            logger.warning("%s", "; ".join(wrong))
        return Series(name, kind.kind, kind.unit, times[:count], samples)

    def frame(self, *signals: str) -> "pd.DataFrame":
        """Signals as a data frame of pandas: one row per time and element.

        Signals of one component along the same axes are columns of one frame; elements along an
        axis of constant length are columns, too, `place[0]`. The column `time` is in seconds: the
        double that is nearest to the time, whose nanosecond it tells for 104 days; elements are
        told apart by the numbers that their axis has (`id`), else by their index. Signals of
        packets, receptions and other records have a row for each. Units are in
        `frame.attrs["units"]`, by column.

        Args:
            signals: `component.connector`; `*` and `?` stand for any letters.

        Raises:
            RecordingError: one is not recorded, lost in part, or has no columns; they are along
                different axes; or pandas is not installed.
        """
        from orchestrator.recording.frames import frame  # noqa: PLC0415 - needs this module

        return frame(self, signals)

    def dataset(self, *signals: str) -> "xr.Dataset":
        """Signals as labelled arrays of xarray, with the axes of the signal and `time`.

        Where an element is not there at a time is NaN. Coordinates are those of `frame`; units are
        in the `attrs` of every variable, as `units`.

        Args:
            signals: as of `frame`.

        Raises:
            RecordingError: as of `frame`; or xarray is not installed.
        """
        from orchestrator.recording.frames import dataset  # noqa: PLC0415 - needs this module

        return dataset(self, signals)

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


def _check_rows(path: Path, stored: Stored, kind: SignalType) -> None:
    """Refuse the values of a signal that are not of its declared type.

    Raises:
        RecordingError: they are not; the file is another one's.
    """
    element, shape = element_type(kind.kind), declared_shape(kind.kind)
    if element is None or shape is None:
        return
    rows = {Layout.UNIFORM: shape, Layout.RAGGED: shape[1:], Layout.FLAT: ()}
    expected = rows.get(Layout(kind.layout), ())
    if stored.row_shape != expected or stored.dtype.name != np.dtype(element).name:
        raise other(path, stored)
