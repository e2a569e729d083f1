"""Every declaration that cannot be meant so is refused: by name, with what to write instead."""

from collections.abc import Mapping
from pathlib import Path

import pytest

from adapters.sumo.entities import (
    Entity,
    Finish,
    Position,
    SpeedPoint,
    Synchronise,
    Trigger,
    Vertex,
)
from adapters.sumo.errors import SumoError
from orchestrator.distribution import Constant, Uniform
from orchestrator.errors import ComponentTypeError
from tests.adapters.sumo_runs import car, on, scene, simulate

LANES = "branch_0, east_1_0, east_2_0, east_3_0, north_1_0, north_2_0, west_1_0, west_2_0, west_3_0"
EDGES = LANES.replace("_0,", ",").removesuffix("_0")
TEN = Constant(10.0)
VERTEX = Vertex(time=1.0, x=5.0, y=0.0)
PROFILE = (SpeedPoint(time=1.0, speed=5.0),)


def at(x: float | None, y: float | None, **more: object) -> Entity:
    """A car anywhere."""
    return Entity(type="car", position=Position(x=x, y=y), **more)  # type: ignore[arg-type]


def unit(**more: object) -> Entity:
    """A roadside unit."""
    at = Position(x=1.0, y=1.0)
    return Entity(type="roadside_unit", position=at, **more)  # type: ignore[arg-type]


def meets(entity: str, **more: float) -> Synchronise:
    return Synchronise(entity=entity, **more)


MISDECLARED: Mapping[str, tuple[Mapping[str, Entity], str]] = {
    "reserved": (
        {"vehicle": car("east_1_0", 50.0, controller="policy")},
        "`entities.vehicle`: is the name of other connectors; call the entity otherwise",
    ),
    "a partner who is never there": (
        {
            "a": car("east_1_0", 50.0, speed=TEN, presence=0.0),
            "b": car("north_1_0", 50.0, synchronise=meets("a")),
        },
        "`entities.b.synchronise.entity`: `a` never takes part: its `presence` is 0",
    ),
    "x without y": (
        {"a": at(1.0, None)},
        "`entities.a.position`: has only one of `x` and `y`; write both",
    ),
    "y without x": (
        {"a": at(None, 1.0)},
        "`entities.a.position`: has only one of `x` and `y`; write both",
    ),
    "lane and x": (
        {"a": Entity(type="car", position=Position(lane="east_1_0", x=1.0, y=1.0))},
        "`entities.a.position`: has both `lane` and `x`, `y`; leave one out",
    ),
    "s and x": (
        {"a": Entity(type="car", position=Position(s=1.0, x=1.0, y=1.0))},
        "`entities.a.position`: has `x` and `y`; leave out `s` and `to_end`, places on a lane",
    ),
    "not a number": (
        {"a": at(float("nan"), 1.0)},
        "`entities.a.position`: `x` and `y` must be finite and within +-1e+06 m",
    ),
    "speed anywhere": (
        {"a": at(1.0, 1.0, speed=Uniform(0.0, 5.0))},
        (
            "`entities.a.speed`: is of those on a lane; from `x`, `y` on, `trajectory` says "
            "how it moves"
        ),
    ),
    "route anywhere": (
        {"a": at(1.0, 1.0, to="east_2")},
        "`entities.a.to`: is of those on a lane; at `x`, `y`, write a `trajectory`",
    ),
    "speeds of synchronise": (
        {
            "a": car("east_1_0", 50.0, speed=TEN),
            "b": car("north_1_0", 50.0, synchronise=meets("a", min_speed=9.0, max_speed=8.0)),
        },
        "`entities.b.synchronise.min_speed`: is above `max_speed`, 8 m/s; lower it",
    ),
    "synchronise with an unknown one": (
        {"b": car("north_1_0", 50.0, synchronise=meets("a"))},
        "`entities.b.synchronise.entity`: no other entity is called `a`; there are none",
    ),
    "half a place to meet": (
        {
            "a": car("east_1_0", 50.0, speed=TEN),
            "b": car("north_1_0", 50.0, synchronise=meets("a", x=1.0)),
        },
        "`entities.b.synchronise`: has only one of `x` and `y`; write both",
    ),
    "half a finish": (
        {"a": car("east_1_0", 50.0, controller="policy", finish=Finish(y=1.0))},
        "`entities.a.finish`: has only one of `x` and `y`; write both",
    ),
    "finish at an unknown one": (
        {"a": car("east_1_0", 50.0, controller="policy", finish=Finish(crossing="b"))},
        "`entities.a.finish.crossing`: no other entity is called `b`; there are none",
    ),
    "trigger by an unknown one": (
        {"a": car("east_1_0", 9.0, speed_profile=PROFILE, trigger=Trigger(entity="b"))},
        "`entities.a.trigger.entity`: no other entity is called `b`; there are none",
    ),
    "trigger by a queue": (
        {
            "a": car("east_1_0", 9.0, speed_profile=PROFILE, trigger=Trigger(entity="b")),
            "b": car("west_1_0", 90.0, count=2),
        },
        "`entities.a.trigger.entity`: `b` is a queue; name one of it, for example `b.0`",
    ),
    "closer to nobody": (
        {"a": car("east_1_0", 9.0, speed_profile=PROFILE, trigger=Trigger(closer_than=5.0))},
        "`entities.a.trigger.closer_than`: needs `trigger.entity`: closer to whom?",
    ),
    "trigger of nothing": (
        {"a": car("east_1_0", 9.0, trigger=Trigger(after=5.0))},
        (
            "`entities.a.trigger`: starts nothing; declare `speed_profile` or `trajectory`, or "
            "leave it out"
        ),
    ),
    "route and to": (
        {"a": car("east_1_0", 10.0, route=("east_2",), to="east_3")},
        "`entities.a.to`: there are both `route` and `to`; leave one out",
    ),
    "no place": (
        {"a": Entity(type="car", position=Position())},
        "`entities.a.position`: says no place; write `lane`, or `x` and `y`",
    ),
    "s and to_end": (
        {"a": Entity(type="car", position=on("east_1_0", 9.0, to_end=9.0))},
        "`entities.a.position`: has both `s` and `to_end`; leave one out",
    ),
    "queue anywhere": (
        {"a": at(1.0, 1.0, count=2)},
        "`entities.a.count`: a queue stands on a lane; set `position.lane`, or leave `count` out",
    ),
    "several driven by one": (
        {"a": car("east_1_0", 50.0, count=2, controller="policy")},
        "`entities.a.count`: it is driven; declare each by its name, and leave `count` out",
    ),
    "driven anywhere": (
        {"a": at(1.0, 1.0, controller="policy")},
        (
            "`entities.a.position`: `controller: policy` is for those on a lane; write `lane` "
            "instead of `x`, `y`"
        ),
    ),
    "profile anywhere": (
        {"a": at(1.0, 1.0, speed_profile=PROFILE)},
        (
            "`entities.a.position`: `speed_profile` is for those on a lane; write `lane` instead "
            "of `x`, `y`"
        ),
    ),
    "meets somebody anywhere": (
        {"a": at(1.0, 1.0), "b": car("north_1_0", 50.0, synchronise=meets("a"))},
        (
            "`entities.b.synchronise.entity`: `a` starts at `x`, `y` and has no way; name one who "
            "is on a lane"
        ),
    ),
    "driven and parked": (
        {"a": car("east_1_0", 50.0, controller="policy", parked=True)},
        "`entities.a.parked`: the entity is moved by `controller: policy` and `parked`; leave one",
    ),
    "driven, with a profile": (
        {"a": car("east_1_0", 50.0, controller="policy", speed_profile=PROFILE)},
        (
            "`entities.a.speed_profile`: the entity is moved by `controller: policy` and "
            "`speed_profile`; leave one"
        ),
    ),
    "profile and trajectory": (
        {"a": car("east_1_0", 50.0, speed_profile=PROFILE, trajectory=(VERTEX,))},
        (
            "`entities.a.trajectory`: the entity is moved by `speed_profile` and `trajectory`; "
            "leave one"
        ),
    ),
    "trajectory from a lane": (
        {"a": car("east_1_0", 50.0, trajectory=(VERTEX,))},
        (
            "`entities.a.position`: who follows a trajectory starts at `x`, `y`; write them, and "
            "no `lane`"
        ),
    ),
    "times of a trajectory": (
        {"a": at(0.0, 0.0, trajectory=(VERTEX, VERTEX))},
        "`entities.a.trajectory`: the times must increase, got [1.0, 1.0]",
    ),
    "times of a profile": (
        {
            "a": car(
                "east_1_0",
                50.0,
                speed_profile=(SpeedPoint(time=2.0, speed=1.0), SpeedPoint(time=1.0, speed=1.0)),
            )
        },
        "`entities.a.speed_profile`: the times must not decrease, got [2.0, 1.0]",
    ),
    "parked and moving": (
        {"a": car("east_1_0", 50.0, parked=True, speed=TEN)},
        "`entities.a.speed`: the entity is parked; leave `speed` or `parked` out",
    ),
    "a unit that moves": (
        {"a": unit(trajectory=(VERTEX,))},
        "`entities.a.trajectory`: a roadside unit does not move; leave `trajectory` out",
    ),
    **{
        f"a unit with {key}": (
            {"a": unit(**{key: value})},
            f"`entities.a.{key}`: means nothing for a roadside unit; leave it out",
        )
        for key, value in {
            "enters": 1.0,
            "speed": TEN,
            "route": ("east_1",),
            "to": "east_1",
            "lidar": True,
        }.items()
    },
    "a unit that is there now and then": (
        {"a": unit(presence=0.5)},
        "`entities.a.presence`: of a roadside unit is 0 or 1",
    ),
    "units without a way": (
        {
            "a": Entity(type="roadside_unit", position=Position(x=1.0, y=1.0)),
            "b": car("north_1_0", 50.0, synchronise=meets("a")),
        },
        (
            "`entities.b.synchronise.entity`: `a` starts at `x`, `y` and has no way; name one who "
            "is on a lane"
        ),
    ),
    "a circle": (
        {
            "a": car("east_1_0", 50.0, synchronise=meets("b")),
            "b": car("north_1_0", 50.0, synchronise=meets("c")),
            "c": car("west_1_0", 50.0, synchronise=meets("b")),
        },
        (
            "`entities.b.synchronise.entity`: goes round in a circle: `b` with `c`, `c` with `b`; "
            "leave out one `synchronise`"
        ),
    ),
    "a dot": (
        {"a.0": car("east_1_0", 50.0)},
        (
            "`entities.a.0`: has a dot, which stands before the numbers of a queue; write a name "
            "without one"
        ),
    ),
}

NOT_OF_THE_SCENE: Mapping[str, tuple[Mapping[str, Entity], str]] = {
    "lane": (
        {"a": car("nowhere_0", 10.0)},
        f"`entities.a`: `position.lane`: the scene has no lane `nowhere_0`; there are {LANES}",
    ),
    "inner lane": (
        {"a": car(":m_0_0", 10.0)},
        f"`entities.a`: `position.lane`: the scene has no lane `:m_0_0`; there are {LANES}",
    ),
    "type": (
        {"a": Entity(type="lorry", position=on("east_1_0", 10.0))},
        "`entities.a`: `type`: the scene has no vehicle type `lorry`; there are bike, car, van",
    ),
    "edge of a route": (
        {"a": car("east_1_0", 10.0, route=("nowhere",))},
        f"`entities.a`: `route`: the scene has no edge `nowhere`; there are {EDGES}",
    ),
    "destination": (
        {"a": car("east_1_0", 10.0, to="nowhere")},
        f"`entities.a`: `to`: the scene has no edge `nowhere`; there are {EDGES}",
    ),
    "no way": (
        {"a": car("east_1_0", 10.0, to="west_1")},
        "`entities.a`: `to`: no way leads from `east_1` to `west_1`",
    ),
    "route with a gap": (
        {"a": car("east_1_0", 10.0, route=("east_3",))},
        (
            "`entities.a`: lane `east_1_0` does not lead to edge `east_3` and on; no lane beside "
            "it does either"
        ),
    ),
    "s beyond the lane": (
        {"a": car("east_1_0", 500.0)},
        (
            "`entities.a`: `position.s` is 500 m, but on `east_1_0` the front bumper can be "
            "between 5 m and 196.0 m"
        ),
    ),
    "s before the lane": (
        {"a": car("east_1_0", 4.9)},
        (
            "`entities.a`: `position.s` is 4.9 m, but on `east_1_0` the front bumper can be "
            "between 5 m and 196.0 m"
        ),
    ),
    "to_end before the lane": (
        {"a": Entity(type="car", position=on("east_1_0", to_end=192.0))},
        (
            "`entities.a`: `position.to_end` is 192 m, but before the end of `east_1_0` there is "
            "room for at most 191.0 m"
        ),
    ),
    "moves from nowhere": (
        {"a": car("east_1_0", speed=TEN)},
        "`entities.a`: it moves; say where it starts by `position.s` or `.to_end`",
    ),
    "walks on a lane": (
        {"a": Entity(type="DEFAULT_PEDTYPE", position=on("east_1_0", 10.0))},
        "`entities.a`: who walks is placed by coordinates: `position: {x: .., y: ..}`",
    ),
    "queue too long": (
        {"a": car("east_1_0", 50.0, count=8)},
        "`entities.a`: `count` is 8, but lane `east_1_0` has room for 7",
    ),
    "queue too close": (
        {"a": car("east_1_0", 50.0, count=2, gap=2.4)},
        (
            "`entities.a`: `gap` is 2.4 m, but SUMO keeps the `minGap` of `car`, 2.5 m; change "
            "one of them"
        ),
    ),
    "no room": (
        {"a": car("east_1_0", 50.0), "b": car("east_1_0", 52.0)},
        (
            "`entities.b`: there is no room for `b` at the start; change its `position` or "
            "`count`, or what others keep clear"
        ),
    ),
    "too fast for what is ahead": (
        {"a": Entity(type="car", position=on("north_1_0", to_end=3.0), speed=TEN)},
        (
            "`entities.a`: there is no room for `a` at the start, or SUMO lets nobody enter who "
            "could not stop for what is ahead (a light, a junction where it gives way, a vehicle), "
            "and its `speed` is 10 m/s; change its `position`, `speed` or `count`, or what others "
            "keep clear"
        ),
    ),
    "no room for who ignores lights": (
        {
            "a": car("east_1_0", 50.0),
            "b": car("east_1_0", 52.0, speed=TEN, controller="policy"),
        },
        (
            "`entities.b`: there is no room for `b` at the start, or a vehicle is too close to it "
            "at its `speed`, 10 m/s; change its `position`, `speed` or `count`, or what others "
            "keep clear"
        ),
    ),
    "ways that do not cross": (
        {
            "a": car("east_1_0", 50.0, speed=TEN),
            "b": car("west_1_0", 50.0, synchronise=meets("a")),
        },
        (
            "`entities.b.synchronise`: its way does not cross that of `a`; give the place of the "
            "meeting as `x` and `y`"
        ),
    ),
    "ways that do not cross, to start from": (
        {"a": car("east_1_0", 50.0, speed=TEN), "b": car("west_1_0", synchronise=meets("a"))},
        (
            "`entities.b`: the way from `west_1_0` does not cross that of `a`; place them on "
            "lanes whose ways cross, or give the place of the meeting as `x` and `y`"
        ),
    ),
    "waits for one that the draw leaves out": (
        {
            "a": car("east_1_0", 50.0, speed=TEN, presence=1e-12),
            "b": car("north_1_0", synchronise=meets("a")),
        },
        "`entities.b`: `synchronise.entity` is `a`, which does not take part",
    ),
    "waits for one that is wrong itself": (
        {
            "a": car("east_1_0", 500.0, speed=TEN),
            "b": car("north_1_0", synchronise=meets("a")),
        },
        (
            "`entities.a`: `position.s` is 500 m, but on `east_1_0` the front bumper can be "
            "between 5 m and 196.0 m"
        ),
    ),
    "waits for one that stands": (
        {"a": car("east_1_0", 50.0), "b": car("north_1_0", synchronise=meets("a"))},
        (
            "`entities.b`: `a` stands at the start, so nobody can start as far in time from the "
            "meeting as it; set `position.s` or `position.to_end`"
        ),
    ),
    "finish where nobody crosses": (
        {
            "b": car("west_1_0", 50.0),
            "a": car("east_1_0", 50.0, controller="policy", finish=Finish(crossing="b")),
        },
        "`entities.a.finish.crossing`: its way does not cross that of `b`",
    ),
}


@pytest.mark.parametrize("case", MISDECLARED)
def test_what_contradicts_itself_is_refused_before_sumo_starts(tmp_path: Path, case: str) -> None:
    entities, message = MISDECLARED[case]
    with pytest.raises(ComponentTypeError) as caught:
        simulate(scene(tmp_path), 0.0, entities)
    assert str(caught.value) == message


@pytest.mark.parametrize("case", NOT_OF_THE_SCENE)
def test_what_the_scene_cannot_give_is_refused_at_the_start(tmp_path: Path, case: str) -> None:
    entities, message = NOT_OF_THE_SCENE[case]
    with pytest.raises(SumoError) as caught:
        simulate(scene(tmp_path), 0.0, entities)
    assert str(caught.value) == message


def test_all_problems_are_named_at_once(tmp_path: Path) -> None:
    entities = {
        "a": car("nowhere_0", 10.0),
        "b": Entity(type="lorry", position=on("east_1_0", 10.0)),
    }
    with pytest.raises(SumoError, match=r"(?s)`entities\.a`.*\n`entities\.b`"):
        simulate(scene(tmp_path), 0.0, entities)


def test_a_name_of_connectors_is_free_for_those_whom_no_policy_drives(tmp_path: Path) -> None:
    run = simulate(scene(tmp_path), 0.1, {"vehicle": car("east_1_0", 50.0)})
    assert run.present(1) == ["vehicle"]


def test_one_that_takes_part_later_can_be_met_at_a_place_that_is_given(tmp_path: Path) -> None:
    """Who is met needs to come first only where its start says where the other one starts."""
    entities = {
        "b": car("north_1_0", 100.0, speed=TEN, synchronise=meets("a")),
        "a": car("east_1_0", 100.0, speed=TEN),
    }
    assert simulate(scene(tmp_path), 0.1, entities).present(1) == ["b", "a"]


def test_a_lane_is_for_vehicles_of_its_classes(tmp_path: Path) -> None:
    with pytest.raises(SumoError) as caught:
        simulate(scene(tmp_path, "town"), 0.0, {"a": car("em_1", 50.0)})
    assert str(caught.value) == (
        "`entities.a`: `position.lane`: `em_1` is not for the class `passenger`, to which the type "
        "`car` belongs; it is open to bicycle"
    )


def test_a_lane_shorter_than_the_body_has_no_place(tmp_path: Path) -> None:
    long = '<vType id="train" vClass="ignoring" length="150"/>'
    entity = Entity(type="train", position=on("branch_0", 100.0))
    with pytest.raises(SumoError) as caught:
        simulate(scene(tmp_path, extra=long), 0.0, {"a": entity})
    assert str(caught.value) == (
        "`entities.a`: `position.lane`: `branch_0` is 142.8 m long, too short for `train`, 150 m"
    )


OWN_NAMES = """
    <person id="foot" depart="0"><walk edges="east_1"/></person>
    <route id="way" edges="east_1 east_2"/>
    <vehicle id="taken" type="car" route="way" depart="0"/>
"""


@pytest.mark.parametrize(
    ("name", "entity", "refusal"),
    [
        ("taken", car("west_1_0", 50.0), "The vehicle 'taken' to add already exists."),
        ("taken", at(30.0, 9.0), "The vehicle 'taken' to add already exists."),
        (
            "foot",
            Entity(type="DEFAULT_PEDTYPE", position=Position(x=30.0, y=9.0)),
            "The person foot to add already exists.",
        ),
    ],
    ids=["on a lane", "anywhere", "on foot"],
)
def test_names_of_the_scenes_own_traffic_are_taken(
    tmp_path: Path, name: str, entity: Entity, refusal: str
) -> None:
    with pytest.raises(SumoError) as caught:
        simulate(scene(tmp_path, demand=OWN_NAMES), 0.0, {name: entity})
    assert str(caught.value) == f"`entities.{name}`: SUMO refuses `{name}`: {refusal}"


@pytest.mark.parametrize("kind", ["van", "DEFAULT_PEDTYPE"])
def test_nobody_can_be_placed_where_no_road_is_near(tmp_path: Path, kind: str) -> None:
    entity = Entity(type=kind, position=Position(x=5000.0, y=9000.0))
    with pytest.raises(
        SumoError,
        match=r"^`entities\.far`: SUMO finds no lane near \(50.*, 9000\) m .*; begin closer",
    ):
        simulate(scene(tmp_path), 0.0, {"far": entity})


def test_names_of_the_scenes_routes_are_free(tmp_path: Path) -> None:
    entities = {"way": car("west_1_0", 50.0)}
    run = simulate(scene(tmp_path, demand=OWN_NAMES), 0.0, entities)
    assert run.present(0) == ["way", "foot", "taken"]
