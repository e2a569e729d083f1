"""From the lidar's points to cells, against brute force and against the lidar itself."""

import dataclasses
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.driving.network.cloud import Cloud, clouds
from fmus.driving.network.scan import CELL, LAYERS, SIDE, Scan, scan_of
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.driving.network.world import HEIGHT, Sensor, points_signal
from tests.fmus.lidar.harness import NO_NOISE, Lidar
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

COUNTS = st.integers(0, 40)
TOP = LAYERS[1] - HEIGHT


def of_points(points: Array) -> Scan:
    (cloud,) = clouds(points_signal(Sensor(vehicle=1, points=points)))
    return scan_of(cloud)


def cells(scan: Scan) -> set[tuple[int, int, int]]:
    """Layer, row and column."""
    return {
        (int(cell) // SIDE**2, int(cell) // SIDE % SIDE, int(cell) % SIDE) for cell in scan.cells
    }


@given(seed=st.integers(0, 10**6), count=COUNTS)
@settings(max_examples=80, deadline=None)
def test_a_cell_is_seen_if_a_point_above_the_ground_is_in_it(seed: int, count: int) -> None:
    """One point after the other; away from borders, where float32 may round to either side."""
    rng = np.random.default_rng(seed)
    row, column = rng.integers(-10, SIDE + 10, (2, count))
    x, y = ((np.array([row, column]) + rng.uniform(0.01, 0.99, (2, count))) - SIDE / 2) * CELL
    z = rng.choice([-2.3, -2.0, -1.75, -1.65, -0.5, -0.25, -0.15, 3.0], count)
    expected = {
        (int(height > TOP), int(r), int(c))
        for r, c, height in zip(row, column, z, strict=True)
        if 0 <= r < SIDE and 0 <= c < SIDE and height > LAYERS[0] - HEIGHT
    }
    found = of_points(np.stack([x, y, z], axis=1))
    assert cells(found) == expected
    assert (np.diff(found.cells) > 0).all()


@given(seed=st.integers(0, 10**6))
@settings(max_examples=20, deadline=None)
def test_centers_and_layers_lead_back_to_the_cells(seed: int) -> None:
    drawn = np.random.default_rng(seed).choice(2 * SIDE**2, 50, replace=False)
    scan = dataclasses.replace(of_points(np.zeros((0, 3))), cells=np.sort(drawn).astype(np.int32))
    x, y = scan.centers()
    z = np.where(scan.layers() == 0, 1.0, 3.0) - HEIGHT
    assert (of_points(np.stack([x, y, z], axis=1)).cells == scan.cells).all()


def test_neither_order_nor_repetition_matters() -> None:
    rng = np.random.default_rng(3)
    points = rng.uniform((-50, -50, -2), (50, 50, 3), (500, 3))
    again = np.concatenate([points[::-1], points[:100]])
    assert of_points(points).cells.tobytes() == of_points(again).cells.tobytes()


def test_only_positions_are_read() -> None:
    """Intensities and instances, which a lidar does not know, change nothing."""
    points = np.random.default_rng(4).uniform((-50, -50, -2), (50, 50, 3), (200, 3))
    sensor = Sensor(vehicle=1, points=points, pitch=0.1, roll=-0.2)
    (one,) = clouds(points_signal(sensor))
    (other,) = clouds(points_signal(sensor, intensity=0.1, instance=17))
    for name in ("x", "y", "z"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes()
    assert scan_of(one).cells.tobytes() == scan_of(other).cells.tobytes()


def test_points_outside_or_not_finite_are_nowhere() -> None:
    reach = SIDE * CELL / 2
    for value in (np.nan, np.inf, -np.inf, 1e30, reach, -reach):
        for at in range(2):
            point = np.zeros((1, 3))
            point[0, at] = value
            assert len(of_points(point).cells) == 0, value
    assert len(of_points(np.array([[0.0, 0.0, np.nan]])).cells) == 0
    edge = float(np.nextafter(np.float32(reach), np.float32(0.0)))
    assert cells(of_points(np.array([[-edge, edge, 0.0]]))) == {(1, 0, SIDE - 1)}


def test_each_sensor_gets_its_own_points() -> None:
    parts = [np.full((count, 3), float(count)) for count in (3, 0, 5)]
    found = clouds(
        points_signal(
            *(
                Sensor(vehicle=k, points=part, time=7, position=(k, 2.0, 3.0), heading=0.5)
                for k, part in enumerate(parts)
            )
        )
    )
    assert [cloud.vehicle for cloud in found] == [0, 1, 2]
    assert [cloud.x.tolist() for cloud in found] == [part[:, 0].tolist() for part in parts]
    assert {(c.time, c.height) for c in found} == {(7, 3.0)}
    assert found[2].frame == Frame(x=2.0, y=2.0, heading=0.5)


def test_no_sensor_and_no_point_are_fine() -> None:
    assert clouds(b"") == []
    (cloud,) = clouds(points_signal(Sensor(vehicle=1, points=np.zeros((0, 3)))))
    assert len(cloud.x) == len(scan_of(cloud).cells) == 0


def test_a_damaged_signal_is_refused() -> None:
    data = points_signal(Sensor(vehicle=3, points=np.zeros((4, 3))))
    with pytest.raises(ValueError, match="`points` announces 4 points and is cut short"):
        clouds(data[:-1])
    damaged = bytearray(data)
    damaged[16 + 64] = 2  # `first` of the record
    with pytest.raises(
        ValueError, match="has 4 points, and those of vehicle 3 are 4 from number 2"
    ):
        clouds(bytes(damaged))
    with pytest.raises(ValueError, match="not a `LPTS` frame"):
        clouds(b"OBJS" + data[4:])


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    folder: Path = tmp_path_factory.mktemp("lidar")
    return Library.build("lidar", folder)


@pytest.fixture
def lidar(library: Library) -> Callable[..., list[Cloud]]:
    """Scans a scene once: the clouds, levelled."""

    def scan(scene: Scene, **parameters: float) -> list[Cloud]:
        with Lidar(library, scene, **NO_NOISE, **parameters) as instance:
            return clouds(instance.start().points())

    return scan


@pytest.mark.parametrize(
    ("pitch", "roll", "heading"),
    [(0.0, 0.0, 0.4), (0.2, 0.0, 0.4), (0.0, 0.3, 0.4), (0.25, -0.35, 0.4), (-0.3, 0.5, -2.8)],
)
def test_levelled_points_lie_on_the_planes_they_were_measured_on(
    lidar: Callable[..., list[Cloud]], pitch: float, roll: float, heading: float
) -> None:
    """The lidar itself, tilted: ground is at z = 0, walls are where they are."""
    ego = Vehicle(id=1, lidar=True, position=(3.0, -2.0, 0.0), heading=heading)
    house = Building(ring=rectangle(3.0, 20.0, 60.0, 10.0), height=8.0)  # its wall: y = 15
    tilt = {"pitch": pitch, "roll": roll, "elevation_top": 0.8, "elevation_bottom": -0.8}
    (cloud,) = lidar(Scene(vehicles=[ego], buildings=[house]), **tilt)
    x, y = cloud.frame.to(Frame(x=0.0, y=0.0, heading=0.0), cloud.x, cloud.y)
    z = cloud.z + cloud.height
    on_ground, on_wall = np.abs(z) < 1e-4, np.abs(y - 15.0) < 1e-4
    assert (on_ground | on_wall).all()
    assert on_ground.sum() > 1000
    assert on_wall.sum() > 1000
    assert (np.abs(x[on_wall] - 3.0) < 30.0 + 1e-4).all()
    assert z[on_wall].min() > -1e-4
    assert z[on_wall].max() < 8.0 + 1e-4
    assert math.isclose(cloud.height, 2.0)


def test_a_tilted_sensor_sees_the_same_vehicle(lidar: Callable[..., list[Cloud]]) -> None:
    ego = Vehicle(id=1, lidar=True, heading=1.0)
    other = Vehicle(id=2, position=(10.0, 12.0, 0.0), heading=0.3)
    (level,) = map(scan_of, lidar(Scene(vehicles=[ego, other])))
    (tilted,) = map(scan_of, lidar(Scene(vehicles=[ego, other]), pitch=0.03, roll=-0.02))
    assert 10 < len(level.cells) < 40
    both = np.intersect1d(level.cells, tilted.cells)
    assert len(both) > 0.6 * max(len(level.cells), len(tilted.cells))
