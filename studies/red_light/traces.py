"""The recording of a red-light run, read into tables."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, Protocol

import numpy as np
import numpy.typing as npt

from fmus.messages.records import OBJECT, PACKET, RECEPTION, SENSOR_DATA, unframe
from fmus.physics.boxes import corners
from studies.red_light.polygons import polygon_distance
from studies.red_light.roles import COLLISION, EGO, USUAL, Names, roles_of

Array = npt.NDArray[Any]


class Series(Protocol):
    """One recorded signal."""

    @property
    def times(self) -> Array:
        """Communication points of the samples [ns], int64, shape (sample,)."""

    def __len__(self) -> int:
        """Number of samples."""

    def __getitem__(self, index: int) -> Any:
        """One sample."""

    def at(self, t: int) -> Any:
        """The newest sample at or before `t`."""


class Recording(Protocol):
    """Recorded signals by name, `component.connector`."""

    @property
    def manifest(self) -> Mapping[str, Any]:
        """What was run: `scenario` is the resolved one."""

    def __getitem__(self, name: str) -> Series:
        """One signal."""

    def __contains__(self, name: str) -> bool:
        """Whether it was recorded."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """All vehicles at one communication point.

    Attributes:
        time: the communication point [ns].
        ids: ids of the vehicles, int64, shape (vehicle,).
        position: middles of the bodies in the plane, and height of the ground [m], shape
            (vehicle, 3).
        heading: counter-clockwise from east [rad], shape (vehicle,).
        velocity: towards east and north [m/s], shape (vehicle, 2).
        size: length, width and height [m], shape (vehicle, 3).
        role: one of `studies.red_light.roles` each, shape (vehicle,).
    """

    time: int
    ids: Array
    position: Array
    heading: Array
    velocity: Array
    size: Array
    role: Array

    def row(self, role: int) -> int | None:
        """The row of the first vehicle with `role`."""
        rows = np.flatnonzero(self.role == role)
        return int(rows[0]) if len(rows) else None

    def corners(self, rows: Sequence[int] | slice = slice(None)) -> Array:
        """Footprints of the vehicles in `rows`, counter-clockwise [m], shape (vehicle, 4, 2)."""
        return corners(self.position[rows, :2], self.heading[rows], self.size[rows, :2])


_SCENE: Final = {
    "ids": "traffic.vehicle.id",
    "position": "traffic.vehicle.position",
    "heading": "traffic.vehicle.heading",
    "velocity": "traffic.vehicle.velocity",
    "size": "traffic.vehicle.size",
}
"""The signal of each array of a `Scene` that is as recorded."""


_ROLE: Final = "traffic.vehicle.role"


class Traces:
    """A recording with its signals opened once and its events read once.

    Args:
        recording: the signals, and the manifest with the resolved scenario.
        names: what the scenario calls entities and components; signals are asked for by the names
            that they have in the shipped scenario.

    Raises:
        ValueError: when roles are read: vehicles are entities that the scenario does not declare.
    """

    def __init__(self, recording: Recording, names: Names = USUAL) -> None:
        self._recording = recording
        self._series: dict[str, Series] = {}
        self._names = names
        self._roles = roles_of(recording.manifest, names)

    def series(self, name: str) -> Series:
        """The recorded signal called `name`."""
        if name not in self._series:
            self._series[name] = self._recording[self._names.signal(name)]
        return self._series[name]

    def has(self, name: str) -> bool:
        """Whether the signal called `name` was recorded."""
        return self._names.signal(name) in self._recording

    def at(self, name: str, time: int) -> Any:
        """The newest sample of a signal at or before `time` [ns]."""
        return self.series(name).at(time)

    @property
    def end(self) -> int:
        """The last communication point of traffic [ns]."""
        return int(self.series("traffic.vehicle.id").times[-1])

    def scene(self, time: int) -> Scene:
        """The scene at the last communication point of traffic at or before `time` [ns]."""
        fields = {field: np.asarray(self.at(name, time)) for field, name in _SCENE.items()}
        return Scene(time=time, role=self._role(self.at(_ROLE, time)), **fields)

    def scenes(self) -> Iterator[Scene]:
        """Every scene, in order of time."""
        for k, time in enumerate(self.series("traffic.vehicle.id").times.tolist()):
            fields = {field: np.asarray(self.series(name)[k]) for field, name in _SCENE.items()}
            yield Scene(time=time, role=self._role(self.series(_ROLE)[k]), **fields)

    def vehicle_with(self, role: int) -> int | None:
        """The id of the first vehicle that has `role` in the run."""
        roles, ids = self.series(_ROLE), self.series("traffic.vehicle.id")
        for k in range(len(roles)):
            rows = np.flatnonzero(self._role(roles[k]) == role)
            if len(rows):
                return int(np.asarray(ids[k])[rows[0]])
        return None

    def role_of(self, vehicle: int) -> int | None:
        """The role of the vehicle with id `vehicle`; `None` if it never entered."""
        roles, ids = self.series(_ROLE), self.series("traffic.vehicle.id")
        for k in reversed(range(len(roles))):
            rows = np.flatnonzero(np.asarray(ids[k]) == vehicle)
            if len(rows):
                return int(self._role(roles[k])[rows[0]])
        return None

    @cached_property
    def gap_to_hidden(self) -> Array:
        """Times [s] and distances between ego and collision vehicle [m], shape (sample, 2)."""
        rows = []
        for scene in self.scenes():
            ego, hidden = scene.row(EGO), scene.row(COLLISION)
            if ego is not None and hidden is not None:
                rows.append((scene.time / 1e9, polygon_distance(*scene.corners([ego, hidden]))))
        return np.array(rows).reshape(-1, 2)

    @cached_property
    def packets(self) -> Array:
        """All packets handed to the radios, `PACKET` records, shape (packet,)."""
        return self._table("facilities.packets", "PKTS", PACKET)

    @cached_property
    def receptions(self) -> Array:
        """All receptions of sensor data, `RECEPTION` records, shape (reception,)."""
        return self._table("channel.receptions", "RCPT", RECEPTION, kind=SENSOR_DATA)

    def objects(self, name: str) -> Iterator[tuple[int, Array]]:
        """Time [ns] and `OBJECT` records, shape (object,), of each sample of an objects signal."""
        series = self.series(name)
        for k, time in enumerate(series.times):
            yield int(time), unframe("OBJS", bytes(series[k]), OBJECT)

    def scalars(self, name: str) -> tuple[Array, Array]:
        """Times [s] and values of a scalar signal, in its unit, each of shape (sample,)."""
        series = self.series(name)
        values = np.array([np.asarray(series[k]) for k in range(len(series))])
        return np.asarray(series.times) / 1e9, values

    def _role(self, numbers: Any) -> Array:
        """The roles for which values of `vehicle.role` stand, shape (vehicle,)."""
        recorded = np.asarray(numbers)
        if recorded.size and recorded.max() >= len(self._roles):
            raise ValueError(
                f"`{_ROLE}` has {recorded.max()}, but the scenario of the recording declares "
                f"{len(self._roles) - 1} entities; repeat the run with this version of nlosim"
            )
        return np.asarray(self._roles[recorded])

    def _table(self, name: str, magic: str, dtype: np.dtype[Any], kind: int | None = None) -> Array:
        series = self.series(name)
        tables = [unframe(magic, bytes(series[k]), dtype) for k in range(len(series))]
        if kind is not None:
            tables = [table.compress(table["kind"] == kind) for table in tables]
        # in bytes, because NumPy compares the fields of all tables before it joins them
        return np.frombuffer(bytearray().join(table.tobytes() for table in tables), dtype)
