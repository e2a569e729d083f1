"""Packets that travel over relays, stored and forwarded inside the channel."""

import numpy as np

from fmus.messages.records import FATES, OUTCOMES
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import AIRTIME, MS, US, Channel, packet

# around the corner of a house: 0 and 2 see 1, but not each other
CORNER = Scene(
    vehicles=[
        Vehicle(id=0, position=(-300.0, 0.0, 0.0)),
        Vehicle(id=1),
        Vehicle(id=2, position=(0.0, 300.0, 0.0)),
    ],
    buildings=[Building(ring=rectangle(-155, 155, 300, 300))],
)
RELAY_DELAY = 200_000
PROPAGATION = 1_001  # over 300 m


def _received(records: Array, number: int, receiver: int) -> Array:
    good = records["outcome"] == OUTCOMES.index("R")
    found: Array = records[good & (records["packet"] == number) & (records["receiver"] == receiver)]
    return found


def test_a_relay_delivers_where_the_direct_link_is_blocked(library: Library) -> None:
    numbers = range(50, 100)
    with Channel(library, CORNER) as channel:
        direct = channel.step(0.0, 0.1, [packet(k, 0, to=2) for k in range(50)])
        relayed = channel.step(
            0.1, 0.1, [packet(k, 0, to=2, via=[1], time=2 * k * MS) for k in numbers]
        )
    assert not any(len(_received(direct, k, 2)) for k in range(50))
    final = np.concatenate([_received(relayed, k, 2) for k in numbers])
    assert len(final) == 50
    assert (final["hop"] == 1).all()
    assert (final["transmitter"] == 1).all()
    assert final["addressed"].all()


def test_a_hop_takes_its_airtime_and_the_relays_delay(library: Library) -> None:
    with Channel(library, CORNER, medium_access=False) as channel:
        records = channel.step(0.0, 0.1, [packet(1, 0, to=2, via=[1], time=MS)])
        sent = channel.transmissions()
    (first,), (second,) = _received(records, 1, 1), _received(records, 1, 2)
    assert first["time"] == MS + AIRTIME + PROPAGATION
    assert second["time"] == first["time"] + RELAY_DELAY + AIRTIME + PROPAGATION
    assert first["addressed"]
    assert sent[["hop", "transmitter", "duration"]].tolist() == [(0, 0, AIRTIME), (1, 1, AIRTIME)]
    assert sent["queued"].tolist() == sent["time"].tolist()


def test_what_is_lost_directly_says_nothing_of_what_is_lost_over_the_relay(
    library: Library,
) -> None:
    """Source and relay stand together, so both hops to the far one have the same SNIR, at which
    about half of all frames are received: of each pair of copies independently."""
    cars = [Vehicle(id=0), Vehicle(id=1, position=(0.0, 3.0, 0.0))]
    scene = Scene(vehicles=[*cars, Vehicle(id=2, position=(830.0, 1.5, 0.0))])
    count = 400
    frames = [packet(k, 0, to=2, via=[1], time=2 * k * MS) for k in range(count)]
    radio = {"transmit_power": 14.0, "sensitivity": -110.0, "noise_floor": -98.0}
    with Channel(library, scene, vehicle_shadowing=False, **radio) as channel:
        records = channel.step(0.0, 1.0, frames)
    far = records[records["receiver"] == 2]
    first, second = (
        np.sort(far[far["hop"] == hop], order="packet")["outcome"] == OUTCOMES.index("R")
        for hop in (0, 1)
    )
    assert len(first) == len(second) == count
    assert 0.2 < first.mean() < 0.8
    assert abs(first.mean() - second.mean()) < 4 * np.sqrt(0.5 / count)
    correlation = np.corrcoef(first, second)[0, 1]
    assert abs(correlation) < 4 / np.sqrt(count)


def test_a_relay_contends_for_each_hop(library: Library) -> None:
    with Channel(library, CORNER) as channel:
        records = channel.step(0.0, 0.1, [packet(1, 0, to=2, via=[1], time=MS)])
        sent = channel.transmissions()
    (first,), (second,) = _received(records, 1, 1), _received(records, 1, 2)
    assert 0 <= first["time"] + RELAY_DELAY - sent[1]["queued"] <= 1  # a part of a nanosecond
    # the medium has been idle for 200 us: next slot boundary, turnaround
    assert 0 < sent[1]["time"] - US - sent[1]["queued"] <= 13 * US
    assert second["time"] == sent[1]["time"] + AIRTIME + PROPAGATION + 1


def test_a_relay_that_does_not_receive_does_not_send(library: Library) -> None:
    with Channel(library, CORNER, sensitivity=0.0) as channel:
        records = channel.step(0.0, 0.1, [packet(1, 0, to=2, via=[1])])
    assert set(records["hop"].tolist()) == {0}


def test_two_relays_in_the_order_of_the_route(library: Library) -> None:
    scene = Scene(vehicles=[Vehicle(id=k, position=(30.0 * k, 0.0, 0.0)) for k in range(4)])
    with Channel(library, scene) as channel:
        records = channel.step(0.0, 0.1, [packet(1, 0, to=3, via=[2, 1])])
    addressed = records[records["addressed"] == 1]
    assert addressed[["transmitter", "receiver", "hop"]].tolist() == [
        (0, 2, 0),
        (2, 1, 1),
        (1, 3, 2),
    ]


def test_a_routed_broadcast_addresses_everyone_on_its_last_hop(library: Library) -> None:
    with Channel(library, CORNER) as channel:
        records = channel.step(0.0, 0.1, [packet(1, 0, via=[1])])
    addressed = records[records["addressed"] == 1]
    assert addressed[["hop", "receiver"]].tolist() == [(0, 1), (1, 0), (1, 2)]


def test_a_frame_vanishes_with_its_relay(library: Library) -> None:
    without = Scene(vehicles=[CORNER.vehicles[0], CORNER.vehicles[2]], buildings=CORNER.buildings)
    cut = (AIRTIME + PROPAGATION) * 1e-9 + 1e-5  # the relay holds the packet
    with Channel(library, CORNER, medium_access=False) as channel:
        first = channel.step(0.0, cut, [packet(1, 0, to=2, via=[1])])
        channel.change(without)
        rest = channel.step(cut, 0.1, [])
        (given_up,) = channel.transmissions()
    assert len(_received(first, 1, 1)) == 1
    assert len(rest) == 0
    assert FATES[given_up["fate"]] == "gone"
    assert [given_up[name] for name in ("packet", "hop", "transmitter", "duration")] == [1, 1, 1, 0]


def test_a_source_that_has_left_sends_nothing(library: Library) -> None:
    with Channel(library, CORNER) as channel:
        channel.step(0.0, 0.1, [])
        channel.change(Scene(vehicles=CORNER.vehicles[:2]))
        assert len(channel.step(0.1, 0.1, [packet(1, 2)])) == 0
        assert [FATES[r["fate"]] for r in channel.transmissions()] == ["gone"]
