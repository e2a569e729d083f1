"""Whoever enters at coordinates within somebody is told of: in the log, and by `nlosim check`."""

import json
import logging
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, strategies as st

import scenarios
from adapters.sumo.entities import Entity, Position
from adapters.sumo.overlaps import overlaps
from adapters.sumo.population import Poses, Roster, Vehicle
from adapters.sumo.scene import VehicleType
from adapters.traffic.bodies import Body
from orchestrator.cli import main
from tests.adapters.sumo_runs import car, scene, simulate

LENGTH, WIDTH = 5.0, 1.8
"""Of the type `car` [m]."""

CAR = VehicleType(
    name="car",
    size=(LENGTH, WIDTH, 1.5),
    antenna_height=1.6,
    body=Body.CAR,
    share=1.0,
    stop_gap=1.0,
)

decimetres = st.tuples(st.integers(-80, 80), st.integers(-30, 30))
places = st.lists(
    decimetres.map(lambda at: (at[0] / 10, at[1] / 10)), min_size=1, max_size=6, unique=True
)


def standing(at: list[tuple[float, float]]) -> tuple[Roster, Poses]:
    """Cars that look to the east, called by their numbers."""
    vehicles = [
        Vehicle(name=str(k), type=CAR, equipped=False, lidar=False, antenna_height=1.6)
        for k in range(len(at))
    ]
    poses = Poses(center=np.array(at), heading=np.zeros(len(at)), velocity=np.zeros((len(at), 2)))
    return Roster.empty().changed(vehicles, frozenset()), poses


@given(places)
def test_cars_in_one_direction_overlap_where_both_sides_do(at: list[tuple[float, float]]) -> None:
    """Each pair once; touching does not count."""
    roster, poses = standing(at)
    everybody = [str(k) for k in range(len(at))]
    expected = {
        (str(i), str(j))
        for i, j in combinations(range(len(at)), 2)
        if abs(at[i][0] - at[j][0]) <= LENGTH - 0.01 and abs(at[i][1] - at[j][1]) <= WIDTH - 0.01
    }
    assert set(overlaps(everybody, roster, poses)) == expected
    assert len(list(overlaps(everybody, roster, poses))) == len(expected)
    of_one = set(overlaps(["0"], roster, poses))
    assert of_one == {pair for pair in expected if pair[0] == "0"}
    assert list(overlaps(["nobody"], roster, poses)) == []


@pytest.mark.parametrize(("within", "told"), [(0.0095, []), (0.0105, [("0", "1")])])
def test_a_centimetre_is_a_touch(within: float, told: list[tuple[str, str]]) -> None:
    roster, poses = standing([(0.0, 0.0), (LENGTH - within, 0.0)])
    assert list(overlaps(["0"], roster, poses)) == told


def test_the_heading_counts() -> None:
    """Side by side they have room; one across reaches into the other."""
    roster, poses = standing([(0.0, 0.0), (0.0, 2.0)])
    assert list(overlaps(["1"], roster, poses)) == []
    poses.heading[1] = np.pi / 2
    assert list(overlaps(["1"], roster, poses)) == [("1", "0")]


def test_a_run_tells_of_it_once_when_it_enters(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Of two at the same place the one declared first; on a lane SUMO keeps room itself."""
    entities = {
        "there": car("east_1_0", 100.0),
        "in": Entity(type="van", position=Position(x=-103.0, y=-1.6)),
        "late": Entity(type="car", position=Position(x=-60.0, y=-6.0, h=0.3), enters=0.5),
        "twin": Entity(type="car", position=Position(x=-60.5, y=-6.0), enters=0.5),
        "apart": Entity(type="van", position=Position(x=-30.0, y=-6.0)),
    }
    with caplog.at_level(logging.WARNING):
        simulate(scene(tmp_path), 2.0, entities)
    told = [r.message.partition(" as it")[0] for r in caplog.records if "within" in r.message]
    assert told == [
        "`entities.in`: `position`: the body of `in` is within that of `there`",
        "`entities.late`: `position`: the body of `late` is within that of `twin`",
    ]


def test_check_says_it_at_the_place(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "wreck.yaml"
    red_light = Path(scenarios.__file__).parent / "red_light.yaml"
    file.write_text(
        f"schema: 1\ntitle: a wreck in the queue\nextends: {red_light}\ncomponents:\n"
        "  traffic:\n    parameters:\n      entities:\n        wreck:\n          type: compact\n"
        "          position: {x: 3 m, y: -31 m}\n"
    )
    assert main(["check", str(file), "--json"]) == 0
    remarks = json.loads(capsys.readouterr().out)["remarks"]
    (found,) = [each for each in remarks if "within" in each["message"]]
    assert (found["file"], found["line"]) == (str(file), 10)
    assert found["message"].startswith(
        "components.traffic.parameters.entities.wreck.position: the body of `wreck` is within "
        "that of `blocking.2`"
    )
    file.write_text(file.read_text().replace("x: 3 m", "x: 14 m"))
    assert main(["check", str(file), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert not any("within" in each["message"] for each in found.get("remarks", ()))
