"""Everybody on the road: where each was, who each is."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from orchestrator.page.layer import PageOfRun
from orchestrator.recording.layout import RecordingError
from orchestrator.signal import Array
from studies.measures.vehicles import Vehicles, vehicles_in

MOST_ROWS: Final = 500_000
"""Places of vehicles on a page; of a larger run every second, third, ... time is kept."""

_CENTIMETRE: Final = 0.01
_DIRECTIONS: Final = 4096


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Crowd:
    """Everybody who was ever there.

    Attributes:
        vehicles: all rows.
        ids: numbers, ascending, int64, shape (vehicle,).
        names: of each; empty where nothing says it.
        roles: of each, 0 if it is not declared, shape (vehicle,).
        radio: whether each has one, shape (vehicle,).
        data: what the scripts read.
    """

    vehicles: Vehicles
    ids: Array
    names: tuple[str, ...]
    roles: Array
    radio: Array
    data: Mapping[str, Any]

    def index(self, ids: Array) -> Array:
        """Places among all vehicles, -1 of who is none of them.

        Args:
            ids: numbers, any shape.

        Returns:
            Of the shape of `ids`, int64.
        """
        place = np.searchsorted(self.ids, ids).clip(0, max(0, len(self.ids) - 1))
        if not len(self.ids):
            return np.full(np.shape(ids), -1)
        return np.where(self.ids[place] == ids, place, -1)


def crowd_of(run: PageOfRun, traffic: str) -> Crowd:
    """Read everybody.

    Args:
        run: with `traffic.vehicle.*`.
        traffic: the component.

    Raises:
        RecordingError: a signal that is needed was not recorded.
        ValueError: there is nobody at any time.
    """
    vehicles = vehicles_in(run.recording, f"{traffic}.vehicle")
    ids, first = np.unique(vehicles.ids, return_index=True)
    names, kinds = _named(run, traffic, ids)
    stride = max(1, -(-len(vehicles.ids) // MOST_ROWS))
    points = np.arange(0, len(vehicles.times), stride)
    kept = np.isin(vehicles.points, points)
    frame = vehicles.points[kept] // stride
    order = np.lexsort((frame, vehicles.ids[kept]))
    rows = np.flatnonzero(kept)[order]
    frame = frame[order]
    owner = np.searchsorted(ids, vehicles.ids[rows])
    begins = np.ones(len(rows), bool)  # of a stretch of one vehicle without a gap
    begins[1:] = (np.diff(owner) != 0) | (np.diff(frame) != 1)
    starts = np.flatnonzero(begins)
    heading = _all(run, vehicles, f"{traffic}.vehicle.heading", 0.0)[rows]
    turn = np.rint(heading / (2 * np.pi) * _DIRECTIONS).astype(np.int64) % _DIRECTIONS
    add, place = run.arrays.add, vehicles.position[rows]
    size = _all(run, vehicles, f"{traffic}.vehicle.size", np.array([4.5, 1.8, 1.5]))[first]

    def once(name: str) -> Array:
        return np.asarray(_all(run, vehicles, f"{traffic}.vehicle.{name}", 0)[first])

    roles, radio = once("role"), once("equipped").astype(bool)

    data = {
        "ids": add(ids, "i4", deltas=1),
        "names": list(names),
        "kinds": list(kinds),
        "size": run.arrays.rounded(size, _CENTIMETRE),
        "body": add(once("body"), "u1"),
        "role": add(roles, "i4"),
        "radio": add(radio, "u1"),
        "lidar": add(once("lidar"), "u1"),
        "times": run.times(vehicles.times[points]),
        "stretches": {
            "vehicle": add(owner[starts], "i4", deltas=1),
            "first": add(frame[starts], "i4"),
            "count": add(np.diff(np.append(starts, len(rows))), "i4"),
        },
        "x": run.arrays.rounded(place[:, 0], _CENTIMETRE, deltas=2),
        "y": run.arrays.rounded(place[:, 1], _CENTIMETRE, deltas=2),
        "heading": add(turn, "u2", deltas=1),
        "directions": _DIRECTIONS,
        "stride": stride,
    }
    return Crowd(vehicles=vehicles, ids=ids, names=names, roles=roles, radio=radio, data=data)


def _all(run: PageOfRun, vehicles: Vehicles, signal: str, otherwise: Any) -> Array:
    """A signal of all rows; where it was not recorded, the same for all."""
    try:
        return vehicles.values(run.recording, signal)
    except (RecordingError, ValueError):
        return np.broadcast_to(otherwise, (len(vehicles.ids), *np.shape(otherwise)))


def _named(run: PageOfRun, traffic: str, ids: Array) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The name and the type of each; empty where `entered` does not say it."""
    found: dict[int, tuple[str, str]] = {}
    if f"{traffic}.entered" in run.recording:
        for sample in run.recording[f"{traffic}.entered"]:
            for number, name, kind in json.loads(bytes(sample) or b"[]"):
                found[int(number)] = (str(name), str(kind))
    known = [found.get(number, ("", "")) for number in ids.tolist()]
    return tuple(name for name, _ in known), tuple(kind for _, kind in known)
