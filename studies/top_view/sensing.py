"""What sensors see and what is made of it: objects, blind zones, matrices, points."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

import numpy as np

from fmus.messages.apm import decode, split
from fmus.messages.records import BUILDING, GROUND, OBJECT, POINT, POINTS_MIME, SENSOR, unframe
from orchestrator.page.layer import PageOfRun
from orchestrator.recording.reader import Series
from orchestrator.signal import Array
from studies.top_view.crowd import Crowd
from studies.top_view.signals import Sources

MOST_BOXES: Final = 50_000
MOST_CELLS: Final = 300_000
MOST_POINTS: Final = 120_000

_GRID: Final = 0.4
"""Points of one scan within a square of so many metres are one on the page."""

_SHADES: Final = 30
"""Steps from no points to many, of their logarithm."""

_MANY: Final = 200.0


def sensing_of(run: PageOfRun, sources: Sources, crowd: Crowd) -> Mapping[str, Any]:
    """What is recorded of it, by what it is."""
    objects = [_objects(run, name, crowd) for name in sources.objects]
    zones = [_zones(run, name) for name in sources.zones]
    matrices = [_matrices(run, name, crowd) for name in sources.matrices]
    points = [_points(run, name, crowd) for name in sources.points]
    return {
        "objects": [each for each in objects if each],
        "zones": [each for each in zones if each],
        "matrices": [each for each in matrices if each],
        "points": [each for each in points if each],
    }


def _new(series: Series) -> Iterator[tuple[int, bytes]]:
    """The values of a Binary signal that is held, whenever there is something new."""
    former = b""
    for k, time in enumerate(series.times.tolist()):
        data = bytes(series[k])
        if data != former:
            yield time, data
        former = data


def every(count: int, most: int) -> int:
    """Every how manyth of `count` things is kept for them to be `most`, or nearly."""
    return max(1, -(-count // most))


def _objects(run: PageOfRun, name: str, crowd: Crowd) -> Mapping[str, Any] | None:
    scans = [(time, unframe("OBJS", data, OBJECT)) for time, data in _new(run.recording[name])]
    stride = every(sum(len(table) for _, table in scans), MOST_BOXES)
    scans = scans[::stride]
    table = np.concatenate([np.empty(0, OBJECT), *(each for _, each in scans)])
    if not len(table):
        return None
    rounded, add = run.arrays.rounded, run.arrays.add
    return {
        "name": name,
        "told": "received" in name,
        "times": run.times(np.array([time for time, _ in scans])),
        "ends": add(np.cumsum([len(each) for _, each in scans]), "i4", deltas=1),
        "sensor": add(crowd.index(table["sensor"]), "i4"),
        "scanned": run.times(table["time"], 1_000_000),
        "position": rounded(table["position"], 0.05),
        "angle": rounded(table["angle"], 0.005),
        "size": rounded(table["size"], 0.05),
        "stride": stride,
    }


def _zones(run: PageOfRun, name: str) -> Mapping[str, Any] | None:
    centers, ranges = run.recording[f"{name}.center"], run.recording[f"{name}.range"]
    lengths = np.array([len(np.asarray(each)) for each in ranges], np.int64)
    if not lengths.sum():
        return None
    return {
        "name": name,
        "times": run.times(ranges.times),
        "ends": run.arrays.add(np.cumsum(lengths), "i4", deltas=1),
        "center": run.arrays.rounded(centers.values, 0.1),
        "range": run.arrays.rounded(ranges.values, 0.1),
    }


def _matrices(run: PageOfRun, name: str, crowd: Crowd) -> Mapping[str, Any] | None:
    times, messages = [], []
    for time, data in _new(run.recording[name]):
        for message in split(data):
            times.append(time)
            messages.append(message)
    if not messages:
        return None
    cells = decode(messages[0]).cells.size
    stride = every(len(messages) * cells, MOST_CELLS)
    scans = sorted(set(times))[::stride]
    kept = [(t, decode(m)) for t, m in zip(times, messages, strict=True) if t in set(scans)]
    every_one = [each for _, each in kept]
    shades = [_shade(each.cells, each.levels).reshape(-1) for each in every_one]
    rounded, add = run.arrays.rounded, run.arrays.add
    return {
        "name": name,
        "times": run.times(np.array([time for time, _ in kept])),
        "vehicle": add(crowd.index(np.array([each.vehicle for each in every_one])), "i4"),
        "center": rounded(np.array([each.center for each in every_one]), 0.05),
        "heading": rounded(np.array([each.heading for each in every_one]), 0.001),
        "cell": rounded(np.array([each.cell for each in every_one]), 0.01),
        "rows": add(np.array([each.cells.shape[0] for each in every_one]), "i4"),
        "columns": add(np.array([each.cells.shape[1] for each in every_one]), "i4"),
        "shade": add(np.concatenate(shades), "u1"),
        "most": _SHADES,
        "stride": stride,
    }


def _shade(cells: Array, levels: int) -> Array:
    """How dark a cell is: 0 for nothing, then 1 to `_SHADES`."""
    if levels:
        return np.ceil(cells / levels * _SHADES).astype(np.uint8)
    found = np.ceil(np.log2(1.0 + cells) / np.log2(1.0 + _MANY) * _SHADES)
    return np.asarray(found.clip(0, _SHADES), np.uint8)


def _points(run: PageOfRun, name: str, crowd: Crowd) -> Mapping[str, Any] | None:
    """Points that are not on the ground, thinned out, in the world."""
    scans = [(time, _thin(data)) for time, data in _new(run.recording[name])]
    stride = every(sum(len(each) for _, each in scans), MOST_POINTS)
    scans = scans[::stride]
    table = np.concatenate([np.empty((0, 4)), *(each for _, each in scans)])
    if not len(table):
        return None
    return {
        "name": name,
        "mime": POINTS_MIME,
        "times": run.times(np.array([time for time, _ in scans])),
        "ends": run.arrays.add(np.cumsum([len(each) for _, each in scans]), "i4", deltas=1),
        "x": run.arrays.rounded(table[:, 0], 0.1),
        "y": run.arrays.rounded(table[:, 1], 0.1),
        "building": run.arrays.add(table[:, 2], "u1"),
        "sensor": run.arrays.add(crowd.index(table[:, 3].astype(np.int64)), "i4", deltas=1),
        "stride": stride,
    }


def _thin(data: bytes) -> Array:
    """East, north, whether on a building, and who sees it; of one scan, shape (point, 4)."""
    sensors = unframe("LPTS", data, SENSOR)
    if not len(sensors):
        return np.empty((0, 4))
    every_point = np.frombuffer(data, POINT, offset=16 + sensors.nbytes)
    found: Sequence[Array] = [_seen(sensor, every_point) for sensor in sensors]
    return np.concatenate(found)


def _seen(sensor: Any, every_point: Array) -> Array:
    first = int(sensor["first"])
    points = every_point[first : first + int(sensor["count"])]
    points = points[points["instance"] != GROUND]
    x, y = points["position"][:, 0], points["position"][:, 1]
    sine, cosine = np.sin(sensor["heading"]), np.cos(sensor["heading"])
    place = np.column_stack([x * cosine - y * sine, x * sine + y * cosine])
    place += sensor["position"][:2]
    east, north = np.floor(place / _GRID).astype(np.int64).T
    _, first_of = np.unique((east << 32) + north, return_index=True)
    first_of.sort()
    is_building = points["instance"][first_of] <= BUILDING
    owner = np.full(len(first_of), float(sensor["vehicle"]))
    return np.column_stack([place[first_of], is_building, owner])
