"""Who is hidden from whom, who is known all the same, and how soon."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import LINKS
from orchestrator.recording.reader import Recording
from orchestrator.signal import Array
from studies.measures.cells import Cells
from studies.measures.first_knowledge import FirstKnowledge
from studies.measures.hidden import HiddenRoadUsers
from studies.measures.sight import NLOSB, Bodies, Walls
from studies.measures.vehicles import vehicles_in
from studies.red_light.polygons import polygon_distance
from tests.studies.measures.world import Body, packet, reception, record, seen

HOUSE = [(10.0, -5.0), (20.0, -5.0), (20.0, 5.0), (10.0, 5.0)]
TRUCK = (8.0, 2.5, 3.5)
NAMES: dict[str, Any] = {
    "building": "map.building",
    "received": "listener.received.objects",
    "ego": "listener.ego.id",
}
"""Where the hand-made recordings have what shipped scenarios have elsewhere."""


def pair(**other: Any) -> list[Body]:
    """An observer, and a road user without a radio 30 m east of it, behind the house."""
    return [Body(id=1, start=(0, 0)), Body(id=2, start=(30, 0), **({"equipped": False} | other))]


def between(run: Recording) -> dict[tuple[int, int], str]:
    """The class of the link of every pair of bodies in the first scene."""
    vehicles = vehicles_in(run, "traffic.vehicle")
    bodies = Bodies.of(run, vehicles, "traffic.vehicle")
    present = slice(0, int(vehicles.first[1]))
    a, b = np.triu_indices(present.stop, k=1)
    links = bodies.links(Walls.of(run, "map.building"), present, a, b)
    ids = vehicles.ids
    return {
        (int(ids[i]), int(ids[j])): LINKS[k] for i, j, k in zip(a, b, links.tolist(), strict=True)
    }


@pytest.mark.parametrize(
    ("middle", "link"),
    [
        (None, "LOS"),
        (Body(id=3, start=(15, 0), size=TRUCK), "NLOSv"),
        (Body(id=3, start=(15, 0)), "LOS"),  # a car among cars: they see each other's roofs
        (Body(id=3, start=(15, 2.3), size=TRUCK), "LOS"),  # beside the line
        (Body(id=3, start=(15, 2.3), size=TRUCK, heading=1.5), "NLOSv"),  # across it
        (Body(id=3, start=(15, 0), size=TRUCK, ground=6.0), "LOS"),  # on a bridge above
        (Body(id=3, start=(40, 0), size=TRUCK), "LOS"),  # behind
    ],
)
def test_a_body_hides_what_is_behind_it_and_lower(
    middle: Body | None, link: str, tmp_path: Path
) -> None:
    run = record(tmp_path, [*pair(), *([middle] if middle else [])], 0.1, buildings=[])
    assert between(run)[1, 2] == link


def test_a_wall_hides_and_a_house_beside_the_line_does_not(tmp_path: Path) -> None:
    beside = [(x, y + 20.0) for x, y in HOUSE]
    assert between(record(tmp_path / "a", pair(), 0.1, buildings=[HOUSE]))[1, 2] == "NLOSb"
    assert between(record(tmp_path / "b", pair(), 0.1, buildings=[beside]))[1, 2] == "LOS"
    high = [Body(id=1, start=(0, 0), ground=10.0), Body(id=2, start=(30, 0), ground=10.0)]
    assert between(record(tmp_path / "c", high, 0.1, buildings=[HOUSE]))[1, 2] == "LOS"


@pytest.mark.slow
def test_walls_are_found_as_by_a_search_among_all(tmp_path: Path) -> None:
    """500 lines among 60 random houses: hidden exactly if the line touches one of them."""
    rng = np.random.default_rng(3)
    corner, extent = rng.uniform(-200, 200, (60, 2)), rng.uniform(3, 40, (60, 2))
    steps = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    rings = corner[:, None] + extent[:, None] * steps
    walls = Walls.between(rings.reshape(-1, 2), np.repeat(np.arange(60), 4), np.full(60, 10.0))
    a, b = rng.uniform(-220, 220, (2, 500, 2))
    outside = [not ((ring.min(0) < p) & (p < ring.max(0))).all() for p in a for ring in rings]
    is_outside = np.array(outside).reshape(500, 60).all(axis=1)
    lines = np.stack([a, b, b + 1e-9, a + 1e-9], axis=1)  # as thin boxes
    touched = [any(polygon_distance(line, ring) == 0.0 for ring in rings) for line in lines]
    low = np.ones((500, 1))
    hidden = walls.hide(np.hstack([a, low]), np.hstack([b, low]))
    assert 100 < hidden[is_outside].sum() < 400
    np.testing.assert_array_equal(hidden[is_outside], np.array(touched)[is_outside])


def test_cells_miss_no_box_along_a_segment() -> None:
    rng = np.random.default_rng(8)
    low = rng.uniform(-100, 100, (200, 2))
    high = low + rng.uniform(0, 30, (200, 2))
    start, end = rng.uniform(-120, 120, (2, 300, 2))
    segment, box = Cells(low, high, 20.0).along(start, end)
    found = set(zip(segment.tolist(), box.tolist(), strict=True))
    assert len(found) == len(segment)
    for share in np.linspace(0, 1, 101):
        point = start + share * (end - start)
        inside = ((low <= point[:, None]) & (point[:, None] <= high)).all(axis=2)
        assert set(zip(*(each.tolist() for each in np.nonzero(inside)), strict=True)) <= found


def found(run: Recording, **parameters: Any) -> Any:
    """The answer, looked at every communication point."""
    return HiddenRoadUsers(interval=0.05, edges=(0.0, 100.0), **NAMES | parameters).compute(run)


def test_a_hidden_road_user_is_known_for_as_long_as_a_message_of_it_is_remembered(
    tmp_path: Path,
) -> None:
    """Looked at 41 times in 2 s. One message at 0.5 s, remembered for 1 s: known at 20 of them."""
    run = record(
        tmp_path,
        pair(equipped=True),
        2.0,
        packets=[packet(1, 2, 0.499)],
        receptions=[reception(1, (2, 1), 0.5)],
        buildings=[HOUSE],
    )
    numbers = found(run).numbers
    assert (numbers["hidden"], numbers["hidden_NLOSb"], numbers["hidden_NLOSv"]) == (82, 82, 0)
    assert numbers["known"] == numbers["known_by_messages"] == pytest.approx(20 / 82)
    assert numbers["known_NLOSb"] == pytest.approx(20 / 82)
    assert numbers["known_NLOSv"] is None
    assert numbers["sources"] == "messages"
    assert numbers["not_recorded"] == (
        "perception.objects, listener.received.objects, listener.ego.id"
    )
    assert (numbers["meetings"], numbers["first_known"], numbers["first_run_over"]) == (2, 1, 1)
    assert numbers["first_mean_ms"] == pytest.approx(500.0)


def test_each_source_is_told_apart(tmp_path: Path) -> None:
    """Road user 2 is known by sensing, 3 by what others sent; of 4 nobody knows. All are hidden."""
    bodies = [
        *pair(),
        Body(id=3, start=(30, 3), equipped=False),
        Body(id=4, start=(30, -3), equipped=False),
    ]
    scans = [0.05 * k for k in range(21)]
    run = record(
        tmp_path,
        bodies,
        1.0,
        buildings=[HOUSE],
        objects=[seen(1, (30.0, 0.2), time) for time in scans],
        shared=(1, [seen(9, (30.0, 3.2), time) for time in scans]),
    )
    answer = found(run, memory=0.06)
    numbers = answer.numbers
    assert numbers["hidden"] == 3 * 21
    assert numbers["known_by_sensing"] == pytest.approx(1 / 3)
    assert numbers["known_by_others"] == pytest.approx(1 / 3)
    assert numbers["known"] == pytest.approx(2 / 3)
    assert (numbers["sources"], numbers["not_recorded"]) == (
        "sensing, messages, others",
        None,
    )
    ends = dict(
        zip(answer.tables["first"]["road_user"], answer.tables["first"]["end"], strict=True)
    )
    assert ends == {2: "known before", 3: "known before", 4: "run over"}


def test_an_object_that_lies_in_no_body_is_knowledge_of_nobody(tmp_path: Path) -> None:
    """The body is 4 m by 2 m at 30 m; up to half a metre beside it an object is still it."""
    scans = [0.05 * k for k in range(5)]
    for place, share in (((30.0, 1.4), 1.0), ((30.0, 1.6), 0.0)):
        folder = tmp_path / str(place[1])
        run = record(
            folder, pair(), 0.2, buildings=[HOUSE], objects=[seen(1, place, t) for t in scans]
        )
        assert found(run).numbers["known"] == share


@pytest.mark.parametrize(
    ("other", "at", "end", "time"),
    [
        ({}, 0.75, "known", 0.75),
        ({}, None, "run over", 2.0),
        ({"until": 1.0}, None, "left", 1.0),
        ({"until": 1.0}, 1.5, "left", 1.0),
        ({"velocity": (0.0, 24.0)}, None, "in sight", 0.65),  # 15 m north of its place
        ({"velocity": (0.0, 24.0)}, 0.25, "known", 0.25),
        ({"since": 1.0}, 1.3, "known", 0.3),
        ({}, 0.0, "known before", 0.0),
    ],
)
def test_the_wait_for_the_first_knowledge_ends(
    other: dict[str, Any], at: float | None, end: str, time: float, tmp_path: Path
) -> None:
    heard = [] if at is None else [(packet(1, 2, max(0.0, at - 0.001)), reception(1, (2, 1), at))]
    run = record(
        tmp_path,
        pair(equipped=True, heading=0.0, **other),
        2.0,
        packets=[sent for sent, _ in heard],
        receptions=[told for _, told in heard],
        buildings=[HOUSE],
    )
    table = found(run).tables["first"]
    (row,) = np.flatnonzero(table["observer"] == 1)
    assert table["end"][row] == end
    is_known = end.startswith("known")
    assert table["first_s" if is_known else "censored_s"][row] == pytest.approx(time, abs=1e-9)
    assert np.isnan(table["censored_s" if is_known else "first_s"][row])


def test_who_never_waited_has_no_time_and_nobody_hidden_has_no_share(tmp_path: Path) -> None:
    numbers = found(record(tmp_path, pair(), 0.5, buildings=[])).numbers
    assert (numbers["hidden"], numbers["known"], numbers["meetings"]) == (0, None, 0)
    assert numbers["first_mean_ms"] is None
    assert numbers["first_km_median_ms"] is None
    assert (numbers["road_users"], numbers["ear"]) == (11, 0.0)


def test_one_who_observes_is_named_by_the_signal_of_its_number(tmp_path: Path) -> None:
    """Both have radios; asked of vehicle 2 alone there are half as many."""
    run = record(tmp_path, pair(equipped=True), 1.0, buildings=[HOUSE], shared=(2, []))
    assert found(run).numbers["hidden"] == 42
    answer = found(run, observers="listener.ego.id")
    assert answer.numbers["hidden"] == 21
    assert answer.tables["first"]["observer"].tolist() == [2]


def test_a_mast_neither_observes_nor_is_looked_for(tmp_path: Path) -> None:
    mast = Body(id=3, start=(30, 3), size=(0.0, 0.0, 0.0))
    assert found(record(tmp_path, [*pair(), mast], 1.0, buildings=[HOUSE])).numbers["hidden"] == 21


def test_the_median_of_censored_times_is_that_of_kaplan_and_meier() -> None:
    """Times 1, 2 (censored), 3, 4 s: known by 1 s 1/4, by 3 s 1 - 3/4 1/2 = 5/8, by 4 s all."""
    ends = np.array([1, 3, 1, 1])
    many = FirstKnowledge(
        observer=np.zeros(4, np.int64),
        road_user=np.arange(4),
        link=np.full(4, NLOSB),
        since=np.zeros(4, np.int64),
        duration=np.array([1, 2, 3, 4]) * 1_000_000_000,
        end=ends,
    )
    place, share = many.curve()
    np.testing.assert_allclose(place, [1, 2, 3, 4])
    np.testing.assert_allclose(share, [1 / 4, 1 / 4, 5 / 8, 1])
    numbers = many.numbers()
    assert numbers["first_km_median_ms"] == 3000.0
    assert numbers["first_mean_ms"] == pytest.approx(8000 / 3)
    assert (numbers["first_known"], numbers["first_left"]) == (3, 1)


def _row(table: Any, link: str) -> Array:
    (row,) = np.flatnonzero(table["link"] == link)
    return np.array([table["road_users"][row], table["known"][row]])


def test_the_table_adds_up(tmp_path: Path) -> None:
    """Hidden are those behind walls and those behind bodies; nobody is in two groups."""
    bodies = [
        *pair(equipped=True),
        Body(id=3, start=(0, 15), size=TRUCK),
        Body(id=4, start=(0, 30), equipped=False),
    ]
    heard = [reception(1, (2, 1), 0.1), reception(1, (2, 3), 0.1)]
    run = record(
        tmp_path, bodies, 1.0, packets=[packet(1, 2, 0.09)], receptions=heard, buildings=[HOUSE]
    )
    table = found(run).tables["distance"]
    total = _row(table, "NLOSv") + _row(table, "NLOSb")
    np.testing.assert_array_equal(_row(table, "hidden"), total)
    assert (total + _row(table, "LOS"))[0] == found(run).numbers["road_users"]
    assert _row(table, "NLOSv")[0] >= 21
