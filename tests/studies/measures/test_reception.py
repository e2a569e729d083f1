"""How many frames arrive, how often, and how late."""

from pathlib import Path

import numpy as np
import pytest

from fmus.channel.stand_ins import ConstantPer
from fmus.messages.records import OUTCOMES, SENSOR_DATA
from orchestrator.intervals import wilson
from orchestrator.measure import Answer
from studies.measures.aoi import AgeOfInformation
from studies.measures.awareness import NeighbourAwareness
from studies.measures.cbr import ChannelBusyRatio
from studies.measures.delivery import Delivery
from studies.measures.freshness import instants_between
from studies.measures.pir import PacketInterReception
from studies.measures.prr import PacketReceptionRatio
from tests.fmus.channel.harness import packet as stand_in_packet, packets as stand_in_packets
from tests.fmus.channel.stand_ins.harness import Run, scene
from tests.studies.measures.world import (
    CHANNEL_STEP,
    MS,
    Body,
    packet,
    reception,
    record,
    transmission,
)

THREE = [Body(id=4, start=(0, 0)), Body(id=7, start=(30, 0)), Body(id=9, start=(0, 70))]
EDGES = (0.0, 50.0, 100.0)


def row(answer: Answer, link: str, low: float) -> dict[str, float]:
    table = answer.tables["distance"]
    chosen = (table["link"] == link) & (table["from_m"] == low)
    (index,) = np.flatnonzero(chosen)
    return {name: table[name][index] for name in table if name != "link"}


def test_a_constant_loss_is_the_packet_reception_ratio(tmp_path: Path) -> None:
    heard = [reception(k, (4, 7), 0.1 * k, "R" if k % 10 < 7 else "N") for k in range(1, 101)]
    run = record(tmp_path, THREE[:2], 10.2, receptions=heard, parameters={"weak_receptions": True})
    found = PacketReceptionRatio(edges=EDGES).compute(run).numbers
    low, high = wilson(np.array([70]), np.array([100]))
    assert (found["prr"], found["receivers"]) == (0.7, 100)
    assert (found["prr_low"], found["prr_high"]) == (low[0], high[0])
    assert found["prr_LOS"] == 0.7
    assert found["prr_NLOSb"] is None


def test_receivers_are_told_apart_by_distance_and_link(tmp_path: Path) -> None:
    heard = [
        reception(1, (4, 7), 0.1, "R", link="LOS"),  # 30 m
        reception(1, (4, 9), 0.1, "C", link="NLOSv"),  # 70 m
        reception(2, (7, 4), 0.2, "R", link="LOS"),  # 30 m
        reception(2, (7, 9), 0.2, "R", link="NLOSb"),  # 76 m
        reception(3, (9, 4), 0.3, "B", link="LOS"),  # 70 m
    ]
    run = record(tmp_path, THREE, 1.0, receptions=heard, parameters={"weak_receptions": True})
    found = PacketReceptionRatio(edges=EDGES).compute(run)
    assert (row(found, "all", 0.0)["received"], row(found, "all", 0.0)["receivers"]) == (2, 2)
    assert (row(found, "all", 50.0)["received"], row(found, "all", 50.0)["receivers"]) == (1, 3)
    assert row(found, "NLOSb", 50.0)["prr"] == 1.0
    assert row(found, "NLOSv", 50.0)["prr"] == 0.0
    assert row(found, "LOS", 50.0)["prr"] == 0.0
    assert np.isnan(row(found, "NLOSb", 0.0)["prr"])


def test_who_is_out_of_hearing_counts_even_if_the_channel_does_not_tell_of_them(
    tmp_path: Path,
) -> None:
    """The same run with and without its records `U`, and one vehicle that has no radio."""
    bodies = [*THREE, Body(id=11, start=(10, 10), equipped=False)]
    told = [reception(1, (4, 7), 0.1), reception(1, (4, 9), 0.1, "U", link="NLOSb")]
    sent = [transmission(1, 4, 0.0995)]
    whole = record(tmp_path / "a", bodies, 1.0, receptions=told, transmissions=sent)
    less = record(
        tmp_path / "b",
        bodies,
        1.0,
        receptions=told[:1],
        transmissions=sent,
        parameters={"weak_receptions": False},
    )
    measure = PacketReceptionRatio(edges=EDGES)
    full, short = measure.compute(whole), measure.compute(less)
    assert full.numbers["weak_recorded"] is True  # a record `U` shows it
    assert short.numbers["weak_recorded"] is False
    for low in (0.0, 50.0):
        assert row(full, "all", low) == row(short, "all", low)
    assert full.numbers["prr"] == short.numbers["prr"] == 0.5
    assert (full.numbers["prr_NLOSb"], short.numbers["prr_NLOSb"]) == (0.0, None)


def test_times_between_receptions_are_those_of_each_link(tmp_path: Path) -> None:
    heard = [
        reception(1, (4, 7), 0.1),
        reception(2, (9, 7), 0.15),
        reception(3, (4, 7), 0.2, "N"),
        reception(4, (4, 7), 0.4),
        reception(5, (9, 7), 0.65),
        reception(6, (4, 7), 0.5),
        reception(7, (7, 4), 0.45),
    ]
    run = record(tmp_path, THREE, 1.0, receptions=heard)
    found = PacketInterReception(edges=EDGES).compute(run)
    assert (found.numbers["gaps"], found.numbers["links"], found.numbers["links_once"]) == (3, 3, 1)
    table = found.tables["distance"]
    assert table["count"].tolist() == [2, 1]
    np.testing.assert_allclose(table["mean_s"], [0.2, 0.5])  # 0.3 and 0.1; 0.5
    assert found.numbers["pir_mean_ms"] == pytest.approx(300.0)


def test_a_radio_that_sends_half_the_time_makes_a_busy_ratio_of_one_half(tmp_path: Path) -> None:
    """With the stand-in's own count of it; a vehicle without a radio is not asked."""
    bodies = [Body(id=k, start=(10.0 * k, 0.0), equipped=k < 2) for k in range(3)]
    channel = Run(ConstantPer(ConstantPer.Parameters(per=0.0)))
    frames = [stand_in_packet(k, 0, time=(100 * k + 20) * MS, duration=50 * MS) for k in range(10)]
    where = scene({body.id: body.start for body in bodies}, equipped=[0, 1])
    told = {0: channel.busy_ratio().copy() if channel.t else np.zeros(3)}
    while channel.t < 1000 * MS:
        channel.step(where, stand_in_packets(frames) if channel.t == 0 else b"", CHANNEL_STEP)
        told[channel.t] = channel.busy_ratio()
    run = record(tmp_path, bodies, 1.0, busy_ratio=told.__getitem__)
    found = ChannelBusyRatio().compute(run).numbers
    assert found["values"] == 20
    assert found["windows"] == 10
    for name in ("cbr_mean", "cbr_median", "cbr_max"):
        assert found[name] == pytest.approx(0.5, abs=1e-6)


def test_packets_are_delivered_once_and_where_they_are_to_go(tmp_path: Path) -> None:
    sent = [
        packet(1, 4, 0.1),
        packet(2, 4, 0.2, destination=9, route=(7, -1), kind=2, size=1000),
        packet(3, 9, 0.3, destination=4, kind=2, size=1000),
    ]
    heard = [
        reception(1, (4, 7), 0.101),
        reception(1, (4, 9), 0.103),
        reception(2, (4, 7), 0.202, kind=2),  # the relay, for which it is not
        reception(2, (4, 9), 0.202, "N", kind=2, addressed=0),
        reception(2, (7, 9), 0.206, kind=2, hop=1),
        reception(2, (7, 9), 0.209, kind=2, hop=1),  # once more
        reception(3, (9, 4), 0.302, "C", kind=2),
    ]
    run = record(tmp_path, THREE, 2.0, packets=sent, receptions=heard)
    found = Delivery().compute(run).numbers
    assert (found["bsm_packets"], found["bsm_deliveries"]) == (1, 2)
    assert found["bsm_latency_mean_ms"] == pytest.approx(2.0)
    assert (found["sensor_data_packets"], found["sensor_data_deliveries"]) == (2, 1)
    assert found["sensor_data_latency_mean_ms"] == pytest.approx(6.0)
    assert found["sensor_data_sent_kbit_s"] == 2 * 1000 * 8 / 2.0 / 1000
    assert found["sensor_data_delivered_kbit_s"] == 1000 * 8 / 2.0 / 1000
    assert "apm_packets" not in found


def test_information_grows_old_until_something_newer_arrives(tmp_path: Path) -> None:
    """The mean of a sawtooth from latency to latency + period; and by a slow count."""
    period, latency = 0.4, 0.03
    sent = [packet(k, 4, 0.1 + period * k) for k in range(24)]
    heard = [reception(k, (4, 7), 0.1 + period * k + latency) for k in range(24)]
    heard += [reception(k, (4, 9), 0.1 + period * k + latency, "N") for k in range(24)]
    run = record(tmp_path, THREE, 9.7, packets=sent, receptions=heard)
    found = AgeOfInformation(interval=0.02, edges=EDGES).compute(run)
    assert found.numbers["aoi_mean_ms"] == pytest.approx(1e3 * (latency + period / 2), rel=0.01)
    instants = instants_between(np.array([0, round(9.7e9)]), 0.02)
    made = [(k * period + 0.1 + latency, k * period + 0.1) for k in range(24)]
    ages = []
    for time in instants / 1e9:
        known = [born for there, born in made if there <= time]
        if known:
            ages.append(time - max(known))
    assert found.numbers["samples"] == len(ages)
    assert found.tables["distance"]["mean_s"][0] == pytest.approx(np.mean(ages), abs=1e-9)
    assert found.numbers["unknown"] == pytest.approx(1 - len(ages) / (6 * len(instants)))


def test_old_information_that_comes_late_over_a_relay_makes_nothing_older(tmp_path: Path) -> None:
    sent = [packet(1, 4, 0.1), packet(2, 4, 0.5)]
    heard = [reception(2, (4, 7), 0.501), reception(1, (9, 7), 0.6, hop=1)]
    run = record(tmp_path, THREE, 1.0, packets=sent, receptions=heard)
    found = AgeOfInformation(interval=0.01, edges=EDGES).compute(run)
    assert found.numbers["aoi_mean_ms"] == pytest.approx(250.0, abs=5.0)  # from 0.5 s to 1 s
    assert found.tables["distance"]["count"].tolist()[1] == 0  # information of 4, not of the relay


def test_awareness_is_the_share_of_neighbours_heard_lately(tmp_path: Path) -> None:
    """Of six directed pairs two are heard: one all the time, one in the second before 2 s."""
    sent = [packet(k, 4, 0.1 * k) for k in range(60)] + [packet(100, 9, 1.0)]
    heard = [reception(k, (4, 7), 0.1 * k + 0.001) for k in range(60)]
    heard.append(reception(100, (9, 7), 1.0))
    run = record(tmp_path, THREE, 5.0, packets=sent, receptions=heard)
    found = NeighbourAwareness(interval=0.01, edges=EDGES).compute(run)
    table = found.tables["distance"]
    near, far = table["nar"]
    assert near == 0.5  # 4 is known to 7, 7 is not to 4
    assert far == pytest.approx(1 / 4 / 4, abs=0.01)  # one of four for one of four seconds
    without = Body(id=12, start=(1, 1), equipped=False)
    again = record(tmp_path / "b", [*THREE, without], 5.0, packets=sent, receptions=heard)
    assert NeighbourAwareness(interval=0.01, edges=EDGES).compute(again).numbers == found.numbers


def test_a_reception_of_what_nobody_sent_is_refused(tmp_path: Path) -> None:
    run = record(tmp_path, THREE, 1.0, receptions=[reception(5, (4, 7), 0.1)])
    for measure in (Delivery(), AgeOfInformation(), NeighbourAwareness()):
        with pytest.raises(ValueError, match=r"`channel.receptions` has packet 5, which nobody"):
            measure.compute(run)


def test_nothing_heard_is_nothing_said(tmp_path: Path) -> None:
    run = record(tmp_path, THREE, 1.0)
    assert PacketReceptionRatio().compute(run).numbers["prr"] is None
    assert PacketReceptionRatio().compute(run).numbers["weak_recorded"] is None
    assert PacketInterReception().compute(run).numbers["pir_mean_ms"] is None
    assert AgeOfInformation().compute(run).numbers["aoi_mean_ms"] is None
    assert NeighbourAwareness(interval=0.1, memory=0.1).compute(run).numbers["nar"] == 0.0
    assert Delivery().compute(run).numbers == {}


@pytest.mark.parametrize("edges", [(), (1.0,), (0.0, 0.0), (2.0, 1.0)])
def test_edges_ascend(edges: tuple[float, ...]) -> None:
    (problem,) = PacketReceptionRatio(edges=edges).problems(())
    assert problem.address == ("edges",)
    assert "two edges" in problem.what or "ascend" in problem.what


def test_the_ratio_of_type_2_counts_those_for_whom_packets_are(tmp_path: Path) -> None:
    """Of ten packets for 9 seven arrive, three of them over a relay; the eleventh is in flight.

    Broadcasts and what others overhear change nothing.
    """
    sent = [packet(k, 4, 0.1 * k, destination=9, kind=SENSOR_DATA) for k in range(1, 11)]
    sent += [packet(11, 4, 1.18, destination=9, kind=SENSOR_DATA), packet(12, 4, 0.5)]
    direct = [reception(k, (4, 9), 0.1 * k + 0.001, kind=SENSOR_DATA) for k in range(1, 5)]
    relayed = [reception(k, (7, 9), 0.1 * k + 0.003, hop=1, kind=SENSOR_DATA) for k in range(5, 8)]
    lost = [reception(k, (4, 9), 0.1 * k + 0.001, "N", kind=SENSOR_DATA) for k in range(5, 11)]
    aside = [reception(k, (4, 7), 0.1 * k + 0.001, kind=SENSOR_DATA) for k in range(5, 8)]
    run = record(
        tmp_path,
        THREE,
        1.2,
        packets=sent,
        receptions=[*direct, *relayed, *lost, *aside, reception(12, (4, 7), 0.501)],
        parameters={"weak_receptions": True},
    )
    found = PacketReceptionRatio(edges=EDGES).compute(run).numbers
    low, high = wilson(np.array([7]), np.array([10]))
    assert (found["prr2"], found["intended"]) == (0.7, 10)
    assert (found["prr2_low"], found["prr2_high"]) == (low[0], high[0])
    bsm = PacketReceptionRatio(edges=EDGES, kind="bsm").compute(run).numbers
    assert (bsm["prr2"], bsm["intended"]) == (None, 0)
    silent = PacketReceptionRatio(edges=EDGES, packets="facilities.other").compute(run).numbers
    assert (silent["prr2"], silent["intended"]) == (None, None)
    assert silent["prr"] == found["prr"]


def test_leaving_out_weak_receptions_raises_ratios_of_link_classes_by_what_was_left_out(
    tmp_path: Path,
) -> None:
    """Of ten frames over an NLOSb link two arrive, two are noise, six nobody notices.

    Told of all, the class has 2 of 10; told of four, 2 of 4; the ratio of all links stays 2 of 10.
    """
    outcomes = "RRNNUUUUUU"
    told = [
        reception(k, (4, 7), 0.1 * k + 0.001, outcome, link="NLOSb")
        for k, outcome in enumerate(outcomes, 1)
    ]
    sent = [transmission(k, 4, 0.1 * k) for k in range(1, 11)]
    found = {}
    for weak in (True, False):
        run = record(
            tmp_path / str(weak),
            THREE[:2],
            1.2,
            receptions=[row for row in told if weak or row["outcome"] != OUTCOMES.index("U")],
            transmissions=sent,
            parameters={"weak_receptions": weak},
        )
        found[weak] = PacketReceptionRatio(edges=EDGES).compute(run).numbers
    assert [found[weak]["prr"] for weak in (True, False)] == [0.2, 0.2]
    assert [found[weak]["prr_NLOSb"] for weak in (True, False)] == [0.2, 0.5]
    assert [found[weak]["weak_recorded"] for weak in (True, False)] == [True, False]
    assert found[True]["left_out"] is None
    assert "noticed frames only" in str(found[False]["left_out"])
