"""A run as a recording of Rerun, which its viewer opens."""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from fmus.messages.records import POINTS_MIME
from orchestrator.log import LOG
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording, Series
from orchestrator.recording.tidy import Flat, Lost
from orchestrator.signal import Array
from studies.exports.export import Asked, Exported, Format, described, module_for
from studies.exports.geo import Projection, projection_of
from studies.exports.log_lines import log_lines
from studies.exports.numbers import numbers_of
from studies.exports.outputs import ExportError
from studies.exports.radio_lines import lines_of
from studies.exports.rrd_chunks import Chunks
from studies.exports.scene import (
    Surroundings,
    binary_signals,
    driven_in,
    surroundings_of,
    users_of,
)
from studies.exports.show import clouds
from studies.exports.tracks import Tracks, tracks_of

_SUBJECT: Final = "--rerun"
_EXTRA: Final = "rerun"
_APPLICATION: Final = "nlosim"
_MANY: Final = 1 << 20
"""Points that are in one chunk."""


def write(asked: Asked, draft: Path) -> Exported:
    """Write one file.

    Args:
        asked: of which run.
        draft: the file, which is created.
    """
    chunks = Chunks(_SUBJECT)
    told = _Told(asked, chunks)
    said = described(asked)
    stream = chunks.stream.LazyChunkStream.from_iter(told.all(said))
    run = said.get("fingerprint", asked.name)
    with chunks.strict():
        stream.write_rrd(str(draft), application_id=_APPLICATION, recording_id=run)
    return Exported(
        files={f"{asked.name}.rrd": f"{told.rows} rows of {len(told.entities)} entities"},
        left_out=(*told.left_out, *told.lost.said),
    )


class _Told:
    """A run as chunks, one entity after the other.

    Attributes:
        rows: how many there were, of entities that change.
        entities: that have some.
        left_out: what is not told, a sentence each.
        lost: what could not be read.
    """

    def __init__(self, asked: Asked, chunks: Chunks) -> None:
        self.rows = 0
        self.entities: set[str] = set()
        self.left_out: list[str] = []
        self.lost = Lost.nothing()
        self._asked = asked
        self._chunks = chunks

    def all(self, said: Mapping[str, str]) -> Iterator[Any]:
        """All chunks; `said` is what was run."""
        for chunk in self._everything(said):
            if not chunk.is_static:
                self.rows += chunk.num_rows
                self.entities.add(chunk.entity_path)
            yield chunk

    def _everything(self, said: Mapping[str, str]) -> Iterator[Any]:
        recording = self._asked.recording
        yield from self._chunks.run(said)
        yield from self._chunks.frame()
        surroundings = surroundings_of(recording)
        self.left_out += surroundings.left_out
        yield from self._chunks.surroundings(surroundings)
        projection = self._projection()
        yield from self._outlines(surroundings, projection)
        yield from self._users(recording, projection)
        for number, lights in enumerate(surroundings.lights):
            entity = "/world/lights" if number == 0 else f"/world/lights/{number}"
            times, states = self._whole(lights.states)
            yield from self._chunks.lights(entity, lights, times, states)
        for name in binary_signals(recording, POINTS_MIME):
            yield from self._opened(recording, name, self._points)
        for component, names in numbers_of(recording).items():
            for name in names:
                yield from self._opened(recording, name, self._numbers, component)
        lines = log_lines(self._asked.directory / LOG)
        if lines:
            yield self._chunks.log(lines, self._begin(recording))

    def _opened(
        self,
        recording: Recording,
        name: str,
        tell: Callable[..., Iterator[Any]],
        *more: str,
    ) -> Iterator[Any]:
        """What `tell` says of a signal, if it can be opened."""
        try:
            series = recording[name]
        except RecordingError as error:
            self.left_out.append(f"left out: {error}")
            return
        yield from tell(series, *more)

    def _projection(self) -> Projection | None:
        try:
            return projection_of(self._asked.manifest)
        except RecordingError:
            return None

    def _outlines(self, surroundings: Surroundings, projection: Projection | None) -> Iterator[Any]:
        rings = [building.ring for building in surroundings.buildings] + [*surroundings.roads]
        if projection is not None and rings:
            yield self._chunks.outlines([projection.degrees(ring) for ring in rings])

    def _users(self, recording: Recording, projection: Projection | None) -> Iterator[Any]:
        driven = driven_in(recording)
        try:
            users, said = users_of(recording)
        except (ExportError, RecordingError) as error:
            self.left_out.append(str(error))
            return
        self.left_out += said
        tracks = tracks_of(users, driven, self.lost)
        taken: set[str] = set()
        for number, track in tracks.each():
            name = users.name_of(number)
            name = f"{name} ({number})" if name in taken else name
            taken.add(name)
            type_ = users.named[number].type if number in users.named else ""
            yield from self._chunks.user(track, name, type_, number)
            if projection is not None and track.is_driven.any():
                rows = np.flatnonzero(track.is_driven)
                degrees = projection.degrees(track.position[rows, :2])
                yield self._chunks.place(name, track.times[rows], degrees)
        yield from self._lines(recording, tracks)

    def _lines(self, recording: Recording, tracks: Tracks) -> Iterator[Any]:
        try:
            found, left_out = lines_of(recording, tracks, self.lost)
        except RecordingError as error:
            self.left_out.append(f"links and messages are left out: {error}")
            return
        self.left_out += left_out
        for lines in found:
            yield from self._chunks.lines(lines)

    def _points(self, series: Series) -> Iterator[Any]:
        """Chunks of each lidar, of about `_MANY` points."""
        waiting: dict[int, list[tuple[int, Array, Array]]] = {}
        for k, time in enumerate(series.times.tolist()):
            try:
                for sensor, points in clouds(bytes(series[k])):
                    waiting.setdefault(int(sensor["vehicle"]), []).append((time, sensor, points))
            except (RecordingError, ValueError) as error:
                what = error if isinstance(error, RecordingError) else RecordingError(str(error))
                self.lost.note(series.name, time, what)
            if sum(len(points) for each in waiting.values() for _, _, points in each) > _MANY:
                yield from self._clouds(series.name, waiting)
                waiting = {}
        yield from self._clouds(series.name, waiting)

    def _clouds(
        self, name: str, waiting: Mapping[int, list[tuple[int, Array, Array]]]
    ) -> Iterator[Any]:
        for number, told in waiting.items():
            entity = self._chunks.path("world", "points", name, str(number))
            times = np.array([time for time, _, _ in told], np.int64)
            sensors = np.stack([sensor for _, sensor, _ in told])
            yield from self._chunks.clouds(entity, times, sensors, [each for _, _, each in told])

    def _numbers(self, series: Series, component: str) -> Iterator[Any]:
        flat = Flat.of(series)
        times, rows = self._whole(series)
        for column, values in zip(flat.columns, rows.reshape(len(times), -1).T, strict=True):
            yield from self._chunks.scalar((component, column), series.unit, times, values)

    def _whole(self, series: Series) -> tuple[Array, Array]:
        """Times [ns] and samples of one shape, all that can be read."""
        found = []
        for k, time in enumerate(series.times.tolist()):
            try:
                found.append((time, np.asarray(series[k])))
            except RecordingError as error:
                self.lost.note(series.name, time, error)
        times = np.array([time for time, _ in found], np.int64)
        return times, np.stack([each for _, each in found]) if found else np.empty((0, 1))

    def _begin(self, recording: Recording) -> int:
        """The first time of all [ns]."""
        firsts = []
        for name in recording.signals:
            try:
                firsts += recording[name].times[:1].tolist()
            except RecordingError:
                continue
        return min(firsts, default=0)


def _check() -> None:
    module_for("rerun", _SUBJECT, _EXTRA)


FORMATS: Final = {"rerun": Format(".rrd", write, _check)}
