"""What holds for the links of a scene, whatever spares their calculation."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from tests.fmus.scene import rectangle

from .links import (
    VEINS,
    Announced,
    LinkMatrix,
    Propagation,
    Town,
    least_loss,
    link_pairs,
    link_rows,
    link_rows_of_scenes,
)
from .primitives import PathLoss, Primitives, Ring

pytestmark = pytest.mark.slow

FLOOR = 10**-12.0  # -94 dBm of 26 dBm
PATTERN = (3.0, -2.0, -6.0, 1.0)
CASES = [
    Propagation(),
    VEINS,
    Propagation(antenna_gain=PATTERN, band_edges=False, maximum_range=300),
    replace(VEINS, path_loss=PathLoss(model="two_ray"), antenna_gain=PATTERN),
    Propagation(path_loss=PathLoss(model="breakpoint"), finite_buildings=False),
    Propagation(path_loss=PathLoss(exponent=2.7), vehicle_shadowing=False),
    Propagation(building_shadowing=False, knife_edge_factor=1.0),
]


def grid_town(seed: int, vehicles: int) -> Town:
    """A town of streets between blocks of all shapes, with some vehicles off the streets."""
    rng = np.random.default_rng(seed)
    along = rng.random(vehicles) < 0.5
    place = np.column_stack([rng.uniform(-20, 420, vehicles), 100 * rng.integers(0, 5, vehicles)])
    place[:, 1] += rng.choice([-5, -1.6, 1.6, 5], vehicles)
    place[along] = place[along][:, ::-1]
    stray = rng.random(vehicles) < 0.1
    place[stray] = rng.uniform(-50, 450, (int(stray.sum()), 2))
    return Town(
        position=np.column_stack([place, np.where(rng.random(vehicles) < 0.1, 6.0, 0.0)]),
        heading=np.where(along, np.pi / 2, 0) + rng.choice([0, np.pi, 0.01], vehicles),
        size=rng.choice([(4.5, 1.8, 1.5), (12, 2.55, 4), (5.6, 2, 2.3), (0, 0, 0)], vehicles),
        antenna_height=rng.choice([1.6, 1.895, 3.5, 0.0], vehicles),
        equipped=rng.random(vehicles) < 0.9,
        buildings=[_block(rng, 50 + 100 * x, 50 + 100 * y) for x in range(4) for y in range(4)],
    )


def _block(rng: np.random.Generator, x: float, y: float) -> Ring:
    shapes = [
        rectangle(x, y, 80, 80),
        rectangle(x, y, 60, 10),
        [(x - 40, y - 40), (x + 40, y - 40), (x + 40, y), (x, y), (x, y + 40), (x - 40, y + 40)],
        [
            (x + 40 * np.cos(k * 4 * np.pi / 5), y + 40 * np.sin(k * 4 * np.pi / 5))
            for k in range(5)
        ],
        [(x - 40, y), (x + 40, y + 10), (x, y + 40)],
        [(x - 40, y - 40), (x + 40, y - 40), (x + 40, y + 40), (x, y - 30), (x - 40, y + 40)],
    ]
    corners = shapes[int(rng.integers(len(shapes)))]
    return Ring(corners=corners[:: int(rng.choice([-1, 1]))], height=float(rng.choice([3, 20])))


def expected(pairs: LinkMatrix, town: Town, reach: float, floor: float) -> np.ndarray:
    """Which links belong into the rows."""
    both = town.equipped[:, None] & town.equipped[None, :]
    return (
        both
        & ~np.eye(town.vehicles, dtype=bool)
        & (pairs.distance <= reach)
        & (pairs.gain[:, :, 1] >= floor)
    )


def check_rows(rows: LinkMatrix, pairs: LinkMatrix, town: Town, reach: float, floor: float) -> None:
    """The rows hold exactly what the links looked up one by one say, nearest first."""
    wanted = expected(pairs, town, reach, floor)
    np.testing.assert_array_equal(rows.rank >= 0, wanted)
    for name in ("gain", "distance", "kind"):
        np.testing.assert_array_equal(getattr(rows, name)[wanted], getattr(pairs, name)[wanted])
    for rank, distance in zip(rows.rank, pairs.distance, strict=True):
        members = np.flatnonzero(rank >= 0)
        order = members[np.lexsort((members, distance[members]))]
        np.testing.assert_array_equal(rank[order], np.arange(len(members)))


@pytest.mark.parametrize("propagation", CASES)
@pytest.mark.parametrize("floor", [0.0, FLOOR, 1e-9])
def test_rows_hold_the_links_looked_up_one_by_one(
    primitives: Primitives, propagation: Propagation, floor: float
) -> None:
    for seed in range(6):
        town = grid_town(seed, 60)
        rows = link_rows(primitives, town, propagation, floor)
        pairs = link_pairs(primitives, town, propagation)
        check_rows(rows, pairs, town, propagation.maximum_range, floor)


@given(st.integers(0, 2**32), st.sampled_from(CASES), st.floats(-16, -6), st.data())
@settings(deadline=None, max_examples=60)
def test_rows_do_not_depend_on_the_order_in_which_they_are_asked_for(
    primitives: Primitives, seed: int, p: Propagation, level: float, data: st.DataObject
) -> None:
    n = data.draw(st.integers(1, 40))
    town = grid_town(seed, n)
    order = data.draw(st.permutations(range(n)))
    rows = link_rows(primitives, town, p, 10**level, order)
    check_rows(rows, link_pairs(primitives, town, p), town, p.maximum_range, 10**level)


@given(st.integers(0, 2**32), st.sampled_from(CASES), st.floats(-16, -6), st.data())
@settings(deadline=None, max_examples=100)
def test_nor_on_how_many_find_them_nor_on_what_was_announced(
    primitives: Primitives, seed: int, p: Propagation, level: float, data: st.DataObject
) -> None:
    n = data.draw(st.integers(1, 60))
    town = grid_town(seed, n)
    order = data.draw(st.permutations(range(n)))
    radios = data.draw(st.just(order) | st.lists(st.integers(0, n - 1), min_size=n, max_size=n))
    announced = Announced(
        workers=data.draw(st.sampled_from([1, 2, 3, 8])),
        width=data.draw(st.integers(1, n)),
        radios=radios,
    )
    rows = link_rows(primitives, town, p, 10**level, order, announced=announced)
    check_rows(rows, link_pairs(primitives, town, p), town, p.maximum_range, 10**level)


@pytest.mark.parametrize("floors", [(1e-9, 1e-12), (1e-12, 1e-9), (1e-10, 1e-12, 1e-9, 0.0, 1e-10)])
def test_each_floor_gets_its_rows(primitives: Primitives, floors: tuple[float, ...]) -> None:
    town = grid_town(3, 50)
    order = [k for _ in floors for k in range(50)]
    each = [floor for floor in floors for _ in range(50)]
    for propagation in (Propagation(), VEINS):
        rows = link_rows(primitives, town, propagation, each, order)
        pairs = link_pairs(primitives, town, propagation)
        check_rows(rows, pairs, town, propagation.maximum_range, floors[-1])


def test_links_are_reciprocal_to_the_last_bit_unless_veins_is_wanted(
    primitives: Primitives,
) -> None:
    town = grid_town(8, 80)
    for propagation in CASES:
        pairs = link_pairs(primitives, town, propagation)
        alike = (pairs.gain == pairs.gain.transpose(1, 0, 2)).all()
        assert alike == (propagation.reciprocal or not propagation.vehicle_shadowing)
        np.testing.assert_array_equal(pairs.distance, pairs.distance.T)


def test_links_between_radios_equal_those_looked_up(primitives: Primitives) -> None:
    for seed, propagation in enumerate(CASES):
        town = grid_town(seed, 50)
        looked_up = link_pairs(primitives, town, propagation)
        viewed = link_pairs(primitives, town, propagation, negligible=0.0)
        for name in ("gain", "distance", "kind"):
            np.testing.assert_array_equal(getattr(viewed, name), getattr(looked_up, name))


def test_a_negligible_link_has_no_gain(primitives: Primitives) -> None:
    for seed, propagation in enumerate(CASES):
        town = grid_town(seed, 50)
        both = town.equipped[:, None] & town.equipped[None, :]
        exact = link_pairs(primitives, town, propagation)
        cut = link_pairs(primitives, town, propagation, negligible=1e-12)
        keeps = (exact.gain[:, :, 1] >= 1e-12) | ~both
        np.testing.assert_array_equal(cut.gain[keeps], exact.gain[keeps])
        assert not cut.gain[~keeps].any()


def test_the_bands_differ_by_their_wavelength_only(primitives: Primitives) -> None:
    town = grid_town(5, 40)
    three = link_pairs(primitives, town, VEINS)
    for band, offset in enumerate((-5e6, 0.0, 5e6)):
        alone = replace(VEINS, carrier_frequency=5.9e9 + offset, band_edges=False)
        gain = link_pairs(primitives, town, alone).gain
        np.testing.assert_array_equal(gain[:, :, 1], three.gain[:, :, band])
        np.testing.assert_array_equal(gain[:, :, 0], gain[:, :, 2])


def test_links_of_crowds_at_one_place_and_of_far_radios_are_finite(primitives: Primitives) -> None:
    n = 30
    position = np.zeros((n, 3))
    position[10:20] = (1e8, -1e8, 0)
    position[20:] = (3, 0, 0)
    town = Town(
        position=position,
        heading=np.linspace(-1e8, 1e8, n),
        size=np.tile([4.5, 1.8, 1.5], (n, 1)),
        antenna_height=np.zeros(n),
        equipped=np.ones(n, bool),
        buildings=[Ring(corners=rectangle(0, 0, 1e8, 1e8))],
    )
    for propagation in CASES:
        far = replace(propagation, maximum_range=1e9)
        rows = link_rows(primitives, town, far)
        check_rows(rows, link_pairs(primitives, town, far), town, 1e9, 0.0)
        others = ~np.eye(n, dtype=bool)
        assert (rows.gain[others] > 0).all()
        # antennas add at most their gain, and in this crowd nothing else does
        assert (rows.gain <= 10 ** (2 * max(far.antenna_gain) / 10) * (1 + 1e-12)).all()


def test_an_antenna_pattern_turns_with_its_carrier(primitives: Primitives) -> None:
    alone = Town(
        position=np.array([(0.0, 0.0, 0.0), (100.0, 0.0, 0.0)]),
        heading=np.array([0.0, 0.0]),
        size=np.zeros((2, 3)),
        antenna_height=np.full(2, 1.5),
        equipped=np.ones(2, bool),
    )
    pattern = Propagation(antenna_gain=(6.0, 0.0, -6.0, 0.0))
    plain = link_pairs(primitives, alone, Propagation()).gain[0, 1, 1]
    for turn, gain_db in [(0.0, 0.0), (np.pi, -12.0), (np.pi / 2, -6.0), (np.pi / 4, -3.0)]:
        # the first sees the second at -turn, and is seen from its back
        town = replace(alone, heading=np.array([turn, 0.0]))
        gain = link_pairs(primitives, town, pattern).gain[0, 1, 1]
        assert 10 * np.log10(gain / plain) == pytest.approx(gain_db, abs=1e-9)


def test_an_empty_and_a_lonely_scene_have_no_links(primitives: Primitives) -> None:
    for n in (0, 1):
        assert (link_rows(primitives, grid_town(1, n), VEINS, FLOOR).rank == -1).all()


@given(st.integers(0, 2**32), st.sampled_from(CASES), st.sampled_from(CASES), st.floats(-16, -6))
@settings(deadline=None, max_examples=40)
def test_scenes_before_leave_no_trace_in_the_links(
    primitives: Primitives, seed: int, before: Propagation, p: Propagation, level: float
) -> None:
    """Vehicles move, leave and enter, buildings stay or change, antennas grow, models change."""
    first, second, third = (grid_town(seed + k, n) for k, n in enumerate((50, 30, 60)))
    stays = replace(third, buildings=())
    floor = 10**level
    for scenes, town in (
        ([(first, p), (replace(second, buildings=()), p), (stays, p)], first),
        ([(first, before), (second, p), (stays, p)], second),
        ([(first, p), (third, p)], third),
        ([(first, before), (stays, replace(p, wall_loss=3.0, indoor_loss=0.1))], first),
    ):
        last = replace(third, buildings=town.buildings)
        rows = link_rows_of_scenes(primitives, scenes, floor, floor / 1e4)
        model = scenes[-1][1]
        pairs = link_pairs(primitives, last, model)
        check_rows(rows, pairs, last, model.maximum_range, floor)


@pytest.mark.slow
def test_rows_are_the_same_where_there_are_more_cells_than_room(primitives: Primitives) -> None:
    """Over 8,192 places: cells get larger, and beyond that radios have none."""
    rng = np.random.default_rng(5)
    town = grid_town(5, 60)
    scenes = []
    for extent in (3e3, 3e4, 3e5):
        n = 9000
        far = replace(
            town,
            position=np.column_stack([rng.uniform(-extent, extent, (n, 2)), np.zeros(n)]),
            heading=np.zeros(n), size=np.tile((4.5, 1.8, 1.5), (n, 1)),
            antenna_height=np.full(n, 1.6), equipped=np.ones(n, bool),
        )  # fmt: skip
        scenes.append(far)
    model = Propagation(maximum_range=300)
    strays = np.arange(0, 9000, 450)
    for far in scenes:
        mixed = replace(
            far,
            position=np.vstack([far.position, town.position]),
            heading=np.append(far.heading, town.heading),
            size=np.vstack([far.size, town.size]),
            antenna_height=np.append(far.antenna_height, town.antenna_height),
            equipped=np.append(far.equipped, town.equipped),
        )
        order = [*strays, *range(9000, 9060)]
        ends = np.asarray(order)
        few = replace(
            mixed,
            position=mixed.position[ends], heading=mixed.heading[ends], size=mixed.size[ends],
            antenna_height=mixed.antenna_height[ends], equipped=mixed.equipped[ends],
        )  # fmt: skip
        unshadowed = replace(model, vehicle_shadowing=False)
        rows = link_rows(primitives, mixed, unshadowed, FLOOR, order)
        pairs = link_pairs(primitives, few, unshadowed)
        wanted = expected(pairs, few, 300, FLOOR)
        np.testing.assert_array_equal(rows.gain[np.ix_(ends, ends)][wanted], pairs.gain[wanted])
        assert not rows.gain[np.ix_(ends, ends)][~wanted].any()


def _two(ends: tuple[tuple[float, float], ...], *buildings: Ring) -> Town:
    return Town(
        position=np.array([[*end, 0.0] for end in ends]), heading=np.zeros(2),
        size=np.tile((4.5, 1.8, 1.5), (2, 1)), antenna_height=np.full(2, 1.6),
        equipped=np.ones(2, bool), buildings=buildings,
    )  # fmt: skip


def test_what_buildings_take_at_least_between_two_cells(primitives: Primitives) -> None:
    """A house 20 m deep: two walls of 9 dB, and 0.4 dB/m.

    Cells reach from 0 to 6 m and from 96 to 102 m, the house from 40 to 60 m. Of a link at least
    54 / 96 - 40 / 96 is inside, and it is 90 m long or longer: 13.1 m, 5.2 dB.
    """
    house = Ring(corners=rectangle(50, 3, 20, 60), height=10)
    model = Propagation()
    assert least_loss(primitives, _two(((3, 3), (99, 3)), house), model) == 23
    assert least_loss(primitives, _two(((3, 3), (99, 3)), house, house), model) == 46
    walls_alone = replace(model, indoor_loss=0.0)
    loss = least_loss(primitives, _two(((3, 3), (99, 3)), house), walls_alone)
    assert loss == 17  # 18 dB less a hair, rounded down
    # a link from corner to corner of the cells passes beside it, or over it, or there is none
    beside = Ring(corners=rectangle(50, 30, 20, 59), height=10)
    assert least_loss(primitives, _two(((3, 3), (99, 3)), beside), model) == 0
    low = Ring(corners=rectangle(50, 3, 20, 60), height=1.5)
    assert least_loss(primitives, _two(((3, 3), (99, 3)), low), model) == 0
    endless = replace(model, finite_buildings=False)
    assert least_loss(primitives, _two(((3, 3), (99, 3)), low), endless) == 23
    off = replace(model, building_shadowing=False)
    assert least_loss(primitives, _two(((3, 3), (99, 3)), house), off) == 0
    # no more is looked for than matters above the floor: the second house is left out
    assert least_loss(primitives, _two(((3, 3), (99, 3)), house, house), model, 1e-9) == 23


@given(st.integers(0, 2**32), st.data())
@settings(deadline=None, max_examples=60)
def test_no_link_loses_less_than_its_cells_say(
    primitives: Primitives, seed: int, data: st.DataObject
) -> None:
    town = grid_town(seed, 40)
    rng = np.random.default_rng(seed)
    model = Propagation(
        finite_buildings=data.draw(st.booleans()), vehicle_shadowing=False, wall_loss=7.0
    )
    for _ in range(5):
        cells = 6 * rng.integers(-10, 80, (2, 2))
        ends = tuple(tuple(cell + rng.uniform(0, 6, 2)) for cell in cells)
        pair = _two(ends, *town.buildings)
        least = least_loss(primitives, pair, model)
        free = link_pairs(primitives, pair, replace(model, building_shadowing=False))
        exact = link_pairs(primitives, pair, model)
        loss = 10 * np.log10(free.gain[0, 1, 1] / exact.gain[0, 1, 1])
        assert least <= loss + 1e-9
