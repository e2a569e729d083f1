"""The facilities layer: nothing counts that the channel did not deliver."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.facilities import Facilities
from fmus.facilities.outbox import Message, Outbox
from fmus.messages.apm import join, split
from fmus.messages.records import (
    APM,
    BSM,
    NO_VEHICLE,
    OBJECT,
    PACKET,
    REQUEST,
    SENSOR_DATA,
    unframe,
)
from orchestrator.testing import check_component
from tests.fmus.facilities.world import (
    EGO,
    RELAY,
    SHARER,
    H,
    Run,
    apm_of,
    delivered,
    objects_of,
)


def facilities(**parameters: Any) -> Run:
    return Run(Facilities(Facilities.Parameters(**parameters)))


def test_every_equipped_vehicle_sends_one_bsm_per_period_at_a_phase_of_its_own() -> None:
    run = facilities()
    sent = np.concatenate([run.step() for _ in range(50)])
    bsms = sent[sent["kind"] == BSM]
    for vehicle in (EGO, SHARER, RELAY):
        times = bsms["time"][bsms["source"] == vehicle]
        assert set(np.diff(times)) == {100_000_000}
        assert len(times) == 5
    assert len({int(t) % 100_000_000 for t in bsms["time"]}) == 3


def test_a_vehicle_without_a_radio_is_silent() -> None:
    run = facilities()
    silent = np.array([True, False, True])
    steps = [run.step(vehicle__equipped=silent, apms=join([apm_of(SHARER)])) for _ in range(20)]
    assert SHARER not in np.concatenate(steps)["source"]


def test_packets_become_ready_within_the_next_step() -> None:
    run = facilities()
    for _ in range(30):
        packets = run.step(apms=join([apm_of(SHARER)]))
        assert ((packets["time"] >= run.t) & (packets["time"] < run.t + H)).all()
        assert (np.diff(packets["time"]) >= 0).all()


def test_a_received_bsm_says_what_was_sent_and_ages() -> None:
    run = facilities()
    while True:
        packets = run.step()
        mine = packets[packets["source"] == RELAY]
        if len(mine):
            break
    run.step(receptions=delivered(mine, EGO))
    np.testing.assert_array_equal(run.output("received.bsm.id"), [RELAY])
    np.testing.assert_array_equal(run.output("received.bsm.position"), [[20.0, 20.0]])
    age = float(run.output("received.bsm.age")[0])
    run.step()
    assert float(run.output("received.bsm.age")[0]) == pytest.approx(age + 0.01)
    for _ in range(110):
        run.step()
    assert len(run.output("received.bsm.id")) == 0


@pytest.mark.parametrize("outcome", list("NCBTU"))
def test_a_lost_packet_has_no_effect(outcome: str) -> None:
    run = facilities()
    first = run.step(apms=join([apm_of(SHARER)]))
    run.step(receptions=delivered(first, EGO, outcome))
    assert len(run.output("received.bsm.id")) == 0
    assert split(run.output("received.apms")) == []


def test_an_overheard_packet_has_no_effect() -> None:
    run = facilities()
    first = run.step(apms=join([apm_of(SHARER)]))
    run.step(receptions=delivered(first, EGO, addressed=0))
    assert split(run.output("received.apms")) == []


def test_an_apm_arrives_when_its_last_fragment_does() -> None:
    run = facilities(fragment_size=600)
    packets = run.step(apms=join([apm_of(SHARER)]))
    fragments = packets[packets["kind"] == APM]
    assert len(fragments) == 3
    assert fragments["size"].sum() == len(apm_of(SHARER))
    run.step(receptions=delivered(fragments[:2], EGO))
    assert split(run.output("received.apms")) == []
    run.step(receptions=delivered(fragments[2:], EGO))
    assert split(run.output("received.apms")) == [apm_of(SHARER)]


@pytest.mark.parametrize("missing", range(3))
def test_a_lost_apm_is_not_used(missing: int) -> None:
    """One fragment lost on the air: the older APM stays what the ego knows, then nothing."""
    run = facilities(fragment_size=600)
    first = run.step(apms=join([apm_of(SHARER)]))
    run.step(receptions=delivered(first[first["kind"] == APM], EGO))
    newer = apm_of(SHARER, time=100)
    packets = run.step(apms=join([newer]))
    fragments = packets[packets["kind"] == APM]
    arrived = np.arange(len(fragments)) != missing
    reports = [delivered(fragments[arrived], EGO), delivered(fragments[~arrived], EGO, "N")]
    for report in reports:
        run.step(receptions=report)
        assert split(run.output("received.apms")) == [apm_of(SHARER)]
    for _ in range(110):
        run.step()
    assert split(run.output("received.apms")) == []


def test_lost_sensor_data_are_not_used() -> None:
    run = facilities(sensor_data_size=3000)
    request = run.step(match__trigger=np.array(True))
    request = request[request["kind"] == REQUEST]
    packets = run.step(objects=objects_of(SHARER, 1), receptions=delivered(request, SHARER))
    data = packets[packets["kind"] == SENSOR_DATA]
    assert len(data) == 3
    run.step(receptions=delivered(data[1:], EGO))
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 0


def test_sensor_data_need_a_request_that_arrived() -> None:
    """The whole exchange: trigger, request, session, data, objects at the ego."""
    run = facilities()
    packets = run.step(match__trigger=np.array(True))
    request = packets[packets["kind"] == REQUEST]
    assert request["destination"].tolist() == [SHARER]
    packets = run.step(objects=objects_of(SHARER, run.t))
    assert SENSOR_DATA not in packets["kind"]
    packets = run.step(objects=objects_of(SHARER, run.t), receptions=delivered(request, SHARER))
    data = packets[packets["kind"] == SENSOR_DATA]
    assert data["source"].tolist() == [SHARER]
    assert data["destination"].tolist() == [EGO]
    run.step(receptions=delivered(data, EGO))
    rows = unframe("OBJS", run.output("received.objects"), OBJECT)
    assert rows["instance"].tolist() == [99, 98]


def test_data_take_the_route_in_the_request_and_end_with_the_session() -> None:
    run = facilities(session=0.5)
    request = run.step(match__trigger=np.array(True), relay=np.array(RELAY))
    request = request[request["kind"] == REQUEST]
    assert request["route"].tolist() == [[RELAY, NO_VEHICLE]]
    packets = run.step(objects=objects_of(SHARER, 1), receptions=delivered(request, SHARER))
    data = packets[packets["kind"] == SENSOR_DATA]
    assert data["route"].tolist() == [[RELAY, NO_VEHICLE]]
    for _ in range(60):
        run.step()
    assert SENSOR_DATA not in run.step(objects=objects_of(SHARER, 2))["kind"]


def test_a_sharer_in_a_relayed_session_sends_its_apm_along_the_route_too() -> None:
    run = facilities()
    request = run.step(match__trigger=np.array(True), relay=np.array(RELAY))
    run.step(receptions=delivered(request[request["kind"] == REQUEST], SHARER))
    packets = run.step(apms=join([apm_of(SHARER), apm_of(EGO)]))
    apms = packets[packets["kind"] == APM]
    routed = apms[apms["destination"] == EGO]
    assert set(apms["source"][apms["destination"] == NO_VEHICLE]) == {SHARER, EGO}
    assert set(routed["source"]) == {SHARER}
    assert (routed["route"] == [RELAY, NO_VEHICLE]).all()
    run.step(receptions=delivered(routed, EGO))
    assert split(run.output("received.apms")) == [apm_of(SHARER)]


def test_what_the_relay_receives_is_not_yet_received_by_the_ego() -> None:
    run = facilities()
    request = run.step(match__trigger=np.array(True), relay=np.array(RELAY))
    request = request[request["kind"] == REQUEST]
    packets = run.step(objects=objects_of(SHARER, 1), receptions=delivered(request, RELAY))
    assert SENSOR_DATA not in packets["kind"]


@settings(deadline=None)
@given(sizes=st.lists(st.integers(1, 5000), max_size=8), fragment=st.integers(1, 1500))
def test_fragments_sum_up_to_the_message_and_have_ascending_ids(
    sizes: list[int], fragment: int
) -> None:
    outbox = Outbox(fragment, 10)
    messages = [
        Message(kind=APM, time=k, source=1, size=size, content=b"") for k, size in enumerate(sizes)
    ]
    rows = unframe("PKTS", outbox.send(messages), PACKET)
    assert rows["id"].tolist() == list(range(len(rows)))
    assert (rows["size"] <= fragment).all()
    for k, size in enumerate(sizes):
        assert rows["size"][rows["time"] == k].sum() == size


def test_contract() -> None:
    check_component(Facilities(Facilities.Parameters()), steps=30, h=H, seed=1)


def test_packets_of_sensor_data_are_counted_where_they_reach_the_ego() -> None:
    """Fragments count one by one, and none that was lost, overheard, or stays with a relay."""
    run = facilities(sensor_data_size=3000, fragment_size=1400)
    asked = run.step(match__trigger=np.array(True))
    request = asked[asked["kind"] == REQUEST]
    sent = run.step(receptions=delivered(request, SHARER), objects=objects_of(SHARER))
    data = sent[sent["kind"] == SENSOR_DATA]
    assert len(data) == 3
    count = "received.sensor_data.count"
    for packets, receiver, outcome, addressed in (
        (data, RELAY, "R", 1),
        (data, EGO, "N", 1),
        (data, EGO, "R", 0),
    ):
        run.step(receptions=delivered(packets, receiver, outcome, addressed))
        assert run.output(count) == 0
    run.step(receptions=delivered(data[:2], EGO))
    assert run.output(count) == 2
    run.step(receptions=delivered(data[2:], EGO))
    run.step()
    assert (run.output(count), run.output(count).dtype) == (3, np.int64)
