"""Who is the best sharer, and what another one costs, where it can be computed by hand.

A wall 20 m ahead hides 9 m by 4 m of road, 36 m^2, from the requester. Of three candidates one
stands 33 m away and sees all of it but what is below its lowest beam; one stands 55 m away and sees
the half that another wall leaves it; one stands before the wall and sees nothing of it.
"""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon

from fmus.messages.apm import Apm, encode, join
from fmus.messages.connectors import outputs
from fmus.messages.records import APM_CELL, NO_VEHICLE
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.recording import RecordingError
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent
from studies.sharing.choice import SharerChoice, compare
from studies.verification.perception.scene import Building, Scene, Vehicle
from studies.verification.perception.truth import Interest, Truth, find_truth

EGO, FULL, HALF, NONE, CAR = 1, 2, 3, 4, 5
POLE = (0.001, 0.001, 1.5)
"""So thin that nobody hides anything; the sensor is 2 m high."""
HAIR = 0.02
"""More road than their shadows take [m^2]."""
PLACES = {EGO: (0.0, 0.0), FULL: (33.0, 0.0), HALF: (55.0, 0.0), NONE: (10.0, 1.0)}
HIDDEN_CAR = (25.0, -1.0)
WALLS = (((20.0, -10.0), (21.0, -10.0), (21.0, 10.0), (20.0, 10.0)),
         ((36.0, 0.0), (37.0, 0.0), (37.0, 10.0), (36.0, 10.0)))  # fmt: skip
ROADS = ((6.0, -2.0, 20.0, 2.0), (21.0, -2.0, 30.0, 2.0))
INTEREST = Interest(corridor=25.0, horizon=35.0)


def nearest_ring() -> float:
    """What lies below the lowest beam of the nearer candidate of the hidden road [m^2]."""
    radius = 2.0 / math.tan(math.radians(20.0))
    circle = 2.0 * math.sqrt(radius**2 - 4.0) + radius**2 * math.asin(2.0 / radius)
    return circle - 3.0 * 4.0


HALF_AREA = 18.0
FULL_AREA = 36.0 - nearest_ring()


def truth(*, car: bool = False) -> Truth:
    vehicles = [
        Vehicle(id=one, position=place, heading=0.0, size=POLE, body=3)
        for one, place in PLACES.items()
    ]
    if car:
        thin = Vehicle(id=CAR, position=HIDDEN_CAR, heading=0.0, size=POLE, body=3)
        vehicles.append(thin)
    return find_truth(
        Scene(
            road=cast("Polygon", shapely.union_all([shapely.box(*road) for road in ROADS])),
            buildings=[Building(ring=ring, height=10.0) for ring in WALLS],
            vehicles=vehicles,
            ego=EGO,
            candidates=[FULL, HALF, NONE],
            route=np.array([[0.0, 0.0], [60.0, 0.0]]),
            description="three candidates",
        ),
        INTEREST,
    )


def test_what_each_candidate_reveals() -> None:
    found = truth()
    assert found.hidden.area == pytest.approx(36.0, rel=1e-3)
    assert found.areas[FULL] == pytest.approx(FULL_AREA, rel=2e-3)
    assert found.areas[HALF] == pytest.approx(HALF_AREA, rel=2e-3)
    assert found.areas[NONE] < HAIR


@pytest.mark.parametrize(
    ("chosen", "revealed"),
    [(FULL, FULL_AREA), (HALF, HALF_AREA), (NONE, 0.0), (NO_VEHICLE, 0.0), (99, 0.0)],
)
def test_what_a_choice_reveals_beside_the_best(chosen: int, revealed: float) -> None:
    look = compare(2_000_000_000, truth(), chosen=chosen, heard=[HALF, 99], nearest=NONE)
    assert look.time == 2.0
    assert look.best == FULL
    assert (look.candidates, look.heard) == (3, 1)
    assert look.revealed == pytest.approx(revealed, rel=2e-3, abs=HAIR)
    assert look.most == pytest.approx(FULL_AREA, rel=2e-3)
    assert look.most_heard == pytest.approx(HALF_AREA, rel=2e-3)
    assert look.nearest < HAIR
    assert look.mean == pytest.approx((FULL_AREA + HALF_AREA) / 3, rel=2e-3)
    # the half that the far one sees has the half of the ring that the near one does not see
    assert look.all == pytest.approx(36.0 - nearest_ring() / 2, rel=2e-3)


@pytest.mark.parametrize(("chosen", "told"), [(FULL, 1), (HALF, 1), (NONE, 0), (NO_VEHICLE, 0)])
def test_who_tells_of_the_hidden_car(chosen: int, told: int) -> None:
    look = compare(0, truth(car=True), chosen=chosen, heard=[], nearest=NONE)
    assert look.hidden_vehicles == 1
    assert (look.told, look.told_all) == (told, 1)


def test_without_candidates_there_is_nothing_to_choose() -> None:
    alone = Truth(
        interest=shapely.box(0, 0, 1, 1),
        hidden=shapely.box(0, 0, 1, 1),
        known={},
        revealed={},
        hidden_vehicles=set(),
        seen={},
    )
    look = compare(0, alone, chosen=NO_VEHICLE, heard=[7], nearest=None)
    assert (look.candidates, look.heard, look.best) == (0, 0, NO_VEHICLE)
    assert (look.most, look.all, look.mean, look.nearest) == (0.0, 0.0, 0.0, 0.0)


def matrix(vehicle: int) -> bytes:
    place = np.array(PLACES[vehicle])
    cells = np.zeros((2, 2), APM_CELL)
    return encode(
        Apm(
            vehicle=vehicle,
            time=0,
            position=place,
            heading=0.0,
            center=place,
            cell=5.0,
            cells=cells,
        )
    )


_ROAD = {
    "road.vertex": Connector(causality=Causality.OUTPUT, shape=("road_vertex", 2), unit="m"),
    "road.index": Connector(causality=Causality.OUTPUT, shape=("road_vertex",), dtype=np.int32),
}


def _rings(name: str, rings: Any) -> Signals:
    return {
        f"{name}.vertex": np.array([corner for ring in rings for corner in ring], float),
        f"{name}.index": np.repeat(np.arange(len(rings), dtype=np.int32), 4),
    }


def _unit(own: dict[str, Connector], values: Callable[[int], Signals]) -> FunctionComponent:
    return FunctionComponent(own, lambda state, inputs, t: (None, values(t)))


def record(folder: Path, sharers: list[int], heard: list[int], **without: bool) -> Recording:
    """Three seconds of the scene above, in which the match says `sharers[k]` in second k."""
    ids = list(PLACES)
    scene = {
        "vehicle.id": np.array(ids, np.int64),
        "vehicle.position": np.array([(*PLACES[one], 0.0) for one in ids]),
        "vehicle.heading": np.zeros(4),
        "vehicle.size": np.array([POLE] * 4),
        "vehicle.body": np.full(4, 3, np.int32),
        "vehicle.lidar": np.array([True] * 3 + [not without.get("third")]),
        "vehicle.equipped": np.array([True] * 4),
        "ego.id": np.array(EGO),
        "ego.route": np.array([[0.0, 0.0], [60.0, 0.0]]),
        **_rings("building", WALLS),
        "building.height": np.array([10.0, 10.0]),
        **_rings("road", [tuple(shapely.box(*r).exterior.coords)[:4] for r in ROADS]),
    }

    def perception(t: int) -> Signals:
        now = sharers[min(t // 1_000_000_000, len(sharers) - 1)]
        return {"match.sharer": np.array([now, NO_VEHICLE], np.int64)}

    received = join([matrix(one) for one in heard])
    plain = [name for name in scene if not name.startswith("road")]
    units = {
        "traffic": ({**outputs(*plain), **_ROAD}, lambda _: scene),
        "perception": (outputs("match.sharer"), perception),
        "facilities": (outputs("received.apms"), lambda _: {"received.apms": received}),
    }
    system = System(
        {name: _unit(own, values) for name, (own, values) in units.items()},
        dict.fromkeys(units, 100_000_000),
        [],
    )
    recorder = Recorder(folder, manifest={"scenario": {"components": {}}})
    simulate(system, Jacobi(), start=0, stop=3_500_000_000, seed=0, observers=[recorder])
    return Recording(folder)


def test_shares_and_regrets_over_a_run(tmp_path: Path) -> None:
    """At 1, 2 and 3 s the best, the half and nobody is chosen; the best one was not heard."""
    run = record(tmp_path / "run", [NONE, FULL, HALF, NO_VEHICLE], [HALF, NONE])
    answer = SharerChoice(interval=1.0).compute(run)
    half = 1 - HALF_AREA / FULL_AREA
    expected = {
        "looks": 3,
        "wanted": 3,
        "candidates": 3.0,
        "hidden_m2": 36.0,
        "most_m2": FULL_AREA,
        "revealed_m2": (FULL_AREA + HALF_AREA) / 3,
        "best": 1 / 3,
        "right": 1 / 3,
        "missed": 1 / 3,
        "regret": (half + 1) / 3,
        "regret_unheard": half,
        "regret_nearest": 1.0,
        "regret_random": 1 - (1 + HALF_AREA / FULL_AREA) / 3,
        "heard": 2 / 3,
    }
    for name, value in expected.items():
        assert answer.numbers[name] == pytest.approx(value, rel=3e-3), name
    assert answer.tables["looks"]["chosen"].tolist() == [FULL, HALF, NO_VEHICLE]
    assert answer.tables["looks"]["time"].tolist() == [1.0, 2.0, 3.0]


def test_without_matrices_the_choice_has_no_numbers(tmp_path: Path) -> None:
    answer = SharerChoice(interval=1.0).compute(record(tmp_path / "run", [NO_VEHICLE], []))
    assert answer.numbers["regret"] is None
    assert answer.numbers["missed"] is None
    assert answer.numbers["most_m2"] == pytest.approx(FULL_AREA, rel=3e-3)


@pytest.mark.parametrize(("demand", "wanted"), [(FULL_AREA - 0.1, 3), (FULL_AREA + 0.1, 0)])
def test_looks_at_which_nobody_reveals_enough_do_not_count(
    tmp_path: Path, demand: float, wanted: int
) -> None:
    run = record(tmp_path / "run", [FULL], [FULL])
    numbers = SharerChoice(interval=1.0, demand=demand).compute(run).numbers
    assert (numbers["looks"], numbers["wanted"]) == (3, wanted)
    assert (numbers["regret"] is None) == (wanted == 0)


def test_who_has_no_lidar_is_no_candidate(tmp_path: Path) -> None:
    run = record(tmp_path / "run", [FULL], [FULL], third=True)
    assert SharerChoice(interval=1.0).compute(run).numbers["candidates"] == 2.0


def test_a_signal_that_was_not_recorded_is_named(tmp_path: Path) -> None:
    run = record(tmp_path / "run", [FULL], [FULL])
    with pytest.raises(RecordingError, match=r"`elsewhere.sharer`"):
        SharerChoice(match="elsewhere").compute(run)
