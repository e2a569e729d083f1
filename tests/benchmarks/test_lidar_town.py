"""The town that the lidar is measured in, and its prisms as triangles."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from benchmarks.lidar.caster import Prism
from benchmarks.lidar.mesh import ears, mesh, triangles
from benchmarks.lidar.town import BUILDINGS, SCANS, SIDE, Town, town

CAR = 0


@pytest.mark.parametrize(("vehicles", "sensors"), [(100, 1), (500, 10)])
def test_the_town_is_what_the_targets_are_about(vehicles: int, sensors: int) -> None:
    found = town(vehicles, sensors)
    assert found.position.shape == (SCANS, vehicles, 3)
    assert len(found.height) == BUILDINGS == len(np.unique(found.index))
    assert len(found.sensors) == sensors
    assert (found.body[found.sensors] == CAR).all()
    assert np.abs(found.position[0]).max() < SIDE / 2
    assert set(found.body) == set(range(5))
    moved = np.linalg.norm(np.diff(found.position, axis=0), axis=-1)
    assert moved.min() > 0.4, "all vehicles move between two scans"


def test_it_is_the_same_town_every_time() -> None:
    for one, two in zip(town(50, 3).inputs(), town(50, 3).inputs(), strict=True):
        assert all(np.array_equal(one[name], two[name]) for name in one)


def footprint(found: Town, vehicle: int) -> np.ndarray:
    """Corners of a vehicle in the first scene [m], shape (4, 2)."""
    heading = found.heading[0, vehicle]
    ahead = np.array([np.cos(heading), np.sin(heading)])
    left = np.array([-ahead[1], ahead[0]])
    length, width, _ = found.size[vehicle] / 2
    middle = found.position[0, vehicle, :2]
    return np.array([middle + a * length * ahead + b * width * left
                     for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))])  # fmt: skip


def test_no_vehicle_begins_in_another_one_or_in_a_building() -> None:
    found = town(500, 10)
    boxes = [footprint(found, k) for k in range(found.vehicles)]
    boxes += [found.vertex[found.index == k] for k in range(BUILDINGS)]
    middles = np.array([box.mean(axis=0) for box in boxes])
    for k, box in enumerate(boxes[: found.vehicles]):
        for other in np.flatnonzero(np.linalg.norm(middles - middles[k], axis=1) < 20):
            assert other == k or are_apart(box, boxes[other]), (k, other)


def are_apart(one: np.ndarray, two: np.ndarray) -> bool:
    """Whether an edge of the first separates it from the second: sufficient, if both are boxes."""
    for first, second in ((one, two), (two, one)):
        for edge in np.roll(first, -1, axis=0) - first:
            normal = np.array([edge[1], -edge[0]])
            if (first @ normal).max() < (second @ normal).min() or (second @ normal).max() < (
                first @ normal
            ).min():
                return True
    return False


@st.composite
def rings(draw: st.DrawFn) -> np.ndarray:
    """Corners around a middle that sees them all: simple, and mostly not convex; (corner, 2)."""
    count = draw(st.integers(3, 12))
    radii = draw(st.lists(st.floats(1.0, 10.0), min_size=count, max_size=count))
    angle = 2 * np.pi * np.arange(count) / count
    ring: np.ndarray = np.stack([np.cos(angle), np.sin(angle)], axis=-1) * np.array(radii)[:, None]
    return ring


def area(ring: np.ndarray) -> float:
    """Counter-clockwise positive [m^2]."""
    x, y = ring.T
    return float(0.5 * (x * np.roll(y, -1) - y * np.roll(x, -1)).sum())


@given(ring=rings())
def test_ears_cover_a_polygon_once(ring: np.ndarray) -> None:
    parts = [area(ring[corners]) for corners in ears(ring)]
    assert len(parts) == len(ring) - 2
    assert min(parts) > 0
    assert sum(parts) == pytest.approx(area(ring))


@given(ring=rings(), bottom=st.floats(-5, 5), height=st.floats(0.1, 20))
def test_triangles_enclose_the_volume_of_their_prism(
    ring: np.ndarray, bottom: float, height: float
) -> None:
    """By the divergence theorem, with the open bottom in the plane z = 0 of the sum."""
    prism = Prism(ring=ring, bottom=bottom, top=bottom + height, instance=7)
    found, instance = mesh([prism, prism])
    assert np.array_equal(found, np.concatenate([triangles(prism)] * 2))
    assert (instance == 7).all()
    a, b, c = np.moveaxis(triangles(prism) - (0, 0, bottom), 1, 0)
    assert np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6 == pytest.approx(area(ring) * height)
