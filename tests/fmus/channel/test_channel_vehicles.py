"""Vehicles that come and go, and what becomes of their frames."""

from dataclasses import replace

import numpy as np
import pytest

from fmus.messages.records import FATES, NO_VEHICLE
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Scene, Vehicle

from .harness import AIRTIME, MS, US, Channel, outcomes, packet

CARS = [Vehicle(id=k, position=(10.0 * k, 0.0, 0.0)) for k in range(5)]
CUT = 1e-3


def _scene(*ids: int) -> Scene:
    return Scene(vehicles=[CARS[k] for k in ids])


def _fates(sent: Array) -> dict[int, str]:
    return {int(r["packet"]): FATES[r["fate"]] for r in sent}


def test_frames_that_wait_are_gone_with_their_vehicle(library: Library) -> None:
    with Channel(library, _scene(0, 1, 2)) as channel:
        channel.step(0.0, CUT, [packet(k, 1, category=k % 4) for k in range(8)])
        first = _fates(channel.transmissions())
        channel.change(_scene(0, 2))
        channel.step(CUT, 0.1, [])
        rest = channel.transmissions()
    assert set(first.values()) == {"sent"}
    assert _fates(rest) == {k: "gone" for k in range(8) if k not in first}
    assert (rest["time"] == round(CUT * 1e9)).all()
    assert (rest["queued"] == 0).all()
    assert (rest["duration"] == 0).all()


def test_a_vehicle_that_loses_its_radio_has_gone_too(library: Library) -> None:
    without = Scene(vehicles=[CARS[0], replace(CARS[1], equipped=False), CARS[2]])
    with Channel(library, _scene(0, 1, 2)) as channel:
        channel.step(0.0, CUT, [packet(k, 1) for k in range(4)])
        channel.change(without)
        received = channel.step(CUT, 0.1, [packet(9, 0, time=5 * MS)])
        fates = _fates(channel.transmissions())
    assert set(fates.values()) == {"sent", "gone"}
    assert fates[9] == "sent"
    assert 1 not in received["receiver"]


@pytest.mark.parametrize("left", [0.5 * US, 10 * US])
def test_a_frame_in_its_turnaround_is_gone_and_one_on_air_is_heard(
    library: Library, left: float
) -> None:
    """The decision falls 58 us after the start, the frame begins 1 us later."""
    cut = (58 * US + left) * 1e-9
    with Channel(library, _scene(0, 1)) as channel:
        channel.step(0.0, cut, [packet(1, 1)])
        sent = channel.transmissions()
        channel.change(_scene(0))
        received = channel.step(cut, 0.1, [])
        rest = channel.transmissions()
    if left < US:
        assert (len(sent), len(received), _fates(rest)) == (0, 0, {1: "gone"})
    else:
        assert (_fates(sent), outcomes(received), len(rest)) == ({1: "sent"}, {(1, 0): "R"}, 0)


def test_a_receiver_that_leaves_tells_nothing(library: Library) -> None:
    with Channel(library, _scene(0, 1, 2, 3), medium_access=False) as channel:
        channel.step(0.0, 1e-4, [packet(1, 1)])
        channel.change(_scene(0, 1, 3))
        assert channel.step(1e-4, 0.1, [])["receiver"].tolist() == [0, 3]


def test_a_vehicle_that_enters_does_not_hear_what_is_on_air_and_is_no_part_of_it(
    library: Library,
) -> None:
    with Channel(library, _scene(1, 3), medium_access=False) as channel:
        channel.step(0.0, 1e-4, [packet(1, 1)])
        channel.change(_scene(0, 1, 2, 3, 4))
        # it sends into the frame: both overlap at 3, of which only the first is received
        received = channel.step(1e-4, 0.1, [packet(2, 4, time=200 * US)])
    found = outcomes(received)
    assert [receiver for number, receiver in found if number == 1] == [3]
    assert found[1, 3] == "C"
    assert found[2, 3] == "B"
    assert found[2, 1] == "T"
    assert found[2, 0] == found[2, 2] == "R"


def test_frames_on_air_reach_receivers_whose_place_in_the_list_changes(library: Library) -> None:
    """Vehicles with lower and higher numbers leave and enter while frames are on air."""
    records = [packet(k, k, time=k * 50 * US) for k in (1, 3)]
    scenes = [_scene(1, 2, 3), _scene(0, 1, 2, 3), _scene(2, 3), _scene(0, 2, 4), _scene(2)]
    with Channel(library, scenes[0], medium_access=False) as channel:
        whole = channel.step(0.0, 0.1, records)
    expected = whole[whole["receiver"] == 2].tobytes()
    with Channel(library, scenes[0], medium_access=False) as channel:
        found = [channel.step(0.0, 1e-4, records)]
        for k, scene in enumerate(scenes[1:], start=1):
            channel.change(scene)
            found.append(channel.step(k * 1e-4, 1e-4, []))
        found.append(channel.step(5e-4, 1e-3, []))
    together = np.concatenate(found)
    assert together[together["receiver"] == 2].tobytes() == expected


def test_a_vehicle_that_is_back_is_a_new_radio(library: Library) -> None:
    with Channel(library, _scene(0, 1)) as channel:
        channel.step(0.0, CUT, [packet(k, 1) for k in range(4)])
        channel.change(_scene(0))
        channel.step(CUT, CUT, [])
        channel.change(_scene(0, 1))
        received = channel.step(2 * CUT, 0.1, [packet(9, 1, time=3 * MS)])
        assert _fates(channel.transmissions()) == {9: "sent"}
    assert outcomes(received) == {(9, 0): "R"}


def test_new_numbers_make_new_vehicles(library: Library) -> None:
    renamed = Scene(vehicles=[replace(v, id=v.id + 100) for v in _scene(0, 1).vehicles])
    with Channel(library, _scene(0, 1)) as channel:
        channel.step(0.0, CUT, [packet(k, 1) for k in range(4)])
        channel.change(renamed)
        received = channel.step(CUT, 0.1, [packet(9, 101, time=MS), packet(10, 1, time=MS)])
        fates = _fates(channel.transmissions())
    assert fates.pop(9) == "sent"
    assert set(fates.values()) == {"gone"}
    assert 10 in fates
    assert outcomes(received) == {(9, 100): "R"}


def test_a_hop_is_sent_if_its_relay_is_there_when_it_is_due(library: Library) -> None:
    record = packet(1, 0, to=2, via=[1])
    hold = (AIRTIME + 100 * US) * 1e-9  # the relay has received, its hop is due 100 us later
    with Channel(library, _scene(0, 1, 2), medium_access=False) as channel:
        channel.step(0.0, hold, [record])
        channel.change(_scene(0, 2))
        channel.step(hold, 1e-5, [])
        channel.change(_scene(0, 1, 2))
        received = channel.step(hold + 1e-5, 0.1, [])
        assert outcomes(received)[1, 2] == "R"


def test_everybody_leaves_and_others_come(library: Library) -> None:
    with Channel(library, _scene(0, 1, 2)) as channel:
        channel.step(0.0, CUT, [packet(k, k % 3) for k in range(9)])
        channel.change(Scene())
        assert len(channel.step(CUT, CUT, [])) == 0
        assert set(_fates(channel.transmissions()).values()) == {"gone"}
        channel.change(_scene(3, 4))
        received = channel.step(2 * CUT, 0.1, [packet(10, 3, time=2 * MS)])
    assert outcomes(received) == {(10, 4): "R"}


@pytest.mark.parametrize("equipped", [[], [0], [False, False, False]])
def test_one_vehicle_or_none_with_a_radio_sends_to_nobody(
    library: Library, equipped: list[bool]
) -> None:
    cars = [
        replace(CARS[k], equipped=bool(e) or len(equipped) == 1) for k, e in enumerate(equipped)
    ]
    records = [packet(1, 0)] if len(equipped) == 1 else []
    with Channel(library, Scene(vehicles=cars)) as channel:
        assert len(channel.step(0.0, 0.1, records)) == 0
        assert len(channel.transmissions()) == len(records)
        assert channel.get("busy_ratio", len(cars)).shape == (len(cars),)


def test_5000_vehicles(library: Library) -> None:
    """A city: all hear a few frames, many queue at once, and half of them leave."""
    rng = np.random.default_rng(5)
    cars = [
        Vehicle(id=k, position=(*rng.uniform(-1500, 1500, 2), 0.0), heading=rng.uniform(0, 7))
        for k in range(5000)
    ]
    with Channel(library, Scene(vehicles=cars)) as channel:
        received = channel.step(0.0, 0.01, [packet(k, 1000 * k) for k in range(5)])
        assert channel.get("busy_ratio", 5000).shape == (5000,)
        channel.change(Scene(vehicles=cars[::2]))
        state = channel.save()
        later = channel.step(0.01, 0.01, [packet(9, 2, to=4, time=11 * MS)])
        channel.restore(state)
        again = channel.step(0.01, 0.01, [packet(9, 2, to=4, time=11 * MS)])
    assert len(received) > 15_000
    assert np.isfinite(received["power_dbm"]).all()
    assert len(later) > 1_500
    assert later.tobytes() == again.tobytes()
    assert NO_VEHICLE not in later["receiver"]
