"""The scene of a run, found by what its signals declare, whatever components are called.

Road users are what has `id`, `position`, `heading`, `velocity` and `size` along one axis; buildings
are rings with heights; roads are rings without; lights have a position and a state; a driven entity
has an `id` and a position of its own.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from adapters.traffic.bodies import Body
from adapters.traffic.connectors import ENTERED_MIME
from orchestrator.recording.declared import declared_shape, element_type, mime_type
from orchestrator.recording.layout import RecordingError
from orchestrator.recording.reader import Recording, Series
from orchestrator.recording.tidy import Lost
from orchestrator.signal import Array
from studies.exports.outputs import ExportError

_USER: Final = {
    "id": ("int64", ("*",), "1"),
    "position": ("float64", ("*", 3), "m"),
    "heading": ("float64", ("*",), "rad"),
    "velocity": ("float64", ("*", 2), "m/s"),
    "size": ("float64", ("*", 3), "m"),
}
"""Element type, shape and unit of what a road user has."""

_RINGS: Final = {"vertex": ("float64", ("*", 2), "m"), "index": ("int32", ("*",), "1")}
_HEIGHT: Final = ("float64", ("*",), "m")
_LIGHT: Final = {"position": ("float64", ("*", 2), "m"), "state": ("int32", ("*",), "1")}
_DRIVEN: Final = {"id": ("int64", (), "1"), "position": ("float64", (2,), "m")}
_BODY: Final = ("int32", ("*",), "1")

SMALLEST: Final = 0.01
"""What is shorter than this [m] is no body: a roadside unit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Snapshot:
    """All road users at one time.

    Attributes:
        time: [ns].
        ids: their numbers, int64, shape (user,).
        position: middles of the bodies on the ground [m], shape (user, 3).
        heading: counter-clockwise from east [rad], shape (user,).
        velocity: in the plane [m/s], shape (user, 2).
        size: length, width, height [m], shape (user, 3).
        body: codes of `vehicle.body`, int32, shape (user,).
    """

    time: int
    ids: Array
    position: Array
    heading: Array
    velocity: Array
    size: Array
    body: Array

    def __len__(self) -> int:
        return len(self.ids)

    def those(self, which: Array) -> "Snapshot":
        """Some of them; `which` is bool, shape (user,)."""
        return Snapshot(
            time=self.time,
            ids=self.ids[which],
            position=self.position[which],
            heading=self.heading[which],
            velocity=self.velocity[which],
            size=self.size[which],
            body=self.body[which],
        )

    @property
    def is_body(self) -> Array:
        """Which have a body, bool, shape (user,)."""
        return np.asarray(self.size[:, 0] >= SMALLEST)


@dataclass(frozen=True, slots=True)
class Named:
    """What a road user is called, and the name of its type."""

    name: str
    type: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Users:
    """The road users of a run.

    Attributes:
        prefix: what the names of their signals begin with, `component.connector`.
        times: at which they were told [ns], int64, shape (time,).
        named: who entered, by number, as far as that was recorded.
    """

    prefix: str
    times: Array
    named: Mapping[int, Named]
    _series: Mapping[str, Series]

    def at(self, k: int) -> Snapshot:
        """All of them at `times[k]`.

        Raises:
            RecordingError: that is lost.
        """
        found = {name: np.asarray(each[k]) for name, each in self._series.items()}
        ids = found["id"]
        return Snapshot(
            time=int(self.times[k]),
            ids=ids,
            position=found["position"],
            heading=found["heading"],
            velocity=found["velocity"],
            size=found["size"],
            body=found.get("body", np.full(len(ids), Body.CAR, np.int32)),
        )

    def snapshots(self, lost: Lost) -> Iterator[Snapshot]:
        """All of them, time by time; `lost` takes the times that cannot be read."""
        for k, time in enumerate(self.times.tolist()):
            try:
                yield self.at(k)
            except RecordingError as error:
                lost.note(self.prefix, time, error)

    def name_of(self, number: int) -> str:
        """What the road user of this number is called; the number, if that was not recorded."""
        return self.named[number].name if number in self.named else str(number)


@dataclass(frozen=True, slots=True)
class Building:
    """A building.

    Attributes:
        ring: corners [m], an open ring, shape (corner, 2).
        height: above the ground [m].
    """

    ring: Array
    height: float


@dataclass(frozen=True, slots=True)
class Lights:
    """Traffic lights: where each is [m], shape (signal, 2), and the series of their states."""

    position: Array
    states: Series


@dataclass(frozen=True, slots=True, kw_only=True)
class Surroundings:
    """What stands around.

    Attributes:
        buildings: all of them.
        roads: rings of the drivable surface [m], shape (corner, 2) each.
        lights: of each component that tells of some.
        left_out: what of it cannot be read, a sentence each.
    """

    buildings: tuple[Building, ...]
    roads: tuple[Array, ...]
    lights: tuple[Lights, ...]
    left_out: tuple[str, ...] = field(default=())


def users_of(recording: Recording) -> tuple[Users, list[str]]:
    """The road users of a run, and what is left out.

    Raises:
        ExportError: none are recorded.
        RecordingError: what is recorded of them is lost.
    """
    found = _prefixes(recording, _USER)
    if not found:
        near = _prefixes(recording, {"id": _USER["id"], "position": _USER["position"]})
        names = ", ".join(f"`{name}`" for name in _USER)
        of = f"; of `{near[0]}` not all of these are" if near else ""
        raise ExportError(
            f"no road users are recorded: {names} along one axis of one component{of}"
        )
    prefix, *others = found
    parts = [*_USER, *(["body"] if _is(recording, f"{prefix}.body", _BODY) else [])]
    series = {name: recording[f"{prefix}.{name}"] for name in parts}
    count = min(len(each) for each in series.values())
    left_out = [
        f"road users of `{other}` are left out; those of `{prefix}` are taken" for other in others
    ]
    named, said = _entered(recording, prefix.partition(".")[0])
    users = Users(prefix=prefix, times=series["id"].times[:count], named=named, _series=series)
    return users, [*left_out, *said]


def surroundings_of(recording: Recording) -> Surroundings:
    """The buildings, roads and lights of a run, as far as they are recorded and can be read."""
    buildings: list[Building] = []
    roads: list[Array] = []
    lights: list[Lights] = []
    left_out: list[str] = []
    for prefix in _prefixes(recording, _RINGS):
        try:
            rings = _rings(recording, prefix)
            if _is(recording, f"{prefix}.height", _HEIGHT):
                heights = np.asarray(recording[f"{prefix}.height"].values).tolist()
                buildings += map(Building, rings, heights)
            else:
                roads += rings
        except RecordingError as error:
            left_out.append(f"`{prefix}` is left out: {error}")
    for prefix in _prefixes(recording, _LIGHT):
        try:
            position = np.asarray(recording[f"{prefix}.position"].values).reshape(-1, 2)
            lights.append(Lights(position, recording[f"{prefix}.state"]))
        except RecordingError as error:
            left_out.append(f"`{prefix}` is left out: {error}")
    return Surroundings(
        buildings=tuple(buildings),
        roads=tuple(roads),
        lights=tuple(lights),
        left_out=tuple(left_out),
    )


def driven_in(recording: Recording) -> dict[str, Series]:
    """The series of the numbers of driven entities, -1 while one is not there, by entity."""
    return {
        prefix.rpartition(".")[2]: recording[f"{prefix}.id"]
        for prefix in _prefixes(recording, _DRIVEN)
    }


def binary_signals(recording: Recording, mime: str) -> list[str]:
    """The signals whose contents are of a MIME type."""
    return [name for name in recording.signals if mime_type(recording.kind(name)) == mime]


def _prefixes(
    recording: Recording, wanted: Mapping[str, tuple[str, tuple[int | str, ...], str]]
) -> list[str]:
    """What the names of signals begin with that have all of `wanted`, along the same axes."""
    first = next(iter(wanted))
    candidates = [
        name.removesuffix(f".{first}") for name in recording.signals if name.endswith(f".{first}")
    ]
    found = []
    for prefix in candidates:
        names = [f"{prefix}.{name}" for name in wanted]
        fits = all(_is(recording, f"{prefix}.{name}", type_) for name, type_ in wanted.items())
        if fits and len({axis for name in names for axis in _named_axes(recording, name)}) <= 1:
            found.append(prefix)
    return found


def _named_axes(recording: Recording, name: str) -> list[str]:
    shape = declared_shape(recording.kind(name)) or ()
    return [axis for axis in shape if isinstance(axis, str)]


def _is(recording: Recording, name: str, type_: tuple[str, tuple[int | str, ...], str]) -> bool:
    """Whether a signal of this element type, shape and unit is recorded; `*` is any named axis."""
    if name not in recording:
        return False
    element, shape, unit = type_
    kind = recording.kind(name)
    axes = declared_shape(kind)
    if axes is None or element_type(kind) != element or recording.unit(name) != unit:
        return False
    return tuple("*" if isinstance(axis, str) else axis for axis in axes) == shape


def _rings(recording: Recording, prefix: str) -> list[Array]:
    vertex = np.asarray(recording[f"{prefix}.vertex"].values).reshape(-1, 2)
    index = np.asarray(recording[f"{prefix}.index"].values)
    return [vertex[index == k] for k in range(int(index.max(initial=-1)) + 1)]


def _entered(recording: Recording, component: str) -> tuple[dict[int, Named], list[str]]:
    named: dict[int, Named] = {}
    for signal in binary_signals(recording, ENTERED_MIME):
        if signal.partition(".")[0] != component:
            continue
        try:
            for text in recording[signal]:
                for number, name, type_ in json.loads(bytes(text) or b"[]"):
                    named[int(number)] = Named(str(name), str(type_))
        except RecordingError as error:
            return named, [f"names are left out: {error}"]
    return named, []
