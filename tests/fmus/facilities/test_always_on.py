"""Always-on sharing: everybody's data after every scan, asked for or not."""

from typing import Any

import numpy as np
import pytest

from fmus.facilities import AlwaysOnFacilities
from fmus.messages.apm import join, split
from fmus.messages.records import BSM, NO_VEHICLE, OBJECT, SENSOR_DATA, unframe
from orchestrator.testing import check_component
from tests.fmus.facilities.world import EGO, RELAY, SHARER, H, Run, apm_of, delivered, objects_of


def always_on(**parameters: Any) -> Run:
    return Run(AlwaysOnFacilities(AlwaysOnFacilities.Parameters(**parameters)))


def data_in(packets: Any) -> Any:
    return packets[packets["kind"] == SENSOR_DATA]


def test_every_scan_of_every_lidar_is_broadcast_once_and_nothing_else_is() -> None:
    run = always_on()
    sent = []
    for scan in range(5):
        signals = {"apms": join([apm_of(SHARER, scan), apm_of(EGO, scan)])}
        sent += [run.step(objects=objects_of(SHARER, scan), **signals) for _ in range(10)]
    packets = np.concatenate(sent)
    assert set(packets["kind"]) == {BSM, SENSOR_DATA}
    data = data_in(packets)
    assert data["source"].tolist().count(SHARER) == data["source"].tolist().count(EGO) == 5
    assert (data["destination"] == NO_VEHICLE).all()
    assert (data["route"] == NO_VEHICLE).all()
    assert (data["size"] == 200).all()


def test_a_trigger_changes_nothing() -> None:
    quiet, triggered = always_on(), always_on()
    for scan in range(3):
        apms = join([apm_of(SHARER, scan)])
        a = quiet.step(apms=apms)
        b = triggered.step(apms=apms, match__trigger=np.array(True), relay=np.array(RELAY))
        np.testing.assert_array_equal(a, b)


def test_a_lidar_without_a_radio_shares_nothing() -> None:
    silent = np.array([True, False, True])
    packets = always_on().step(apms=join([apm_of(SHARER)]), vehicle__equipped=silent)
    assert len(data_in(packets)) == 0


def test_real_features_go_as_fragments_and_count_only_together() -> None:
    run = always_on(sensor_data_size=67_072)
    data = data_in(run.step(objects=objects_of(SHARER, 1)))
    assert len(data) == 48
    assert data["size"].sum() == 67_072
    run.step(receptions=delivered(data[:-1], EGO))
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 0
    run.step(receptions=delivered(data[-1:], EGO))
    rows = unframe("OBJS", run.output("received.objects"), OBJECT)
    assert rows["instance"].tolist() == [99, 98]
    assert split(run.output("received.apms")) == []


def test_what_the_ego_received_is_forgotten_after_a_while() -> None:
    run = always_on(maximum_age=0.1)
    data = data_in(run.step(objects=objects_of(SHARER, run.t)))
    run.step(receptions=delivered(data, EGO))
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 2
    for _ in range(10):
        run.step()
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 0


@pytest.mark.parametrize("outcome", list("NCBTU"))
def test_lost_data_have_no_effect(outcome: str) -> None:
    run = always_on()
    data = data_in(run.step(objects=objects_of(SHARER, 1)))
    run.step(receptions=delivered(data, EGO, outcome))
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 0


def test_contract() -> None:
    component = AlwaysOnFacilities(AlwaysOnFacilities.Parameters())
    check_component(component, steps=30, h=H, seed=1)
