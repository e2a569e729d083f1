"""The collective perception service: when CPMs go out, how long, and what the ego makes of them."""

from typing import Any

import numpy as np
import pytest

from fmus.facilities import CpmFacilities, cpm
from fmus.facilities.lower_layers import LowerLayers
from fmus.messages.apm import join, split
from fmus.messages.records import BSM, NO_VEHICLE, OBJECT, SENSOR_DATA, frame, unframe
from orchestrator.errors import ComponentTypeError
from orchestrator.testing import check_component
from tests.fmus.boxes import put
from tests.fmus.facilities.world import EGO, SHARER, H, Run, apm_of, delivered

pytest.importorskip("asn1tools", reason="the extra `cpm` is not installed")

SCAN = 10
"""Steps between two scans: 100 ms."""
SIGNED = LowerLayers(signed=True, certificate_size=157)


def service(**parameters: Any) -> Run:
    return Run(CpmFacilities(CpmFacilities.Parameters(**parameters)))


def seen(count: int, time: int, x: float = 0.0) -> bytes:
    """`count` cars in the sharer's view, all at `x`."""
    rows = np.zeros(count, OBJECT)
    rows["sensor"], rows["time"], rows["instance"] = SHARER, time, np.arange(100, 100 + count)
    rows["points"], rows["height"] = 50, 1.5
    put(rows, [x, 1.0], [x + 4.5, 2.8])
    return frame("OBJS", rows)


def cpms(run: Run, seconds: float, count: int = 1, speed: float = 0.0) -> Any:
    """The CPM packets of that time, while the sharer sees `count` cars that drive at `speed`."""
    sent = []
    for _ in range(round(seconds * 100)):
        scan = run.t // (SCAN * H) * SCAN * H
        objects = seen(count, scan, speed * scan / 1e9)
        packets = run.step(apms=join([apm_of(SHARER, scan)]), objects=objects)
        sent.append(packets[packets["kind"] == SENSOR_DATA])
    return np.concatenate(sent)


def contents(run: Run, packets: Any) -> list[cpm.Cpm]:
    outbox = run.component._outbox  # type: ignore[attr-defined]
    return [cpm.decode(outbox._by_packet[int(p)].message.content) for p in packets["id"]]


def test_a_vehicle_that_sees_nothing_sends_one_message_per_second_with_sensor_information() -> None:
    run = service(maximum_age=100.0)
    packets = cpms(run, 5.0, count=0)
    assert len(packets) == 5
    assert np.diff(packets["time"]) == pytest.approx(1e9, abs=1.1e7)
    for message in contents(run, packets):
        assert len(message.objects) == 0
        assert message.sensor_range == 50.0


def test_a_car_at_rest_is_sent_once_per_second() -> None:
    run = service(maximum_age=100.0)
    messages = contents(run, cpms(run, 3.0))
    assert [len(m.objects) for m in messages] == [1, 1, 1]
    assert [m.sensor_range for m in messages] == [50.0, 50.0, 50.0]


@pytest.mark.parametrize(("speed", "each"), [(3.0, 10), (7.0, 6), (15.0, 3), (50.0, 1)])
def test_a_moving_car_is_sent_each_four_metres(speed: float, each: int) -> None:
    """So many generation events of 100 ms lie between two inclusions."""
    run = service(maximum_age=100.0)
    cpms(run, 2.0, speed=speed)
    messages = [m for m in contents(run, cpms(run, 4.0, speed=speed)) if len(m.objects)]
    gaps = np.diff([m.time for m in messages]) / 1e8
    assert set(gaps) <= {each - 1, each, each + 1}
    assert np.median(gaps) == pytest.approx(each, abs=0.5)


@pytest.mark.parametrize("period", [0.1, 0.2, 0.5, 1.0])
def test_no_vehicle_sends_more_often_than_its_generation_period(period: float) -> None:
    run = service(maximum_age=100.0, generation_period=period)
    times = [m.time for m in contents(run, cpms(run, 5.0, speed=60.0))]
    assert len(times) == 5.0 / period
    assert set(np.diff(times)) == {round(period * 1e9)}


def test_packets_are_as_long_as_the_encoding_and_the_headers_make_them() -> None:
    run = service(maximum_age=100.0)
    packets = cpms(run, 3.0, count=3, speed=10.0)
    certified = []
    for packet, message in zip(packets, contents(run, packets), strict=True):
        sizes = [SIGNED.size(len(cpm.encode(message)), certificate=c) for c in (False, True)]
        certified.append(sizes.index(packet["size"]))
        assert packet["destination"] == NO_VEHICLE
    assert sum(certified) == 3  # one certificate per second
    assert certified[0] == 1


def test_unsigned_messages_are_shorter() -> None:
    signed, plain = service(), service(signed=False)
    assert cpms(signed, 0.2)["size"].sum() - cpms(plain, 0.2)["size"].sum() > 94


def test_many_objects_go_in_segments_that_fit_into_a_packet() -> None:
    run = service(maximum_age=100.0)
    packets = cpms(run, 0.2, count=100)
    messages = sorted(contents(run, packets), key=lambda m: m.segment.number if m.segment else 0)
    assert (packets["size"] <= 1400).all()
    assert [m.segment for m in messages] == [cpm.Segment(number=k, total=4) for k in range(1, 5)]
    numbers = np.concatenate([m.objects["instance"] for m in messages])
    assert sorted(numbers) == list(range(100, 200))
    assert {m.perceived for m in messages} == {100}
    assert [m.sensor_range is not None for m in messages] == [True, False, False, False]


def test_a_lost_segment_takes_only_its_objects_with_it() -> None:
    run = service()
    packets = cpms(run, 0.2, count=100)
    run.step(receptions=delivered(packets[1:], EGO))
    rows = unframe("OBJS", run.output("received.objects"), OBJECT)
    assert len(rows) == 100 - 33


@pytest.mark.parametrize("outcome", list("NCBTU"))
def test_a_lost_message_has_no_effect(outcome: str) -> None:
    run = service()
    run.step(receptions=delivered(cpms(run, 0.2), EGO, outcome))
    assert run.output("received.objects") == frame("OBJS", np.empty(0, OBJECT))


def test_the_ego_knows_what_the_message_says_and_no_more() -> None:
    run = service()
    run.step(receptions=delivered(cpms(run, 0.2, speed=7.0), EGO))
    (row,) = unframe("OBJS", run.output("received.objects"), OBJECT)
    assert (row["sensor"], row["instance"], row["points"]) == (SHARER, 100, 0)
    assert row["size"] == pytest.approx([4.5, 1.8])
    assert row["height"] == pytest.approx(1.5)
    assert split(run.output("received.apms")) == []


def test_an_object_stays_known_until_it_is_too_old_though_messages_leave_it_out() -> None:
    """The first message has two cars; the car at rest is not in the following ones."""
    run = service(maximum_age=0.5)

    def step(scan: int, report: bytes = b"") -> Any:
        table = np.array(unframe("OBJS", seen(2, scan), OBJECT))
        table["position"][1] += [5.0 * scan / 1e8, 0.0]
        packets = run.step(objects=frame("OBJS", table), receptions=report)
        return packets[packets["kind"] == SENSOR_DATA]

    report, known = b"", []
    for k in range(80):
        packets = step(k // SCAN * SCAN * H, report)
        report = delivered(packets, EGO) if len(packets) else report
        rows = unframe("OBJS", run.output("received.objects"), OBJECT)
        known.append(rows["instance"].tolist())
    assert known[20] == [100, 101]
    assert known[-1] == [101]


def test_nothing_but_bsms_and_cpms_is_sent_whatever_matches() -> None:
    run = service()
    sent = [run.step(apms=join([apm_of(SHARER)]), match__trigger=np.array(True)) for _ in range(20)]
    assert set(np.concatenate(sent)["kind"]) == {BSM, SENSOR_DATA}


def test_a_lidar_without_a_radio_and_a_radio_without_a_lidar_send_no_cpm() -> None:
    silent = np.array([True, False, True])
    run = service()
    steps = [run.step(apms=join([apm_of(SHARER)]), vehicle__equipped=silent) for _ in range(20)]
    assert set(np.concatenate(steps)["kind"]) == {BSM}


def test_too_small_packets_are_an_error() -> None:
    with pytest.raises(ComponentTypeError, match="`fragment_size` is 300 B; a collective perc"):
        service(fragment_size=300)


def test_contract() -> None:
    check_component(CpmFacilities(CpmFacilities.Parameters()), steps=30, h=H, seed=1)
