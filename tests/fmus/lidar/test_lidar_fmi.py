"""The unit behind FMI: refused inputs, changing sizes and saved states."""

import dataclasses
import math

import numpy as np
import pytest

from tests.fmus.driver import Library, Refused
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import NO_NOISE, Lidar, clouds

A = Vehicle(id=3, lidar=True)
B = Vehicle(id=5, position=(10.0, 0.0, 0.0))
HOUSE = Building(ring=rectangle(20.0, 0.0, 5.0, 5.0))
GOOD = Scene(vehicles=[A, B], buildings=[HOUSE, HOUSE])
INDEX = [0, 0, 0, 0, 1, 1, 1, 1]

WRONG = [
    ("vehicle.position", [[0, 0, 0], [1, math.nan, 0]], r"vehicle.position\[1, 1\] is -?nan; c"),
    ("vehicle.position", [[math.inf, 0, 0], [1, 1, 0]], r"vehicle.position\[0, 0\] is inf; c"),
    ("vehicle.position", [[0, 0, 1e300], [1, 1, 0]], r"vehicle.position\[0, 2\] is 1e\+300; c"),
    ("vehicle.heading", [0, math.nan], r"vehicle.heading\[1\] is -?nan; it must be finite"),
    ("vehicle.heading", [1e9, 0], r"vehicle.heading\[0\] is 1e\+09; .* within \+-1e\+06 rad"),
    ("vehicle.size", [[4, 2, 1], [4, -2, 1]], r"vehicle.size\[1, 1\] is -2; length, width and"),
    ("vehicle.size", [[4, 2, 0], [4, 2, 1]], r"vehicle.size\[0, 2\] is 0; .* must be positive"),
    ("vehicle.size", [[4, 2, 1], [math.nan, 2, 1]], r"vehicle.size\[1, 0\] is -?nan"),
    ("vehicle.body", [0, 9], r"vehicle.body\[1\] is 9; it must be one of 0 car, .*, 8 pedestrian"),
    ("vehicle.body", [-1, 0], r"vehicle.body\[0\] is -1; it must be one of 0 car, 1 SUV or"),
    ("vehicle.id", [5, 3], r"vehicle.id\[1\] is 3 after 5; ids must ascend, each once"),
    ("vehicle.id", [5, 5], r"vehicle.id\[1\] is 5 after 5; ids must ascend, each once"),
    ("vehicle.id", [-1, 5], r"vehicle.id\[0\] is -1; ids are 0 ... 2147483647"),
    ("vehicle.id", [0, 2**31], r"vehicle.id\[1\] is 2147483648; ids are 0 ... 2147483647"),
    ("building.vertex", [[0, 0]] * 7 + [[math.inf, 0]], r"building.vertex\[7, 0\] is inf; c"),
    ("building.index", [0, 0, 0, 0, 1, 1, 1, 2], r"building.index\[7\] is 2; there are 2 build"),
    ("building.index", [-1, *INDEX[1:]], r"building.index\[0\] is -1; there are 2 buildings"),
    ("building.index", [0, 0, 0, 1, 0, 1, 1, 1], r"building.index\[4\] is 0 after 1; it must not"),
    ("building.index", [0] * 6 + [1] * 2, r"building 1 has 2 corners in building.index; it needs"),
    ("building.index", [1] * 8, r"building 0 has 0 corners in building.index; it needs"),
    ("building.height", [3, -1], r"building.height\[1\] is -1; heights must be positive"),
    ("building.height", [math.nan, 3], r"building.height\[0\] is -?nan; heights must be"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "value", "message"), WRONG)
def test_wrong_inputs_are_refused_with_their_index(
    library: Library, name: str, value: list[float], message: str
) -> None:
    lidar = Lidar(library, GOOD).start()
    lidar.set(name, np.array(value))
    with pytest.raises(Refused, match=message):
        lidar.step(0.0, 0.1)
    lidar.free()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("channels", 0), ("channels", 513), ("azimuths", 3), ("azimuths", 8193), ("range", 0),
        ("range", math.nan), ("range", 2000), ("elevation_top", 1.6), ("elevation_bottom", -1.6),
        ("range_noise", -0.1), ("dropout", 1.1), ("mount_height", -1), ("pitch", 2), ("roll", 4),
    ],
)  # fmt: skip
def test_parameters_out_of_bounds_are_refused(library: Library, name: str, value: float) -> None:
    with pytest.raises(Refused, match=f"`{name}` is"):
        Lidar(library, GOOD, **{name: value})


def test_channels_must_go_downwards(library: Library) -> None:
    lidar = Lidar(library, GOOD, elevation_top=-0.4)
    with pytest.raises(Refused, match=r"elevation_bottom is -0.349066 rad; it must be less than"):
        lidar.start()
    lidar.free()


def test_start_values_are_a_valid_scene(library: Library) -> None:
    lidar = Lidar(library, None).start()
    lidar.step(0.0, 0.1)
    assert clouds(lidar.points()) == {}
    lidar.free()


def test_vehicles_come_and_go(library: Library) -> None:
    lidar = Lidar(library, GOOD, **NO_NOISE).start()
    assert clouds(lidar.points())[3].instances == {-1, -2, 5}
    for step, scene in enumerate([Scene(vehicles=[A]), Scene(), GOOD]):
        lidar.resize(**scene.lengths())
        lidar.set_inputs(scene)
        lidar.step(step * 0.1, 0.1)
        found = {vehicle: cloud.instances for vehicle, cloud in clouds(lidar.points()).items()}
        assert found == [{3: {-1}}, {}, {3: {-1, -2, 5}}][step]
    lidar.free()


def test_sensors_come_and_go(library: Library) -> None:
    """Each sensor of each step sees what it would see in a run of its own."""
    rng = np.random.default_rng(0)
    lidar = Lidar(library, GOOD, azimuths=128, pitch=0.03).start()
    lengths = []
    for step in range(8):
        count = int(rng.integers(0, 12))
        vehicles = [
            Vehicle(
                id=7 * k + int(rng.integers(7)),
                position=(float(rng.uniform(-40, 40)), float(rng.uniform(-40, 40)), 0.0),
                heading=float(rng.uniform(-3, 3)),
                lidar=bool(rng.random() < 0.6),
            )
            for k in range(count)
        ]
        scene = Scene(vehicles=vehicles, buildings=[HOUSE] * int(rng.integers(3)))
        lidar.resize(**scene.lengths())
        lidar.set_inputs(scene)
        lidar.step(step * 0.1, 0.1)
        fresh = Lidar(library, scene, azimuths=128, pitch=0.03).start()
        fresh.step(0.0, (step + 1) * 0.1)
        assert lidar.points() == fresh.points()
        found = clouds(lidar.points())
        assert list(found) == [v.id for v in vehicles if v.lidar]
        lengths.append(len(found))
        fresh.free()
    assert len(set(lengths)) > 3, "the number of sensors changes"
    lidar.free()


def test_a_restored_instance_continues_bit_for_bit(library: Library) -> None:
    lidar = Lidar(library, GOOD).start()
    lidar.step(0.0, 0.1)
    state = lidar.save()
    before = lidar.points()
    moved = dataclasses.replace(B, position=(7.0, 3.0, 0.0))
    futures = []
    for _ in range(2):
        lidar.resize(**GOOD.lengths())
        lidar.set_inputs(Scene(vehicles=[A, moved], buildings=GOOD.buildings))
        lidar.step(0.1, 0.1)
        futures.append(lidar.points())
        lidar.resize(**Scene().lengths())
        lidar.restore(state)
        assert lidar.points() == before
    assert futures[0] == futures[1]
    assert futures[0] != before
    lidar.free()


def test_a_state_moves_to_an_instance_with_other_parameters(library: Library) -> None:
    """The tables of the scan pattern follow the restored parameters."""
    source = Lidar(library, GOOD, channels=16, azimuths=64, pitch=0.1).start()
    target = Lidar(library, GOOD).start()
    state = source.save()
    target.restore(state)
    frames = []
    for lidar in (source, target):
        lidar.step(0.0, 0.1)
        frames.append(lidar.points())
    assert frames[0] == frames[1]
    source.free()
    target.free()
