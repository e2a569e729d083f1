"""What is searched is on the road, near the route and within reach; shares of cells are areas."""

import re
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.apm import Float, encode, join
from orchestrator.signal import Array
from tests.fmus.driver import Library, Refused
from tests.fmus.messages.apm.apms import apm_of

from .harness import Outputs, Perception
from .scene import Scan, cloud, ground

EGO = 1
ROWS, CELL = 12, 5.0
HALF = ROWS * CELL / 2
NOTHING = np.zeros((0, 3))
EVERYWHERE = {"near_field": 0.0, "horizon": 1e4, "n_blind_zone": 400, "benefit_threshold": 0.0}


def rectangle(x: float, y: float, length: float, width: float, angle: float = 0.0) -> Float:
    """Corners, counter-clockwise."""
    half = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * (length / 2, width / 2)
    c, s = np.cos(angle), np.sin(angle)
    corners: Float = half @ np.array([[c, s], [-s, c]]) + (x, y)
    return corners


def perceive(
    library: Library,
    road: Sequence[Float] = (),
    *,
    points: Float = NOTHING,
    route: Float | None = None,
    heading: float = 0.0,
    position: tuple[float, float] = (0.0, 0.0),
    **settings: float,
) -> Outputs:
    """The ego's outputs with one sharer that sees one point in each square metre around it."""
    scan = Scan(vehicle=EGO, points=points, heading=heading, position=(*position, 2.0))
    sharer = apm_of(
        [[1]], vehicle=2, position=position, heading=heading, center=position, cell=3 * HALF
    )
    sizes: dict[str, float] = {"rows": ROWS, "columns": ROWS, "cell": CELL}
    with Perception(library, **{**sizes, **EVERYWHERE, **settings}) as unit:
        return unit.step(cloud(scan), join([encode(sharer)]), ego=EGO, route=route, road=road)


def searched_area(library: Library, road: Sequence[Float] = (), **settings: object) -> float:
    """The area [m^2] that is searched: all of it is blind, and all of it counts once."""
    settings = {"region_share": 0.0, **settings}
    found = perceive(library, road, **settings)  # type: ignore[arg-type]
    return float(found.benefits[0]) if len(found.benefits) else 0.0


def winding(ring: Float, points: Float) -> Array:
    """How often the ring winds around the points, (n, 2)."""
    a, b, p = ring[None], np.roll(ring, -1, axis=0)[None], points[:, None]
    side = (b - a)[..., 0] * (p - a)[..., 1] - (b - a)[..., 1] * (p - a)[..., 0]
    up = (a[..., 1] <= p[..., 1]) & (b[..., 1] > p[..., 1]) & (side > 0)
    down = (a[..., 1] > p[..., 1]) & (b[..., 1] <= p[..., 1]) & (side < 0)
    return np.asarray(up.sum(axis=1) - down.sum(axis=1))


def area_by_counting(road: Sequence[Float], spacing: float = 0.2) -> float:
    """The area of the union inside the matrix [m^2], from points that are `spacing` apart."""
    axis = np.arange(-HALF + spacing / 2, HALF, spacing)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    return float(np.any([winding(ring, points) != 0 for ring in road], axis=0).sum() * spacing**2)


# ---- the road


@pytest.mark.parametrize(
    ("road", "area"),
    [
        ([], 60.0 * 60.0),  # no map: everywhere
        ([rectangle(0, 0, 20, 7)], 140.0),
        ([rectangle(0, 0, 20, 7)[::-1]], 140.0),  # either sense
        ([rectangle(0, 0, 20, 7), rectangle(5, 0, 20, 7)], 175.0),  # overlapping: once
        ([rectangle(0, 0, 20, 7), rectangle(5, 0, 20, 7)[::-1]], 175.0),
        ([rectangle(0, 3.5, 100, 7), rectangle(0, -3.5, 100, 7)], 840.0),  # beyond the matrix
        ([rectangle(30, 0, 20, 10)], 100.0),
        ([rectangle(500, 0, 20, 7)], 0.0),  # the ego is off the map
        ([np.array([(0, 0), (20, 0), (20, 20), (10, 20), (10, 10), (0, 10)])], 300.0),
        # crossing itself: both halves of a bow tie
        ([np.array([(-10, -10), (10, 10), (10, -10), (-10, 10)])], 200.0),
        # a ring that runs around twice has no hole
        ([np.tile(rectangle(0, 0, 20, 10), (2, 1))], 200.0),
        # flat: no area
        ([np.array([(0, 0), (10, 0), (20, 0)])], 0.0),
    ],
)
def test_the_searched_area_is_that_of_the_road(
    library: Library, road: list[Float], area: float
) -> None:
    # a sub-cell of 0.05 m: borders at multiples of 0.05 m are exact
    assert searched_area(library, road, region_resolution=0.05) == pytest.approx(area, abs=2.01)


@pytest.mark.slow
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 4), corners=st.integers(3, 9))
def test_the_searched_area_is_that_of_the_union_of_any_polygons(
    library: Library, seed: int, count: int, corners: int
) -> None:
    """Corners at random: non-convex, crossing themselves and each other."""
    rng = np.random.default_rng(seed)
    road = [rng.uniform(-45, 45, (corners, 2)) for _ in range(count)]
    length = sum(np.hypot(*(ring - np.roll(ring, 1, axis=0)).T).sum() for ring in road)
    found = searched_area(library, road, region_resolution=0.25)
    # the rasters differ by less than half a sub-cell beside a border, on average much less
    assert found == pytest.approx(area_by_counting(road), abs=0.1 * length * 0.25 + 1.0)


@given(st.floats(-3, 3), st.floats(-900, 900), st.floats(-900, 900), st.integers(0, 2**32 - 1))
def test_it_does_not_matter_where_the_world_is_and_how_it_is_turned(
    library: Library, turn: float, east: float, north: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    road = [rng.uniform(-45, 45, (5, 2)) for _ in range(3)]
    c, s = np.cos(turn), np.sin(turn)
    moved = [ring @ np.array([[c, s], [-s, c]]) + (east, north) for ring in road]
    here = searched_area(library, road)
    there = searched_area(library, moved, heading=turn, position=(east, north))
    assert there == pytest.approx(here, abs=0.26)  # rounding may move one sub-cell


def test_from_a_cell_on_the_centre_of_a_cell_decides(library: Library) -> None:
    road = [rectangle(0, 0, 60, 5.1)]  # reaches the centres of the two middle columns
    assert searched_area(library, road, region_resolution=CELL) == pytest.approx(2 * 60 * CELL)
    road = [rectangle(0, 0, 60, 4.9)]
    assert searched_area(library, road, region_resolution=CELL) == 0


# ---- route, near field and horizon


def test_the_corridor_is_a_band_with_round_ends(library: Library) -> None:
    bend = np.array([(-10.0, 0.0), (10.0, 0.0), (10.0, 15.0)])
    reach = 4.0
    # two pieces, a disc for both ends, three quarters at the bend less the inner square
    expected = 2 * reach * (20 + 15) + np.pi * reach**2 + (np.pi / 4 - 1) * reach**2
    found = searched_area(library, route=bend, corridor=reach, region_resolution=0.05)
    assert found == pytest.approx(expected, rel=2e-3)
    still = np.array([(3.0, 3.0), (3.0, 3.0)])
    disc = searched_area(library, route=still, corridor=reach, region_resolution=0.05)
    assert disc == pytest.approx(np.pi * reach**2, rel=2e-3)


def test_near_field_and_horizon_are_circles_around_the_sensor(library: Library) -> None:
    ring = searched_area(library, near_field=6.0, horizon=20.0, region_resolution=0.05)
    assert ring == pytest.approx(np.pi * (20**2 - 6**2), rel=1e-3)
    ahead = searched_area(library, near_field=6.0, horizon=20.0, offset=30.0)
    assert ahead == pytest.approx(np.pi * (20**2 - 6**2) / 2, rel=2e-3)


def test_road_and_corridor_and_distance_must_all_hold(library: Library) -> None:
    road, route = [rectangle(0, 10, 60, 8)], np.array([(0.0, 0.0), (60.0, 0.0)])
    found = searched_area(
        library, road, route=route, corridor=10.0, horizon=1e4, region_resolution=0.05
    )
    # of the strip 6 <= y <= 14 what is right of y = 10, and ahead of the ego or within 10 m of it
    behind = np.trapezoid(np.sqrt(100 - np.linspace(6, 10, 2001) ** 2), np.linspace(6, 10, 2001))
    assert found == pytest.approx(4 * 30 + behind, rel=5e-3)


# ---- windows


def test_a_window_with_too_little_road_is_no_zone(library: Library) -> None:
    """A lane of 2 m in cells of 5 m: 40 % of each."""
    lane = [rectangle(0, 2.5, 60, 2.0)]
    some = perceive(library, lane, region_share=0.39, window_largest=1)
    assert len(some.ranges) == ROWS
    assert (some.centers[:, 1] == 2.5).all()
    assert len(perceive(library, lane, region_share=0.41, window_largest=1).ranges) == 0


def test_large_windows_merge_what_is_blind_along_a_lane(library: Library) -> None:
    lane = [rectangle(0, 2.5, 60, 5.0)]
    apart = perceive(library, lane, region_share=0.5)
    merged = perceive(library, lane, region_share=0.2)
    assert sorted(apart.ranges) == [2.5] * 2 + [5.0] * 5
    assert merged.ranges.tolist() == [10.0] * 3
    assert apart.benefits == pytest.approx(merged.benefits)  # only the lane counts


def test_only_the_index_where_it_matters_is_compared(library: Library) -> None:
    """Points beside the road do not make the road visible; those on it do."""
    road = [rectangle(0, 2.5, 60, 5.0)]
    carpet = ground(-30, 30)
    beside = carpet[(carpet[:, 1] < 0) | (carpet[:, 1] > 5)]
    blind = perceive(library, road, points=beside)
    assert 4 * (blind.ranges**2).sum() >= 60 * 5
    assert blind.benefits == pytest.approx([60 * 5])
    assert len(perceive(library, road, points=carpet).ranges) == 0


def test_off_the_map_there_is_no_zone_and_no_trigger(library: Library) -> None:
    found = perceive(library, [rectangle(500, 500, 100, 100)])
    assert len(found.ranges) == 0
    assert not found.trigger


def test_zones_cover_the_road_that_is_hidden_and_nothing_else(library: Library) -> None:
    """Two streets that cross, seen everywhere but in one square."""
    streets = [rectangle(0, 0, 60, 7, 0.4), rectangle(0, 0, 60, 7, 0.4 + np.pi / 2)]
    carpet = ground(-30, 30, 0.5)
    seen = carpet[(np.abs(carpet[:, :2] - (10, 5)) > 10).any(axis=1)]
    found = perceive(library, streets, points=seen)
    assert len(found.ranges)
    for center, reach in zip(found.centers, found.ranges, strict=True):
        assert (np.abs(center - (10, 5)) + reach <= 10 + 1e-9).all()
    axis = np.arange(-HALF + 0.1, HALF, 0.2)
    points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    points = points[(np.abs(points - (10, 5)) < 10).all(axis=1)]
    points = points[np.any([winding(ring, points) != 0 for ring in streets], axis=0)]
    apart = np.abs(points[:, None] - found.centers)
    covered = (apart < found.ranges[:, None]).all(axis=-1).any(axis=-1)
    assert covered.mean() > 0.9


# ---- malformed roads


@pytest.mark.parametrize(
    ("vertex", "index", "wrong"),
    [
        ([(0, 0), (1, np.nan), (2, 2)], [0, 0, 0], "road.vertex[1, 1] is nan, must be within 1e9"),
        ([(0, 0), (1, 1), (np.inf, 2)], [0, 0, 0], "road.vertex[2, 0] is inf"),
        ([(0, 0), (1, 1), (2e9, 2)], [0, 0, 0], "road.vertex[2, 0] is 2e+09"),
        ([(0, 0), (1, 1), (0, 1)], [0, 1, 0], "road.index[2] is 0, must be >= 0 and not fall"),
        ([(0, 0), (1, 1), (0, 1)], [-1, -1, -1], "road.index[0] is -1, must be >= 0"),
        ([(0, 0), (1, 1)], [0, 0], "road polygon 0 has 2 corners, at least 3 are needed"),
        ([(0, 0), (1, 1), (0, 1), (5, 5)], [4, 4, 4, 7], "road polygon 7 has 1 corners"),
    ],
)
def test_a_malformed_road_is_refused_with_the_place(
    library: Library, vertex: list[tuple[float, float]], index: list[int], wrong: str
) -> None:
    with Perception(library) as unit:
        unit.begin()
        unit.set_inputs(cloud(Scan(vehicle=EGO, points=NOTHING)), ego=EGO)
        unit.set_road(np.array(vertex, float), np.array(index))
        with pytest.raises(Refused, match=re.escape(wrong)):
            unit.advance()


def test_one_corner_is_no_road(library: Library) -> None:
    """An input that nobody connects keeps the one element with which FMI wants it to start."""
    assert searched_area(library, [np.zeros((1, 2))]) == pytest.approx(60 * 60)


def test_numbers_of_polygons_may_be_left_out(library: Library) -> None:
    ring = rectangle(0, 0, 20, 10)
    with Perception(library, rows=ROWS, columns=ROWS, **EVERYWHERE) as unit:
        unit.begin()
        unit.set_inputs(cloud(Scan(vehicle=EGO, points=NOTHING)), ego=EGO)
        unit.set_road(np.concatenate([ring, ring + 15]), np.repeat([3, 2**31 - 1], 4))
        unit.advance()
        assert len(unit.outputs().ranges)
