"""Chunks of Rerun: the rows of one entity, in columns.

Entities: https://rerun.io/docs/reference/types/archetypes. The world frame is that of the run: x
east, y north, z up, in metres. Positions and rotations have 32 bits there.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Final

import numpy as np

from adapters.traffic.bodies import Body
from adapters.traffic.colours import BODY_COLOURS, LIGHT_COLOURS, LIGHT_STATES
from orchestrator.palette import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    GROUND,
    LIGHT,
    LINK_COLOURS,
    ORANGE,
    PURPLE,
    VERMILLION,
)
from orchestrator.signal import Array
from studies.exports.export import module_for
from studies.exports.log_lines import LogLine
from studies.exports.radio_lines import Lines
from studies.exports.rotation import quaternion
from studies.exports.scene import Lights, Surroundings
from studies.exports.tracks import Track
from studies.exports.triangles import prism, triangulated

TIMELINE: Final = "time"
"""The time of the run, a duration since its zero."""

CLOCK: Final = "clock"
"""When a line of the log was written."""

_LINE_COLOURS: Final = {
    **LINK_COLOURS,
    "lost": GREY,
    "bsm": BLUE,
    "apm": GREEN,
    "sensor_data": PURPLE,
    "request": ORANGE,
}
_THICKNESS: Final = {"LOS": 0.16, "NLOSv": 0.1, "NLOSb": 0.05, "lost": 0.03}
"""Half the thickness of links [m], for readers without colours; messages have `_THICK`."""

_THICK: Final = 0.22
_LIGHT_HEIGHT: Final = 4.0
_LIGHT_RADIUS: Final = 0.4
_POINT_RADIUS: Final = 0.06
_SURFACES: Final = {0: ("ground", LIGHT), 1: ("building", GROUND), 2: ("road user", BLUE)}
"""What points are on, by class."""


class Chunks:
    """Makes chunks.

    Args:
        subject: what needs the SDK, for the error if it is not installed.
    """

    def __init__(self, subject: str) -> None:
        self.sdk = module_for("rerun", subject, "rerun")
        self.stream = module_for("rerun.chunk", subject, "rerun")

    @contextmanager
    def strict(self) -> Iterator[None]:
        """What the SDK would warn of and leave out is an error within the block."""
        before = self.sdk.strict_mode()
        self.sdk.set_strict_mode(True)
        try:
            yield
        finally:
            self.sdk.set_strict_mode(before)

    def path(self, *parts: str) -> str:
        """The path of an entity."""
        found: str = self.sdk.new_entity_path(list(parts))
        return found

    def run(self, said: Mapping[str, str]) -> Iterator[Any]:
        """What was run, as pairs of text, of which `run` is the name of the recording."""
        info = self.sdk.archetypes.RecordingInfo
        yield self._fixed(self.sdk.RECORDING_PROPERTIES_PATH, info.columns(name=[said["run"]]))
        yield self.stream.Chunk.from_property("nlosim", self.sdk.AnyValues(**said))

    def frame(self) -> Iterator[Any]:
        """Which axis is up, and what classes are called."""
        up = self.sdk.components.ViewCoordinates.RIGHT_HAND_Z_UP
        yield self._fixed("/world", self.sdk.ViewCoordinates.columns(xyz=[up]))
        bodies = {int(body): (body.name.lower(), code) for body, code in BODY_COLOURS.items()}
        states = dict(enumerate(zip(LIGHT_STATES, LIGHT_COLOURS, strict=True)))
        for name, classes in (("users", bodies), ("lights", states), ("points", _SURFACES)):
            context = [(number, word, _rgb(code)) for number, (word, code) in classes.items()]
            columns = self.sdk.AnnotationContext.columns(
                context=self.sdk.components.AnnotationContext(context)
            )
            yield self._fixed(self.path("world", name), columns)

    def surroundings(self, found: Surroundings) -> Iterator[Any]:
        """Meshes of roads and buildings."""
        roads = [
            (np.column_stack([ring, np.zeros(len(ring))]), triangulated(ring))
            for ring in found.roads
        ]
        buildings = [prism(building.ring, building.height) for building in found.buildings]
        for name, parts, code in (("roads", roads, LIGHT), ("buildings", buildings, GROUND)):
            if not parts:
                continue
            starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
            indices = [start + each for start, (_, each) in zip(starts, parts, strict=False)]
            vertices = np.concatenate([vertices for vertices, _ in parts])
            columns = [
                *_one(self.sdk.Mesh3D.columns(vertex_positions=vertices), len(vertices)),
                *_one(
                    self.sdk.Mesh3D.columns(triangle_indices=np.concatenate(indices)),
                    sum(map(len, indices)),
                ),
                *self.sdk.Mesh3D.columns(albedo_factor=[_rgb(code)]),
            ]
            yield self._fixed(self.path("world", name), columns)

    def user(self, track: Track, name: str, type_: str, number: int) -> Iterator[Any]:
        """The frame, the box and the end of a road user."""
        entity = self.path("world", "users", name)
        said = {"number": str(number), **({"type": type_} if type_ else {})}
        yield self._fixed(entity, self.sdk.AnyValues.columns(**{k: [v] for k, v in said.items()}))
        frames = self.sdk.Transform3D.columns(
            translation=track.position, quaternion=quaternion(track.heading)
        )
        yield self._told(entity, track.times, frames)
        rows = track.looks
        rows = rows[track.is_body[rows]]
        if len(rows):
            half = track.size[rows] / 2
            driven = track.is_driven[rows].tolist()
            bodies = track.body[rows].tolist()
            colours = [
                VERMILLION if is_driven else BODY_COLOURS[Body(body)]
                for is_driven, body in zip(driven, bodies, strict=True)
            ]
            boxes = self.sdk.Boxes3D.columns(
                half_sizes=half,
                centers=half * np.array([0.0, 0.0, 1.0]),
                class_ids=bodies,
                colors=[_rgb(code) for code in colours],
                labels=[name] * len(rows),
                show_labels=driven,
                fill_mode=["solid"] * len(rows),
            )
            yield self._told(entity, track.times[rows], boxes)
        if len(track.gone):
            clear = self.sdk.Clear.columns(is_recursive=[False] * len(track.gone))
            yield self._told(entity, track.gone, clear)

    def lights(self, entity: str, lights: Lights, times: Array, states: Array) -> Iterator[Any]:
        """Traffic lights: their states, int32, shape (time, signal)."""
        count = len(lights.position)
        places = np.column_stack([lights.position, np.full(count, _LIGHT_HEIGHT)])
        points = self.sdk.Points3D
        radii = points.columns(radii=[_LIGHT_RADIUS], show_labels=[False])
        yield self._fixed(entity, [*_one(points.columns(positions=places), count), *radii])
        known = np.where((states >= 0) & (states < len(LIGHT_STATES)), states, 0)
        columns = points.columns(class_ids=known.reshape(-1)).partition([count] * len(times))
        yield self._told(entity, times, columns)

    def clouds(
        self, entity: str, times: Array, sensors: Array, clouds: Sequence[Array]
    ) -> Iterator[Any]:
        """Points of one lidar: records of the sensor, shape (time,), and its points at each."""
        turns = quaternion(sensors["heading"], sensors["pitch"], sensors["roll"])
        pose = self.sdk.Transform3D.columns(translation=sensors["position"], quaternion=turns)
        yield self._told(entity, times, pose)
        points = np.concatenate(clouds)
        surface = np.select([points["instance"] >= 0, points["instance"] == -1], [2, 0], 1)
        counts = [len(cloud) for cloud in clouds]
        columns = [
            *self.sdk.Points3D.columns(positions=points["position"], class_ids=surface).partition(
                counts
            ),
            *self.sdk.AnyValues.columns(
                intensity=points["intensity"], instance=points["instance"]
            ).partition(counts),
        ]
        yield self._told(entity, times, columns)
        yield self._fixed(entity, self.sdk.Points3D.columns(radii=[_POINT_RADIUS]))

    def lines(self, lines: Lines) -> Iterator[Any]:
        """Links or messages."""
        entity = self.path("world", *lines.name.split("/"))
        sort = lines.name.rpartition("/")[2]
        strips = self.sdk.LineStrips3D
        look = strips.columns(
            colors=[_rgb(_LINE_COLOURS.get(sort, BLACK))], radii=[_thickness(lines.name)]
        )
        yield self._fixed(entity, look)
        columns = strips.columns(strips=list(lines.ends.astype(np.float32)))
        yield self._told(entity, lines.times, columns.partition(lines.counts.tolist()))

    def scalar(self, parts: Sequence[str], unit: str, times: Array, values: Array) -> Iterator[Any]:
        """A single number over time, shape (time,), with its unit in its name and beside it."""
        entity = self.path("signals", *parts)
        name = parts[-1] if unit in ("", "1") else f"{parts[-1]} [{unit}]"
        scalars = self.sdk.Scalars.columns(scalars=values.astype(np.float64))
        yield self._told(entity, times, scalars)
        yield self._fixed(
            entity,
            [*self.sdk.SeriesLines.columns(names=[name]), *self.sdk.AnyValues.columns(unit=[unit])],
        )

    def log(self, lines: Sequence[LogLine], time: int) -> Any:
        """All lines of the log, at `time` [ns] of the run and at the time of the clock."""
        clock = np.array([line.at for line in lines], np.int64).astype("datetime64[ns]")
        levels = {"WARNING": "WARN"}
        return self.stream.Chunk.from_columns(
            "/log",
            [
                self._duration(np.full(len(lines), time)),
                self.sdk.TimeColumn(CLOCK, timestamp=clock),
            ],
            self.sdk.TextLog.columns(
                text=[f"{line.name}: {line.text}" for line in lines],
                level=[levels.get(line.level, line.level) for line in lines],
            ),
        )

    def outlines(self, rings: Sequence[Array]) -> Any:
        """Rings on the Earth, longitude and latitude [deg], shape (corner, 2) each."""
        closed = [np.concatenate([ring, ring[:1]])[:, ::-1] for ring in rings]
        strings = self.sdk.GeoLineStrings.columns(line_strings=closed)
        return self._fixed("/map", _one(strings, len(closed)))

    def place(self, name: str, times: Array, degrees: Array) -> Any:
        """Where a driven entity was on the Earth, longitude and latitude [deg], shape (time, 2)."""
        places = self.sdk.GeoPoints.columns(positions=degrees[:, ::-1])
        return self._told(self.path("location", name), times, places)

    def _told(self, entity: str, times: Array, columns: Any) -> Any:
        return self.stream.Chunk.from_columns(entity, [self._duration(times)], columns)

    def _fixed(self, entity: str, columns: Any) -> Any:
        return self.stream.Chunk.from_columns(entity, [], columns)

    def _duration(self, times: Array) -> Any:
        return self.sdk.TimeColumn(TIMELINE, duration=times.astype("timedelta64[ns]"))


def _one(columns: Any, count: int) -> Any:
    """Columns of one row that has `count` instances."""
    return columns.partition([count])


def _thickness(name: str) -> float:
    group, _, sort = name.partition("/")
    return _THICKNESS[sort] if group == "links" or sort == "lost" else _THICK


def _rgb(code: str) -> list[int]:
    """A colour, `#RRGGBB`, as three bytes."""
    return [int(code[k : k + 2], 16) for k in (1, 3, 5)]
