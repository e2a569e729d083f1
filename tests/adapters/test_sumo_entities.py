"""Entities start where, when and as fast as they are declared, and go where they are sent."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from adapters.sumo.entities import Entity, Position, SpeedPoint, Synchronise
from adapters.sumo.parameters import Background
from adapters.traffic.polyline import Polyline
from orchestrator.distribution import Constant, Normal, Uniform
from orchestrator.randomness import stream
from tests.adapters.sumo_runs import BRAKE, RED_LIGHT, Run, car, on, scene, simulate

ROUNDING = 1e-5
"""SUMO is told places with six decimals, and adds them up [m]."""

EAST = -1.6
"""y of all lanes `east_*` [m]; `west_*` are mirrored."""

LENGTH = 196.0
"""Of the lanes between `w` and `m`, and `s` and `m` [m]: the junction begins before its middle."""

STOPS_BEFORE_LINE = 1.0
"""SUMO's default of `jmStoplineGap` [m]."""


@pytest.mark.parametrize(
    ("position", "front"),
    [
        (on("east_1_0", 50.0), 50.0),
        (on("east_1_0", to_end=20.0), LENGTH - 20.0),
        (on("east_1_0", to_end=0.0), LENGTH),
        (on("east_1_0"), LENGTH - STOPS_BEFORE_LINE),
    ],
    ids=["s", "to_end", "end", "stop line"],
)
def test_a_place_on_a_lane_is_that_of_the_front_bumper(
    tmp_path: Path, position: Position, front: float
) -> None:
    run = simulate(scene(tmp_path), 0.0, {"a": Entity(type="car", position=position)})
    expected = (-200.0 + front - 2.5, EAST, 0.0)
    assert run.of("a", "position")[0] == pytest.approx(expected, abs=ROUNDING)
    assert run.of("a", "heading")[0] == 0.0


def test_coordinates_are_those_of_the_centre_and_nobody_there_moves(tmp_path: Path) -> None:
    """A van on the verge, askew; a car that passes it on the lane does not mind."""
    van = Entity(type="van", position=Position(x=-60.0, y=-6.0, h=0.25))
    entities = {"van": van, "passes": car("east_1_0", 50.0, speed=Constant(14.0))}
    run = simulate(scene(tmp_path), 8.0, entities)
    alone = simulate(scene(tmp_path), 8.0, {"passes": entities["passes"]})
    np.testing.assert_allclose(
        run.of("van", "position"), np.tile((-60.0, -6.0, 0.0), (81, 1)), atol=1e-12
    )
    assert set(run.of("van", "heading")) == {0.25}
    assert not run.of("van", "velocity").any()
    np.testing.assert_array_equal(run.of("passes", "position"), alone.of("passes", "position"))


@pytest.mark.parametrize("count", [1, 2, 5])
@pytest.mark.parametrize("gap", [None, 2.5, 4.25], ids=["minGap", "SUMO's default", "wider"])
def test_a_queue_keeps_its_gap_exactly(tmp_path: Path, count: int, gap: float | None) -> None:
    entities = {"q": car("east_1_0", 100.0, count=count, gap=gap)}
    run = simulate(scene(tmp_path), 0.0, entities)
    names = ["q"] if count == 1 else [f"q.{k}" for k in range(count)]
    assert run.present(0) == names
    fronts = run.array(0, "vehicle.position")[:, 0] + 2.5
    assert fronts == pytest.approx(
        [-100.0 - k * (5.0 + (gap or 2.5)) for k in range(count)], abs=ROUNDING
    )


def test_a_queue_of_nobody_is_nobody(tmp_path: Path) -> None:
    assert simulate(scene(tmp_path), 1.0, {"q": car("east_1_0", 99.0, count=0)}).present(0) == []


def test_who_is_parked_stands_beside_the_lane_for_good_and_blocks_nobody(tmp_path: Path) -> None:
    """SUMO inserts it on the lane, and puts it beside with the next step."""
    moving = car("east_1_0", 20.0, speed=Constant(14.0))
    entities = {"parked": car("east_1_0", 100.0, parked=True), "passes": moving}
    run = simulate(scene(tmp_path), 15.0, entities)
    alone = simulate(scene(tmp_path), 15.0, {"passes": moving})
    beside = (-102.5, EAST - 3.2, 0.0)
    np.testing.assert_allclose(
        run.of("parked", "position")[1:], np.tile(beside, (150, 1)), atol=ROUNDING
    )
    assert not run.of("parked", "velocity").any()
    late = run.of("passes", "position")[-1, 0]
    assert late > 0.0
    assert late == pytest.approx(alone.of("passes", "position")[-1, 0], abs=15.0)


def start(run: Run) -> dict[str, tuple[float, ...]]:
    """Where all but `x` are at the start."""
    return {n: tuple(run.of(n, "position")[0]) for n in run.present(0) if n != "x"}


def test_who_never_takes_part_changes_nothing() -> None:
    background = Background(spacing=30.0)
    ego = Entity(type="sedan", position=on("south_in_1", to_end=100.0), speed=Constant(8.0))
    absent = Entity(type="van", position=on("west_in_0", 100.0), presence=0.0, keeps_clear="edge")
    with_it = simulate(RED_LIGHT, 5.0, {"ego": ego, "x": absent}, background=background)
    without = simulate(RED_LIGHT, 5.0, {"ego": ego}, background=background)
    for one, other in zip(with_it.points, without.points, strict=True):
        for name in one:
            np.testing.assert_array_equal(one[name], other[name], err_msg=name)


def test_the_background_is_the_same_whether_or_not_somebody_beside_the_road_takes_part() -> None:
    """Who takes part is drawn, and changes neither the draws of speeds nor of the background."""
    x = Entity(type="van", position=Position(x=60.0, y=60.0), presence=0.5)
    after = Entity(type="sedan", position=on("west_in_0", 100.0), speed=Uniform(2.0, 8.0))
    seen = set()
    for seed in range(1, 7):
        entities = {"x": x, "after": after}
        run = simulate(RED_LIGHT, 0.0, entities, seed=seed, background=Background())
        certain = {"x": Entity(type="van", position=x.position, presence=0.999), "after": after}
        always = simulate(RED_LIGHT, 0.0, certain, seed=seed, background=Background())
        seen.add("x" in run.number)
        assert "x" in always.number
        assert start(run) == start(always)
        np.testing.assert_array_equal(run.of("after", "velocity"), always.of("after", "velocity"))
    assert seen == {False, True}


@pytest.mark.slow
def test_presence_is_a_probability(tmp_path: Path) -> None:
    """Within three standard deviations of 400 runs; a half has the widest."""
    path, runs, share = scene(tmp_path), 400, 0.3
    entities = {"x": car("east_1_0", 50.0, presence=share)}
    there = sum(len(simulate(path, 0.0, entities, seed=k).number) for k in range(runs))
    assert abs(there - share * runs) < 3.0 * math.sqrt(runs * share * (1.0 - share))


def test_speeds_are_drawn_from_the_components_stream_in_the_order_of_declaration(
    tmp_path: Path,
) -> None:
    """After SUMO's own seed; presence first, for those who have one, whether or not they come."""
    speeds = {"a": Uniform(3.0, 9.0), "b": Normal(6.0, 1.0), "c": Uniform(4.0, 5.0)}
    entities = {
        "a": car("east_1_0", 50.0, speed=speeds["a"]),
        "b": car("west_1_0", 50.0, speed=speeds["b"], presence=0.5),
        "c": car("north_1_0", 50.0, speed=speeds["c"]),
    }
    for seed in range(5):
        run = simulate(scene(tmp_path), 0.0, entities, seed=seed)
        rng = stream(seed, "traffic")
        rng.integers(2**31)
        drawn = {}
        for name, speed in speeds.items():
            takes_part = name != "b" or rng.random() < 0.5
            value = speed.draw(rng)
            if takes_part:
                drawn[name] = value
        assert run.number.keys() == drawn.keys()
        for name, value in drawn.items():
            speed_then = math.hypot(*run.of(name, "velocity")[0])
            assert speed_then == pytest.approx(value, abs=1e-6)


def test_who_enters_later_is_there_from_that_communication_point_on(tmp_path: Path) -> None:
    """At its place and speed, with the next number; an ego's `id` is -1 before."""
    entities = {
        "ego": car("east_1_0", 60.0, speed=Constant(5.0), enters=2.0, controller="policy"),
        "late": car("north_1_0", 60.0, speed=Constant(5.0), enters=2.0),
        "first": car("west_1_0", 60.0, speed=Constant(5.0)),
    }
    run = simulate(scene(tmp_path), 3.0, entities)
    assert run.number == {"first": 0, "ego": 1, "late": 2}
    assert run.series("ego.id").tolist() == [-1] * 20 + [1] * 11
    assert run.array(19, "ego.route").size == 0
    for name, front in (("ego", (-142.5, EAST)), ("late", (1.6, -142.5))):
        position = run.of(name, "position")
        assert np.isnan(position[:20]).all()
        assert position[20, :2] == pytest.approx(front, abs=ROUNDING)
        assert math.hypot(*run.of(name, "velocity")[20]) == pytest.approx(5.0)
    assert run.of("ego", "position")[21, 0] == pytest.approx(-142.0)
    _, ego, late = run.array(20, "vehicle.position")
    assert 0.0 < run.array(20, "ego.gap") < math.dist(ego, late)


def test_who_finds_no_room_enters_as_soon_as_there_is_some(tmp_path: Path) -> None:
    entities = {
        "stands": car("east_1_0", 60.0, controller="policy"),
        "late": car("east_1_0", 60.0, enters=1.0),
    }
    go = simulate(
        scene(tmp_path), 8.0, entities, policy=lambda t: {"stands": (float(t > 2.0), 0.0, 0.0)}
    )
    stays = simulate(scene(tmp_path), 8.0, entities, policy=lambda _: {"stands": BRAKE})
    assert "late" in go.number
    assert "late" not in stays.number
    first = int(np.flatnonzero(~np.isnan(go.of("late", "heading")))[0])
    assert first > 20
    assert go.of("stands", "position")[first, 0] - go.of("late", "position")[first, 0] > 5.0


def test_an_ego_leaves_at_the_end_of_its_route_and_is_nobody_from_then_on(tmp_path: Path) -> None:
    """Its front passes the end of the lane after 4 s at 10 m/s; its state stays the last one."""
    place = on("branch_0", to_end=40.0)
    ego = Entity(type="car", position=place, speed=Constant(10.0), controller="policy")
    run = simulate(scene(tmp_path), 6.0, {"ego": ego})
    left = int(np.flatnonzero(run.series("ego.id") == -1)[0])
    assert left in {40, 41}  # the last step may end a rounding error short of the end
    assert run.series("ego.completion_time")[-1] == pytest.approx(4.0, abs=0.1)
    assert run.present(left) == []
    assert len({tuple(point) for point in run.series("ego.position")[left:]}) == 1
    assert run.array(left, "ego.route").shape == (0, 2)
    assert run.series("encounter.over")[left]


@pytest.mark.parametrize(
    ("way", "through", "last"),
    [
        ({}, [(0.0, EAST), (200.0, EAST)], (400.0, EAST)),
        ({"route": ("north_2",)}, [], (1.6, 200.0)),
        ({"route": ("east_2", "branch")}, [(0.0, EAST)], (201.6, 150.0)),
        ({"route": ("east_2",)}, [(0.0, EAST)], (192.8, EAST)),
        ({"to": "branch"}, [(0.0, EAST)], (201.6, 150.0)),
        ({"to": "east_1"}, [], (-4.0, EAST)),
    ],
    ids=["straight on", "left", "two edges", "ends half-way", "to", "to its own edge"],
)
def test_an_entity_goes_the_way_that_is_declared(
    tmp_path: Path, way: dict[str, object], through: list[tuple[float, float]], last: object
) -> None:
    """Straight on over all junctions by default; the ego sees its route as far as it goes."""
    entities = {"a": car("east_1_0", 100.0, speed=Constant(10.0), controller="policy", **way)}
    route = np.asarray(simulate(scene(tmp_path), 0.0, entities).points[0]["a.route"])
    assert route[0] == pytest.approx((-102.5, EAST))
    assert route[-1] == pytest.approx(last, abs=4.0)
    line = Polyline(route)
    for place in through:
        assert aside(line, place) < 1e-6
    driven = {"a": car("east_1_0", 100.0, speed=Constant(10.0), **way)}
    run = simulate(scene(tmp_path), 60.0, driven)
    seen = run.of("a", "position")[:, :2]
    seen = seen[~np.isnan(seen[:, 0])]
    assert len(seen) < len(run.points)
    assert seen[-1] == pytest.approx(route[-1], abs=6.0)
    assert max(aside(line, (x, y)) for x, y in seen.tolist()) < 1.0


def aside(line: Polyline, place: tuple[float, float]) -> float:
    """From a point to a polyline [m]."""
    return math.dist(line.at(line.station(*place)), place)


@pytest.mark.parametrize("kept", ["behind", "lane", "edge"])
@pytest.mark.parametrize("seed", range(3))
def test_what_an_entity_keeps_clear(kept: str, seed: int) -> None:
    """Before it on its lane, its lane, or its edge; without it, all of them are in use."""
    entity = Entity(type="compact", position=on("west_in_0", 100.0), keeps_clear=kept)  # type: ignore[arg-type]
    background = Background(spacing=15.0)
    run = simulate(RED_LIGHT, 0.0, {"x": entity}, seed=seed, background=background)
    x = run.of("x", "position")[0]
    all_of = np.array([run.of(n, "position")[0] for n in run.present(0) if n != "x"])
    own = all_of[(np.abs(all_of[:, 1] - x[1]) < 1.0) & (all_of[:, 0] < -14.0)]
    beside = all_of[(all_of[:, 1] < 0.0) & (all_of[:, 1] > -8.0) & (all_of[:, 0] < -14.0)]
    assert (own[:, 0] < x[0] - 10.0).all()
    assert bool(len(own)) == (kept == "behind")
    assert bool(len(beside)) == (kept != "edge")


def driven_by(
    mover: str, lane: str, to_end: float, speed: float = 8.0, **more: Any
) -> dict[str, Entity]:
    """`x`, close to the end of a lane and fast, and whom it may need."""
    actions: dict[str, dict[str, Any]] = {
        "policy": {"controller": "policy"},
        "profile": {"speed_profile": (SpeedPoint(time=2.0, speed=speed),)},
        "synchronise": {"synchronise": Synchronise(entity="other", x=0.0, y=0.0)},
        "sumo": {},
    }
    x = Entity(
        type="car",
        position=on(lane, to_end=to_end),
        speed=Constant(speed),
        **actions[mover],
        **more,
    )
    other = Entity(type="car", position=on("em_2", 20.0), speed=Constant(speed))
    return {"other": other, "x": x} if mover == "synchronise" else {"x": x}


@pytest.mark.parametrize("to_end", [5.0, 0.0])
@pytest.mark.parametrize("enters", [0.0, 1.0])
@pytest.mark.parametrize("lane", ["wm_2", "sm_1"])
@pytest.mark.parametrize("mover", ["policy", "profile", "synchronise"])
def test_no_light_ahead_holds_back_who_ignores_lights(
    tmp_path: Path, mover: str, lane: str, enters: float, to_end: float
) -> None:
    """Of the two lanes one has red; it enters in time, at its speed, and drives across."""
    entities = driven_by(mover, lane, to_end, enters=enters)
    run = simulate(scene(tmp_path, "town"), 4.0, entities)
    there = np.flatnonzero(~np.isnan(run.of("x", "heading")))
    assert there[0] == round(10 * enters)
    assert math.hypot(*run.of("x", "velocity")[there[0]]) == pytest.approx(8.0, abs=1e-6)
    way = np.diff(run.of("x", "position")[there][:, :2], axis=0)
    assert np.hypot(*way.T).sum() > 15.0


@pytest.mark.parametrize("mover", ["policy", "profile"])
def test_nobody_who_has_priority_holds_back_who_ignores_it(tmp_path: Path, mover: str) -> None:
    run = simulate(scene(tmp_path), 2.0, driven_by(mover, "north_1_0", 3.0))
    assert run.of("x", "position")[-1, 1] > run.of("x", "position")[0, 1] + 15.0


def test_whom_sumo_holds_back_to_the_end_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It could not stop any more where it gives way; the time of another one does not come."""
    entities = {
        **driven_by("sumo", "north_1_0", 3.0, enters=1.0),
        "late": car("east_1_0", 50.0, enters=9.0),
    }
    run = simulate(scene(tmp_path), 3.0, entities)
    assert run.number == {}
    warnings = [each.getMessage() for each in caplog.records if each.levelname == "WARNING"]
    assert [text for text in warnings if "has not" in text] == [
        (
            "`entities.x`: `x` was to enter 1 s after the start and has not by the end: there was "
            "no room, or SUMO did not let it enter at its `speed` with what was ahead"
        ),
        (
            "`entities.late`: `late` was to enter 9 s after the start and has not by the end: that "
            "was later"
        ),
    ]


@pytest.mark.parametrize("mover", ["policy", "profile", "synchronise", "sumo"])
@pytest.mark.parametrize("enters", [0.0, 1.0])
def test_a_speed_above_the_limit_is_the_one_that_it_starts_with(
    tmp_path: Path, mover: str, enters: float
) -> None:
    """The limit is 13.9 m/s. Who has no reason to brake keeps it, others brake as they can."""
    entities = driven_by(mover, "wm_2", 120.0, speed=20.0, enters=enters)
    run = simulate(scene(tmp_path, "town"), 2.0, entities)
    first = int(np.flatnonzero(~np.isnan(run.of("x", "heading")))[0])
    assert first == round(10 * enters)
    velocity = run.of("x", "velocity")
    np.testing.assert_allclose(velocity[first], (20.0, 0.0), atol=1e-6)
    speed = velocity[first:, 0]
    if mover in {"policy", "profile"}:
        np.testing.assert_allclose(speed, 20.0, atol=1e-6)
    else:
        assert -5.0 < (speed[1] - speed[0]) / 0.1 < 0.0
        assert speed[-1] < 18.0
