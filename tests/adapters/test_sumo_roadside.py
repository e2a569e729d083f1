"""Roadside units: rows of `vehicle.*` that nobody in the traffic knows of."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, strategies as st

from adapters.sumo import SumoTraffic
from adapters.sumo.entities import ROADSIDE_UNIT, Entity, Position
from adapters.sumo.errors import SumoError
from adapters.sumo.parameters import TrafficParameters
from adapters.sumo.roadside import FIRST_NUMBER, RoadsideUnit, RoadsideUnits, contains
from orchestrator.errors import ComponentTypeError
from orchestrator.randomness import stream
from orchestrator.signal import Signals
from orchestrator.testing import check_component
from tests.adapters.red_light import ALONE, STEP as H, red_light

CORNER, OVER_THE_LANE = (14.0, 9.0), (7.0, -100.0)  # the latter on the ego's way

Float = npt.NDArray[np.float64]


def unit(x: float | None, y: float | None, antenna_height: float | None = None) -> Entity:
    """A roadside unit."""
    place = Position(x=x, y=y)
    return Entity(type=ROADSIDE_UNIT, position=place, antenna_height=antenna_height)


def with_units(
    *units: Entity, spacing: float = 60.0, changes: Mapping[str, Any] | None = None
) -> TrafficParameters:
    """The red light with `units`, called `rsu0`, `rsu1`, ..., and `changes` of other entities."""
    named = {f"rsu{k}": each for k, each in enumerate(units)}
    return red_light(background={"spacing": spacing}, entities={**named, **(changes or {})})


PARAMETERS = with_units()
BOTH = (unit(*CORNER), unit(*OVER_THE_LANE))
UNITS = with_units(*BOTH)


def run(parameters: Any, seconds: float, seed: int = 1) -> list[Signals]:
    """The outputs at each communication point; the ego keeps its speed."""
    traffic = SumoTraffic(parameters)
    try:
        traffic.setup(0, stream(seed, "traffic"))
        outputs = [traffic.outputs()]
        for k in range(round(seconds * 1e9) // H):
            traffic.step({"ego.command": np.zeros(3)}, k * H, H)
            outputs.append(traffic.outputs())
        return outputs
    finally:
        traffic.close()


def test_the_traffic_is_the_same_with_them_and_they_are_there_throughout() -> None:
    """Bit by bit, `ego.gap` too although the ego passes right under one."""
    without, with_them = run(PARAMETERS, 8.0), run(UNITS, 8.0)
    assert np.asarray(without[-1]["ego.position"])[1] > OVER_THE_LANE[1] + 5.0, "passed it"
    newcomers = [json.loads(bytes(signals[0]["entered"])) for signals in (without, with_them)]
    assert newcomers[1] == newcomers[0] + [
        [FIRST_NUMBER, "rsu0", "roadside_unit"],
        [FIRST_NUMBER + 1, "rsu1", "roadside_unit"],
    ]
    for k, (before, after) in enumerate(zip(without, with_them, strict=True)):
        for name, expected in before.items():
            if name == "entered" and k == 0:
                continue
            signal = np.asarray(after[name])
            rows = len(signal) - 2 if name.startswith("vehicle.") else None
            np.testing.assert_array_equal(signal[:rows] if rows else signal, expected, name)
        units = {name: np.asarray(after[f"vehicle.{name}"])[-2:] for name in ROWS}
        for name, expected_rows in ROWS.items():
            np.testing.assert_array_equal(units[name], expected_rows, name)


ROWS: dict[str, Any] = {
    "id": [FIRST_NUMBER, FIRST_NUMBER + 1],
    "position": [(*CORNER, 0.0), (*OVER_THE_LANE, 0.0)],
    "velocity": np.zeros((2, 2)),
    "antenna_height": [5.0, 5.0],
    "equipped": [True, True],
    "lidar": [False, False],
    "role": [5, 6],
}


@pytest.mark.parametrize(
    ("spacing", "changes"),
    [(30.0, {}), (60.0, {"blocking": {"count": 2}}), (60.0, ALONE)],
    ids=["more traffic", "fewer trucks", "no collider"],
)
def test_their_numbers_and_roles_depend_on_nobody(
    spacing: float, changes: Mapping[str, Any]
) -> None:
    (start,) = run(with_units(*BOTH, spacing=spacing, changes=changes), 0.0, seed=2)
    numbers = np.asarray(start["vehicle.id"])
    assert numbers[-2:].tolist() == ROWS["id"]
    assert (np.diff(numbers) > 0).all()
    assert np.asarray(start["vehicle.role"])[-2:].tolist() == ROWS["role"]


def test_the_component_keeps_the_contract_with_them() -> None:
    check_component(SumoTraffic(UNITS), steps=5, h=H)


def test_what_did_not_change_stays_the_same_object() -> None:
    """Consumers skip work for signals that are the same object as before."""
    corner = RoadsideUnit(name="corner", x=CORNER[0], y=CORNER[1], antenna_height=5.0, role=5)
    units = RoadsideUnits([corner])
    (start,) = run(PARAMETERS, 0.0)
    signals = {name: np.asarray(value) for name, value in start.items()}
    first, second = units.join(signals), units.join(dict(signals))
    assert all(first[name] is second[name] for name in signals)
    moved = units.join({**signals, "vehicle.position": signals["vehicle.position"] + 1.0})
    assert moved["vehicle.id"] is first["vehicle.id"]
    assert moved["vehicle.position"] is not first["vehicle.position"]
    nobody = RoadsideUnits([]).join(signals)
    assert all(nobody[name] is signals[name] for name in signals)


CORNERS = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)])
"""An L: the union of two rectangles."""
OFF_THE_EDGES = st.floats(-1.0, 5.0).filter(lambda x: min(abs(x - e) for e in (0, 1, 3, 4)) > 1e-9)


@given(OFF_THE_EDGES, OFF_THE_EDGES, st.integers(0, 5), st.sampled_from([1, -1]))
def test_a_polygon_contains_what_its_rectangles_contain(
    x: float, y: float, first: int, way: int
) -> None:
    """Wherever the ring begins and whichever way it goes."""
    ring = np.roll(CORNERS, first, axis=0)
    expected = (0 < x < 4 and 0 < y < 1) or (0 < x < 1 and 0 < y < 3)
    assert contains(ring[::way], x, y) == expected


@dataclass(frozen=True)
class Wrong:
    units: tuple[Entity, ...]
    message: str


@pytest.mark.parametrize(
    "wrong",
    [
        Wrong((unit(14.0, None),), "rsu0.position`: a roadside unit is on no lane; write `x` and"),
        Wrong((unit(*CORNER), unit(None, 9.0)), "rsu1.position`: .*; write `x` and `y`, and"),
        Wrong((unit(None, None),), "rsu0.position`: .*; write `x` and `y`, and nothing else"),
        Wrong((unit(np.nan, 9.0),), "rsu0.position`: `x` and `y` must be finite and within"),
        Wrong((unit(14.0, 2e6),), "rsu0.position`: `x` and `y` must be finite and within"),
        Wrong(
            (unit(*CORNER), unit(*CORNER)),
            r"rsu1.position`: is \(14, 9\) m, the same place as that of `entities.rsu0`; leave",
        ),
    ],
    ids=["only x", "only y", "neither", "not a number", "too far", "twice"],
)
def test_positions_that_are_none_are_refused(wrong: Wrong) -> None:
    with pytest.raises(ComponentTypeError, match=f"`entities.{wrong.message}"):
        SumoTraffic(with_units(*wrong.units))


IN_THE_CORNER_BUILDING = (25.0, 20.0)  # 18 m high
ON_A_LANE = (7.0, -50.0)


@pytest.mark.parametrize(
    "wrong",
    [
        Wrong(
            (unit(*CORNER), unit(*IN_THE_CORNER_BUILDING)),
            r"rsu1`: the roadside unit at \(25, 20\) m is inside a building of 18 m; "
            "move it out, or raise `antenna_height`, 5 m, above the roof",
        ),
        Wrong(
            (unit(*ON_A_LANE, antenna_height=4.0),),
            r"rsu0`: the roadside unit at \(7, -50\) m is on the road, where vehicles are up to "
            "4 m high; move it off the road, or raise `antenna_height`, 4 m, above them",
        ),
        Wrong(
            (unit(0.0, 0.0, antenna_height=3.0),),
            r"rsu0`: the roadside unit at \(0, 0\) m is on the road",
        ),
    ],
    ids=["in a building", "on a lane", "on the crossing"],
)
def test_places_where_no_antenna_can_be_are_refused(wrong: Wrong) -> None:
    with pytest.raises(SumoError, match=f"`entities.{wrong.message}"):
        run(with_units(*wrong.units), 0.0)


@pytest.mark.parametrize(
    ("position", "antenna_height"), [(IN_THE_CORNER_BUILDING, 20.0), (ON_A_LANE, 5.0)]
)
def test_antennas_over_roofs_and_over_the_road_are_not(
    position: tuple[float, float], antenna_height: float
) -> None:
    (start,) = run(with_units(unit(*position, antenna_height=antenna_height)), 0.0)
    assert np.asarray(start["vehicle.antenna_height"])[-1] == antenna_height
