"""Background traffic: where it starts, how far apart, when it enters, and where it goes."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from adapters.sumo.background import Background, KeptClear, Spawned, kept_clear
from adapters.sumo.entities import Entity, Position
from adapters.sumo.errors import SumoError
from adapters.sumo.net import Link
from adapters.sumo.parameters import Background as Demand, Equipment
from adapters.sumo.placement import Placement
from adapters.sumo.scene import VehicleType, VehicleTypes
from adapters.sumo.simulation import Sumo
from adapters.traffic.bodies import Body
from tests.adapters.sumo_runs import Float, car, scene, simulate

NOTHING = KeptClear(reserved=frozenset(), closed=frozenset(), limits={})
BORDER = {"east_1", "west_1", "north_1"}
"""Edges that begin at the border of the street's net."""


def kind(name: str, length: float, share: float) -> VehicleType:
    return VehicleType(
        name=name,
        size=(length, 1.8, 1.5),
        antenna_height=1.5,
        body=Body.CAR,
        share=share,
        stop_gap=1.0,
    )


def tall(name: str, share: float, height: float = 3.0) -> VehicleType:
    return replace(kind(name, 8.0, share), size=(8.0, 2.5, height))


CAR, VAN = kind("car", 5.0, 3.0), kind("van", 9.0, 1.0)


class Means:
    """Stands in for a generator: every draw is its mean, every choice the first one.

    Attributes:
        offered: the probabilities of the choices.
    """

    def __init__(self) -> None:
        self.offered: list[Sequence[float]] = []

    def uniform(self, low: float, high: float) -> float:
        return (low + high) / 2

    def exponential(self, scale: float) -> float:
        return scale

    def choice(self, count: int, p: Sequence[float]) -> int:
        assert len(p) == count
        assert math.isclose(sum(p), 1.0)
        self.offered.append(p)
        return 0


MEANS = cast("np.random.Generator", Means())


@pytest.fixture
def street(tmp_path: Path, loaded: Callable[..., Sumo]) -> Sumo:
    """A street with two junctions, before its first step."""
    return loaded(scene(tmp_path))


def background(
    sumo: Sumo, rng: np.random.Generator = MEANS, clear: KeptClear = NOTHING, **demand: Any
) -> Background:
    return Background(sumo, [CAR, VAN], Demand(**demand), clear, rng)


def by_lane(spawned: Sequence[Spawned]) -> dict[str, list[Spawned]]:
    """By the first edge of their routes."""
    found: dict[str, list[Spawned]] = {}
    for each in spawned:
        found.setdefault(edges_of(each)[0], []).append(each)
    return found


def edges_of(spawned: Spawned) -> tuple[str, ...]:
    import libsumo  # noqa: PLC0415  (SUMO alone knows what a route is)

    return tuple(libsumo.route.getEdges(spawned.departure.route))


@pytest.mark.parametrize("spacing", [15.0, 25.0, 40.0])
def test_vehicles_stand_one_spacing_apart_on_average(street: Sumo, spacing: float) -> None:
    """A gap is at least 4 m, and as much more as the mean length leaves of the spacing."""
    rows = by_lane(background(street, spacing=spacing).place())
    assert set(rows) == set(street.net.edges())
    mean_length = (3.0 * CAR.length + 1.0 * VAN.length) / 4.0
    headway = CAR.length + spacing - mean_length
    for edge, row in rows.items():
        fronts = [each.departure.position for each in row]
        assert fronts[0] == street.net.lane_length(f"{edge}_0") - spacing / 2
        np.testing.assert_allclose(np.diff(fronts), -headway)
        assert CAR.length <= fronts[-1] < CAR.length + headway


def test_a_spacing_of_less_than_the_vehicles_leaves_the_smallest_gap(street: Sumo) -> None:
    """A mean length of 20 m is more than a spacing of 15 m."""
    long = Background(street, [kind("car", 20.0, 1.0)], Demand(spacing=15.0), NOTHING, MEANS)
    for row in by_lane(long.place()).values():
        np.testing.assert_allclose(np.diff([each.departure.position for each in row]), -24.0)


@pytest.mark.parametrize("seed", range(3))
def test_no_two_of_a_lane_are_closer_than_four_metres_and_all_are_on_it(
    street: Sumo, seed: int
) -> None:
    spawned = background(street, np.random.default_rng(seed), spacing=15.0).place()
    assert len({each.name for each in spawned}) == len(spawned)
    assert {each.type.name for each in spawned} == {"car", "van"}
    for edge, row in by_lane(spawned).items():
        front = np.array([each.departure.position for each in row])
        rear = front - [each.type.length for each in row]
        assert (rear[:-1] - front[1:] >= 4.0).all()
        assert rear[-1] >= 0.0
        length = street.net.lane_length(f"{edge}_0")
        assert length - 15.0 <= front[0] <= length


def test_what_is_kept_clear_is_clear(street: Sumo) -> None:
    """One lane ends early, one is reserved, and nobody turns into the two that are closed."""
    clear = KeptClear(
        reserved=frozenset({"north_1_0"}),
        closed=frozenset({"east_3_0", "branch_0"}),
        limits={"east_1_0": 60.0, "branch_0": 1000.0},
    )
    rows = by_lane(background(street, np.random.default_rng(1), clear, spacing=15.0).place())
    assert max(each.departure.position for each in rows["east_1"]) <= 60.0
    branch = max(each.departure.position for each in rows["branch"])
    assert branch <= street.net.lane_length("branch_0")
    assert set(street.net.edges()) - set(rows) == {"north_1", "east_2"}
    assert {edges_of(each)[:2] for each in rows["west_1"]} == {("west_1", "west_2")}
    later = [edges_of(each)[2:] for each in rows["east_1"]]
    assert ("east_3",) in later, "from the second lane on, closed lanes are as others"


@pytest.mark.parametrize(("turning", "straight"), [(0.0, 1.0), (0.2, 0.8), (1.0, 0.0)])
def test_at_every_junction_the_share_of_those_turning_is_kept(
    street: Sumo, turning: float, straight: float
) -> None:
    """Within four standard deviations; of two ways to turn each has half."""
    drawn = background(street, np.random.default_rng(1), spacing=15.0, turning_share=turning)
    ways = Counter(edges_of(each)[:2] for _ in range(40) for each in drawn.place())

    def share(start: str, end: str) -> float:
        return ways[start, end] / sum(n for (edge, *_), n in ways.items() if edge == start)

    def is_near(found: float, expected: float) -> bool:
        return abs(found - expected) <= 4.0 * math.sqrt(expected * (1.0 - expected) / 400)

    for start, end in (("west_1", "west_2"), ("east_1", "east_2"), ("north_1", "north_2")):
        assert is_near(share(start, end), straight)
    for end in ("east_2", "west_3"):
        assert is_near(share("north_1", end), turning / 2)


def test_everybody_drives_to_the_border_of_the_net_by_a_way_that_there_is(street: Sumo) -> None:
    """And the path of each begins with its lane and ends with the one after the junction."""
    ends = {"east_3", "west_3", "north_2", "branch"}
    for each in background(street, np.random.default_rng(1), spacing=30.0).place():
        edges = edges_of(each)
        assert edges[-1] in ends
        for edge, following in pairwise(edges):
            links = [link.to_lane for link in street.net.links(f"{edge}_0")]
            assert f"{following}_0" in links
        lanes = [f"{edge}_0" for edge in edges[:2]]
        np.testing.assert_array_equal(each.path.at(0.0), street.net.lane_shape(lanes[0])[0])
        end = street.net.lane_shape(lanes[-1])[-1]
        np.testing.assert_allclose(each.path.at(each.path.length), end, atol=1e-9)
        assert each.path.length >= sum(map(street.net.lane_length, lanes)) - 1e-6


@pytest.mark.parametrize("changes_lanes", [True, False])
def test_they_enter_where_lanes_begin_at_the_border_at_intervals_of_the_spacing(
    street: Sumo, *, changes_lanes: bool
) -> None:
    """Every `spacing` over the speed limit of 14 m/s, with the rear at the start of the lane."""
    drawn = background(street, spacing=28.0, changes_lanes=changes_lanes)
    assert drawn.enter(1.99) == []
    assert set(by_lane(drawn.enter(2.0))) == BORDER
    assert drawn.enter(3.99) == []
    entering = drawn.enter(4.5)  # late: the next interval begins now
    assert set(by_lane(entering)) == BORDER
    assert drawn.enter(6.49) == []
    assert set(by_lane(drawn.enter(6.5))) == BORDER
    for each in entering:
        departure = each.departure
        assert (departure.position, departure.speed, departure.lane) == (CAR.length, None, 0)
        assert departure.changes_lanes is changes_lanes


def test_they_are_asked_for_at_the_begin_of_each_step_of_sumo(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the time since the start."""
    asked = []

    def enter(_: Background, elapsed: float) -> list[Spawned]:
        asked.append(elapsed)
        return []

    monkeypatch.setattr(Background, "enter", enter)
    share = '<vType id="auto"><param key="share" value="1"/></vType>'
    simulate(scene(tmp_path, extra=share), 0.4, background=Demand(), step_length=0.05)
    assert asked == pytest.approx([0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35])


@pytest.mark.parametrize("count", [6, 7])
def test_nobody_enters_a_lane_that_is_full(
    street: Sumo, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """Full is one vehicle per spacing: seven on a lane of seven spacings; the others go on."""
    monkeypatch.setattr(street, "occupancy", {"east_1_0": count}.get)
    clear = KeptClear(reserved=frozenset({"west_1_0", "north_1_0"}), closed=frozenset(), limits={})
    drawn = background(street, clear=clear, spacing=street.net.lane_length("east_1_0") / 7)
    assert bool(drawn.enter(100.0)) == (count < 7)


def test_who_finds_no_room_never_enters_and_its_lidar_is_for_another(tmp_path: Path) -> None:
    """Vehicles are numbered as they want to enter; who entered later would be out of order."""
    share = '<vType id="auto" length="5"><param key="share" value="1"/></vType>'
    run = simulate(
        scene(tmp_path, extra=share),
        40.0,
        background=Demand(spacing=10.0),
        equipment={"all": Equipment(lidar=1.0, lidar_limit=30)},
    )
    wanted = [int(run.name[number].removeprefix("background.")) for number in sorted(run.name)]
    assert wanted == sorted(wanted)
    assert len(wanted) + 50 < wanted[-1], "there was no room for many"
    assert run.array(-1, "vehicle.lidar").sum() == 30


def test_types_are_drawn_by_their_shares(street: Sumo) -> None:
    """Three cars for each van, none of what has no share; within four standard deviations."""
    kinds = [kind("none", 4.0, 0.0), CAR, VAN]
    drawn = Background(street, kinds, Demand(spacing=15.0), NOTHING, np.random.default_rng(2))
    found = Counter(each.type.name for _ in range(40) for each in drawn.place())
    assert set(found) == {"car", "van"}
    # who does not fit at the start of a lane is drawn in vain, a van more often than a car
    share = found["van"] / found.total()
    assert share == pytest.approx(0.25, abs=4.0 * math.sqrt(0.1875 / found.total()) + 0.01)


TRUCK = replace(kind("truck", 9.0, 1.0), vehicle_class="truck")
BUS = replace(kind("bus", 9.0, 2.0), vehicle_class="bus")


def close(lanes: Sequence[str], *classes: str) -> None:
    """Forbid `lanes` to `classes`."""
    import libsumo  # noqa: PLC0415  (nets do not change otherwise)

    for lane in lanes:
        libsumo.lane.setDisallowed(lane, classes)


@pytest.mark.parametrize("seed", range(3))
def test_a_type_is_only_on_lanes_and_ways_that_its_class_may_use(street: Sumo, seed: int) -> None:
    """Trucks are forbidden on one lane that they would start on, and on one that they turn into."""
    close(["west_1_0", "east_2_0"], "truck")
    rng = np.random.default_rng(seed)
    drawn = Background(street, [CAR, TRUCK], Demand(spacing=15.0), NOTHING, rng)
    spawned = drawn.place() + [each for k in range(100) for each in drawn.enter(float(k))]
    assert {each.type.name for each in spawned} == {"car", "truck"}
    for each in spawned:
        for edge in edges_of(each):
            assert street.net.allows(f"{edge}_0", each.type.vehicle_class)
    rows = by_lane(spawned)
    assert set(rows) == set(street.net.edges())
    # from `east_1` straight on is closed, and the turn is not
    assert {edges_of(each)[1] for each in rows["east_1"] if each.type is TRUCK} == {"north_2"}


def test_others_stand_in_by_their_shares_for_a_type_that_may_not_be_there(street: Sumo) -> None:
    """Cars and buses are 6 to 2, so of four that stand in for trucks three are cars."""
    close([f"{edge}_0" for edge in street.net.edges()], "truck")
    kinds = [replace(CAR, share=6.0), BUS, replace(TRUCK, share=1000.0)]
    drawn = Background(street, kinds, Demand(spacing=15.0), NOTHING, np.random.default_rng(1))
    found = Counter(each.type.name for _ in range(5) for each in drawn.place())
    assert set(found) == {"car", "bus"}
    assert found["bus"] / found.total() == pytest.approx(0.25, abs=0.02)


def test_where_no_type_may_be_there_is_nobody(street: Sumo) -> None:
    close(["west_1_0"], "truck")
    drawn = Background(street, [TRUCK], Demand(spacing=15.0), NOTHING, np.random.default_rng(1))
    assert set(by_lane(drawn.place())) == set(street.net.edges()) - {"west_1"}
    assert set(by_lane(drawn.enter(100.0))) == BORDER - {"west_1"}


def test_who_leads_only_to_what_is_closed_does_not_start(street: Sumo) -> None:
    """Of `east_1` every way on is closed to trucks, so a truck could only vanish at its end."""
    close(["east_2_0", "north_2_0"], "truck")
    drawn = Background(street, [TRUCK], Demand(spacing=15.0), NOTHING, np.random.default_rng(1))
    assert "east_1" not in by_lane(drawn.place())


def test_closing_a_lane_to_a_class_that_is_not_in_the_mix_changes_nothing(
    street: Sumo, monkeypatch: pytest.MonkeyPatch
) -> None:
    routes: list[Sequence[str]] = []
    monkeypatch.setattr(street, "add_route", lambda _, edges: routes.append(edges))

    def all_of() -> list[object]:
        routes.clear()
        drawn = background(street, np.random.default_rng(1), spacing=15.0)
        return [*((each.type, each.departure) for each in drawn.place()), *routes]

    before = all_of()
    close(["west_1_0", "east_2_0"], "truck", "bus")
    assert all_of() == before


def test_a_mix_with_bicycles_drives_in_a_net_with_bicycle_lanes(tmp_path: Path) -> None:
    """Lanes of cars are closed to bicycles there; SUMO refuses nobody."""
    share = '<param key="share" value="1"/>'
    types = f"""<vType id="auto">{share}</vType>
        <vType id="rad" vClass="bicycle">{share}</vType>
        <vType id="tram" vClass="tram">{share}</vType>"""
    run = simulate(scene(tmp_path, "town", extra=types), 5.0, background=Demand(spacing=20.0))
    assert len(run.number) > 20


def test_without_a_share_there_is_no_background(street: Sumo) -> None:
    with pytest.raises(SumoError, match="no vehicle type of the scene has a positive `share`"):
        Background(street, [kind("none", 4.0, 0.0)], Demand(), NOTHING, MEANS)


@dataclass
class Circle:
    """Stands in for SUMO and its net: a lane of 1500 m that leads to itself, that way."""

    directions: str = "s"
    routes: list[Sequence[str]] = field(default_factory=list)

    @property
    def net(self) -> "Circle":
        return self

    def lanes(self) -> list[str]:
        return ["o_0"]

    def allows(self, lane: str, vehicle_class: str) -> bool:
        return (lane, vehicle_class) == ("o_0", "passenger")

    def links(self, _: str) -> list[Link]:
        return [Link(to_lane="o_0", via="", direction=letter) for letter in self.directions]

    def lane_length(self, _: str) -> float:
        return 1500.0

    def lane_shape(self, _: str) -> Float:
        return np.array([(0.0, 0.0), (1500.0, 0.0)])

    def edge_of(self, lane: str) -> str:
        return lane.removesuffix("_0")

    def index_of(self, _: str) -> int:
        return 0

    def speed_limit(self, _: str) -> float:
        return 14.0

    def add_route(self, _: str, edges: Sequence[str]) -> None:
        self.routes.append(edges)


def test_a_route_in_circles_ends_after_twenty_kilometres() -> None:
    """After the lane it starts on, the first number of lanes that are as long together."""
    circle = Circle()
    drawn = background(cast("Sumo", circle), spacing=100.0)
    assert len({each.departure.route for each in drawn.place()}) == 1
    (edges,) = circle.routes
    assert len(edges) == 1 + math.ceil(20_000 / 1500)
    assert drawn.enter(1e6) == []  # no lane begins at a border


@pytest.mark.parametrize(
    ("directions", "weights"),
    [
        ("s", (1.0,)),
        ("rsl", (0.1, 0.8, 0.1)),
        ("ssl", (0.4, 0.4, 0.2)),
        ("lt", (0.5, 0.5)),
        ("sss", (1 / 3, 1 / 3, 1 / 3)),
    ],
)
def test_ways_straight_on_share_evenly_and_so_do_turns(
    directions: str, weights: tuple[float, ...]
) -> None:
    """Of a share of 0.2; where all ways are of one kind there is nothing to share."""
    rng = Means()
    circle = cast("Sumo", Circle(directions))
    drawn = background(circle, cast("np.random.Generator", rng), turning_share=0.2)
    drawn.place()
    ways = [p for p in rng.offered if len(p) == len(weights) and not isinstance(p, np.ndarray)]
    assert ways
    for each in ways:
        np.testing.assert_allclose(each, weights)


def test_what_entities_keep_clear(street: Sumo) -> None:
    """Of an edge, its lanes and the lane beyond the junction; of who stands beside it, nothing."""
    entities = {
        "edge": car("east_1_0", 50.0, keeps_clear="edge"),
        "lane": car("north_1_0", 50.0, keeps_clear="lane"),
        "first": car("west_1_0", 60.0, keeps_clear="behind"),
        "second": car("west_1_0", 100.0, keeps_clear="behind"),
        "beside": Entity(type="car", position=Position(x=50.0, y=-9.0)),
    }
    placed = Placement(street, VehicleTypes(street, 0.05), MEANS).place(entities)
    for turned in (placed, placed[::-1]):
        clear = kept_clear(street, turned)
        assert clear.reserved == {"east_1_0", "north_1_0"}
        assert clear.closed == {"east_2_0"}
        assert clear.limits == {"west_1_0": 60.0 - 5.0 - 10.0}


@pytest.mark.parametrize(
    ("share", "wanted"),
    [
        (None, [0.3, 0.1, 0.1, 0.3, 0.2]),
        (0.4, [0.3, 0.1, 0.1, 0.3, 0.2]),
        (0.8, [0.1, 0.2 / 6, 0.2, 0.6, 0.4 / 6]),
        (0.0, [0.5, 1 / 6, 0.0, 0.0, 1 / 3]),
        (1.0, [0.0, 0.0, 0.25, 0.75, 0.0]),
    ],
)
def test_tall_vehicles_get_the_share_that_is_asked_for(
    street: Sumo, share: float | None, wanted: list[float]
) -> None:
    """Proportions among the tall, 1 to 3, and among the others stay; 2 m is not yet tall."""
    types = [CAR, VAN, tall("bus", 1.0), tall("truck", 3.0), tall("low", 2.0, height=2.0)]
    means = Means()
    rng = cast("np.random.Generator", means)
    Background(street, types, Demand(tall_share=share), NOTHING, rng).place()
    assert [float(each) for each in means.offered[0]] == pytest.approx(wanted)


@pytest.mark.parametrize(
    ("share", "types", "what"),
    [
        (
            0.1,
            [CAR],
            "`background.tall_share` is 0.1, but no vehicle type with a `share` is higher",
        ),
        (
            0.9,
            ["bus"],
            "`background.tall_share` is 0.9, but .* with a `share` is not higher than 2",
        ),
    ],
)
def test_a_tall_share_needs_types_of_both_kinds(
    street: Sumo, share: float, types: list[Any], what: str
) -> None:
    kinds = [tall(each, 1.0) if isinstance(each, str) else each for each in types]
    with pytest.raises(SumoError, match=what):
        Background(street, kinds, Demand(tall_share=share), NOTHING, MEANS)
