"""Who carries what: shares, rules in order, patterns, and lidars that are few."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from adapters.sumo.entities import Entity
from adapters.sumo.equipment import Outfitter
from adapters.sumo.parameters import Background, Equipment
from adapters.sumo.population import Vehicle
from adapters.sumo.scene import VehicleType
from adapters.traffic.bodies import Body
from orchestrator.distribution import Constant
from tests.adapters.sumo_runs import RED_LIGHT, car, on, scene, simulate

MANY = 4000


def kind(name: str, body: Body = Body.CAR) -> VehicleType:
    return VehicleType(
        name=name, size=(5.0, 1.8, 1.5), antenna_height=1.55, body=body, share=0.0, stop_gap=1.0
    )


CAR, BUS, BIKE = kind("car"), kind("city_bus", Body.BUS), kind("bike", Body.BICYCLE)
WALKS = kind("DEFAULT_PEDTYPE", Body.PEDESTRIAN)


def fitted(
    rules: Mapping[str, Equipment | None], *kinds: VehicleType, seed: int = 1
) -> list[Vehicle]:
    """Many road users, of these types in turn."""
    outfitter = Outfitter(rules, np.random.default_rng(seed))
    return [outfitter.equip(f"v.{k}", kinds[k % len(kinds)]) for k in range(MANY)]


def share_of(vehicles: list[Vehicle], what: str) -> float:
    return float(np.mean([getattr(vehicle, what) for vehicle in vehicles]))


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_shares_are_probabilities(share: float) -> None:
    """Within three standard deviations of a binomial distribution; radio and lidar independent."""
    vehicles = fitted({"all": Equipment(radio=share, lidar=share)}, CAR)
    bound = 3.0 * math.sqrt(share * (1.0 - share) / MANY)
    assert abs(share_of(vehicles, "equipped") - share) < bound
    assert abs(share_of(vehicles, "lidar") - share) < bound
    both = float(np.mean([vehicle.equipped and vehicle.lidar for vehicle in vehicles]))
    assert abs(both - share**2) < 3.0 * math.sqrt(share**2 * (1.0 - share**2) / MANY)


def test_all_or_none_is_exact() -> None:
    vehicles = fitted({"all": Equipment(radio=1.0, lidar=0.0)}, CAR, BUS)
    assert share_of(vehicles, "equipped") == 1.0
    assert share_of(vehicles, "lidar") == 0.0


def test_the_last_rule_that_fits_holds_and_says_only_what_it_says() -> None:
    rules = {
        "all": Equipment(radio=1.0, lidar=1.0),
        "buses": Equipment(types="*_bus", radio=0.0),
        "first": Equipment(vehicles="v.[0-1]", lidar=0.0),
        "removed": None,
    }
    vehicles = fitted(rules, CAR, BUS)
    assert [vehicle.equipped for vehicle in vehicles[:4]] == [True, False, True, False]
    assert [vehicle.lidar for vehicle in vehicles[:4]] == [False, False, True, True]
    turned = fitted(dict(reversed(rules.items())), CAR, BUS)
    assert share_of(turned, "equipped") == share_of(turned, "lidar") == 1.0


def test_a_rule_for_all_leaves_out_those_without_an_engine_and_one_that_names_them_does_not() -> (
    None
):
    everybody = fitted({"all": Equipment(radio=1.0)}, CAR, BIKE, WALKS)
    assert [vehicle.equipped for vehicle in everybody[:3]] == [True, False, False]
    by_type = fitted({"w": Equipment(types="DEFAULT_PED*", radio=1.0)}, CAR, BIKE, WALKS)
    assert [vehicle.equipped for vehicle in by_type[:3]] == [False, False, True]
    by_name = fitted({"n": Equipment(vehicles="v.*", radio=1.0)}, CAR, BIKE, WALKS)
    assert [vehicle.equipped for vehicle in by_name[:3]] == [True, True, True]


def test_patterns_heed_case() -> None:
    assert share_of(fitted({"x": Equipment(types="CAR", radio=1.0)}, CAR), "equipped") == 0.0


def test_no_rule_is_no_equipment() -> None:
    assert share_of(fitted({}, CAR), "equipped") == 0.0


def test_one_rule_more_changes_nothing_for_those_it_does_not_name() -> None:
    """Two draws for each, whatever the rules are."""
    half = {"all": Equipment(radio=0.5, lidar=0.5)}
    plain = fitted(half, CAR, BUS)
    ruled = fitted({**half, "buses": Equipment(types="city_bus", radio=1.0)}, CAR, BUS)
    assert plain[::2] == ruled[::2]
    assert [v.lidar for v in plain] == [v.lidar for v in ruled]


LIMITED = Equipment(radio=1.0, lidar=1.0, lidar_limit=3)

FLOW = """
    <route id="r" edges="east_1 east_2 east_3"/>
    <flow id="f" type="car" route="r" begin="0" end="120" period="3" departSpeed="max"/>
"""


def test_there_are_never_more_lidars_than_the_limit_and_one_that_leaves_frees_its_own(
    tmp_path: Path,
) -> None:
    """At every communication point; nobody loses a lidar that it has, or gets one on its way."""
    run = simulate(scene(tmp_path, demand=FLOW), 160.0, equipment={"all": LIMITED})
    has: dict[int, bool] = {}
    count = []
    for k in range(len(run.points)):
        numbers, lidars = run.array(k, "vehicle.id"), run.array(k, "vehicle.lidar")
        count.append(int(lidars.sum()))
        for number, lidar in zip(numbers.tolist(), lidars.tolist(), strict=True):
            assert has.setdefault(number, lidar) == lidar
    assert max(count) == 3
    assert [has[number] for number in sorted(has)[:4]] == [True, True, True, False]
    assert sum(has.values()) > 6  # those that left gave on theirs
    leaves = next(k for k in range(1, len(count)) if count[k] < count[k - 1])
    assert 3 in count[leaves:]


def test_the_limit_is_that_of_the_rule_that_gives_the_lidar() -> None:
    outfitter = Outfitter(
        {"all": LIMITED, "buses": Equipment(types="city_bus", lidar=1.0)}, np.random.default_rng(1)
    )
    cars = [outfitter.equip(f"c.{k}", CAR) for k in range(5)]
    buses = [outfitter.equip(f"b.{k}", BUS) for k in range(5)]
    assert [v.lidar for v in cars] == [True] * 3 + [False] * 2
    assert all(v.lidar for v in buses)
    outfitter.forget(buses[0])
    assert not outfitter.equip("c.5", CAR).lidar
    outfitter.forget(cars[1])
    assert outfitter.equip("c.6", CAR).lidar


def test_lidars_of_entities_do_not_count(tmp_path: Path) -> None:
    entities = {"a": car("west_1_0", 50.0, lidar=True, count=2)}
    run = simulate(scene(tmp_path, demand=FLOW), 30.0, entities, equipment={"all": LIMITED})
    assert run.array(-1, "vehicle.lidar").sum() == 5


def test_another_share_of_radios_leaves_the_traffic_byte_for_byte() -> None:
    """And the lidars."""
    entities = {"a": Entity(type="sedan", position=on("west_in_0", 100.0), speed=Constant(5.0))}
    runs = [
        simulate(
            RED_LIGHT,
            20.0,
            entities,
            background=Background(),
            equipment={"all": Equipment(radio=radio, lidar=0.3, lidar_limit=4)},
        )
        for radio in (0.2, 0.8)
    ]
    few, many = (run.array(-1, "vehicle.equipped") for run in runs)
    assert few.sum() < many.sum()
    assert not (few & ~many).any()  # who has one of few has one of many
    for one, other in zip(runs[0].points, runs[1].points, strict=True):
        for name in one.keys() - {"vehicle.equipped"}:
            assert np.asarray(one[name]).tobytes() == np.asarray(other[name]).tobytes(), name
