"""A run as messages of Foxglove's schemas, in the order of time: for a file and for a live viewer.

Topics: `/scene` (SceneUpdate of road users), `/surroundings` (of buildings and roads), `/lights`,
`/tf` (FrameTransforms), `/points/SIGNAL/VEHICLE` (PointCloud), `/map` (GeoJSON) and
`/location/NAME` (LocationFix) where the net has a projection, `/log` (Log), and
`/signals/COMPONENT`: all single numbers that a component tells, as JSON for plots.
"""

import json
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import FRAME, POINT, POINTS_MIME, SENSOR, unframe
from orchestrator.log import LOG
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording, Series
from orchestrator.recording.tidy import Lost
from orchestrator.signal import Array
from studies.exports.export import module_for
from studies.exports.foxglove_messages import Messages
from studies.exports.geo import Projection, projection_of
from studies.exports.log_lines import LogLine, log_lines
from studies.exports.numbers import nested, numbers_of, schema_of
from studies.exports.outputs import ExportError
from studies.exports.scene import (
    Lights,
    Surroundings,
    Users,
    binary_signals,
    driven_in,
    surroundings_of,
    users_of,
)

_LEVELS: Final = {"DEBUG": "Debug", "INFO": "Info", "WARNING": "Warning", "ERROR": "Error"}


class Stage:
    """The channels that messages go to.

    Args:
        subject: what needs the SDK, for the error if it is not installed.

    Attributes:
        present: numbers of the road users that were shown last.
    """

    def __init__(self, subject: str) -> None:
        self.sdk = module_for("foxglove", subject, "mcap")
        self.channels = module_for("foxglove.channels", subject, "mcap")
        self.schemas = module_for("foxglove.messages", subject, "mcap")
        self.websocket = module_for("foxglove.websocket", subject, "mcap")
        self.context = self.sdk.Context()
        self.make = Messages(self.schemas)
        self._open: dict[str, Any] = {}
        self.present: set[int] = set()

    def send(self, topic: str, schema: str, message: Any, time: int) -> None:
        """Log a message at `time` [ns]; `schema` is the name of a Foxglove schema."""
        if topic not in self._open:
            make = getattr(self.channels, f"{schema}Channel")
            self._open[topic] = make(topic, context=self.context)
        self._open[topic].log(message, log_time=time)

    def tell(self, topic: str, schema: dict[str, Any], message: dict[str, Any], time: int) -> None:
        """Log JSON at `time` [ns]; `schema` is its JSON Schema."""
        if topic not in self._open:
            make = self.sdk.Channel
            self._open[topic] = make(topic, schema=schema, context=self.context)
        self._open[topic].log(message, log_time=time)


class Source(ABC):
    """Something that is told at certain times.

    Attributes:
        name: for messages of what is lost.
        times: when [ns], int64, ascending, shape (sample,).
    """

    name: str
    times: Array

    @abstractmethod
    def send(self, k: int, stage: Stage) -> None:
        """Log sample `k`.

        Raises:
            RecordingError: it is lost.
        """


class Show:
    """A recording as messages.

    Args:
        recording: of the run; of one that goes on, what is there by now.
        directory: of the run.

    Attributes:
        left_out: what cannot be shown, a sentence each.
        lost: what could not be read.
        sources: all there is over time.
    """

    def __init__(self, recording: Recording, directory: Path) -> None:
        self.lost = Lost.nothing()
        self.left_out: list[str] = []
        self.sources: list[Source] = []
        self._directory = directory
        self._projection = _projection(recording)
        self._surroundings = surroundings_of(recording)
        self.left_out += self._surroundings.left_out
        try:
            users, said = users_of(recording)
            self.left_out += said
            self.sources.append(_Users(users, driven_in(recording), self._projection))
        except (ExportError, RecordingError) as error:
            self.left_out.append(str(error))
        self.sources += [_Lights(k, each) for k, each in enumerate(self._surroundings.lights)]
        for name in binary_signals(recording, POINTS_MIME):
            self._add(lambda name=name: _Points(recording[name]))
        for component, names in numbers_of(recording).items():
            self._add(lambda c=component, n=names: _Numbers(c, [recording[each] for each in n]))

    def _add(self, make: Any) -> None:
        try:
            self.sources.append(make())
        except RecordingError as error:
            self.left_out.append(f"left out: {error}")

    @property
    def begin(self) -> int:
        """The first time of all [ns]; 0 if there is none."""
        return min((int(each.times[0]) for each in self.sources if len(each.times)), default=0)

    @property
    def end(self) -> int:
        """The last time of all [ns]; 0 if there is none."""
        return max((int(each.times[-1]) for each in self.sources if len(each.times)), default=0)

    def set_up(self, stage: Stage, time: int) -> None:
        """Log what does not change, at `time` [ns]."""
        make = stage.make
        stage.send(
            "/surroundings", "SceneUpdate", make.surroundings(self._surroundings, time), time
        )
        if self._projection is not None:
            text = json.dumps(_geojson(self._surroundings, self._projection))
            stage.send("/map", "GeoJson", stage.schemas.GeoJson(geojson=text), time)
        for line in log_lines(self._directory / LOG):
            stage.send("/log", "Log", _log_message(line, stage), time)

    def state(self, stage: Stage, time: int) -> None:
        """Log what holds at `time` [ns]: the newest of everything at or before it."""
        for source in self.sources:
            k = int(np.searchsorted(source.times, time, side="right")) - 1
            if k >= 0:
                self._send(source, k, stage)

    def newest(self) -> dict[str, int]:
        """When each source told something last [ns], by name; -1 if nothing yet."""
        return {each.name: int(each.times[-1]) if len(each.times) else -1 for each in self.sources}

    def between(self, stage: Stage, after: int, until: int) -> int:
        """Log what is told after `after` and until `until` [ns], by time; how many it was."""
        return self.advance(stage, {each.name: after for each in self.sources}, until)

    def advance(self, stage: Stage, after: Mapping[str, int], until: int | None = None) -> int:
        """Log what each source tells after a time of its own, all by time; how many it was.

        Args:
            stage: where it goes.
            after: times [ns] by the names of sources; from the begin on for one that is not there.
            until: [ns]; `None`: all that there is.
        """
        due: list[tuple[int, int, int]] = []
        for number, source in enumerate(self.sources):
            since = after.get(source.name, -1)
            first = int(np.searchsorted(source.times, since, side="right"))
            end = len(source.times)
            if until is not None:
                end = int(np.searchsorted(source.times, until, side="right"))
            due += [(int(source.times[k]), number, k) for k in range(first, end)]
        for _, number, k in sorted(due):
            self._send(self.sources[number], k, stage)
        return len(due)

    def _send(self, source: Source, k: int, stage: Stage) -> None:
        try:
            source.send(k, stage)
        except (RecordingError, ValueError) as error:
            what = error if isinstance(error, RecordingError) else RecordingError(str(error))
            self.lost.note(source.name, int(source.times[k]), what)


class _Users(Source):
    def __init__(
        self, users: Users, driven: Mapping[str, Series], projection: Projection | None
    ) -> None:
        self.name, self.times = users.prefix, users.times
        self._users = users
        self._driven = driven
        self._projection = projection

    @override
    def send(self, k: int, stage: Stage) -> None:
        snapshot = self._users.at(k)
        bodies = snapshot.those(snapshot.is_body)
        here = set(bodies.ids.tolist())
        numbers = {name: self._number(each, snapshot.time) for name, each in self._driven.items()}
        gone, stage.present = stage.present - here, here
        driven = frozenset(numbers.values()) - {-1}
        update = stage.make.vehicles(bodies, self._users, driven, gone)
        stage.send("/scene", "SceneUpdate", update, snapshot.time)
        frames = stage.make.frames(snapshot, self._users)
        stage.send("/tf", "FrameTransforms", frames, snapshot.time)
        if self._projection is None:
            return
        for name, number in numbers.items():
            rows = np.flatnonzero(snapshot.ids == number)
            if len(rows):
                where = self._projection.degrees(snapshot.position[rows[:1], :2])[0].tolist()
                fix = stage.schemas.LocationFix(
                    timestamp=stage.make.time(snapshot.time),
                    frame_id=self._users.name_of(number),
                    longitude=where[0],
                    latitude=where[1],
                )
                stage.send(f"/location/{name}", "LocationFix", fix, snapshot.time)

    def _number(self, series: Series, time: int) -> int:
        try:
            return int(np.asarray(series.at(time)))
        except RecordingError:
            return -1


class _Lights(Source):
    def __init__(self, number: int, lights: Lights) -> None:
        self.name, self.times = lights.states.name, lights.states.times
        self._topic = "/lights" if number == 0 else f"/lights/{number}"
        self._lights = lights

    @override
    def send(self, k: int, stage: Stage) -> None:
        time, state = int(self.times[k]), np.asarray(self._lights.states[k])
        update = stage.make.lights(self._lights.position, state, time, "lights")
        stage.send(self._topic, "SceneUpdate", update, time)


class _Points(Source):
    def __init__(self, series: Series) -> None:
        self.name, self.times = series.name, series.times
        self._series = series

    @override
    def send(self, k: int, stage: Stage) -> None:
        for sensor, points in clouds(bytes(self._series[k])):
            topic = f"/points/{self.name}/{int(sensor['vehicle'])}"
            stage.send(topic, "PointCloud", stage.make.cloud(sensor, points), int(self.times[k]))


class _Numbers(Source):
    def __init__(self, component: str, series: Sequence[Series]) -> None:
        count = min(len(each) for each in series)
        self.name, self.times = component, series[0].times[:count]
        self._series = {each.name.partition(".")[2]: each for each in series}
        self._schema = schema_of(component, series)

    @override
    def send(self, k: int, stage: Stage) -> None:
        told = {name: np.asarray(each[k]).tolist() for name, each in self._series.items()}
        stage.tell(f"/signals/{self.name}", self._schema, nested(told), int(self.times[k]))


def clouds(data: bytes) -> list[tuple[Array, Array]]:
    """The sensors in a signal of points, a record each, and the points of each, shape (point,).

    Raises:
        ValueError: it is no such signal.
    """
    sensors = unframe("LPTS", data, SENSOR)
    start = FRAME.itemsize + sensors.nbytes
    total = (len(data) - start) // POINT.itemsize if data else 0
    points = np.frombuffer(data, POINT, total, start) if total else np.empty(0, POINT)
    return [
        (sensor, points[int(sensor["first"]) : int(sensor["first"]) + int(sensor["count"])])
        for sensor in sensors
    ]


def _projection(recording: Recording) -> Projection | None:
    try:
        return projection_of(recording.manifest)
    except RecordingError:
        return None


def _geojson(surroundings: Surroundings, projection: Projection) -> dict[str, Any]:
    """Buildings and roads as a FeatureCollection (RFC 7946)."""
    rings = [("building", building.ring) for building in surroundings.buildings]
    rings += [("road", ring) for ring in surroundings.roads]
    features = []
    for kind, ring in rings:
        corners = projection.degrees(ring).round(8).tolist()
        geometry = {"type": "Polygon", "coordinates": [[*corners, corners[0]]]}
        features.append({"type": "Feature", "properties": {"kind": kind}, "geometry": geometry})
    return {"type": "FeatureCollection", "features": features}


def _log_message(line: LogLine, stage: Stage) -> Any:
    return stage.schemas.Log(
        timestamp=stage.make.time(line.at),
        level=getattr(stage.schemas.LogLevel, _LEVELS.get(line.level, "Unknown")),
        message=line.text,
        name=line.name,
    )
