"""Scenes are what they claim to be."""

import itertools

import numpy as np
import pytest
from shapely.geometry import LineString, Point, Polygon

from studies.verification.perception.generator import FEW, MANY, NEAR, draw_scene
from studies.verification.perception.scene import Scene

SCENES = [draw_scene(3, number) for number in range(25)]
each_scene = pytest.mark.parametrize("scene", SCENES, ids=range(25))


def test_a_scene_depends_on_seed_and_number_only() -> None:
    again = draw_scene(3, 7)
    assert again.vehicles == SCENES[7].vehicles
    assert again.buildings == SCENES[7].buildings
    np.testing.assert_array_equal(again.route, SCENES[7].route)
    assert draw_scene(4, 7).vehicles != again.vehicles


@each_scene
def test_no_two_bodies_overlap(scene: Scene) -> None:
    for a, b in itertools.combinations(scene.vehicles, 2):
        assert a.footprint.distance(b.footprint) > 0.39


@each_scene
def test_vehicles_drive_on_the_road_and_houses_stand_beside_it(scene: Scene) -> None:
    for one in scene.vehicles:
        assert scene.road.contains(Point(one.position))
    for house in scene.buildings:
        ring = Polygon(house.ring)
        assert ring.is_valid
        assert ring.distance(scene.road) > 1.4


@each_scene
def test_the_route_begins_at_the_ego_vehicle_in_its_direction(scene: Scene) -> None:
    ego = scene.by_id[scene.ego]
    assert tuple(scene.route[0]) == ego.position
    ahead = scene.route[1] - scene.route[0]
    forward = np.array([np.cos(ego.heading), np.sin(ego.heading)])
    assert ahead @ forward == pytest.approx(np.linalg.norm(ahead))
    assert scene.road.buffer(0.01).contains(LineString(scene.route))
    assert LineString(scene.route).length > 80


@each_scene
def test_candidates_are_other_vehicles_near_the_ego_vehicle(scene: Scene) -> None:
    assert FEW.fewest <= len(set(scene.candidates)) <= FEW.most
    assert scene.ego not in scene.candidates
    ego = Point(scene.by_id[scene.ego].position)
    assert all(ego.distance(Point(scene.by_id[one].position)) <= NEAR for one in scene.candidates)


def test_scenes_vary() -> None:
    assert {scene.description.split(",")[0] for scene in SCENES} == {"2 arms", "3 arms", "4 arms"}
    assert {scene.description.split(", ")[2] for scene in SCENES} == {
        "straight on", "left", "right",
    }  # fmt: skip
    assert {one.body for scene in SCENES for one in scene.vehicles} == set(range(5))
    assert any(not scene.buildings for scene in SCENES)
    rings = [Polygon(house.ring) for scene in SCENES for house in scene.buildings]
    assert any(ring.area < 0.8 * ring.convex_hull.area for ring in rings)
    assert len({len(scene.candidates) for scene in SCENES}) > 5


def test_crowded_scenes_have_many_candidates() -> None:
    for number in range(3):
        scene = draw_scene(3, number, MANY)
        assert MANY.fewest <= len(set(scene.candidates)) <= MANY.most
