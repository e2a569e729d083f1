"""Recordings of bodies that keep their velocities, and of what their radios did."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from adapters.traffic.connectors import VEHICLES
from fmus.messages.connectors import outputs
from fmus.messages.records import (
    FATES,
    LINKS,
    NO_VEHICLE,
    OBJECT,
    OUTCOMES,
    PACKET,
    RECEPTION,
    TRANSMISSION,
    frame,
)
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Array, Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent
from tests.fmus.boxes import put

MS = 1_000_000
TRAFFIC_STEP, CHANNEL_STEP = 50 * MS, 10 * MS


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A body that is there from `since` until `until` [s]; `start` is its middle at 0 s [m].

    `entity` is what the scenario calls it, if it declares it.
    """

    id: int
    start: tuple[float, float]
    velocity: tuple[float, float] = (0.0, 0.0)
    heading: float | None = None
    size: tuple[float, float, float] = (4.0, 2.0, 1.5)
    ground: float = 0.0
    equipped: bool = True
    entity: str = ""
    since: float = 0.0
    until: float = math.inf


def packet(number: int, source: int, time: float, **more: Any) -> Array:
    """A packet of 200 bytes that is handed over at `time` [s]; a broadcast BSM."""
    row = np.zeros((), PACKET)
    usual = {"destination": NO_VEHICLE, "route": NO_VEHICLE, "size": 200}
    for name, value in (usual | {"id": number, "source": source} | more).items():
        row[name] = value
    row["time"] = round(time * 1e9)
    return row


def reception(
    number: int, ends: tuple[int, int], time: float, outcome: str = "R", **more: Any
) -> Array:
    """What became of a frame of packet `number` from one to the other, at `time` [s]."""
    row = np.zeros((), RECEPTION)
    row["link"] = LINKS.index(more.pop("link", "LOS"))
    for name, value in ({"addressed": 1} | more).items():
        row[name] = value
    row["packet"], row["time"] = number, round(time * 1e9)
    row["transmitter"], row["receiver"] = ends
    row["outcome"] = OUTCOMES.index(outcome)
    return row


def transmission(number: int, transmitter: int, time: float) -> Array:
    """A frame that goes on air at `time` [s]."""
    row = np.zeros((), TRANSMISSION)
    row["packet"], row["transmitter"], row["time"] = number, transmitter, round(time * 1e9)
    row["fate"] = FATES.index("sent")
    return row


def record(
    folder: Path,
    bodies: Sequence[Body],
    stop: float,
    *,
    packets: Sequence[Array] = (),
    receptions: Sequence[Array] = (),
    transmissions: Sequence[Array] = (),
    busy_ratio: Callable[[int], Array] | None = None,
    parameters: Mapping[str, Any] | None = None,
    backwards: bool = False,
    buildings: Sequence[Sequence[tuple[float, float]]] | None = None,
    objects: Sequence[Array] | None = None,
    shared: tuple[int, Sequence[Array]] | None = None,
) -> Recording:
    """Record a run until `stop` [s].

    Args:
        folder: of the run.
        bodies: in any order.
        stop: [s].
        packets: see `packet`.
        receptions: see `reception`.
        transmissions: see `transmission`.
        busy_ratio: of the bodies with ascending ids at a communication point [ns].
        parameters: of the channel, in the manifest.
        backwards: whether descending ids come first.
        buildings: rings of corners, 10 m high each; `None`: not recorded.
        objects: of sensors, see `seen`; `None`: not recorded.
        shared: an ego vehicle, and the objects that it received when their scan says; `None`: not
            recorded.
    """
    ordered = sorted(bodies, key=lambda body: body.id, reverse=backwards)

    def channel(t: int) -> Signals:
        present = _present(ordered, t)
        return {
            "receptions": _told("RCPT", receptions, RECEPTION, t),
            "transmissions": _told("SENT", transmissions, TRANSMISSION, t),
            "busy_ratio": np.zeros(len(present)) if busy_ratio is None else busy_ratio(t),
        }

    units = {
        "traffic": (
            TRAFFIC_STEP,
            _VEHICLE,
            lambda t: _vehicles(_present(ordered, t), t, _entities(bodies)),
        ),
        "facilities": (
            CHANNEL_STEP,
            ("packets",),
            lambda t: {"packets": _told("PKTS", packets, PACKET, t)},
        ),
        "channel": (CHANNEL_STEP, ("receptions", "transmissions", "busy_ratio"), channel),
    }
    if buildings is not None:
        walls = _buildings(buildings)
        units["map"] = (TRAFFIC_STEP, tuple(walls), lambda _: walls)
    if objects is not None:
        units["perception"] = (
            TRAFFIC_STEP,
            ("objects",),
            lambda t: {"objects": _scanned(objects, t)},
        )
    if shared is not None:
        ego, sent = shared
        values = ("ego.id", "received.objects")
        units["listener"] = (
            TRAFFIC_STEP,
            values,
            lambda t: dict(zip(values, (np.array(ego), _scanned(sent, t)), strict=True)),
        )
    system = System(
        {name: _unit(names, values) for name, (_, names, values) in units.items()},
        {name: step for name, (step, _, _) in units.items()},
        [],
    )
    components = {
        "traffic": {"parameters": {"entities": {name: {} for name in _entities(bodies)}}},
        "channel": {"parameters": dict(parameters or {})},
    }
    recorder = Recorder(folder, manifest={"scenario": {"components": components}})
    simulate(system, Jacobi(), start=0, stop=round(stop * 1e9), seed=0, observers=[recorder])
    return Recording(folder)


def seen(sensor: int, place: tuple[float, float], time: float, track: int = 0) -> Array:
    """A metre in the plane that a sensor sees, and tells of, at a communication point [s]."""
    row = np.zeros((), OBJECT)
    row["sensor"], row["instance"], row["time"] = sensor, track, round(time * 1e9)
    put(row, np.array(place) - 0.5, np.array(place) + 0.5)
    return row


def _scanned(objects: Sequence[Array], t: int) -> bytes:
    own = [row for row in objects if row["time"] == t]
    return frame("OBJS", np.array(own, OBJECT)) if own else b""


def _buildings(rings: Sequence[Sequence[tuple[float, float]]]) -> Signals:
    return {
        "building.vertex": np.array([corner for ring in rings for corner in ring], float).reshape(
            -1, 2
        ),
        "building.index": np.repeat(np.arange(len(rings), dtype=np.int32), [len(r) for r in rings]),
        "building.height": np.full(len(rings), 10.0),
    }


_OF_TRAFFIC = {"vehicle.role": VEHICLES["vehicle.role"]}
"""Signals that no component but traffic knows."""

_VEHICLE = tuple(
    f"vehicle.{name}"
    for name in ("id", "position", "heading", "velocity", "size", "equipped", "role")
)


def _entities(bodies: Sequence[Body]) -> list[str]:
    """The names of those whom the scenario declares, in the order of `bodies`."""
    return list(dict.fromkeys(body.entity for body in bodies if body.entity))


def _unit(names: tuple[str, ...], values: Callable[[int], Signals]) -> FunctionComponent:
    known = outputs(*(name for name in names if name not in _OF_TRAFFIC))
    of_traffic = {name: _OF_TRAFFIC[name] for name in names if name in _OF_TRAFFIC}
    return FunctionComponent({**known, **of_traffic}, lambda state, inputs, t: (None, values(t)))


def _present(bodies: Sequence[Body], t: int) -> list[Body]:
    """Those that are there at the newest communication point of traffic at or before `t` [ns]."""
    newest = t // TRAFFIC_STEP * TRAFFIC_STEP * 1e-9
    return [body for body in bodies if body.since <= newest + 1e-9 < body.until]


def _vehicles(bodies: Sequence[Body], t: int, entities: Sequence[str]) -> Signals:
    seconds = t * 1e-9
    places = [
        (
            b.start[0] + b.velocity[0] * seconds,
            b.start[1] + b.velocity[1] * seconds,
            b.ground,
        )
        for b in bodies
    ]
    headings = [math.atan2(*b.velocity[::-1]) if b.heading is None else b.heading for b in bodies]
    return {
        "vehicle.id": np.array([b.id for b in bodies], np.int64),
        "vehicle.position": np.array(places, float).reshape(-1, 3),
        "vehicle.heading": np.array(headings, float),
        "vehicle.velocity": np.array([b.velocity for b in bodies], float).reshape(-1, 2),
        "vehicle.size": np.array([b.size for b in bodies], float).reshape(-1, 3),
        "vehicle.equipped": np.array([b.equipped for b in bodies], bool),
        "vehicle.role": np.array(
            [entities.index(b.entity) + 1 if b.entity else 0 for b in bodies], np.int32
        ),
    }


def _told(magic: str, rows: Sequence[Array], dtype: "np.dtype[Any]", t: int) -> bytes:
    """What happened in the step that ends at `t` [ns]."""
    own = [row for row in rows if t - CHANNEL_STEP < row["time"] <= t]
    own.sort(key=lambda row: int(row["time"]))
    return frame(magic, np.array(own, dtype)) if own else b""
