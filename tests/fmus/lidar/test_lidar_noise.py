"""Range noise and dropout: their distribution, and what they do not depend on."""

import dataclasses
import hashlib
import math
from statistics import NormalDist

import numpy as np
import pytest

from tests.fmus.driver import Library
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import BUS, NO_NOISE, TRUCK, Cloud, Lidar, Scan, clouds

EGO = Vehicle(id=500, position=(3.0, 1.0, 0.0), heading=0.4, lidar=True)
OTHERS = (
    Vehicle(id=10, position=(15.0, 3.0, 0.0), heading=1.0),
    Vehicle(id=20, position=(-8.0, 12.0, 0.0), size=(12.0, 2.5, 3.2), body=BUS),
    Vehicle(id=900, position=(2.0, -20.0, 0.0), size=(9.0, 2.5, 3.8), body=TRUCK, lidar=True),
)
HOUSE = Building(ring=rectangle(30.0, 10.0, 9.0, 20.0))
ROOM = Scene(vehicles=[Vehicle(id=0, lidar=True)],
             buildings=[Building(ring=((20, -20), (21, -20), (21, 20), (20, 20)))])  # fmt: skip


def errors(scan: Scan, **parameters: float) -> np.ndarray:
    """Error along the ray of every point [m], over 64 x 1024 rays of which none is lost."""
    exact = scan(ROOM, **NO_NOISE)[0]
    noisy = scan(ROOM, **(NO_NOISE | parameters))[0]
    along = exact.points["position"].astype(float) / exact.distance[:, None]
    assert np.abs(np.cross(along, noisy.points["position"])).max() < 1e-4, "along the ray only"
    found: np.ndarray = (noisy.points["position"].astype(float) * along).sum(1) - exact.distance
    return found


def test_range_errors_are_normally_distributed(scan: Scan) -> None:
    sigma = 0.05
    error = np.sort(errors(scan, range_noise=sigma, seed=3))
    n = len(error)
    assert n > 40_000
    assert error.mean() == pytest.approx(0, abs=4 * sigma / math.sqrt(n))
    assert error.std() == pytest.approx(sigma, rel=4 / math.sqrt(2 * n))
    cdf = np.array([NormalDist(0, sigma).cdf(e) for e in error])
    # Kolmogorov-Smirnov: 1.95 / sqrt(n) is exceeded with probability 0.1 %
    assert np.abs(cdf - (np.arange(n) + 0.5) / n).max() < 1.95 / math.sqrt(n)


def test_neighbouring_rays_have_independent_errors(scan: Scan) -> None:
    error = errors(scan, range_noise=0.05, seed=4)
    for lag in (1, 2, 47, 64):
        correlation = np.corrcoef(error[:-lag], error[lag:])[0, 1]
        assert abs(correlation) < 4 / math.sqrt(len(error))


@pytest.mark.parametrize("share", [0.0, 0.02, 0.5, 1.0])
def test_dropout_loses_that_share_of_the_hits(scan: Scan, share: float) -> None:
    hits = len(scan(ROOM, **NO_NOISE)[0].points)
    kept = len(scan(ROOM, range_noise=0.0, dropout=share)[0].points)
    spread = 4 * math.sqrt(hits * share * (1 - share))
    assert hits - kept == pytest.approx(share * hits, abs=spread)


def test_the_seed_selects_the_noise(scan: Scan) -> None:
    same = [scan(ROOM, seed=s)[0].points.tobytes() for s in (1, 1, 2)]
    assert same[0] == same[1]
    assert same[0] != same[2]


def renamed(cloud: Cloud, names: dict[int, int]) -> np.ndarray:
    """The points with other instance numbers."""
    points = cloud.points.copy()
    points["instance"] = [names.get(i, i) for i in points["instance"].tolist()]
    return points


def test_the_order_of_the_vehicles_does_not_matter(scan: Scan) -> None:
    reference = scan(Scene(vehicles=sorted((EGO, *OTHERS), key=lambda v: v.id)))[500]
    # ids must ascend, so a permutation of the inputs is one of the ids of the others
    for numbers in ((900, 10, 20), (700, 800, 600), (1, 2, 3)):
        names = dict(zip((v.id for v in OTHERS), numbers, strict=True))
        others = [dataclasses.replace(v, id=names[v.id]) for v in OTHERS]
        cloud = scan(Scene(vehicles=sorted((EGO, *others), key=lambda v: v.id)))[500]
        assert cloud.points.tobytes() == renamed(reference, names).tobytes()


def test_what_is_out_of_range_and_other_sensors_change_nothing(scan: Scan) -> None:
    scene = Scene(vehicles=sorted((EGO, *OTHERS), key=lambda v: v.id), buildings=[HOUSE])
    reference = scan(scene)[500]
    far = Vehicle(id=1, position=(3.0, 80.0, 0.0), size=(12.0, 2.5, 3.2), body=BUS, lidar=True)
    distant = Building(ring=rectangle(-200.0, 0.0, 30.0, 30.0))
    more = Scene(vehicles=[far, *scene.vehicles], buildings=[HOUSE, distant])
    with_more = scan(more)
    assert with_more.keys() == {1, 500, 900}
    assert with_more[500].points.tobytes() == reference.points.tobytes()
    blind = [dataclasses.replace(v, lidar=v.id == 500) for v in scene.vehicles]
    alone = scan(dataclasses.replace(scene, vehicles=blind))
    assert alone[500].points.tobytes() == reference.points.tobytes()


def test_a_turned_and_moved_world_gives_the_same_cloud(scan: Scan) -> None:
    scene = Scene(vehicles=[EGO, OTHERS[2]])
    reference = scan(scene, **NO_NOISE)[500]

    def moved(v: Vehicle) -> Vehicle:
        x, y, z = v.position
        return dataclasses.replace(
            v, position=(-y + 1000.0, x - 500.0, z), heading=v.heading + math.pi / 2
        )

    cloud = scan(Scene(vehicles=[moved(v) for v in scene.vehicles]), **NO_NOISE)[500]
    assert (cloud.points["instance"] == reference.points["instance"]).mean() > 0.9999
    same = cloud.points["instance"] == reference.points["instance"]
    difference = cloud.points["position"][same] - reference.points["position"][same]
    assert np.abs(difference).max() < 1e-4


def test_two_instances_give_equal_bytes_and_steps_differ_in_noise(library: Library) -> None:
    scene = Scene(vehicles=sorted((EGO, *OTHERS), key=lambda v: v.id), buildings=[HOUSE])
    runs = []
    for _ in range(2):
        lidar = Lidar(library, scene).start()
        frames = [lidar.points()]
        for k in range(3):
            lidar.step(k * 0.1, 0.1)
            frames.append(lidar.points())
        lidar.free()
        runs.append(frames)
    assert runs[0] == runs[1]
    assert len(set(runs[0])) == 4
    assert clouds(runs[0][3])[500].sensor["time"] == 300_000_000


@pytest.mark.parametrize(
    ("tilt", "digest"),
    [
        (0.0, "fbc72bc83a839349deb202437b3f0f1784e508a3a62f7292fc6786078dd41b90"),
        (0.1, "8ff8e40cab3563fae502c5c382083266b7bb9b4c5a55ac864d1fd27f1bbb17cb"),
    ],
)
def test_the_bytes_are_the_same_on_every_machine(
    library: Library, tilt: float, digest: str
) -> None:
    """No function of the C library and no compiler's freedom decides about a bit."""
    scene = Scene(vehicles=sorted((EGO, *OTHERS), key=lambda v: v.id), buildings=[HOUSE])
    lidar = Lidar(library, scene, azimuths=360, channels=32, pitch=tilt, seed=1).start()
    assert hashlib.sha256(lidar.points()).hexdigest() == digest
    lidar.free()
