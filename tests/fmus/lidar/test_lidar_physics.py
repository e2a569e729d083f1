"""Laws that the scan must obey, most of them in closed form."""

import dataclasses
import math

import numpy as np
import pytest

from fmus.messages.bodies import Body
from fmus.messages.records import BUILDING, GROUND
from tests.fmus.driver import Library
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import BUS, NO_NOISE, TRUCK, Lidar, Scan, clouds

EGO = Vehicle(id=1, lidar=True)
SENSOR_HEIGHT = EGO.size[2] + 0.5
TRUCK_SIZE = (12.0, 2.5, 3.8)


def test_flat_ground_is_hit_where_the_rays_meet_it(scan: Scan) -> None:
    (cloud,) = scan(Scene(vehicles=[EGO]), **NO_NOISE).values()
    elevation = np.linspace(math.radians(4), math.radians(-20), 64)
    down = elevation[(elevation < 0) & (SENSOR_HEIGHT / -np.sin(np.minimum(elevation, -1e-9)) < 50)]
    distance = SENSOR_HEIGHT / -np.sin(down)
    assert cloud.instances == {GROUND}
    assert len(cloud.points) == 1024 * len(down)
    np.testing.assert_allclose(cloud.distance.reshape(1024, -1), np.tile(distance, (1024, 1)),
                               atol=1e-5)  # fmt: skip
    np.testing.assert_allclose(cloud.points["position"][:, 2], -SENSOR_HEIGHT, atol=1e-5)


def test_points_go_counter_clockwise_from_straight_ahead(scan: Scan) -> None:
    (cloud,) = scan(Scene(vehicles=[EGO]), **NO_NOISE, channels=1, elevation_top=-0.1).values()
    x, y, _ = cloud.points["position"].T
    np.testing.assert_allclose(
        np.unwrap(np.arctan2(y, x)), np.arange(1024) * 2 * np.pi / 1024, atol=1e-6
    )


def test_the_sensor_record_says_where_and_when(library: Library) -> None:
    ego = Vehicle(id=7, position=(10.0, -4.0, 0.5), heading=0.7, size=(4.0, 2.0, 1.6), lidar=True)
    lidar = Lidar(library, Scene(vehicles=[ego]), pitch=0.02, roll=-0.03, mount_height=0.25)
    lidar.start().step(0.0, 0.1)
    sensor = clouds(lidar.points())[7].sensor
    assert sensor["position"].tolist() == pytest.approx([10.0, -4.0, 0.5 + 1.6 + 0.25])
    for name, value in (("time", 100_000_000), ("heading", 0.7), ("pitch", 0.02), ("roll", -0.03)):
        assert sensor[name] == value
    lidar.free()


@pytest.mark.parametrize("body", Body)
def test_the_own_body_is_not_seen(scan: Scan, body: Body) -> None:
    ego = dataclasses.replace(EGO, body=body, size=TRUCK_SIZE)
    (cloud,) = scan(Scene(vehicles=[ego]), **NO_NOISE, elevation_bottom=-1.4).values()
    assert cloud.instances == {GROUND}


def test_a_truck_between_sensor_and_car_hides_the_car(scan: Scan) -> None:
    car = Vehicle(id=2, position=(30.0, 0.0, 0.0))
    truck = Vehicle(id=3, position=(15.0, 0.0, 0.0), size=TRUCK_SIZE, body=TRUCK)
    assert 2 in scan(Scene(vehicles=[EGO, car]))[1].instances
    hidden = scan(Scene(vehicles=[EGO, car, truck]))[1]
    assert 3 in hidden.instances
    assert 2 not in hidden.instances


def test_a_building_hides_what_is_behind_it_and_its_roof_is_seen_from_above(scan: Scan) -> None:
    car = Vehicle(id=2, position=(30.0, 0.0, 0.0))
    house = Building(ring=rectangle(15.0, 0.0, 4.0, 10.0))
    assert scan(Scene(vehicles=[EGO, car], buildings=[house]))[1].instances == {GROUND, BUILDING}
    shed = dataclasses.replace(house, height=1.0)
    cloud = scan(Scene(vehicles=[EGO, car], buildings=[shed]), **NO_NOISE)[1]
    assert cloud.instances == {GROUND, BUILDING, 2}
    z = cloud.on(BUILDING)["position"][:, 2]
    assert z.max() == pytest.approx(1.0 - SENSOR_HEIGHT, abs=1e-5)
    assert np.isclose(z, 1.0 - SENSOR_HEIGHT, atol=1e-5).sum() > 100


def test_the_sense_of_a_ring_does_not_matter(scan: Scan) -> None:
    ell = ((5.0, -9.0), (25.0, -9.0), (25.0, 9.0), (18.0, 9.0), (18.0, -2.0), (5.0, -2.0))
    left, right = (
        scan(Scene(vehicles=[EGO], buildings=[Building(ring=ring, height=1.2)]))[1]
        for ring in (ell, ell[::-1])
    )
    np.testing.assert_array_equal(left.points, right.points)


def test_nothing_is_hit_beyond_the_range(scan: Scan) -> None:
    wall = Building(ring=rectangle(20.0, 0.0, 2.0, 80.0), height=30.0)
    for reach in (18.0, 19.5, 40.0):
        cloud = scan(Scene(vehicles=[EGO], buildings=[wall]), **NO_NOISE, range=reach)[1]
        assert cloud.distance.max() <= reach + 1e-5
        assert (BUILDING in cloud.instances) == (reach > 19.0)


def test_intensity_is_reflectivity_times_incidence_times_extinction(scan: Scan) -> None:
    wall = Building(ring=rectangle(21.0, 0.0, 2.0, 80.0), height=30.0)
    cloud = scan(Scene(vehicles=[EGO], buildings=[wall]), **NO_NOISE)[1]
    direction = cloud.points["position"] / cloud.distance[:, None]
    on_wall = cloud.points["instance"] == BUILDING
    incidence = np.where(on_wall, direction[:, 0], -direction[:, 2])
    expected = np.where(on_wall, 0.4, 0.2) * incidence * np.exp(-0.004 * cloud.distance)
    np.testing.assert_allclose(cloud.points["intensity"], expected, rtol=2e-5)


def test_vehicle_surfaces_reflect_more_than_ground(scan: Scan) -> None:
    bus = Vehicle(id=2, position=(16.0, 0.0, 0.0), size=(12.0, 2.5, 3.2), body=BUS)
    points = scan(Scene(vehicles=[EGO, bus]), **NO_NOISE)[1].on(2)  # its rear, 10 m ahead
    distance = np.linalg.norm(points["position"].astype(float), axis=1)
    expected = 0.5 * points["position"][:, 0] / distance * np.exp(-0.004 * distance)
    np.testing.assert_allclose(points["intensity"], expected, rtol=2e-5)
    np.testing.assert_allclose(points["position"][:, 0], 10.0, atol=1e-5)


def test_pitch_lowers_the_nose_and_roll_the_right_side(scan: Scan) -> None:
    one = {"channels": 1, "azimuths": 4, "elevation_top": 0.0}
    nose = scan(Scene(vehicles=[EGO]), **NO_NOISE, **one, pitch=0.1)[1]
    np.testing.assert_allclose(
        nose.points["position"], [[SENSOR_HEIGHT / math.sin(0.1), 0, 0]], atol=1e-5
    )
    right = scan(Scene(vehicles=[EGO]), **NO_NOISE, **one, roll=0.1)[1]
    np.testing.assert_allclose(
        right.points["position"], [[0, -SENSOR_HEIGHT / math.sin(0.1), 0]], atol=1e-5
    )


def test_a_sensor_inside_a_building_sees_out_of_it(scan: Scan) -> None:
    house = Building(ring=rectangle(0.0, 0.0, 20.0, 20.0))
    inside = scan(Scene(vehicles=[EGO], buildings=[house]))[1]
    outside = scan(Scene(vehicles=[EGO]))[1]
    np.testing.assert_array_equal(inside.points, outside.points)


def test_nobody_and_nothing_is_an_empty_frame(library: Library) -> None:
    for scene in (Scene(), Scene(vehicles=[Vehicle(id=3)])):
        lidar = Lidar(library, scene)
        assert lidar.start().points() == b"LPTS" + bytes([1, 0, 0, 0, 0, 0, 0, 0, 72, 0, 0, 0])
        lidar.free()
