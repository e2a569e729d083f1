"""Frames on air: who receives what, when and how strong."""

import math

import numpy as np
import pytest

from fmus.messages.records import LINKS, OUTCOMES
from tests.fmus.driver import Library
from tests.fmus.scene import Building, Scene, Vehicle, rectangle

from .harness import (
    AIRTIME,
    LIGHT_SPEED,
    MS,
    NO_OBSTACLES,
    Channel,
    one_frame,
    packet,
    reception_ratio,
    row_of_cars,
)


def test_every_other_radio_gets_one_reception(library: Library) -> None:
    scene = Scene(
        vehicles=[
            Vehicle(id=3),
            Vehicle(id=7, position=(20.0, 8.0, 0.0)),
            Vehicle(id=8, position=(20.0, 16.0, 0.0), equipped=False),
            Vehicle(id=2**31 - 1, position=(20.0, 24.0, 0.0)),
        ]
    )
    received = one_frame(library, scene, packet(1, 7))
    assert sorted(received) == [3, 2**31 - 1]
    assert all(r["transmitter"] == 7 and r["packet"] == 1 for r in received.values())


def test_power_snir_and_time_of_a_free_link(library: Library) -> None:
    scene = row_of_cars([100.0])
    sending = packet(1, 0, time=5_000)
    record = one_frame(library, scene, sending, sensitivity=-95.0, medium_access=False)[1]
    distance = math.hypot(100, 3)
    loss = 20 * math.log10(4 * math.pi * distance * 5.9e9 / LIGHT_SPEED)
    assert record["power_dbm"] == pytest.approx(26 - loss, abs=1e-5)
    # the upper edge of the channel is weakest
    edge = 20 * math.log10(5.905 / 5.9)
    assert record["snir_db"] == pytest.approx(26 - loss + 98 - edge, abs=1e-5)
    assert record["time"] == 5_000 + AIRTIME + math.ceil(distance / LIGHT_SPEED * 1e9)
    assert LINKS[record["link"]] == "LOS"
    assert OUTCOMES[record["outcome"]] == "R"


def test_without_band_edges_the_snir_is_that_of_the_centre(library: Library) -> None:
    record = one_frame(library, row_of_cars([100.0]), packet(1, 0), band_edges=False)[1]
    assert record["snir_db"] == pytest.approx(record["power_dbm"] + 98, abs=1e-9)


def test_without_header_bytes_a_frame_lasts_as_long_as_in_veins(library: Library) -> None:
    parameters = {"mac_header": 0, "medium_access": False}
    record = one_frame(library, row_of_cars([0.0]), packet(1, 0), **parameters)[1]
    assert record["time"] == 312_000 + math.ceil(3 / LIGHT_SPEED * 1e9)


def test_a_given_duration_and_power_override_those_of_the_radio(library: Library) -> None:
    sending = packet(1, 0, duration=1_000_000, power_offset=-7.5)
    record = one_frame(library, row_of_cars([0.0]), sending, medium_access=False)[1]
    usual = one_frame(library, row_of_cars([0.0]), packet(1, 0), medium_access=False)[1]
    assert record["time"] - usual["time"] == 1_000_000 - AIRTIME
    assert usual["power_dbm"] - record["power_dbm"] == pytest.approx(7.5, abs=1e-9)


def test_reception_ratio_falls_with_distance(library: Library) -> None:
    distances = [10.0, 800.0, 1000.0, 1100.0, 1200.0, 1300.0, 1500.0]
    ratio = reception_ratio(
        library, row_of_cars(distances), 400, transmit_power=14, sensitivity=-110, noise_floor=-98
    )
    assert (np.diff(ratio) <= 0.07).all()  # 3 sigma of 400 draws
    assert ratio[0] == 1
    assert ratio[-1] < 0.2
    assert ((ratio > 0.05) & (ratio < 0.95)).any()


def test_received_share_is_the_success_probability(library: Library) -> None:
    frames = 4000
    scene = row_of_cars([830.0])
    parameters = {"transmit_power": 14.0, "sensitivity": -110.0, "mac_header": 0}
    (ratio,) = reception_ratio(library, scene, frames, **parameters)
    record = one_frame(library, scene, packet(1, 0), **parameters)[1]
    snir = 10 ** (float(record["snir_db"]) / 10)
    expected = _nist_qpsk_half(snir, 1622) * _nist_bpsk_half(snir, 24)
    assert 0.2 < expected < 0.8
    assert ratio == pytest.approx(expected, abs=4 * math.sqrt(expected * (1 - expected) / frames))


def _nist(uncoded: float, bits: int) -> float:
    terms = {10: 36, 12: 211, 14: 1404, 16: 11633, 18: 77433, 20: 502690, 22: 3322763,
             24: 21292910, 26: 134365911}  # fmt: skip
    d = math.sqrt(4 * uncoded * (1 - uncoded))
    return float((1 - min(1, 0.5 * sum(a * d**k for k, a in terms.items()))) ** bits)


def _nist_qpsk_half(snir: float, bits: int) -> float:
    return _nist(0.5 * math.erfc(math.sqrt(snir / 2)), bits)


def _nist_bpsk_half(snir: float, bits: int) -> float:
    return _nist(0.5 * math.erfc(math.sqrt(snir)), bits)


def test_a_house_costs_its_walls_and_metres(library: Library) -> None:
    scene = row_of_cars([100.0])
    house = Building(ring=rectangle(50, 1.5, 20, 20))
    free = one_frame(library, scene, packet(1, 0))[1]
    behind = one_frame(library, Scene(vehicles=scene.vehicles, buildings=[house]), packet(1, 0))[1]
    inside = 20 * math.hypot(100, 3) / 100
    assert free["power_dbm"] - behind["power_dbm"] == pytest.approx(18 + 0.4 * inside, abs=1e-4)
    assert LINKS[behind["link"]] == "NLOSb"


def test_a_low_house_is_passed_over_unless_buildings_are_infinite(library: Library) -> None:
    wall = Building(ring=rectangle(50, 0, 1, 100), height=1.0)
    scene = Scene(vehicles=row_of_cars([100.0]).vehicles, buildings=[wall])
    low = one_frame(library, scene, packet(1, 0))[1]
    infinite = one_frame(library, scene, packet(1, 0), finite_buildings=False)[1]
    assert low["power_dbm"] - infinite["power_dbm"] == pytest.approx(18.4, abs=0.01)
    assert [LINKS[r["link"]] for r in (low, infinite)] == ["LOS", "NLOSb"]


TRUCK = Vehicle(
    id=9, position=(30.0, 0.0, 0.0), size=(12.0, 2.5, 4.0), antenna_height=3.5, equipped=False
)
BEHIND_A_TRUCK = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1, position=(60.0, 0.0, 0.0)), TRUCK])


def test_a_truck_costs_15_to_25_db_on_60_m(library: Library) -> None:
    blocked = one_frame(library, BEHIND_A_TRUCK, packet(1, 0))[1]
    free = one_frame(library, BEHIND_A_TRUCK, packet(1, 0), vehicle_shadowing=False)[1]
    assert 15 < free["power_dbm"] - blocked["power_dbm"] < 25
    assert [LINKS[r["link"]] for r in (free, blocked)] == ["LOS", "NLOSv"]


def test_unequipped_vehicles_shadow_unless_veins_is_wanted(library: Library) -> None:
    veins = one_frame(library, BEHIND_A_TRUCK, packet(1, 0), unequipped_shadow=False)[1]
    free = one_frame(library, BEHIND_A_TRUCK, packet(1, 0), vehicle_shadowing=False)[1]
    assert veins["power_dbm"] == free["power_dbm"]


def test_both_directions_of_a_link_have_the_same_power(library: Library) -> None:
    rng = np.random.default_rng(3)
    cars = [
        Vehicle(
            id=k,
            position=(*rng.uniform(0, 150, 2), 0.0),
            heading=rng.uniform(0, 7),
            size=(5.0, 2.0, rng.uniform(1.4, 3.5)),
            antenna_height=rng.uniform(1.3, 3.0),
        )
        for k in range(25)
    ]
    with Channel(library, Scene(vehicles=cars)) as channel:
        received = channel.step(0.0, 0.1, [packet(k, k, time=k * MS) for k in range(25)])
    power = {(r["transmitter"], r["receiver"]): r["power_dbm"] for r in received}
    assert len(power) == 25 * 24
    assert all(power[a, b] == power[b, a] for a, b in power)


def test_weak_frames_are_not_noticed(library: Library) -> None:
    scene = row_of_cars([500.0, 600.0])
    received = one_frame(library, scene, packet(1, 0), sensitivity=-76.8, **NO_OBSTACLES)
    assert [OUTCOMES[received[k]["outcome"]] for k in (1, 2)] == ["R", "U"]
    assert math.isnan(received[2]["snir_db"])


def test_weak_receptions_can_be_left_out(library: Library) -> None:
    scene = row_of_cars([500.0, 600.0])
    parameters = {"sensitivity": -76.8, **NO_OBSTACLES}
    told = one_frame(library, scene, packet(1, 0), **parameters)
    kept = one_frame(library, scene, packet(1, 0), weak_receptions=False, **parameters)
    assert list(kept) == [1]
    assert kept[1].tobytes() == told[1].tobytes()


def test_beyond_the_range_there_is_no_reception(library: Library) -> None:
    received = one_frame(library, row_of_cars([299.0, 301.0]), packet(1, 0), maximum_range=300.0)
    assert list(received) == [1]


@pytest.mark.parametrize(
    ("record", "addressed"),
    [
        (packet(1, 0), [1, 1, 1]),
        (packet(1, 0, to=2), [0, 1, 0]),
        (packet(1, 0, to=2, via=[3]), [0, 0, 1]),
    ],
)
def test_who_is_addressed(library: Library, record: np.ndarray, addressed: list[int]) -> None:
    received = one_frame(library, row_of_cars([10.0, 20.0, 30.0]), record)
    assert [received[k]["addressed"] for k in (1, 2, 3)] == addressed


def test_degenerate_scenes_give_finite_powers(library: Library) -> None:
    cars = [
        Vehicle(id=0),
        Vehicle(id=1),  # in the same place
        Vehicle(id=2, size=(0.0, 0.0, 0.0), antenna_height=0.0),
        Vehicle(id=3, position=(5.0, 5.0, 0.0)),  # at a corner
        Vehicle(id=4, position=(-5.0, 5.0, 0.0)),  # along a wall
        Vehicle(id=5, position=(50.0, 50.0, 0.0)),  # through a corner
    ]
    house = Building(ring=rectangle(0, 0, 10, 10), height=3.0)
    with Channel(library, Scene(vehicles=cars, buildings=[house])) as channel:
        received = channel.step(0.0, 0.1, [packet(k, k) for k in range(6)])
    assert len(received) == 30
    assert np.isfinite(received["power_dbm"]).all()
    assert (received["power_dbm"] <= 26).all()


@pytest.mark.parametrize("count", [0, 1])
def test_nobody_to_hear(library: Library, count: int) -> None:
    scene = Scene(vehicles=[Vehicle(id=k) for k in range(count)])
    with Channel(library, scene) as channel:
        assert len(channel.step(0.0, 0.1, [packet(k, k) for k in range(count)])) == 0
        assert channel.receptions()[:4] == b"RCPT"
