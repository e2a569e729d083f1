"""Whose scans are processed changes what is told of other vehicles, and nothing of the ego."""

import numpy as np
import pytest

from fmus.messages.apm import join
from tests.fmus.driver import Library

from .harness import Outputs, Perception
from .scene import Scan, car, cloud, ground, look

ALL, EGO = 1, 2  # values of `scans`
VEHICLES = (1, 2, 3)
ROUTE = np.array([[9.0, 2.0], [60.0, 2.0]])
COUNTED = {"benefit_threshold": 1.0}
SEEN = {"index": 2, "seen_benefit_threshold": 1.0}


def scans(k: int, vehicles: tuple[int, ...] = VEHICLES) -> bytes:
    """Scan `k` of vehicles that see each other's surroundings: two cars, and the road."""
    found = []
    for vehicle in vehicles:
        origin = (9.0 * vehicle, 2.0)
        boxes = [car(5, 14 - 0.9 * k, 7), car(6, 20 + 1.3 * k, -5, height=3.0)]
        seen = look(vehicle, origin, boxes, time=k * 10**8)
        floor = ground(-30.0, 40.0) + np.array([*origin, 0.0])
        points = np.concatenate([seen.points, floor[vehicle::3]])
        labels = np.concatenate([np.asarray(seen.instances), np.zeros(len(floor[vehicle::3]), int)])
        found.append(Scan(vehicle=vehicle, points=points, instances=labels, time=k * 10**8,
                          position=seen.position))  # fmt: skip
    return cloud(*found)


def demand(outputs: Outputs) -> tuple[bytes, ...]:
    """The blind zones and the match."""
    found = (outputs.centers, outputs.ranges, outputs.sharers, outputs.benefits)
    return (*(array.tobytes() for array in found), bytes([outputs.trigger]))


@pytest.mark.parametrize("settings", [COUNTED, SEEN])
def test_zones_and_matches_are_the_same_bytes(library: Library, settings: dict[str, float]) -> None:
    """For each of three egos, over scans in which it, and then others, are missing."""
    triggers = set()
    for ego in (*VEHICLES, -1):
        everyone = Perception(library, scans=ALL, **settings)
        alone = Perception(library, scans=EGO, **settings)
        with everyone, alone:
            received = b""
            for k in range(12):
                absent = {4: {ego}, 7: set(VEHICLES) - {ego}}.get(k, set())
                given = scans(k, tuple(v for v in VEHICLES if v not in absent))
                full = everyone.step(given, received, ego, ROUTE)
                own = alone.step(given, received, ego, ROUTE)
                assert demand(own) == demand(full), (ego, k)
                triggers.add((full.trigger, len(full.ranges) > 0))
                received = join([m for m, apm in zip(full.messages, full.apms, strict=True)
                                 if apm.vehicle != ego])  # fmt: skip
    assert {(True, True), (False, False)} <= triggers


def test_apms_and_objects_are_those_of_the_ego(library: Library) -> None:
    with Perception(library, scans=ALL) as everyone, Perception(library, scans=EGO) as alone:
        for k in range(4):
            full, own = (unit.step(scans(k), ego=2) for unit in (everyone, alone))
            assert [apm.vehicle for apm in full.apms] == list(VEHICLES)
            mine = [m for m, a in zip(full.messages, full.apms, strict=True) if a.vehicle == 2]
            assert own.messages == mine
            objects, found = full.objects[full.objects["sensor"] == 2], own.objects
            assert len(found) == len(objects) > 0
            for field in set(found.dtype.names or ()) - {"instance"}:  # counted over all sensors
                np.testing.assert_array_equal(found[field], objects[field])


def test_without_an_ego_no_scan_is_processed(library: Library) -> None:
    with Perception(library, scans=EGO) as unit:
        found = unit.step(scans(0), ego=-1)
        assert (found.messages, len(found.objects)) == ([], 0)
        found = unit.step(scans(1), ego=2)
        assert [apm.vehicle for apm in found.apms] == [2]


def test_all_scans_are_processed_unless_it_is_said(library: Library) -> None:
    with Perception(library) as silent, Perception(library, scans=ALL) as said:
        for k in range(3):
            left, right = (unit.step(scans(k), ego=1) for unit in (silent, said))
            assert left.apms_signal == right.apms_signal
            assert left.objects_signal == right.objects_signal
