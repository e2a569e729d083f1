"""How near bodies come to each other, in time."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.physics.boxes import corners
from orchestrator.measure import Answer
from studies.measures.boxes import time_to_contact
from studies.measures.pet import PostEncroachment
from studies.measures.ttc import TimeToCollision
from studies.red_light.polygons import polygon_distance
from tests.studies.measures.world import Body, record

EAST, NORTH = 0.0, math.pi / 2


def least(answer: Answer) -> dict[int, float]:
    table = answer.tables["vehicles"]
    return dict(zip(table["vehicle"].tolist(), table["ttc_s"].tolist(), strict=True))


def test_a_gap_that_closes_takes_its_length_over_the_speed(tmp_path: Path) -> None:
    """Two bodies 4 m long, 84 m apart and head-on at 25 m/s; and one that follows nobody."""
    bodies = [
        Body(id=1, start=(0, 0), velocity=(15.0, 0.0)),
        Body(id=2, start=(84, 0), velocity=(-10.0, 0.0)),
        Body(id=3, start=(0, 40), velocity=(15.0, 0.0)),
    ]
    run = record(tmp_path, bodies, 0.05)
    found = TimeToCollision(threshold=3.2).compute(run)
    first = 80.0 / 25.0
    assert found.numbers["ttc_min_s"] == pytest.approx(first - 0.05)
    assert least(found)[1] == least(found)[2] == found.numbers["ttc_min_s"]
    assert np.isnan(least(found)[3])
    assert (found.numbers["vehicles_below"], found.numbers["pairs_below"]) == (2, 1)
    table = found.tables["vehicles"]
    assert table["other"].tolist() == [2, 1, -1]
    assert table["time_s"][:2].tolist() == [0.05, 0.05]


def test_time_exposed_is_that_of_each_vehicle(tmp_path: Path) -> None:
    """From 1.5 s before contact at 2 s, until the bodies touch at 2 s: twice 1.45 s of steps."""
    bodies = [
        Body(id=1, start=(0, 0), velocity=(10.0, 0.0)),
        Body(id=2, start=(44, 0), velocity=(-10.0, 0.0)),
    ]
    found = TimeToCollision().compute(record(tmp_path, bodies, 1.95)).numbers
    assert found["exposed_s"] == pytest.approx(2 * 1.45, abs=0.101)
    assert found["contacts"] == 0
    found = TimeToCollision().compute(record(tmp_path / "on", bodies, 2.1)).numbers
    assert (found["contacts"], found["ttc_min_s"]) == (2, 0.0)


def test_who_passes_beside_or_above_another_does_not_collide(tmp_path: Path) -> None:
    bodies = [
        Body(id=1, start=(0, 0), velocity=(15.0, 0.0)),
        Body(id=2, start=(60, 3.5), velocity=(-15.0, 0.0)),
        Body(id=3, start=(60, 0), velocity=(-15.0, 0.0), ground=6.0),
    ]
    found = TimeToCollision().compute(record(tmp_path, bodies, 1.0)).numbers
    assert found["ttc_min_s"] is None
    assert found["vehicles_below"] == found["contacts"] == 0


def vectors(limit: float) -> st.SearchStrategy[tuple[float, float]]:
    component = st.floats(-limit, limit).map(lambda x: round(x, 3))
    return st.tuples(component, component)


EXTENT = st.tuples(st.floats(0.5, 12), st.floats(0.5, 3))


@given(vectors(30), vectors(15), vectors(3.2), st.tuples(EXTENT, EXTENT))
def test_boxes_touch_when_they_touch(
    place: tuple[float, float],
    way: tuple[float, float],
    turned: tuple[float, float],
    extents: tuple[tuple[float, float], tuple[float, float]],
) -> None:
    """Apart until then, at a distance of 0 then; the same seen from the other one."""
    offset, velocity = np.array([place]), np.array([way])
    headings = np.array(turned[:1]), np.array(turned[1:])
    sizes = np.array(extents[:1]), np.array(extents[1:])
    (time,) = time_to_contact(offset, velocity, headings, sizes)
    (back,) = time_to_contact(-offset, -velocity, headings[::-1], sizes[::-1])
    assert back == pytest.approx(time, abs=1e-9)

    def gap(t: float, shrunk: float = 0.0) -> float:
        first = corners(np.zeros(2), headings[0][0], sizes[0][0] - shrunk)
        second = corners(offset[0] + velocity[0] * t, headings[1][0], sizes[1][0] - shrunk)
        return polygon_distance(first, second)

    if time > 0:
        before = np.linspace(0, min(time, 10.0), 50, endpoint=False)
        assert all(gap(t, shrunk=1e-6) > 0 for t in before)  # they may slide along each other
    if np.isfinite(time):
        assert gap(time) == pytest.approx(0.0, abs=1e-6)


def crossing(delay: float, size: tuple[float, float, float] = (4.0, 2.0, 1.5)) -> list[Body]:
    """One goes east at 10 m/s and is at the origin at 5 s; the other north, `delay` later."""
    return [
        Body(id=1, start=(-50.0, 0.0), velocity=(10.0, 0.0), size=size),
        Body(id=2, start=(0.0, -8.0 * (5.0 + delay)), velocity=(0.0, 8.0), size=size),
    ]


@pytest.mark.parametrize("delay", [1.0, 1.4, 3.0])
@pytest.mark.parametrize("spacing", [0.1, 0.5])
def test_the_time_between_crossing_bodies_is_that_at_the_corner_of_their_paths(
    tmp_path: Path, delay: float, spacing: float
) -> None:
    """The first leaves x = 1 m with its rear; the second reaches y = -1 m with its front."""
    leaves, arrives = 5.0 + (1.0 + 2.0) / 10.0, 5.0 + delay - (1.0 + 2.0) / 8.0
    run = record(tmp_path, crossing(delay), 12.0)
    found = PostEncroachment(spacing=spacing).compute(run)
    exact = arrives - leaves
    longest = exact + spacing / 10.0 + spacing / 8.0
    assert exact - 1e-9 <= found.numbers["pet_min_s"] <= longest + 1e-9  # type: ignore[operator]
    table = found.tables["pairs"]
    assert (table["first"].tolist(), table["second"].tolist()) == ([1], [2])
    assert (table["x_m"][0], table["y_m"][0]) == pytest.approx((1.0, -1.0), abs=spacing)
    assert found.numbers["too_fast"] == 0


def test_a_third_one_counts_after_the_second_not_after_the_first(tmp_path: Path) -> None:
    third = Body(id=3, start=(-50.0 - 30.0, 0.0), velocity=(10.0, 0.0))  # 3 s behind the first
    run = record(tmp_path, [*crossing(1.4), third], 12.0)
    table = PostEncroachment(horizon=10.0).compute(run).tables["pairs"]
    pairs = set(zip(table["first"].tolist(), table["second"].tolist(), strict=True))
    assert pairs == {(1, 2), (2, 3)}  # who follows on the same way encroaches on nobody


def test_bodies_that_are_there_at_once_have_no_time_between_them(tmp_path: Path) -> None:
    found = PostEncroachment().compute(record(tmp_path, crossing(0.2), 8.0)).numbers
    assert found["pet_min_s"] == 0.0
    assert found["pairs_below"] == 1


def test_a_body_that_stands_occupies_its_place_until_it_has_left(tmp_path: Path) -> None:
    """The first stands on the way of the other until it is taken away at 4 s."""
    bodies = [
        Body(id=1, start=(0.0, 0.0), heading=EAST, until=4.02),
        Body(id=2, start=(0.0, -60.0), velocity=(0.0, 10.0)),
    ]
    (pet,) = (
        PostEncroachment(spacing=0.1)
        .compute(record(tmp_path, bodies, 9.0))
        .tables["pairs"]["pet_s"]
    )
    assert pet == pytest.approx((60.0 - 1.0 - 2.0) / 10.0 - 4.0, abs=0.011)


def test_steps_too_long_for_a_body_are_said(tmp_path: Path) -> None:
    short = (0.3, 0.3, 1.0)  # 0.5 m in each step
    found = PostEncroachment().compute(record(tmp_path, crossing(1.0, short), 1.0)).numbers
    assert found["too_fast"] == 2 * 20


def test_a_bridge_is_another_place(tmp_path: Path) -> None:
    first, second = crossing(1.0)
    above = Body(id=2, start=second.start, velocity=second.velocity, ground=6.0)
    assert PostEncroachment().compute(record(tmp_path, [first, above], 8.0)).numbers["pairs"] == 0


def test_an_empty_road_has_no_conflicts(tmp_path: Path) -> None:
    late = [Body(id=1, start=(0.0, 0.0), since=3.0)]
    run = record(tmp_path, late, 0.5)
    assert TimeToCollision().compute(run).numbers["vehicles"] == 0
    assert PostEncroachment().compute(run).numbers["pet_min_s"] is None
