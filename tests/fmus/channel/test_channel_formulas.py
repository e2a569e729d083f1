"""What holds for the formulas of the channel, also where no golden data exist."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from tests.fmus.scene import rectangle

from .harness import LIGHT_SPEED
from .primitives import Body, Primitives, Ring

COORDINATE = st.floats(-200, 200)
ANTENNA = st.tuples(COORDINATE, COORDINATE, st.floats(0.5, 8))
BODY = st.builds(
    Body,
    center=st.tuples(COORDINATE, COORDINATE, st.just(0.0)),
    heading=st.floats(-7, 7),
    size=st.tuples(st.floats(0, 20), st.floats(0, 5), st.floats(0, 5)),
)
# small integers, so that links through corners, along walls and ending on walls are frequent
CORNER = st.tuples(st.integers(-3, 3), st.integers(-3, 3))
COARSE_ANTENNA = st.tuples(st.integers(-4, 4), st.integers(-4, 4), st.integers(1, 3))
RING = st.lists(CORNER, min_size=3, max_size=8)


@pytest.mark.parametrize(
    ("tx", "rx", "walls", "indoors"),
    [
        ((-10, 0, 1), (10, 0, 1), 2, 6),  # through
        ((-10, 0, 1), (0, 0, 1), 1, 3),  # into
        ((-1, 0, 1), (2, 0, 1), 0, 3),  # within
        ((-10, 9, 1), (10, 9, 1), 0, 0),  # past
        ((0, 0, 1), (0, 0, 4), 0, 3),  # vertical, inside
    ],
)
def test_walls_and_metres_of_one_house(
    primitives: Primitives,
    tx: tuple[float, ...],
    rx: tuple[float, ...],
    walls: float,
    indoors: float,
) -> None:
    house = Ring(corners=rectangle(0, 0, 6, 4))
    assert np.ravel(primitives.penetration([house], [tx], [rx])) == pytest.approx([walls, indoors])


@pytest.mark.parametrize(
    ("z", "walls", "indoors"),
    [
        ((5, 5), 2, 10.0),  # below the roof
        ((15, 15), 0, 0.0),  # over it
        ((20, 4), 0, 0.0),  # over it, touching the far edge of the roof
        ((20, 0), 2, 5 * math.sqrt(1 + 0.5**2)),  # in through the roof, out through the wall
        ((20, 1e9), 0, 0.0),
    ],
)
def test_a_house_ends_at_its_roof(
    primitives: Primitives, z: tuple[float, float], walls: float, indoors: float
) -> None:
    house = Ring(corners=rectangle(0, 0, 10, 10), height=10.0)
    tx, rx = (-20.0, 0.0, z[0]), (20.0, 0.0, z[1])
    found = primitives.penetration([house], [tx], [rx], finite=True)
    assert np.ravel(found) == pytest.approx([walls, indoors], abs=1e-9)


@given(st.lists(RING, min_size=1, max_size=4), COARSE_ANTENNA, COARSE_ANTENNA)
def test_what_degenerate_links_penetrate_is_finite_and_bounded(
    primitives: Primitives,
    rings: list[list[tuple[int, int]]],
    a: tuple[int, ...],
    b: tuple[int, ...],
) -> None:
    buildings = [Ring(corners=ring) for ring in rings]
    walls, indoors = primitives.penetration(buildings, [a, b], [b, a])
    assert np.isfinite(indoors).all()
    assert (indoors >= 0).all()
    assert (indoors <= math.dist(a, b) * len(rings) * (1 + 1e-9)).all()
    assert (walls == np.round(walls)).all()
    assert (walls <= sum(map(len, rings))).all()


@given(RING, COARSE_ANTENNA, COARSE_ANTENNA)
def test_a_degenerate_link_gets_the_loss_of_links_nearby(
    primitives: Primitives, ring: list[tuple[int, int]], a: tuple[int, ...], b: tuple[int, ...]
) -> None:
    if a[:2] == b[:2]:
        return
    building = Ring(corners=ring)
    (exact_walls,), (exact_indoors,) = primitives.penetration([building], [a], [b])
    along = np.array([b[0] - a[0], b[1] - a[1], 0]) / math.dist(a[:2], b[:2])
    right = np.array([along[1], -along[0], 0])
    shifts = list(itertools.product((1e-7, -1e-7), (-1e-6, 1e-6), (-1e-6, 1e-6)))
    walls, indoors = primitives.penetration(
        [building],
        [a + side * right + start * along for side, start, _ in shifts],
        [b + side * right + stop * along for side, _, stop in shifts],
    )
    np.testing.assert_allclose(indoors[:4], exact_indoors, atol=1e-4)  # on the right
    assert walls.min() <= exact_walls <= walls.max()


@given(st.lists(BODY, min_size=1, max_size=12), ANTENNA, ANTENNA)
def test_shadows_are_finite_and_never_gains(
    primitives: Primitives,
    bodies: list[Body],
    a: tuple[float, float, float],
    b: tuple[float, float, float],
) -> None:
    loss, blocked = primitives.shadow(bodies, [a], [b])
    assert np.isfinite(loss).all()
    assert loss[0] >= 0
    assert not blocked[0] or loss[0] > 6.0  # J(0) = 6.03 dB


def test_a_vehicle_shadows_alike_in_both_directions_unless_veins_is_wanted(
    primitives: Primitives,
) -> None:
    truck = Body(center=(10.0, 0.0, 0.0), heading=0.0, size=(12.0, 2.5, 3.5))
    a, b = (0.0, 0.0, 1.5), (60.0, 0.5, 1.8)
    (there, back), _ = primitives.shadow([truck], [a, b], [b, a])
    assert there == pytest.approx(back, abs=1e-9)
    (there, back), _ = primitives.shadow([truck], [a, b], [b, a], reciprocal=False)
    assert abs(there - back) > 1
    (together,), _ = primitives.shadow([truck], [a], [b], reciprocal=False, back=True)
    assert together == pytest.approx(back, abs=1e-9)


def test_one_knife_edge_is_itu_p526(primitives: Primitives) -> None:
    wall = Body(center=(30.0, 0.0, 0.0), heading=0.0, size=(0.0, 2.0, 4.0))
    (loss,), (blocked,) = primitives.shadow([wall], [(0, 0, 1.5)], [(60, 0, 1.5)], frequency=5.9e9)
    v = 2.5 * math.sqrt(2 / (LIGHT_SPEED / 5.9e9) * (1 / 30 + 1 / 30))
    assert loss == pytest.approx(6.9 + 20 * math.log10(math.hypot(v - 0.1, 1) + v - 0.1))
    assert blocked


def test_the_papers_equation_has_no_factor_two(primitives: Primitives) -> None:
    profile = [(0, 1.5), (30, 4.0), (60, 1.5)]
    itu, paper = (primitives.profile_loss(profile, 5.9e9, factor) for factor in (2.0, 1.0))
    half = primitives.profile_loss(profile, 5.9e9 / 2, 2.0)  # the wavelength doubled instead
    assert paper == pytest.approx(half)
    assert 2 < itu - paper < 20 * math.log10(math.sqrt(2)) + 0.1  # J grows with 20 log10 v


def test_a_taller_vehicle_shadows_more(primitives: Primitives) -> None:
    losses = [
        primitives.shadow(
            [Body(center=(25.0, 0.0, 0.0), heading=0.3, size=(5.0, 2.0, height))],
            [(0, 0, 1.5)],
            [(60, 0, 1.5)],
        )[0][0]
        for height in np.linspace(1.0, 4.0, 31)
    ]
    assert (np.diff(losses) >= 0).all()
    assert losses[-1] > losses[0] + 15


@pytest.mark.parametrize(
    ("what", "body"),
    [
        ("beside the link", Body(center=(30.0, 3.0, 0.0), heading=0.0, size=(5.0, 2.0, 4.0))),
        ("behind the end", Body(center=(70.0, 0.0, 0.0), heading=0.0, size=(5.0, 2.0, 4.0))),
        ("on a bridge", Body(center=(30.0, 0.0, 6.0), heading=0.0, size=(5.0, 2.0, 4.0))),
    ],
)
def test_a_body_out_of_the_way_does_not_shadow(
    primitives: Primitives, what: str, body: Body
) -> None:
    loss, blocked = primitives.shadow([body], [(0, 0, 1.5)], [(60, 0, 1.5)])
    assert (loss[0], blocked[0]) == (0, False), what


@pytest.mark.parametrize("reciprocal", [True, False])
def test_degenerate_bodies_and_links(primitives: Primitives, *, reciprocal: bool) -> None:
    points = [(x, y, z) for x in (0.0, 2.5, 5.0) for y in (0.0, 1.0) for z in (0.0, 1.5, 4.0)]
    links = [(a, b) for a in points for b in points]
    nothing = Body(center=(2.5, 1.0, 0.0), heading=0.0, size=(0.0, 0.0, 0.0))
    car = Body(center=(2.5, 0.0, 0.0), heading=math.pi / 2, size=(4.0, 2.0, 1.5))
    loss, _ = primitives.shadow(
        [nothing, nothing, car, car],
        [a for a, _ in links],
        [b for _, b in links],
        reciprocal=reciprocal,
    )
    assert np.isfinite(loss).all()


def test_culling_finds_every_obstacle(primitives: Primitives) -> None:
    rng = np.random.default_rng(7)
    rings = [
        Ring(corners=rectangle(*rng.uniform(-500, 500, 2), *rng.uniform(1, 60, 2)))
        for _ in range(200)
    ]
    bodies = [
        Body(
            center=(*rng.uniform(-500, 500, 2), 0.0),
            heading=rng.uniform(0, 7),
            size=tuple(rng.uniform((3, 1.5, 1), (18, 2.6, 4))),
        )
        for _ in range(300)
    ]
    ends = rng.uniform((-700, -700, 1), (700, 700, 3), (2, 400, 3))
    ends[1, :50, 0] = ends[0, :50, 0]  # parallel to the axes
    ends[1, 50:100, 1] = ends[0, 50:100, 1]
    walls, indoors = primitives.penetration(rings, *ends)
    alone = [primitives.penetration([ring], *ends) for ring in rings]
    np.testing.assert_allclose(walls, sum(w for w, _ in alone))
    np.testing.assert_allclose(indoors, sum(i for _, i in alone), atol=1e-9)
    blocked = primitives.shadow(bodies, *ends)[1]
    each = [primitives.shadow([body], *ends)[1] for body in bodies]
    np.testing.assert_array_equal(blocked, np.any(each, axis=0))
    assert 100 < blocked.sum() < 400


def test_duration_of_a_frame(primitives: Primitives) -> None:
    assert primitives.duration(6e6, 200) == 312_000_000  # [ps]; 1600 bits: 40 us + 34 symbols
    assert primitives.duration(3e6, 0) == 48_000_000
    assert primitives.duration(27e6, 4095) == 1000 * (
        40_000 + 8_000 * math.ceil((22 + 8 * 4095) / 216)
    )


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ([0, 0, 0, 0], [0, 0], [0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8]),
        (
            [0xFFFFFFFF] * 4,
            [0xFFFFFFFF] * 2,
            [0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD],
        ),
        (
            [0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344],
            [0xA4093822, 0x299F31D0],
            [0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1],
        ),
    ],
)
def test_philox_gives_the_published_known_answers(
    primitives: Primitives, counter: list[int], key: list[int], expected: list[int]
) -> None:
    assert primitives.philox(counter, key) == expected


def test_draws_are_uniform_and_differ_by_seed_packet_and_hop(primitives: Primitives) -> None:
    n = 20_000
    draws = [primitives.uniforms(*key, n) for key in [(1, 5, 0), (2, 5, 0), (1, 6, 0), (1, 5, 1)]]
    columns = np.column_stack(draws)
    assert columns.min() >= 0
    assert columns.max() < 1
    np.testing.assert_allclose(columns.mean(axis=0), 0.5, atol=5 / math.sqrt(12 * n))
    correlation = np.corrcoef(columns.T) - np.eye(8)
    assert np.abs(correlation).max() < 5 / math.sqrt(n)


@pytest.mark.parametrize("reciprocal", [True, False])
@pytest.mark.parametrize("gap", [1e-300, 1e-12, 1e-8, 1e-3])
def test_edges_next_to_an_antenna_or_to_each_other_are_finite(
    primitives: Primitives, gap: float, *, reciprocal: bool
) -> None:
    walls = [
        Body(center=(x, 0.0, 0.0), heading=0.0, size=(0.0, 2.0, height))
        for x, height in [(0.0, 4.0), (gap, 5.0), (2 * gap, 3.0)]
    ]
    links = [((-gap, 0, 1.5), (60, 0, 1.5)), ((-gap, 0, 1.5), (3 * gap, 0, 1.5))]
    (far, near), _ = primitives.shadow(
        walls, [a for a, _ in links], [b for _, b in links], reciprocal=reciprocal
    )
    assert np.isfinite([far, near]).all()
    assert far >= 0
