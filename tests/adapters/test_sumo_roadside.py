"""Roadside units: rows of `vehicle.*` that nobody in the traffic knows of."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, strategies as st

from adapters.sumo import SumoTraffic
from adapters.sumo.fleet import Part
from adapters.sumo.roadside import FIRST_NUMBER, RoadsideUnits, contains
from adapters.sumo.simulation import SumoError
from orchestrator.errors import ComponentTypeError
from orchestrator.randomness import stream
from orchestrator.signal import Signals
from orchestrator.testing import check_component

SCENE = Path(__file__).parents[2] / "scenarios" / "assets" / "red_light" / "red_light.sumocfg"
PARAMETERS = SumoTraffic.Parameters(scene=SCENE, spacing=60.0)
CORNER, OVER_THE_LANE = (14.0, 9.0), (7.0, -100.0)  # the latter on the ego's way
UNITS = replace(PARAMETERS, rsu_positions=(CORNER, OVER_THE_LANE))
H = 50_000_000

Float = npt.NDArray[np.float64]


def run(parameters: Any, seconds: float, seed: int = 1) -> list[Signals]:
    """The outputs at each communication point; the ego keeps its speed."""
    traffic = SumoTraffic(parameters)
    try:
        traffic.setup(0, stream(seed, "traffic"))
        outputs = [traffic.outputs()]
        for k in range(round(seconds * 1e9) // H):
            traffic.step({"command": np.zeros(3)}, k * H, H)
            outputs.append(traffic.outputs())
        return outputs
    finally:
        traffic.close()


def test_the_traffic_is_the_same_with_them_and_they_are_there_throughout() -> None:
    """Bit by bit, `ego.gap` too although the ego passes right under one."""
    without, with_them = run(PARAMETERS, 8.0), run(UNITS, 8.0)
    assert np.asarray(without[-1]["ego.position"])[1] > OVER_THE_LANE[1] + 5.0, "passed it"
    for before, after in zip(without, with_them, strict=True):
        for name, expected in before.items():
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
    "role": [Part.ROADSIDE, Part.ROADSIDE],
}


@pytest.mark.parametrize("change", [{"spacing": 30.0}, {"blocking_count": 2}, {"encounter": False}])
def test_their_numbers_depend_on_nobody(change: dict[str, Any]) -> None:
    (start,) = run(replace(UNITS, **change), 0.0, seed=2)
    numbers = np.asarray(start["vehicle.id"])
    assert numbers[-2:].tolist() == ROWS["id"]
    assert (np.diff(numbers) > 0).all()


def test_the_component_keeps_the_contract_with_them() -> None:
    check_component(SumoTraffic(UNITS), steps=5, h=H)


def test_what_did_not_change_stays_the_same_object() -> None:
    """Consumers skip work for signals that are the same object as before."""
    units = RoadsideUnits([CORNER], 5.0)
    (start,) = run(PARAMETERS, 0.0)
    signals = {name: np.asarray(value) for name, value in start.items()}
    first, second = units.join(signals), units.join(dict(signals))
    assert all(first[name] is second[name] for name in signals)
    moved = units.join({**signals, "vehicle.position": signals["vehicle.position"] + 1.0})
    assert moved["vehicle.id"] is first["vehicle.id"]
    assert moved["vehicle.position"] is not first["vehicle.position"]
    nobody = RoadsideUnits([], 5.0).join(signals)
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
    positions: tuple[tuple[float, ...], ...]
    message: str
    antenna_height: float = 5.0


@pytest.mark.parametrize(
    "wrong",
    [
        Wrong(((14.0,),), r"entry 0 is \[14.0\]; write x and y, for example \[14 m, 9 m\]"),
        Wrong((CORNER, (1.0, 2.0, 3.0)), r"entry 1 is \[1.0, 2.0, 3.0\]; write x and y"),
        Wrong(((np.nan, 9.0),), r"entry 0 is \[nan, 9.0\]; x and y must be finite and within"),
        Wrong(((14.0, 1e6),), r"entry 0 is \[14.0, 1000000.0\]; x and y must be finite and within"),
        Wrong((CORNER, CORNER), r"entry 1 is \[14.0, 9.0\], the same place as another one"),
    ],
    ids=lambda wrong: wrong.message[:30],
)
def test_positions_that_are_none_are_refused(wrong: Wrong) -> None:
    with pytest.raises(ComponentTypeError, match=wrong.message):
        SumoTraffic(replace(PARAMETERS, rsu_positions=wrong.positions))


IN_THE_CORNER_BUILDING = (25.0, 20.0)  # 18 m high
ON_A_LANE = (7.0, -50.0)


@pytest.mark.parametrize(
    "wrong",
    [
        Wrong(
            (CORNER, IN_THE_CORNER_BUILDING),
            r"unit 1 at \(25, 20\) m is inside a building of 18 m; move it out, or raise",
        ),
        Wrong(
            (ON_A_LANE,), r"unit 0 at \(7, -50\) m is on the road, where vehicles are up to 4 m", 4
        ),
        Wrong(((0.0, 0.0),), r"unit 0 at \(0, 0\) m is on the road", 3.0),
    ],
    ids=lambda wrong: wrong.message[:30],
)
def test_places_where_no_antenna_can_be_are_refused(wrong: Wrong) -> None:
    parameters = replace(
        PARAMETERS, rsu_positions=wrong.positions, rsu_antenna_height=wrong.antenna_height
    )
    with pytest.raises(SumoError, match=wrong.message):
        run(parameters, 0.0)


@pytest.mark.parametrize(
    ("position", "antenna_height"), [(IN_THE_CORNER_BUILDING, 20.0), (ON_A_LANE, 5.0)]
)
def test_antennas_over_roofs_and_over_the_road_are_not(
    position: tuple[float, float], antenna_height: float
) -> None:
    parameters = replace(PARAMETERS, rsu_positions=(position,), rsu_antenna_height=antenna_height)
    (start,) = run(parameters, 0.0)
    assert np.asarray(start["vehicle.antenna_height"])[-1] == antenna_height
