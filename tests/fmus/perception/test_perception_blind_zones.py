"""Blind zones lie where the ego vehicle's matrix is empty, near its route, and nowhere else."""

import numpy as np
import pytest

from fmus.messages.apm import Float
from tests.fmus.driver import Library

from .harness import Outputs, Perception
from .scene import Scan, cloud, ground

EGO = 1


def perceive(
    library: Library,
    points: Float,
    *,
    route: Float | None = None,
    ego: int = EGO,
    heading: float = 0.0,
    position: tuple[float, float] = (0.0, 0.0),
    **settings: float,
) -> Outputs:
    """The outputs for one scan of vehicle `EGO`; the search covers 0 to 50 m unless set."""
    scan = Scan(vehicle=EGO, points=points, heading=heading, position=(*position, 2.0))
    with Perception(library, **{"near_field": 0.0, "horizon": 50.0, **settings}) as unit:
        return unit.step(cloud(scan), ego=ego, route=route)


def shadowed(points: Float, low: tuple[float, float], high: tuple[float, float]) -> Float:
    """The points without those in a rectangle."""
    inside = ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)
    return points[~inside]


def behind_a_wall(x: float, y: float) -> Float:
    """Ground that is not hidden by a wall at `x` from -`y` to `y`, and the wall."""
    carpet = ground(-50, 50)
    with np.errstate(divide="ignore", invalid="ignore"):
        hidden = (carpet[:, 0] > x) & (np.abs(carpet[:, 1] / carpet[:, 0]) < y / x)
    wall = np.array([[x, side, z] for side in np.linspace(-y, y, 50) for z in (0.5, 1, 2, 3)])
    return np.concatenate([carpet[~hidden], wall])


def test_there_is_none_when_the_cloud_covers_everything(library: Library) -> None:
    found = perceive(library, ground(-50, 50), horizon=1000.0)
    assert len(found.ranges) == 0
    assert not found.trigger


def test_the_cell_in_shadow_is_found_where_it_is(library: Library) -> None:
    found = perceive(library, shadowed(ground(-50, 50), (10, -5), (15, 0)))
    np.testing.assert_allclose(found.centers, [(12.5, -2.5)])
    assert found.ranges.tolist() == [2.5]


def test_a_shadow_of_ten_metres_is_one_window_of_two_cells(library: Library) -> None:
    found = perceive(library, shadowed(ground(-50, 50), (10, -5), (20, 5)))
    np.testing.assert_allclose(found.centers, [(15, 0)])
    assert found.ranges.tolist() == [5]


def test_blind_zones_turn_with_the_vehicle(library: Library) -> None:
    heading, position = 0.7, np.array([120.0, -45.0])
    turn = np.array([[np.cos(heading), -np.sin(heading)], [np.sin(heading), np.cos(heading)]])
    local = shadowed(ground(-50, 50), (10, -5), (20, 5))
    world = np.column_stack([local[:, :2] @ turn.T + position, local[:, 2]])
    found = perceive(library, world, heading=heading, position=(120.0, -45.0))
    np.testing.assert_allclose(found.centers, [turn @ (15, 0) + position])


def test_the_area_behind_a_wall_is_blind_and_the_road_before_it_is_not(library: Library) -> None:
    found = perceive(library, behind_a_wall(10.0, 4.0), n_blind_zone=100)
    assert len(found.ranges)
    x, y = found.centers.T
    assert (x - found.ranges > 10).all()
    assert (np.abs(y) < 0.4 * x + 2.5).all()  # its shadow opens at 4 m in 10 m
    blind = 4 * (found.ranges**2).sum()
    shadow = 0.4 * (50**2 - 10**2)
    assert 0.6 * shadow < blind < shadow


def test_zones_do_not_overlap_unless_they_may(library: Library) -> None:
    def largest_overlap(found: Outputs) -> float:
        apart = np.abs(found.centers[:, None] - found.centers).max(axis=-1)
        depth = found.ranges[:, None] + found.ranges - apart
        np.fill_diagonal(depth, 0)
        return float(depth.max())

    points = shadowed(ground(-50, 50), (-20, -35), (45, 20))
    alone = perceive(library, points, n_blind_zone=200, horizon=1000.0)
    assert largest_overlap(alone) < 1e-9
    assert 4 * (alone.ranges**2).sum() == pytest.approx(65 * 55)  # they fill the shadow
    shared = perceive(library, points, n_blind_zone=200, zone_overlap=0.5, horizon=1000.0)
    assert largest_overlap(shared) > 1


def test_a_window_that_larger_ones_cover_wholly_adds_nothing(library: Library) -> None:
    points = shadowed(ground(-50, 50), (10, -5), (20, 5))
    found = perceive(library, points, zone_overlap=1.0)
    assert found.ranges.tolist() == [5]


def test_only_the_surroundings_of_the_route_are_searched(library: Library) -> None:
    points = shadowed(ground(-50, 50), (20, -10), (30, 0))
    points = shadowed(points, (-10, 25), (0, 35))
    bend = np.array([(0.0, 0.0), (25.0, 0.0), (25.0, -40.0)])
    ahead = perceive(library, points, route=bend, corridor=15.0)
    np.testing.assert_allclose(ahead.centers, [(25, -5)])
    both = perceive(library, points, route=bend, corridor=45.0)
    assert both.centers.tolist() == [[25, -5], [-5, 30]]
    for no_route in (None, bend[:1]):
        assert len(perceive(library, points, route=no_route).ranges) == 2


def test_only_cells_from_the_near_field_to_the_horizon_are_searched(library: Library) -> None:
    for near_field, horizon in ((0.0, 12.0), (4.0, 20.0), (15.0, 30.0)):
        found = perceive(
            library, np.zeros((0, 3)), horizon=horizon, near_field=near_field, n_blind_zone=400,
            region_resolution=5.0, region_share=1.0,  # the centre of a cell decides
        )  # fmt: skip
        axis = np.arange(-47.5, 50, 5)
        distance = np.hypot(*np.meshgrid(axis, axis))
        cells = (distance >= near_field) & (distance <= horizon)
        assert 4 * (found.ranges**2).sum() == pytest.approx(25 * cells.sum())


def test_the_largest_and_closest_come_first_and_the_rest_is_left_out(library: Library) -> None:
    points = ground(-50, 50)
    for low, high in [((10, 0), (15, 5)), ((30, 0), (40, 10)), ((-40, -20), (-20, 0)),
                      ((35, -30), (40, -25))]:  # fmt: skip
        points = shadowed(points, low, high)
    found = perceive(library, points)
    assert found.centers.tolist() == [[-30, -10], [12.5, 2.5], [35, 5], [37.5, -27.5]]
    short = perceive(library, points, n_blind_zone=2)
    assert short.centers.tolist() == found.centers[:2].tolist()


@pytest.mark.parametrize(("points", "is_blind"), [(4, True), (5, False)])
def test_a_cell_is_blind_below_the_threshold(
    library: Library, *, points: int, is_blind: bool
) -> None:
    few = np.column_stack([np.full(points, 12.0), np.full(points, 2.0), np.zeros(points)])
    carpet = np.concatenate([shadowed(ground(-50, 50), (10, 0), (15, 5)), few])
    assert len(perceive(library, carpet, threshold=5.0).ranges) == is_blind


def test_the_threshold_grows_towards_the_sensor(library: Library) -> None:
    # 25 points per cell everywhere; T1 is 5 at 50 m and 40 at 25 m: cells nearer than
    # 50 m * (5 / 25) ** (1 / 3) = 29.2 m are blind
    found = perceive(library, ground(-50, 50), threshold_exponent=3, n_blind_zone=1000,
                     window_largest=1)  # fmt: skip
    axis = np.arange(-47.5, 50, 5)
    blind = np.hypot(*np.meshgrid(axis, axis)) < 50 * 0.2 ** (1 / 3)
    assert len(found.ranges) == blind.sum()


@pytest.mark.parametrize(("across", "zones"), [(11, []), (9, [(0.0, 0.0)])])
def test_the_threshold_is_bounded_at_the_sensor(
    library: Library, across: int, zones: list[tuple[float, float]]
) -> None:
    """T1 is 5 points * 50 m / d, with d at least 2.5 m: 100 points, in the window around the sensor
    as in its neighbours. There are 121 in each cell of 5 m, or 81."""
    carpet = ground(-50, 50, 5.0 / across)
    found = perceive(library, carpet, threshold_exponent=1, window_largest=2)
    np.testing.assert_allclose(found.centers, np.array(zones).reshape(-1, 2), atol=1e-9)
    assert found.ranges.tolist() == [5.0] * len(zones)


@pytest.mark.parametrize("ego", [-1, 77])
def test_without_an_ego_sensor_there_is_no_blind_zone(library: Library, ego: int) -> None:
    found = perceive(library, np.zeros((0, 3)), ego=ego)
    assert len(found.ranges) == 0
    assert len(found.apms) == 1


def test_windows_wider_than_the_matrix_find_nothing(library: Library) -> None:
    found = perceive(library, np.zeros((0, 3)), rows=2, columns=3, window_smallest=3,
                     window_largest=8)  # fmt: skip
    assert len(found.ranges) == 0
