"""Benefit is index times overlapping area; the ranking holds on to its choice."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import assume, given, strategies as st

from fmus.messages.apm import Float, encode, join
from tests.fmus.driver import Library, Refused
from tests.fmus.messages.apm.apms import apm_of

from .harness import STEP, Outputs, Perception
from .scene import Scan, cloud

EGO = 1
SIDE = 10.0
ONE_ZONE = {"rows": 1, "columns": 1, "cell": SIDE, "benefit_threshold": 0.0, "near_field": 0.0}
"""A matrix of one cell without points is one blind zone, of this side and around the ego."""


def view(time: int = 0, *, heading: float = 0.0, at: tuple[float, float] = (0.0, 0.0)) -> bytes:
    """The empty scan of the ego."""
    position = (*at, 2.0)
    points = np.zeros((0, 3))
    return cloud(Scan(vehicle=EGO, points=points, time=time, heading=heading, position=position))


def message(
    vehicle: int,
    index: int = 1,
    *,
    time: int = 0,
    center: tuple[float, float] = (0.0, 0.0),
    position: tuple[float, float] | None = None,
    heading: float = 0.0,
    cell: float = SIDE,
    cells: Float | None = None,
) -> bytes:
    """An APM of one cell with this index, or of `cells`, centred on its source unless told."""
    array = np.array([[index]]) if cells is None else cells
    return encode(
        apm_of(
            array.astype(np.uint32),
            vehicle=vehicle,
            time=time,
            position=center if position is None else position,
            heading=heading,
            center=center,
            cell=cell,
        )
    )


def benefit(library: Library, *messages: bytes, **ego: object) -> float:
    """The benefit of one sharer for an ego vehicle with one blind zone around it."""
    with Perception(library, **ONE_ZONE) as unit:
        result = unit.step(view(**ego), join(messages), ego=EGO)  # type: ignore[arg-type]
    return float(result.benefits[0]) if len(result.benefits) else 0.0


def overlap_by_integration(zone: float, center: Float, half: float, angle: float) -> float:
    """Area common to a square |x|, |y| <= zone and a turned one, by slicing along x."""
    c, s = np.cos(angle), np.sin(angle)
    x = np.linspace(-zone, zone, 20001)
    low, high = np.full_like(x, -zone), np.full_like(x, zone)
    # the turned square: |c dx + s dy| <= half and |c dy - s dx| <= half
    for along, across in ((c, s), (-s, c)):
        dx = (x - center[0]) * along
        with np.errstate(divide="ignore", invalid="ignore"):
            bounds = np.sort(np.stack([-half - dx, half - dx]) / across, axis=0)
        outside = np.abs(dx) > half
        flat = abs(across) < 1e-12
        low = np.where(flat, np.where(outside, np.inf, low), np.maximum(low, center[1] + bounds[0]))
        high = np.where(flat, high, np.minimum(high, center[1] + bounds[1]))
    length = np.maximum(high - low, 0)
    return float((length[1:] + length[:-1]).sum() * (x[1] - x[0]) / 2)


@pytest.mark.parametrize(
    ("center", "cell", "heading", "area"),
    [
        ((0, 0), SIDE, 0.0, 100.0),  # the same square
        ((0, 0), SIDE, np.pi / 2, 100.0),
        ((0, 0), SIDE, np.pi / 4, 200 * (np.sqrt(2) - 1)),  # a regular octagon
        ((5, 0), SIDE, 0.0, 50.0),
        ((5, 5), SIDE, 0.0, 25.0),
        ((10, 0), SIDE, 0.0, 0.0),  # a common side
        ((30, 0), SIDE, 0.0, 0.0),
        ((1, -2), 2.0, 0.3, 4.0),  # wholly inside
        ((0, 0), 100.0, 0.3, 100.0),  # wholly around
        ((5, 5), 2.0, np.pi / 4, 1.0),  # a quarter of it
        ((5, 0), np.sqrt(8), np.pi / 4, 4.0),  # half of it
    ],
)
def test_the_overlapping_area_is_exact(
    library: Library, center: tuple[float, float], cell: float, heading: float, area: float
) -> None:
    found = benefit(library, message(2, center=center, cell=cell, heading=heading))
    assert found == pytest.approx(area, rel=1e-6, abs=1e-9)


@given(st.tuples(st.floats(-9, 9), st.floats(-9, 9)), st.floats(0.5, 20), st.floats(-4, 4))
def test_the_overlapping_area_is_that_of_slices(
    library: Library, center: tuple[float, float], cell: float, heading: float
) -> None:
    cell = float(np.float32(cell))
    found = benefit(library, message(2, center=center, cell=cell, heading=heading))
    expected = overlap_by_integration(SIDE / 2, np.array(center), cell / 2, heading)
    assert found == pytest.approx(expected, rel=2e-3, abs=0.02)


@given(st.floats(-4, 4), st.tuples(st.floats(-900, 900), st.floats(-900, 900)), st.floats(-4, 4))
def test_only_the_relative_pose_matters(
    library: Library, turn: float, shift: tuple[float, float], heading: float
) -> None:
    apart = np.array([4.0, -3.0])
    moved = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ apart + shift
    here = benefit(library, message(2, center=(4.0, -3.0), heading=heading))
    there = benefit(
        library,
        message(2, center=(moved[0], moved[1]), heading=heading + turn),
        heading=turn,
        at=shift,
    )
    assert there == pytest.approx(here, rel=1e-9)


def test_the_benefit_sums_index_times_area_over_cells_and_zones(library: Library) -> None:
    # four zones of 5 m fill the matrix; the sharer's cells of 4 m straddle them
    cells = np.array([[3, 0], [7, 1]])
    four = ONE_ZONE | {"rows": 2, "columns": 2, "cell": 5.0, "window_largest": 1}
    with Perception(library, **four) as unit:
        result = unit.step(view(), join([message(2, cells=cells, cell=4.0)]), ego=EGO)
    assert len(result.ranges) == 4
    assert result.benefits.tolist() == [pytest.approx(16 * 11)]
    # moved 3 m ahead, one row of cells reaches from 3 to 7 m, half of it beyond the zones
    with Perception(library, **four) as unit:
        shifted = message(2, cells=cells, cell=4.0, center=(3, 0))
        result = unit.step(view(), join([shifted]), ego=EGO)
    assert result.benefits.tolist() == [pytest.approx(16 * 3 + 8 * 8)]


def test_seeing_nothing_or_elsewhere_has_no_benefit(library: Library) -> None:
    with Perception(library, **ONE_ZONE) as unit:
        signal = join([message(2, index=0), message(3, index=999, center=(20.0, 0.0))])
        result = unit.step(view(), signal, ego=EGO)
    assert len(result.sharers) == 0
    assert not result.trigger


def test_a_sharer_in_the_same_cell_as_the_ego_is_one_like_any_other(library: Library) -> None:
    assert benefit(library, message(2, index=6)) == pytest.approx(600)


def test_a_sharer_at_the_very_pose_of_the_ego_sees_what_it_sees(library: Library) -> None:
    """The same sensor, so to speak: cells lie on cells, whatever the heading."""
    cells = np.arange(16.0).reshape(4, 4)
    size = {"rows": 4, "columns": 4, "cell": 5.0, "threshold": 1e6, "horizon": 1e4}
    for heading in (0.0, 0.8, -2.0):
        with Perception(library, **ONE_ZONE | size) as unit:
            same = message(2, cells=cells, cell=5.0, heading=heading)
            result = unit.step(view(heading=heading), join([same]), ego=EGO)
        assert result.benefits.tolist() == [pytest.approx(25 * cells.sum())]


def test_an_index_above_the_limit_counts_as_the_limit(library: Library) -> None:
    """A sharer next to one cell loses to one that reveals more area, if the limit is low."""
    dense = message(2, cells=np.array([[4000, 0], [0, 0]]), cell=5.0)
    wide = message(3, cells=np.full((2, 2), 50.0), cell=5.0)
    for limit, order, benefits in (
        (0, [2, 3], [4000 * 25, 50 * 100]),
        (4000, [2, 3], [4000 * 25, 50 * 100]),
        (100, [3, 2], [50 * 100, 100 * 25]),
        (1, [3, 2], [1 * 100, 1 * 25]),  # the area that is seen at all
    ):
        with Perception(library, **ONE_ZONE, index_limit=limit) as unit:
            result = unit.step(view(), join([dense, wide]), ego=EGO)
        assert result.sharers.tolist() == order
        assert result.benefits.tolist() == pytest.approx(benefits)


def test_the_benefit_counts_all_of_a_zone_or_only_what_is_searched(library: Library) -> None:
    """A lane of 2 m through the one zone of 10 x 10 m."""
    lane = np.array([(-9.0, 1.0), (9.0, 1.0), (9.0, 3.0), (-9.0, 3.0)])
    whole = message(2, 3)
    half = message(2, 3, center=(5.0, 0.0))
    for region_benefit, found, moved in ((True, 3 * 20, 3 * 10), (False, 3 * 100, 3 * 50)):
        settings = ONE_ZONE | {"region_share": 0.1, "region_benefit": region_benefit}
        for signal, expected in ((whole, found), (half, moved)):
            with Perception(library, **settings) as unit:
                result = unit.step(view(), join([signal]), ego=EGO, road=[lane])
            assert result.benefits.tolist() == [pytest.approx(expected)]


@given(
    turn=st.floats(-3, 3),
    shift=st.tuples(st.floats(-900, 900), st.floats(-900, 900)),
    seed=st.integers(0, 2**32 - 1),
    region_benefit=st.booleans(),
    limit=st.sampled_from([0, 5]),
)
def test_moving_and_turning_the_world_changes_no_benefit_and_no_rank(
    library: Library,
    *,
    turn: float,
    shift: tuple[float, float],
    seed: int,
    region_benefit: bool,
    limit: int,
) -> None:
    """Ego with a patchy view, a road, and four sharers anywhere around."""
    rng = np.random.default_rng(seed)
    holes = rng.uniform(-30, 30, (60, 2))
    road = [rng.uniform(-40, 40, (4, 2)) for _ in range(3)]
    poses = np.column_stack([rng.uniform(-40, 40, (4, 2)), rng.uniform(-3, 3, 4)])
    matrices = [np.floor(rng.uniform(0, 20, (9, 7))) for _ in poses]
    settings = {"rows": 12, "columns": 12, "benefit_threshold": 0.0, "threshold": 1.0,
                "region_benefit": region_benefit, "index_limit": limit}  # fmt: skip

    def ranked(angle: float, origin: tuple[float, float]) -> Outputs:
        matrix = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        scan = Scan(
            vehicle=EGO,
            points=np.column_stack([holes @ matrix.T + origin, np.zeros(len(holes))]),
            heading=0.4 + angle,
            position=(*(matrix @ (3.0, -2.0) + origin), 2.0),
        )
        messages = []
        for k, (x, y, heading) in enumerate(poses):
            center = matrix @ (x, y) + origin
            messages.append(
                message(k + 2, cells=matrices[k], cell=4.0, heading=heading + angle,
                        center=(center[0], center[1]))
            )  # fmt: skip
        with Perception(library, **settings) as unit:
            rings = [ring @ matrix.T + origin for ring in road]
            return unit.step(cloud(scan), join(messages), ego=EGO, road=rings)

    here, there = ranked(0.0, (0.0, 0.0)), ranked(turn, shift)
    # where a point is on the border of a cell to single precision, the matrices differ
    assume(here.messages[0][72:] == there.messages[0][72:])
    assert here.sharers.tolist() == there.sharers.tolist()
    np.testing.assert_allclose(there.benefits, here.benefits, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(there.ranges, here.ranges)


# ---- ranking and hysteresis


@pytest.fixture
def unit(library: Library) -> Iterator[Perception]:
    """The benefit threshold is ten points in the whole zone of 100 m^2."""
    with Perception(library, **ONE_ZONE | {"benefit_threshold": 1000.0}) as created:
        yield created


def rank(unit: Perception, **indices: int) -> Outputs:
    """One step in which the vehicles `v2=...` send one cell with this index."""
    time = round(unit.time * 1e9)
    signal = join([message(int(name[1:]), index, time=time) for name, index in indices.items()])
    return unit.step(view(time), signal, ego=EGO)


def test_the_best_comes_first_and_equal_ones_by_number(unit: Perception) -> None:
    result = rank(unit, v7=30, v5=40, v9=30, v4=9)
    assert result.sharers.tolist() == [5, 7, 9]
    assert result.benefits.tolist() == pytest.approx([4000, 3000, 3000])
    assert result.trigger


def test_a_chosen_sharer_stays_until_half_the_threshold(unit: Perception) -> None:
    assert not rank(unit, v2=9).trigger
    for index in (10, 9, 5):
        assert rank(unit, v2=index).sharers.tolist() == [2]
    assert not rank(unit, v2=4).trigger
    assert not rank(unit, v2=9).trigger  # it has to qualify again


def test_a_sharer_is_held_for_so_long_after_it_last_qualified(library: Library) -> None:
    settings = {**ONE_ZONE, "benefit_threshold": 1000.0, "maximum_age": STEP}
    with Perception(library, **settings, hold=3 * STEP) as unit:
        assert rank(unit, v2=10).sharers.tolist() == [2]
        for index in (4, 0):  # too little, and then nothing to see
            held = rank(unit, v2=index)
            assert (held.trigger, held.sharers.tolist()) == (True, [2])
            assert held.benefits.tolist() == pytest.approx([100.0 * index])
        assert rank(unit, v2=5).sharers.tolist() == [2]  # half the threshold: it qualifies again
        for _ in range(3):  # of the first of these steps its matrix is still fresh
            assert rank(unit).sharers.tolist() == [2]
        assert not rank(unit).trigger
        assert not rank(unit, v2=9).trigger


def test_a_held_sharer_makes_room_for_a_better_one(library: Library) -> None:
    settings = {**ONE_ZONE, "benefit_threshold": 1000.0}
    with Perception(library, **settings, hold=10 * STEP) as unit:
        assert rank(unit, v2=20).sharers.tolist() == [2]
        assert rank(unit, v2=4, v3=10).sharers.tolist() == [3, 2]


def test_a_restored_instance_holds_on_as_long(library: Library) -> None:
    settings = {**ONE_ZONE, "benefit_threshold": 1000.0, "maximum_age": STEP}
    with Perception(library, **settings, hold=3 * STEP) as unit:
        rank(unit, v2=10)
        state, time = unit.save(), unit.time
        first = [rank(unit).sharers.tolist() for _ in range(4)]
        unit.restore(state)
        unit.time = time
        assert [rank(unit).sharers.tolist() for _ in range(4)] == first == [[2], [2], [2], []]


def test_a_chosen_sharer_keeps_its_place_within_the_margin(unit: Perception) -> None:
    assert rank(unit, v2=100, v3=90).sharers.tolist() == [2, 3]
    assert rank(unit, v2=100, v3=110).sharers.tolist() == [2, 3]
    assert rank(unit, v2=100, v3=111).sharers.tolist() == [3, 2]
    assert rank(unit, v2=110, v3=100).sharers.tolist() == [3, 2]


def test_a_newcomer_overtakes_only_by_the_margin(unit: Perception) -> None:
    assert rank(unit, v5=50, v4=20).sharers.tolist() == [5, 4]
    assert rank(unit, v5=50, v4=20, v3=54, v2=21).sharers.tolist() == [5, 3, 4, 2]
    assert rank(unit, v9=500).sharers[0] == 9


def test_more_sharers_than_fit_leave_the_worst_out(library: Library) -> None:
    with Perception(library, **ONE_ZONE, n_sharer=3) as unit:
        result = rank(unit, v2=1, v3=3, v4=5, v5=4)
    assert result.sharers.tolist() == [4, 5, 3]


# ---- what was received, and when


def test_an_apm_that_never_arrived_does_not_matter(unit: Perception) -> None:
    assert rank(unit, v2=50, v3=20).sharers.tolist() == [2, 3]
    with Perception(unit.library, **ONE_ZONE | {"benefit_threshold": 1000.0}) as other:
        assert rank(other, v3=20).sharers.tolist() == [3]


def test_an_apm_is_remembered_for_half_a_second(unit: Perception) -> None:
    assert rank(unit, v2=50).trigger  # made at 0 s, matched at 0.1 s
    ages = []
    while rank(unit).trigger:
        ages.append(unit.time)
    assert ages[-1] == pytest.approx(0.5)
    assert ages[0] >= STEP


def test_the_newest_apm_of_a_source_wins_in_any_order(library: Library) -> None:
    old, new = message(2, 10, time=10), message(2, 30, time=20)
    for signal in ([old, new], [new, old]):
        with Perception(library, **ONE_ZONE) as unit:
            result = unit.step(view(), join(signal), ego=EGO)
            assert result.benefits.tolist() == pytest.approx([3000])
            assert unit.step(view(), join([old]), ego=EGO).benefits.tolist() == pytest.approx(
                [3000]
            )


def test_the_own_apm_is_no_offer(unit: Perception) -> None:
    result = rank(unit, v1=1000, v2=20)
    assert result.sharers.tolist() == [2]


@pytest.mark.parametrize("ego", [-1, 6])
def test_without_an_ego_scan_nothing_is_matched(unit: Perception, ego: int) -> None:
    assert rank(unit, v2=50).trigger
    absent = unit.step(view(), b"", ego=ego)
    assert not absent.trigger
    assert len(absent.sharers) == 0
    assert rank(unit).sharers.tolist() == [2]  # still remembered


def test_a_malformed_message_is_dropped_with_a_warning(library: Library) -> None:
    good = message(2, 5)
    future = message(3, 500, time=10**9)
    with Perception(library, **ONE_ZONE) as unit:
        unit.begin()
        unit.set_inputs(view(), join([good[:-1], b"", future, good, good + b"\0"]), EGO)
        warnings = unit.advance()
        result = unit.outputs()
    assert result.sharers.tolist() == [2]
    assert [text.split(":")[1].strip() for text in warnings] == [
        f"message {k} is dropped" for k in (0, 1, 2, 4)
    ]
    assert "76 bytes, not 75" in warnings[0]
    assert "at least 72 bytes, not 0" in warnings[1]
    assert "vehicle 3 is from the future: 1000000000 ns, now is 100000000 ns" in warnings[2]


def warnings_of(library: Library, *messages: bytes) -> tuple[list[str], Outputs]:
    with Perception(library, **ONE_ZONE) as unit:
        unit.begin()
        unit.set_inputs(view(), join(messages), EGO)
        return unit.advance(), unit.outputs()


def test_a_matrix_far_from_its_own_source_contradicts_itself(library: Library) -> None:
    far = message(2, 5, position=(0.0, 200.1))
    near = message(3, 5, position=(120.0, -160.0))
    (warning,), result = warnings_of(library, far, near)
    assert warning.endswith(
        "the APM of vehicle 2 is centred 200.1 m from its source, must be at most 200 m "
        "(maximum_offset)"
    )
    assert result.sharers.tolist() == [3]


def test_of_two_different_matrices_of_one_scan_the_first_counts(library: Library) -> None:
    one, other = message(2, 5), message(2, 7)
    for first, second, expected in ((one, other, 500), (other, one, 700)):
        (warning,), result = warnings_of(library, first, second, first)
        assert "vehicle 2 has sent two different APMs of 0 ns; the first one counts" in warning
        assert result.benefits.tolist() == pytest.approx([expected])
    moved = message(2, 5, center=(1.0, 0.0))
    (warning,), _ = warnings_of(library, one, moved)
    assert "two different" in warning


def test_copies_of_a_message_are_no_contradiction(library: Library) -> None:
    warnings, result = warnings_of(library, *[message(2, 5)] * 3)
    assert warnings == []
    assert result.benefits.tolist() == pytest.approx([500])


@pytest.mark.parametrize(("place", "name"), [(68, "0 x 1"), (70, "1 x 0")])
def test_a_matrix_without_cells_is_dropped(library: Library, place: int, name: str) -> None:
    good = message(2, 5)
    (warning,), result = warnings_of(library, good[:place] + b"\0\0" + good[place + 2 :])
    assert f"an APM of {name} cells" in warning
    assert not result.trigger


def test_cells_of_absurd_size_have_no_absurd_benefit(library: Library) -> None:
    for cell in (1e-30, 1e30, 3e38):
        assert 0 <= benefit(library, message(2, cell=cell)) <= SIDE**2
    far = message(2, center=(1.7e308, -1.7e308), heading=1e6)
    assert benefit(library, far) == 0


@pytest.mark.parametrize(
    ("received", "wrong"),
    [
        (b"APMS", "received: an `APMS` frame has at least 16 bytes, not 4"),
        (b"OBJS" + bytes(12), "received: not an `APMS` frame of version 1"),
        (join([message(2)])[:-8], "received: the `APMS` frame of 1 messages is cut short"),
        (join([message(2)]) + b"\0", "received: the `APMS` frame has 1 bytes after its messages"),
    ],
)
def test_a_malformed_signal_is_an_error(library: Library, received: bytes, wrong: str) -> None:
    with Perception(library) as unit, pytest.raises(Refused, match=wrong):
        unit.step(view(), received, ego=EGO)
