"""What is hidden, and who reveals it."""

import numpy as np
import pytest
import shapely
from shapely.geometry import Point, box
from shapely.geometry.base import BaseGeometry

from studies.verification.perception.generator import draw_scene
from studies.verification.perception.scene import Building, Scene, Vehicle
from studies.verification.perception.scoring import compare_zones, zone_area
from studies.verification.perception.session import Match
from studies.verification.perception.truth import Interest, Truth, best_by_cells, find_truth

CAR = (4.5, 1.8, 1.5)


def car(number: int, x: float, y: float, heading: float = 0.0) -> Vehicle:
    return Vehicle(id=number, position=(x, y), heading=heading, size=CAR, body=0)


def street(*vehicles: Vehicle, buildings: tuple[Building, ...] = ()) -> Scene:
    """A street along the x axis, 20 m wide; vehicle 0 is the ego vehicle, the others candidates."""
    return Scene(
        road=box(-100, -10, 100, 10),
        buildings=buildings,
        vehicles=vehicles,
        ego=0,
        candidates=tuple(one.id for one in vehicles[1:]),
        route=np.array([[0.0, 0.0], [60.0, 0.0]]),
        description="",
    )


SCREEN = Building(ring=((15, -8), (16, -8), (16, 8), (15, 8)), height=5.0)


@pytest.mark.parametrize("number", range(8))
def test_what_is_revealed_was_hidden_and_what_is_hidden_matters(number: int) -> None:
    truth = find_truth(draw_scene(9, number), Interest())
    assert truth.hidden.difference(truth.interest).area < 1e-6
    for area in truth.revealed.values():
        assert area.difference(truth.hidden).area < 1e-6
    assert 0 <= truth.best <= truth.hidden.area
    assert truth.hidden.area < truth.interest.area


def test_nothing_is_hidden_on_an_empty_street() -> None:
    truth = find_truth(street(car(0, 0, 0)), Interest())
    assert truth.hidden.area == 0.0
    assert truth.best == 0.0
    near = 2.0 / np.tan(np.radians(20))
    around = [
        box(-100, -10, 100, 10),
        Point(0, 0).buffer(35),
        box(0, -25, 60, 25).union(Point(0, 0).buffer(25)),
    ]  # the corridor reaches behind the ego vehicle, too
    whole = shapely.intersection_all(around).area
    assert truth.interest.area == pytest.approx(whole - np.pi * near**2, rel=1e-3)


def test_a_car_in_sight_hides_its_shadow_but_not_its_spot() -> None:
    """1.5 m high at 20 m, seen from 2 m: its shadow is four times as long as the way to it."""
    truth = find_truth(street(car(0, 0, 0), car(1, 20, 0)), Interest())
    assert not truth.hidden.intersects(car(1, 20, 0).footprint.buffer(-0.01))
    # from the corners that face the ego vehicle, beside the body, to the end of what matters
    assert truth.hidden.bounds[0] == pytest.approx(17.75)
    assert truth.hidden.bounds[2] == pytest.approx(35.0, abs=0.01)
    assert truth.hidden.contains(Point(30, 0))
    assert truth.hidden_vehicles == set()


def test_whoever_stands_behind_the_screen_reveals_what_it_hides() -> None:
    behind, beside = car(1, 25, 0), car(2, -20, 0)
    scene = street(car(0, 0, 0), behind, beside, buildings=(SCREEN,))
    truth = find_truth(scene, Interest())
    assert truth.hidden_vehicles == {1}
    assert truth.found_by(1) == {1}
    assert truth.found_by(2) == set()
    areas = truth.areas
    assert areas[1] > 0.5 * truth.hidden.area > areas[2]
    # the ring below the lowest channel of the one behind stays hidden, its own spot does not
    ring = Point(25, 0).buffer(5).difference(behind.footprint)
    assert truth.revealed[1].intersection(ring).area == 0.0
    assert truth.revealed[1].contains(behind.footprint.buffer(-0.01))


def test_exact_matrices_with_small_cells_choose_the_best() -> None:
    scene = street(car(0, 0, 0), car(1, 25, 0), car(2, -20, 0), buildings=(SCREEN,))
    truth = find_truth(scene, Interest())
    assert best_by_cells(scene, truth.interest, truth.known, 0.5) == 1


def zones(*squares: tuple[float, float, float]) -> Match:
    table = np.array(squares).reshape(-1, 3)
    return Match(
        centers=table[:, :2], ranges=table[:, 2], sharers=(), benefits=np.empty(0), trigger=False
    )


def with_hidden(hidden: BaseGeometry) -> Truth:
    return Truth(
        interest=box(0, 0, 40, 40), hidden=hidden, known={}, revealed={}, hidden_vehicles=set(),
        seen={},
    )  # fmt: skip


def test_precision_recall_and_iou_of_two_squares() -> None:
    """A zone of 100 m^2 that covers a quarter of a hidden square of 100 m^2."""
    found = compare_zones(zone_area(zones((15, 15, 5)), 0.0), with_hidden(box(15, 15, 25, 25)))
    assert found.precision == pytest.approx(0.25)
    assert found.recall == pytest.approx(0.25)
    assert found.iou == pytest.approx(25 / 175)
    assert (found + found).iou == pytest.approx(found.iou)


def test_zones_count_within_the_area_of_interest_only() -> None:
    found = compare_zones(zone_area(zones((0, 0, 10)), 0.0), with_hidden(box(0, 0, 5, 5)))
    assert found.zones == pytest.approx(100.0)
    assert found.recall == pytest.approx(1.0)


def test_zones_are_turned_with_the_ego_vehicle() -> None:
    """By 45 degrees, a square of half the side 1 reaches to sqrt(2)."""
    area = zone_area(zones((0, 0, 1)), np.pi / 4)
    assert area.bounds == pytest.approx((-(2**0.5), -(2**0.5), 2**0.5, 2**0.5))
    assert area.area == pytest.approx(4.0)


def test_without_zones_there_is_no_precision() -> None:
    found = compare_zones(zone_area(zones(), 0.3), with_hidden(box(0, 0, 5, 5)))
    assert np.isnan(found.precision)
    assert found.recall == 0.0
