"""Visible ground and visible vehicles are what rays say."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings, strategies as st
from shapely.geometry import Point, Polygon, box

from fmus.messages.records import GROUND
from studies.verification.perception.generator import draw_scene
from studies.verification.perception.scene import Building, Float, Scene
from studies.verification.perception.truth import sensor_of
from studies.verification.perception.visibility import (
    Prism,
    Sensor,
    building_prism,
    obstacles,
    seen_vehicles,
    shadow,
    visible,
)
from tests.fmus.lidar.brute_force import cast
from tests.fmus.scene import Building as RayBuilding, Scene as RayScene, Vehicle as RayVehicle

EVERYWHERE = box(-500, -500, 500, 500)
U_SHAPE = [(10, -8), (18, -8), (18, 8), (10, 8), (10, 6), (16, 6), (16, -6), (10, -6)]


def prism(ring: object, bottom: float, top: float) -> Prism:
    return Prism(np.array(ring, float), bottom, top, is_convex=True)


def wall(x: float, half: float, top: float) -> Prism:
    """One metre thick, across the x axis."""
    return prism([(x, -half), (x + 1, -half), (x + 1, half), (x, half)], 0.0, top)


def for_rays(scene: Scene) -> RayScene:
    """The same scene, as the independent intersector takes it."""
    return RayScene(
        vehicles=[
            RayVehicle(
                id=one.id, position=(*one.position, 0.0), heading=one.heading, size=one.size,
                body=one.body,
            )
            for one in scene.vehicles
        ],
        buildings=[RayBuilding(ring=one.ring, height=one.height) for one in scene.buildings],
    )  # fmt: skip


def rays(scene: Scene, own: int, targets: Float) -> tuple[Float, Float, Float]:
    """Distance and instance of the first hit on the way to each target, and its distance."""
    sensor = sensor_of(scene, own)
    origin = np.array([*sensor.position, sensor.height])
    offset = targets - origin
    distance = np.linalg.norm(offset, axis=1)
    hit, instance = cast(for_rays(scene), own, origin, offset / distance[:, None], 1e3)
    return hit, instance.astype(float), distance


@pytest.mark.parametrize("number", range(6))
def test_visible_ground_is_where_a_ray_meets_the_ground_first(number: int) -> None:
    scene = draw_scene(77, number)
    rng = np.random.default_rng(number)
    for own in scene.equipped[:3]:
        sensor = sensor_of(scene, own)
        radius = np.sqrt(rng.uniform(sensor.near**2, sensor.reach**2, 3000))
        angle = rng.uniform(0, 2 * np.pi, 3000)
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        center = np.array(sensor.position)
        ground = np.column_stack([np.stack([x, y], axis=1) + center, np.zeros_like(x)])
        area = visible(sensor, obstacles(scene.vehicles, scene.buildings, own), EVERYWHERE)
        # not on a border, where rounding decides
        clear = shapely.distance(area.boundary, shapely.points(ground[:, :2])) > 1e-6
        hit, instance, distance = rays(scene, own, ground)
        first = (instance == GROUND) & (np.abs(hit - distance) < 1e-6)
        is_in = shapely.contains_xy(area, ground[:, :2])
        # the circles that bound the field are polygons: 64 sides per quarter
        inside = (radius > 1.001 * sensor.near) & (radius < 0.999 * sensor.reach) & clear
        np.testing.assert_array_equal(is_in[inside], first[inside])
        assert 100 < is_in.sum() < 2900


@pytest.mark.parametrize("number", range(4))
def test_a_vehicle_is_seen_if_a_quarter_of_the_rays_reach_it(number: int) -> None:
    scene = draw_scene(78, number)
    own = scene.ego
    sensor = sensor_of(scene, own)
    seen = seen_vehicles(sensor, own, scene.vehicles, scene.buildings)
    for one in scene.vehicles:
        if one.id == own:
            continue
        ring = np.array(one.footprint.exterior.coords)[:-1]
        around = np.concatenate([ring, (ring + np.roll(ring, -1, axis=0)) / 2])
        targets = np.concatenate(
            [np.column_stack([around, np.full(8, z * one.size[2])]) for z in (0.3, 0.6, 0.9)]
        )
        # the vehicle itself does not count as an obstacle
        without = Scene(
            road=scene.road, buildings=scene.buildings, ego=own, candidates=(),
            vehicles=[other for other in scene.vehicles if other is not one],
            route=scene.route, description="",
        )  # fmt: skip
        hit, _, distance = rays(without, own, targets)
        share = ((hit >= distance) & (distance <= sensor.range)).mean()
        assert (one.id in seen) == (share >= 0.25)


def test_a_low_wall_casts_a_finite_shadow() -> None:
    """From 2 m over a wall of 1 m, whose far side is at 11 m: to twice its distance, 22 m."""
    sensor = Sensor(position=(0, 0), height=2.0)
    found = shadow(sensor, [wall(10, 3, 1.0)])
    assert found.bounds == pytest.approx((10, -6, 22, 6))
    # a trapezium from 10 m, 6 m wide, to 20 m, 12 m wide, and the wall's depth, twice as wide
    assert found.area == pytest.approx((6 + 12) / 2 * 10 + 12 * 2)


def test_a_wall_as_high_as_the_sensor_casts_a_shadow_without_end() -> None:
    sensor = Sensor(position=(0, 0), height=2.0)
    found = visible(sensor, [wall(10, 10, 2.0)], EVERYWHERE)
    assert not found.intersects(box(10.01, -9, 100, 9))
    cone = 2 * math.atan(1.0)
    whole = math.pi * (sensor.reach**2 - 10**2) * cone / (2 * math.pi)
    corners = 10 * 10 - math.pi * 10**2 * cone / (2 * math.pi)  # before the wall, beyond 10 m
    assert sensor.field.area - found.area == pytest.approx(whole - corners, rel=1e-3)


def test_a_bridge_leaves_the_ground_below_it_visible() -> None:
    """Between 1 and 1.5 m, from 2 m: hidden is what is 2 to 4 times as far, and no more."""
    sensor = Sensor(position=(0, 0), height=2.0)
    found = shadow(sensor, [prism([(4, -1), (5, -1), (5, 1), (4, 1)], 1.0, 1.5)])
    assert found.bounds == pytest.approx((8, -4, 20, 4))


def test_what_hangs_higher_than_the_sensor_hides_no_ground() -> None:
    sensor = Sensor(position=(0, 0), height=2.0)
    assert shadow(sensor, [prism([(4, -1), (5, -1), (5, 1)], 2.0, 9.0)]).is_empty


def test_the_court_of_a_building_is_seen_over_no_wall() -> None:
    """A U that opens towards the sensor: its court is seen, what is behind it is not."""
    sensor = Sensor(position=(0, 0), height=2.0)
    house = building_prism(Building(ring=U_SHAPE, height=9.0))
    assert not house.is_convex
    found = visible(sensor, [house], EVERYWHERE)
    assert found.contains(Point(14, 0))
    assert not found.intersects(Polygon(U_SHAPE).buffer(-0.01))
    assert not found.intersects(box(18.01, -8, 60, 8))


def test_nothing_hides_nothing() -> None:
    sensor = Sensor(position=(3, -4), height=2.0)
    whole = math.pi * (sensor.range**2 - 2.0**2 - (2.0 / math.tan(math.radians(20))) ** 2)
    assert visible(sensor, [], EVERYWHERE).area == pytest.approx(whole, rel=2e-4)


@settings(max_examples=40, deadline=None)
@given(
    height=st.floats(1.0, 4.0),
    top=st.floats(0.2, 6.0),
    x=st.floats(3.0, 30.0),
    turn=st.floats(0.0, 6.3),
)
def test_a_convex_ring_has_the_same_shadow_edge_by_edge(
    height: float, top: float, x: float, turn: float
) -> None:
    """The hull of a convex footprint is what its edges sweep, and itself."""
    sensor = Sensor(position=(0, 0), height=height)
    angle = turn + np.arange(5) * 2 * np.pi / 5
    ring = np.stack([x + 2 * np.cos(angle), 2 * np.sin(angle)], axis=1)
    hull = shadow(sensor, [Prism(ring, 0.0, top, is_convex=True)])
    swept = shadow(sensor, [Prism(ring, 0.0, top, is_convex=False)])
    field = sensor.field
    assert hull.intersection(field).symmetric_difference(swept.intersection(field)).area < 1e-6
