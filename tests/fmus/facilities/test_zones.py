"""Which part of a matrix, and which boxes, lie in the squares that a request asks about."""

import math
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.facilities.inputs import BlindZones
from fmus.facilities.zones import NOWHERE, Zones, zones_in
from fmus.messages.apm import Apm
from fmus.physics.boxes import Boxes
from orchestrator.signal import Array

CELL = 5.0


def matrix(cells: Array, heading: float = 0.0, cell: float = CELL) -> Apm:
    return Apm(
        vehicle=1,
        time=0,
        position=np.zeros(2),
        heading=heading,
        center=np.zeros(2),
        cell=cell,
        cells=np.asarray(cells, np.uint32),
    )


def squares(*rows: tuple[float, float, float], heading: float = 0.0) -> Zones:
    """Zones as (x, y, range)."""
    table = np.array(rows, float).reshape(-1, 3)
    return Zones(heading=heading, centers=table[:, :2], ranges=table[:, 2])


def united(first: Zones, second: Zones) -> Zones:
    return Zones(
        heading=first.heading,
        centers=np.concatenate([first.centers, second.centers]),
        ranges=np.concatenate([first.ranges, second.ranges]),
    )


MATRICES = st.builds(
    matrix,
    st.lists(st.integers(0, 9), min_size=20, max_size=20).map(lambda n: np.reshape(n, (5, 4))),
    st.floats(-math.pi, math.pi),
)
ZONE = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(0.1, 10))
HEADING = st.floats(-math.pi, math.pi)


def some_zones(heading: float) -> st.SearchStrategy[Zones]:
    return st.lists(ZONE, max_size=4).map(lambda rows: squares(*rows, heading=heading))


TWO_SETS = HEADING.flatmap(lambda heading: st.tuples(some_zones(heading), some_zones(heading)))


@given(MATRICES)
def test_zones_that_cover_the_matrix_have_all_of_it(apm: Apm) -> None:
    everything = squares((0.0, 0.0, 100.0), heading=0.3)
    assert everything.share_of(apm) == (1 if apm.cells.any() else 0)


@given(MATRICES)
def test_no_zones_have_nothing(apm: Apm) -> None:
    assert NOWHERE.share_of(apm) == 0


@given(MATRICES, TWO_SETS)
def test_the_share_is_monotonic_and_counts_no_area_twice(
    apm: Apm, sets: tuple[Zones, Zones]
) -> None:
    first, second = sets
    both = united(first, second).share_of(apm)
    alone = first.share_of(apm), second.share_of(apm)
    assert max(alone) <= both <= min(sum(alone), 1)
    assert united(first, first).share_of(apm) == alone[0]
    assert united(second, first).share_of(apm) == both


@given(MATRICES, HEADING, st.floats(0.1, 10), st.floats(-5, 5), st.floats(-5, 5))
def test_four_squares_side_by_side_have_what_the_square_of_all_has(
    apm: Apm, heading: float, half: float, x: float, y: float
) -> None:
    """Additive over disjoint zones, exactly: no border belongs to two of them, or to none."""
    half = float(np.float32(half))
    forward = np.array([math.cos(heading), math.sin(heading)])
    left = np.array([-forward[1], forward[0]])
    parts = [
        squares((*((x, y) + half * (i * forward + j * left)), half), heading=heading)
        for i in (-1, 1)
        for j in (-1, 1)
    ]
    whole = squares((x, y, 2 * half), heading=heading)
    assert sum(part.share_of(apm) for part in parts) == whole.share_of(apm)


@given(MATRICES, TWO_SETS, HEADING)
@settings(max_examples=50)
def test_turning_the_world_changes_nothing(
    apm: Apm, sets: tuple[Zones, Zones], angle: float
) -> None:
    """Up to sub-cells on a border, of which rounding errors decide."""
    zones = sets[0]
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    turned_apm = matrix(apm.cells, apm.heading + angle)
    turned = Zones(
        heading=zones.heading + angle, centers=zones.centers @ turn.T, ranges=zones.ranges
    )
    assert float(turned.share_of(turned_apm)) == pytest.approx(float(zones.share_of(apm)), abs=0.02)


@pytest.mark.parametrize("angle", [0.0, math.pi / 2, math.pi, -math.pi / 2])
def test_aligned_squares_have_their_exact_share(angle: float) -> None:
    """Along borders of sub-cells the raster is exact: 2 x 2 m in the corner of a 5 m cell."""
    cells = np.zeros((4, 4))
    cells[2, 2], cells[0, 0] = 30, 70  # the cell in front and left of the centre; a far one
    inside = np.array([1.0, 1.0])
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    zones = squares((*(turn @ inside), 1.0), heading=angle)
    assert zones.share_of(matrix(cells, angle)) == Fraction(30, 100) * Fraction(4, 25)


@given(HEADING)
def test_rounding_errors_do_not_decide_about_a_border_through_centres_of_sub_cells(
    angle: float,
) -> None:
    """Aligned grids, however turned: a square of 4 m has 8 x 8 of the sub-cells of 0.5 m."""
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    zones = squares((*(turn @ [0.25, 10.25]), 2.0), heading=angle)
    share = zones.share_of(matrix(np.ones((8, 8)), angle))
    assert share == Fraction(64, 64 * 100)


@pytest.mark.parametrize("heading", [0.0, 0.1, 0.5, math.pi / 4, 1.2])
def test_small_cells_up_to_the_corners_of_a_square_are_found(heading: float) -> None:
    """400 square metres of a matrix of 1600, within half a sub-cell along the border of 80 m."""
    apm = matrix(np.ones((80, 80)), cell=0.5)
    area = float(squares((0.0, 0.0, 10.0), heading=heading).share_of(apm)) * 1600.0
    assert area == pytest.approx(400.0, abs=80.0 * 0.5 / 2)


@pytest.mark.parametrize("heading", [0.1, 0.5, math.pi / 4, 1.2])
def test_a_turned_square_has_the_area_it_has(heading: float) -> None:
    """A square within one cell, and the cell within a square of twice its diagonal."""
    apm = matrix(np.array([[7]]), cell=40.0)
    within = squares((1.3, -2.1, 8.0), heading=heading)
    border, sub_cell = 64.0, 0.5
    assert float(within.share_of(apm)) * 1600.0 == pytest.approx(256.0, abs=border * sub_cell / 2)
    assert squares((0.0, 0.0, 40.0), heading=heading).share_of(apm) == 1


def test_the_diagonal_of_a_cell_halves_it() -> None:
    """A side of a square turned by 45 degrees runs through two corners of the cell."""
    half = 20.0
    zones = squares((half / math.sqrt(2.0), half / math.sqrt(2.0), half), heading=math.pi / 4)
    sub_cells, on_diagonal = 20 * 20, 20
    share = zones.share_of(matrix(np.array([[1]]), cell=10.0))
    assert abs(share - Fraction(1, 2)) <= Fraction(on_diagonal, 2 * sub_cells)


def test_an_index_of_levels_weighs_like_one_of_points() -> None:
    """Only ratios count: the unit of the index falls out."""
    cells = np.array([[1, 2], [3, 0]])
    zones = squares((1.0, 2.0, 3.0))
    assert zones.share_of(matrix(cells)) == zones.share_of(matrix(1000 * cells))


def boxes(*rows: tuple[float, float, float, float]) -> Boxes:
    """Boxes along the axes, given by two corners each."""
    table = np.array(rows, float).reshape(-1, 4)
    low, high = table[:, :2], table[:, 2:]
    return Boxes((low + high) / 2, np.zeros(len(table)), high - low)


def test_boxes_are_reached_exactly_where_they_overlap() -> None:
    """The square |x| + |y| <= 10: its corner reaches (10, 0), its sides not (8, 8)."""
    diamond = squares((0.0, 0.0, 10.0 / math.sqrt(2.0)), heading=math.pi / 4)
    given = boxes(
        (9.9, -1.0, 12.0, 1.0),  # over the corner
        (10.1, -1.0, 12.0, 1.0),  # before it
        (5.1, 5.1, 8.0, 8.0),  # beyond the side, but within the bounds of the square
        (4.9, 4.9, 8.0, 8.0),  # over the side
        (-50.0, -50.0, 50.0, 50.0),  # around it
        (1.0, 1.0, 1.0, 1.0),  # a point in it
    )
    expected = [True, False, False, True, True, True]
    assert diamond.reached_by(given).tolist() == expected
    assert NOWHERE.reached_by(given).tolist() == [False] * 6
    assert diamond.reached_by(boxes()).tolist() == []


@given(st.floats(-math.pi, math.pi))
def test_whether_a_box_is_reached_does_not_depend_on_the_axes(turn: float) -> None:
    """A box of 4 m x 2 m whose corner points at a square's side, 0.01 m before it and over it."""
    cosine, sine = math.cos(turn), math.sin(turn)
    corner = math.hypot(2.0, 1.0)
    for gap, expected in ((0.01, False), (-0.01, True)):
        x = 10.0 + corner + gap
        box = Boxes(
            np.array([[x * cosine, x * sine]]),
            np.array([turn + math.atan2(1.0, 2.0)]),
            np.array([[4.0, 2.0]]),
        )
        found = squares((0.0, 0.0, 10.0), heading=turn).reached_by(box)
        assert found.tolist() == [expected]


@given(TWO_SETS, st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30)), max_size=6))
def test_a_box_is_reached_by_zones_if_it_is_by_one_of_them(
    sets: tuple[Zones, Zones], corners: list[tuple[float, float]]
) -> None:
    first, second = sets
    given = boxes(*((x, y, x + 4.0, y + 2.0) for x, y in corners))
    either = first.reached_by(given) | second.reached_by(given)
    np.testing.assert_array_equal(united(first, second).reached_by(given), either)


def entries(centers: Array, ranges: Array) -> BlindZones:
    return BlindZones(centers=centers, ranges=ranges)


def test_unused_entries_are_left_out_and_the_rest_is_as_on_the_air() -> None:
    centers = np.array([[0.1, 1000.1], [np.nan, 0.0], [3.0, 4.0]])
    zones = zones_in(entries(centers, np.array([0.3, 0.0, 5.0])), 0.7)
    assert len(zones) == 2
    packed = np.column_stack([zones.centers, zones.ranges]).astype("<f4").tobytes()
    assert len(packed) == 24
    np.testing.assert_array_equal(
        np.frombuffer(packed, "<f4").reshape(2, 3), np.column_stack([zones.centers, zones.ranges])
    )
    assert zones.heading == float(np.float32(0.7))


def test_an_input_that_is_not_connected_is_named() -> None:
    with pytest.raises(ValueError, match=r"connect .*to: facilities\.blind_zone.*`answer: all`"):
        zones_in(entries(np.zeros((0, 2)), np.zeros(0)), 0.0)


@pytest.mark.parametrize(
    ("center", "half"),
    [((np.nan, 0.0), 5.0), ((0.0, np.inf), 5.0), ((0.0, 0.0), -1.0), ((0.0, 0.0), np.nan)],
)
def test_what_is_no_zone_is_refused_with_its_place(
    center: tuple[float, float], half: float
) -> None:
    centers, ranges = np.array([[1.0, 2.0], center]), np.array([3.0, half])
    with pytest.raises(ValueError, match=r"`blind_zone` 1 has the centre .* must be finite"):
        zones_in(entries(centers, ranges), 0.0)


def test_centres_and_ranges_must_be_as_many() -> None:
    with pytest.raises(ValueError, match=r"center` has 2 entries, `blind_zone\.range` 3"):
        zones_in(entries(np.zeros((2, 2)), np.zeros(3)), 0.0)
