"""The two loads: a probe per scan, or all packets of a network's features."""

from typing import Any

import numpy as np
import pytest

from fmus.facilities.always_on import AlwaysOnFacilities
from fmus.facilities.demand_driven import Facilities
from fmus.messages.records import OBJECT, REQUEST, SENSOR_DATA, unframe
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array
from tests.fmus.facilities.world import EGO, SHARER, Run, delivered, objects_of

LONGEST = 1400


def answer(**parameters: Any) -> tuple[Run, Array]:
    """The packets of the sensor data of one scan, asked for by the ego."""
    run = Run(Facilities(Facilities.Parameters(**parameters)))
    request = run.step(match__trigger=np.array(True))
    heard = delivered(request[request["kind"] == REQUEST], SHARER)
    packets = run.step(objects=objects_of(SHARER, 1), receptions=heard)
    return run, packets[packets["kind"] == SENSOR_DATA]


@pytest.mark.parametrize(
    ("parameters", "size"),
    [
        ({}, 200),
        ({"load": "probe"}, 200),
        ({"load": "full"}, 33_152),
        ({"load": "full", "compression": 16}, 67_072),
        ({"sensor_data_size": 3000}, 3000),
    ],
    ids=str,
)
def test_a_scan_has_the_bytes_of_its_load_in_packets_that_differ_by_one_byte(
    parameters: dict[str, Any], size: int
) -> None:
    _, packets = answer(**parameters)
    assert packets["size"].sum() == size
    assert len(packets) == -(-size // LONGEST)
    assert np.ptp(packets["size"]) <= 1
    assert len(np.unique(packets["time"])) == 1, "one message: so records tell whole ones apart"


@pytest.mark.parametrize("lost", [0, 11, 23])
def test_features_are_useful_only_whole(lost: int) -> None:
    run, packets = answer(load="full")
    run.step(receptions=delivered(np.delete(packets, lost), EGO))
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 0
    run.step(receptions=delivered(packets[lost : lost + 1], EGO))
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 2


def test_always_on_sharing_has_the_same_loads() -> None:
    run = Run(AlwaysOnFacilities(AlwaysOnFacilities.Parameters(load="full")))
    packets = run.step(objects=objects_of(SHARER, 1))
    assert packets["size"][packets["kind"] == SENSOR_DATA].sum() == 33_152


@pytest.mark.parametrize("component", [Facilities, AlwaysOnFacilities])
@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"compression": 8}, "`compression` is 8; it can be 32 or 16; set `sensor_data_size`"),
        (
            {"load": "full", "sensor_data_size": 500},
            "`load: full` and `sensor_data_size`, 500 B, both say how large sensor data are; leave",
        ),
    ],
)
def test_contradictions_are_refused(
    component: Any, parameters: dict[str, Any], message: str
) -> None:
    with pytest.raises(ComponentTypeError, match=message):
        component(component.Parameters(**parameters))
