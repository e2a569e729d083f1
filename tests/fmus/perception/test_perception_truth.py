"""How well bodies are found and tracked, against the simulator's truth.

`python -m tests.fmus.perception.test_perception_truth` prints the figures of
docs/physics-perception.md.
"""

import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
import pytest
from typing_extensions import override

from fmus.messages.apm import Float
from fmus.messages.bodies import Body
from fmus.messages.records import SENSOR, frame, unframe
from fmus.physics.boxes import in_boxes
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.lidar.harness import BUS, CAR, SUV, TRUCK, VAN, Lidar
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import Perception

CLUSTERS, LABELS = 1, 2  # values of `segmentation`
MODES: Final = {
    "labels": (LABELS, False),
    "clusters, map": (CLUSTERS, True),
    "clusters": (CLUSTERS, False),
}
"""Segmentation, and whether there is a map."""
SCANS: Final = 60
SETTLED: Final = 5
"""Scans after which the velocity of a track is judged."""
NORTH, EAST, SOUTH, WEST = np.pi / 2, 0.0, -np.pi / 2, np.pi
HOUSES: Final = tuple(
    Building(ring=rectangle(30.0 * x, 30.0 * y, 36.0, 36.0), height=12.0)
    for x in (-1, 1)
    for y in (-1, 1)
)
KINDS: Final = {
    CAR: (4.5, 1.8, 1.5), SUV: (4.9, 1.95, 1.75), VAN: (5.9, 2.0, 2.6),
    BUS: (12.0, 2.55, 3.0), TRUCK: (8.0, 2.5, 4.0),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Mover:
    """A vehicle that keeps its velocity."""

    vehicle: Vehicle
    speed: float = 0.0

    def velocity(self) -> Float:
        heading = self.vehicle.heading
        return self.speed * np.array([np.cos(heading), np.sin(heading)])

    def at(self, t: float) -> Vehicle:
        x, y = np.array(self.vehicle.position[:2]) + t * self.velocity()
        return replace(self.vehicle, position=(float(x), float(y), 0.0))


def mover(
    number: int, kind: int, place: tuple[float, float], heading: float, speed: float = 0.0
) -> Mover:
    vehicle = Vehicle(
        id=number,
        position=(*place, 0.0),
        heading=heading,
        size=KINDS[Body(kind)],
        body=kind,
        lidar=number <= 2,
    )
    return Mover(vehicle=vehicle, speed=speed)


def crossroads() -> list[Mover]:
    """Two sensors, a queue of trucks, cars that queue, cross, follow and come towards."""
    return [
        mover(1, CAR, (5.5, -40.0), NORTH, 5.0),
        mover(2, CAR, (-2.0, 28.0), SOUTH, 4.0),
        *(mover(3 + k, TRUCK, (2.0, -13.0 - 10.0 * k), NORTH) for k in range(3)),
        *(mover(6 + k, CAR, (-5.5, 15.0 + 6.7 * k), SOUTH) for k in range(4)),
        mover(10, CAR, (-60.0, -2.0), EAST, 10.0),
        mover(11, SUV, (-45.0, -5.5), EAST, 12.0),
        mover(12, VAN, (62.0, 2.0), WEST, 8.0),
        mover(13, BUS, (52.0, 5.5), WEST, 6.0),
        mover(14, CAR, (5.5, -30.5), NORTH, 5.0),
        mover(15, SUV, (-8.5, 60.0), SOUTH, 9.0),
        mover(16, TRUCK, (5.5, 25.0), NORTH, 4.0),
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scores:
    """What became of the vehicles with points enough, over all scans and sensors.

    Attributes:
        once, split, missed: shares of the vehicles that are one object, several, none.
        false: share of the objects in no vehicle.
        merged: share of the objects that hold several vehicles.
        switches: changes of the track of a vehicle, per vehicle and second.
        error: of the velocities of vehicles seen for `SETTLED` scans [m/s].
        standing: speeds of those that stand [m/s].
    """

    once: float
    split: float
    missed: float
    false: float
    merged: float
    switches: float
    error: Float
    standing: Float

    @override
    def __str__(self) -> str:
        shares = (self.once, self.split, self.missed, self.false, self.merged)
        return " | ".join(
            [f"{100 * share:.1f} %" for share in shares]
            + [f"{self.switches:.3f} /s"]
            + [
                f"{np.median(e):.2f}, {np.percentile(e, 95):.2f}"
                for e in (self.error, self.standing)
            ]
        )


def clouds(lidar: Library, movers: list[Mover]) -> list[bytes]:
    """The scans of all sensors."""
    found = []
    for k in range(SCANS):
        scene = Scene(vehicles=[m.at(0.1 * k) for m in movers], buildings=HOUSES)
        eyes = Lidar(lidar, scene).start()
        points = eyes.points()
        eyes.free()
        sensors = unframe("LPTS", points, SENSOR).copy()
        sensors["time"] = k * 10**8
        found.append(frame("LPTS", sensors, points[16 + sensors.nbytes :]))
    return found


def detected(library: Library, scans: list[bytes], mode: str) -> list[Array]:
    """The objects of every scan."""
    segmentation, has_map = MODES[mode]
    with Perception(library, segmentation=segmentation) as unit:
        unit.begin()
        if has_map:
            unit.resize(n_building_vertex=4 * len(HOUSES))
            unit.set("building.vertex", np.array([house.ring for house in HOUSES]))
            unit.set("building.index", np.repeat(range(len(HOUSES)), 4))
        found = []
        for points in scans:
            unit.set_inputs(points)
            unit.advance()
            found.append(unit.outputs().objects.copy())
    return found


def depth(objects: Array, vehicle: Vehicle, *, margin: float) -> Array:
    """Whether the middle of each object is in a body grown by `margin` [m]."""
    offset = objects["position"] - vehicle.position[:2]
    cos, sin = np.cos(vehicle.heading), np.sin(vehicle.heading)
    along = np.abs(offset @ (cos, sin)) <= vehicle.size[0] / 2 + margin
    across = np.abs(offset @ (-sin, cos)) <= vehicle.size[1] / 2 + margin
    return np.asarray(along & across)


def per_sensor(objects: list[Array], ideal: list[Array]) -> Iterator[tuple[int, int, Array, Array]]:
    """Scan, sensor, its objects and those of the ideal detector."""
    for k, (found, truth) in enumerate(zip(objects, ideal, strict=True)):
        for sensor in (1, 2):
            yield k, sensor, found[found["sensor"] == sensor], truth[truth["sensor"] == sensor]


def score(movers: list[Mover], objects: list[Array], ideal: list[Array]) -> Scores:
    """Compare the objects with those of the ideal detector and with the vehicles."""
    by_number = {m.vehicle.id: m for m in movers}
    counts: list[int] = []
    total = false = merged = switches = 0
    tracks: dict[tuple[int, int], tuple[int, int, int]] = {}  # last scan, number, scans
    errors: list[float] = []
    standing: list[float] = []
    for k, sensor, found, truth in per_sensor(objects, ideal):
        bodies = {n: m.at(0.1 * k) for n, m in by_number.items()}
        total += len(found)
        inside = [depth(found, body, margin=0.5) for body in bodies.values()]
        false += int((~np.any(inside, axis=0)).sum())
        middle = truth["position"]
        for one in found:
            local = in_boxes(middle[:, None], one["position"], one["angle"])[:, 0]
            held = np.abs(local) <= one["size"] / 2 + 0.1
            merged += held.all(axis=1).sum() > 1
        for number in map(int, truth["instance"]):
            mine = found[depth(found, bodies[number], margin=0.5)]
            counts.append(len(mine))
            if not len(mine):
                continue
            best = mine[np.argmax(mine["points"])]
            last, track, scans = tracks.get((sensor, number), (-2, -1, 0))
            scans = scans + 1 if last == k - 1 else 1
            switches += last == k - 1 and track != best["instance"]
            tracks[sensor, number] = (k, int(best["instance"]), scans)
            if scans > SETTLED:
                velocity = by_number[number].velocity()
                errors.append(float(np.hypot(*(best["velocity"] - velocity))))
                if by_number[number].speed == 0.0:
                    standing.append(errors[-1])
    seen = np.array(counts)
    return Scores(
        once=float((seen == 1).mean()),
        split=float((seen > 1).mean()),
        missed=float((seen == 0).mean()),
        false=false / total,
        merged=merged / total,
        switches=switches / (0.1 * len(seen)),
        error=np.array(errors),
        standing=np.array(standing),
    )


@pytest.fixture(scope="module")
def lidar(tmp_path_factory: pytest.TempPathFactory) -> Library:
    """The lidar, as built for this machine."""
    return Library.build("lidar", tmp_path_factory.mktemp("lidar"))


@pytest.fixture(scope="module")
def scored(library: Library, lidar: Library) -> Callable[[str], Scores]:
    """The scores of a mode."""
    movers = crossroads()
    scans = clouds(lidar, movers)
    ideal = detected(library, scans, "labels")
    return lambda mode: score(movers, detected(library, scans, mode), ideal)


def test_the_ideal_detector_finds_every_vehicle(scored: Callable[[str], Scores]) -> None:
    found = scored("labels")
    assert (found.once, found.false, found.merged, found.switches) == (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(("mode", "false"), [("clusters, map", 0.01), ("clusters", 0.25)])
def test_nearly_every_vehicle_is_found_once_without_labels(
    scored: Callable[[str], Scores], mode: str, false: float
) -> None:
    found = scored(mode)
    assert found.once > 0.92
    assert found.split < 0.01
    assert found.merged < 0.06
    assert found.switches < 0.1  # of one vehicle, per second
    assert found.false < false


def test_velocities_do_not_need_labels(scored: Callable[[str], Scores]) -> None:
    found = scored("clusters, map")
    assert np.median(found.error) < 0.1
    assert np.percentile(found.error, 95) < 0.8
    assert np.percentile(found.standing, 95) < 0.6


def main() -> None:
    """Print the figures of the documentation."""
    library, lidar = (
        Library.build(name, Path(tempfile.mkdtemp())) for name in ("perception", "lidar")
    )
    movers = crossroads()
    scans = clouds(lidar, movers)
    ideal = detected(library, scans, "labels")
    for mode in MODES:
        scores = score(movers, detected(library, scans, mode), ideal)
        sys.stdout.write(f"| {mode} | {scores} |\n")


if __name__ == "__main__":
    main()
