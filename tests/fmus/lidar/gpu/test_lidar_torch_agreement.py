"""`lidar-torch` sees what the FMU `lidar` sees."""

import math
from typing import Any

import numpy as np
import pytest

from fmus.lidar.gpu import LidarTorch
from fmus.lidar.gpu.connectors import CONNECTORS
from orchestrator import registry
from orchestrator.parameters import PythonComponentType
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import NO_NOISE, Comparison, compare, create, points_of, scan, town

WIDE = {"elevation_top": 1.3, "elevation_bottom": -1.3}
SENSORS = 4
TILTED = {"pitch": -0.1, "roll": 0.2}
STEEP = WIDE | {"pitch": 1.0, "roll": -0.7}
UPSIDE_DOWN = WIDE | {"pitch": -0.3, "roll": 3.0, "range": 200.0}
NOISY = {"roll": -1.5, "range_noise": 0.1, "dropout": 0.5}
CASES: list[tuple[int, int, list[float], dict[str, float]]] = [
    # vehicles, buildings, heights of the buildings, parameters
    (120, 20, [1.0, 3.0, 12.0], NO_NOISE),
    (60, 12, [12.0, 25.0], {}),
    (SENSORS, 40, [0.5, 1.5, 5.0], NO_NOISE | WIDE),
    (60, 12, [1.5, 15.0], {"pitch": 0.05}),
    (100, 20, [1.5, 5.0], NO_NOISE | TILTED),
    (80, 20, [1.0, 8.0], NO_NOISE | STEEP),
    (80, 20, [2.0], UPSIDE_DOWN),
    (80, 20, [2.0], NOISY),
]


def both(scene: Scene, device: str, **parameters: Any) -> Comparison:
    """Scan with both and compare."""
    pattern = {"azimuths": 600, "elevation_top": 0.07, "elevation_bottom": -0.35} | parameters
    return compare(
        scan("lidar", scene, **pattern),
        scan("lidar-torch", scene, device=device, **pattern),
        azimuths=pattern["azimuths"],
        top=pattern["elevation_top"],
        bottom=pattern["elevation_bottom"],
    )


@pytest.mark.parametrize("case", range(len(CASES)))
def test_the_same_rays_hit_the_same_instances(device: str, case: int) -> None:
    """1.2 million rays in all; an edge may be grazed by 1 in 100,000."""
    vehicles, buildings, heights, parameters = CASES[case]
    scene = town(
        10 + case, vehicles=vehicles, buildings=buildings, sensors=SENSORS, heights=heights
    )
    found = both(scene, device, **parameters)
    assert found.rays == SENSORS * 600 * 64
    assert found.exceptions * 100_000 < found.rays
    assert found.hits > found.rays / 5, "the scene is worth testing"
    assert found.position < 2e-5, "one or two steps of a float32 at 100 m"
    assert found.intensity < 1e-5


def test_noise_of_another_seed_and_time_differs_alike(device: str) -> None:
    scene = town(5, vehicles=30, buildings=5, sensors=2, heights=[8.0])
    given = {"range_noise": 0.5, "dropout": 0.3}
    for seed in (0, -1, 2**63 - 1, -(2**63)):
        found = both(scene, device, seed=seed, **given)
        assert found.exceptions == 0
        assert found.position < 2e-5
    clouds = {scan("lidar-torch", scene, device=device, seed=seed, **given) for seed in (1, 2)}
    assert len(clouds) == 2


def test_measured_ranges_are_not_negative(device: str) -> None:
    """Where the error would put a point behind the sensor it is reported at the sensor."""
    scene = town(8, vehicles=30, buildings=5, sensors=2, heights=[8.0])
    theirs, ours = (
        points_of(scan(kind, scene, range_noise=10.0, **extra))
        for kind, extra in (("lidar", {}), ("lidar-torch", {"device": device}))
    )
    np.testing.assert_array_equal(ours["instance"], theirs["instance"])
    np.testing.assert_allclose(ours["position"], theirs["position"], rtol=0, atol=2e-5)
    assert (ours["position"] == 0.0).all(axis=1).sum() > 100


@pytest.mark.parametrize("tilt", [{}, {"pitch": 0.3, "roll": -0.4}])
def test_coinciding_surfaces_belong_to_the_first(device: str, tilt: dict[str, float]) -> None:
    """A building twice, and a bus of the same size in it: the building with the lower index."""
    ring = rectangle(15.0, 0.0, 12.0, 2.5)
    scene = Scene(
        vehicles=[
            Vehicle(id=1, position=(0.0, 0.0, 4.0), lidar=True),
            Vehicle(id=2, position=(15.0, 0.0, 0.0), size=(12.0, 2.5, 3.0), body=3),
        ],
        buildings=[Building(ring=ring, height=3.0), Building(ring=ring, height=3.0)],
    )
    points = points_of(scan("lidar-torch", scene, device=device, **NO_NOISE, **tilt))
    assert set(points["instance"].tolist()) == {-1, -2}
    assert both(scene, device, **NO_NOISE, **tilt).exceptions == 0


def test_a_roof_in_the_ground_belongs_to_the_ground(device: str) -> None:
    sunk = Vehicle(id=2, position=(10.0, 0.0, -3.0), size=(12.0, 2.5, 3.0), body=3)
    scene = Scene(vehicles=[Vehicle(id=1, lidar=True), sunk])
    points = points_of(scan("lidar-torch", scene, device=device, **NO_NOISE))
    assert set(points["instance"].tolist()) == {-1}


@pytest.mark.parametrize("under", [0.0, 0.5])
@pytest.mark.parametrize("tilt", [{}, {"pitch": 0.1}])
def test_a_sensor_in_the_ground_sees_bodies_and_no_ground(
    device: str, under: float, tilt: dict[str, float]
) -> None:
    """Exactly at its level, or beneath: the ground is hit from above only."""
    given = (
        {"mount_height": 0.25, "elevation_top": 0.07, "elevation_bottom": -0.35} | NO_NOISE | tilt
    )
    sunk = Vehicle(id=1, position=(0.0, 0.0, -1.75 - under), size=(4.5, 1.8, 1.5), lidar=True)
    wall = Vehicle(id=2, position=(15.0, 0.0, -2.0), size=(2.5, 12.0, 8.0))
    scene = Scene(vehicles=[sunk, wall])
    points = points_of(scan("lidar-torch", scene, device=device, azimuths=600, **given))
    assert set(points["instance"].tolist()) == {2}
    found = both(scene, device, **given)
    assert (found.exceptions, found.hits) == (0, len(points))


@pytest.mark.parametrize("tilt", [{}, {"pitch": 0.1}])
@pytest.mark.parametrize("corner", [(0.0, 0.0), (-12.0, 0.0), (-4.0, -6.0)])
def test_a_sensor_over_the_edge_of_a_roof(
    device: str, corner: tuple[float, float], tilt: dict[str, float]
) -> None:
    """Exactly over a corner or an edge, or inside; where a column runs along an edge rounding
    decides, so none does."""
    x, y = corner
    ring = ((x, y), (x + 20.0, y), (x + 20.0, y + 9.0), (x, y + 9.0))
    for heading in np.linspace(-3.0, 3.0, 12):
        sensor = Vehicle(id=1, position=(0.0, 0.0, 5.0), heading=float(heading), lidar=True)
        scene = Scene(vehicles=[sensor], buildings=[Building(ring=ring, height=4.0)])
        found = both(scene, device, **NO_NOISE, **tilt, **WIDE)
        assert found.exceptions == 0
        assert found.position < 2e-5


@pytest.mark.parametrize("tilt", [{}, {"pitch": 0.1}, {"pitch": -0.2, "roll": 0.5}])
def test_no_ray_slips_between_faces_that_share_an_edge(device: str, tilt: dict[str, float]) -> None:
    """A wall of 64 wedges around the sensor, each corner exactly on the azimuth of rays."""

    def corner(k: int, radius: float) -> tuple[float, float]:
        angle = 2 * math.pi * (k % 64) / 64
        return radius * math.cos(angle), radius * math.sin(angle)

    wedges = [
        Building(
            ring=(corner(k, 9.0), corner(k, 30.0), corner(k + 1, 30.0), corner(k + 1, 9.0)),
            height=100.0,
        )
        for k in range(64)
    ]
    scene = Scene(vehicles=[Vehicle(id=1, lidar=True)], buildings=wedges)
    whole = NO_NOISE | tilt | {"elevation_top": 0.4, "elevation_bottom": -0.4, "azimuths": 256}
    points = points_of(scan("lidar-torch", scene, device=device, **whole))
    assert len(points) == 256 * 64, "every ray hits something"
    distance = np.linalg.norm(points["position"].astype(float), axis=1)
    assert distance.max() < 20.0, "and nothing behind the wall"


def test_connectors_and_parameters_are_those_of_the_fmu() -> None:
    fmu = registry.component_type("lidar")
    ours = dict(PythonComponentType(LidarTorch).parameters)
    assert ours.pop("device").default == "cpu", "equal results wherever a scenario runs"
    theirs_alone = {n: p for n, p in fmu.parameters.items() if not n.startswith("fmi.")}
    assert ours == theirs_alone, "what the importer offers of any FMU aside"
    theirs = create("lidar").connectors
    assert {n: c.kind() for n, c in CONNECTORS.items()} == {n: c.kind() for n, c in theirs.items()}
    for name, connector in CONNECTORS.items():
        other = theirs[name]
        for field in ("causality", "unit", "variability", "feedthrough", "description"):
            assert getattr(connector, field) == getattr(other, field), (name, field)
