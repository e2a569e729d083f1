"""Wrong input is refused with a message that names it."""

import dataclasses
import re

import numpy as np
import pytest

from fmus.messages.records import PACKET
from tests.fmus.driver import Instance, Library, Refused
from tests.fmus.scene import Building, Scene, Vehicle

from .harness import MS, Channel, noise, packet, packets

TRIANGLE = ((50.0, 0.0), (60.0, 0.0), (55.0, 9.0))
CARS = (Vehicle(id=4), Vehicle(id=7, position=(10.0, 0.0, 0.0)))
NAN, INF = float("nan"), float("inf")


def _with(**change: object) -> Scene:
    """Two cars, the second one changed."""
    return Scene(vehicles=[CARS[0], dataclasses.replace(CARS[1], **change)])  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (_with(position=(0.0, NAN, 0.0)), "vehicle.position[1, 1] is nan; it must lie between"),
        (_with(position=(INF, 0.0, 0.0)), "vehicle.position[1, 0] is inf"),
        (_with(position=(0.0, 0.0, -1e9)), "vehicle.position[1, 2] is -1e+09"),
        (_with(heading=NAN), "vehicle.heading[1] is nan"),
        (_with(size=(4.0, -2.0, 1.0)), "vehicle.size[1, 1] is -2; it must lie between 0 and"),
        (_with(size=(4.0, 2.0, INF)), "vehicle.size[1, 2] is inf"),
        (_with(antenna_height=-1.0), "vehicle.antenna_height[1] is -1"),
        (_with(id=4), "vehicle.id[1] is 4 after 4; ids must ascend"),
        (_with(id=3), "vehicle.id[1] is 3 after 4; ids must ascend"),
        (_with(id=2**31), "vehicle.id[1] is 2147483648; ids are 0 to 2147483647"),
        (
            Scene(buildings=[Building(ring=TRIANGLE), Building(ring=TRIANGLE[:2])]),
            "building.index names building 1 2 times; a building has at least 3 corners",
        ),
        (
            Scene(buildings=[Building(ring=(*TRIANGLE, (NAN, 1.0)))]),
            "building.vertex[3, 0] is nan",
        ),
        (Scene(buildings=[Building(ring=TRIANGLE, height=NAN)]), "building.height[0] is nan"),
        (Scene(buildings=[Building(ring=TRIANGLE, height=-1.0)]), "building.height[0] is -1"),
    ],
)
def test_wrong_scenes(library: Library, scene: Scene, message: str) -> None:
    with pytest.raises(Refused, match=re.escape(message)), Channel(library, scene) as channel:
        channel.step(0.0, 0.1, [])


@pytest.mark.parametrize(
    ("index", "message"),
    [
        ([0, 0, 0, 1, 1, 2], "building.index[5] is 2; there are 2 buildings"),
        ([0, 0, 0, 1, 1, -1], "building.index[5] is -1; there are 2 buildings"),
        ([0, 0, 1, 1, 0, 1], "building.index[4] is 0 after 1; it must ascend"),
        ([1, 1, 1, 1, 1, 1], "building.index names building 0 0 times"),
    ],
)
def test_wrong_building_numbers(library: Library, index: list[int], message: str) -> None:
    scene = Scene(vehicles=CARS, buildings=[Building(ring=TRIANGLE), Building(ring=TRIANGLE)])
    with Channel(library, scene) as channel:
        channel.set("building.index", np.array(index))
        with pytest.raises(Refused, match=re.escape(message)):
            channel.step(0.0, 0.1, [])


@pytest.mark.parametrize(
    ("record", "message"),
    [
        (packet(1, 5, to=7), None),  # 5 has left, for all the channel knows
        (packet(1, 8), "packets[1].source: there is no vehicle 8"),
        (packet(1, -1), "packets[1].source: there is no vehicle -1"),
        (packet(1, 4, size=5000), "packets[1].size: 5000 bytes and 38 of headers do not fit"),
        (packet(1, 4, size=2**32 - 1), "packets[1].size: 4294967295 bytes"),
        (packet(1, 4, to=-2), "packets[1]: -2 is no vehicle"),
        (packet(1, 4, to=4), "packets[1]: vehicle 4 stands twice on the way"),
        (packet(1, 4, to=7, via=[7]), "packets[1]: vehicle 7 stands twice on the way"),
        (packet(1, 4, to=7, via=[-1, 5]), "packets[1].route: the second relay without a first"),
        (packet(0, 4), "packets: id 0 appears twice; ids are unique in a run"),
    ],
)
def test_wrong_packets(library: Library, record: np.ndarray, message: str | None) -> None:
    with Channel(library, Scene(vehicles=CARS)) as channel:
        if message is None:
            channel.step(0.0, 0.1, [packet(0, 4), record])
            return
        with pytest.raises(Refused, match=re.escape(message)):
            channel.step(0.0, 0.1, [packet(0, 4), record])


def test_a_source_without_a_radio(library: Library) -> None:
    with (
        Channel(library, _with(equipped=False)) as channel,
        pytest.raises(Refused, match=r"packets\[0\]\.source: vehicle 7 is not equipped"),
    ):
        channel.step(0.0, 0.1, [packet(1, 7)])


LAST_TIME = 4_000_000 * 10**9


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("access_category", 4, "access_category is 4; it must be 0 to 3"),
        ("kind", 5, "kind is 5; it must be 0 to 4"),
        ("kind", 4, "duration is 0; noise needs a duration"),
        ("duration", -1, "duration is -1 ns; it must be 0 to 2147483647"),
        ("duration", 2**31, "duration is 2147483648 ns; it must be 0 to 2147483647"),
        ("power_offset", NAN, "power_offset is nan dB; it must lie between -300 and 300"),
        ("power_offset", -INF, "power_offset is -inf dB; it must lie between -300 and 300"),
        ("power_offset", 301.0, "power_offset is 301 dB; it must lie between -300 and 300"),
        ("channel_offset", -2, "channel_offset is -2; only noise may lie beside the channel"),
        ("time", LAST_TIME, "time is 4000000000000000 ns; it must lie within 4e+06 s of 0"),
        ("time", -LAST_TIME, "time is -4000000000000000 ns; it must lie within 4e+06 s of 0"),
        ("time", 2**63 - 1, "time is 9223372036854775807 ns; it must lie within"),
        ("time", -(2**63), "time is -9223372036854775808 ns; it must lie within"),
    ],
)
def test_wrong_members_of_packets(library: Library, name: str, value: float, message: str) -> None:
    record = packet(1, 4)
    record[name] = value
    with (
        Channel(library, Scene(vehicles=CARS)) as channel,
        pytest.raises(Refused, match=re.escape(f"packets[0].{message}")),
    ):
        channel.step(0.0, 0.1, [record])


@pytest.mark.parametrize(
    ("name", "value"),
    [("power_offset", 300.0), ("power_offset", -300.0), ("duration", 2**31 - 1),
     ("channel_offset", 2**15 - 1), ("channel_offset", -(2**15)), ("time", 1 - LAST_TIME)],
)  # fmt: skip
def test_extreme_members_of_noise_are_fine(library: Library, name: str, value: float) -> None:
    record = noise(1, 4, time=0, duration=MS)
    record[name] = value
    with Channel(library, Scene(vehicles=CARS)) as channel:
        received = channel.step(0.0, 5.0, [record, packet(2, 7, time=10 * MS)])
    assert received["packet"].tolist() == [2]
    assert np.isfinite(received["power_dbm"]).all()


@pytest.mark.parametrize(("t", "h"), [(0.0, 4e6), (0.0, 1e300)])
def test_a_step_out_of_range(library: Library, t: float, h: float) -> None:
    with (
        Channel(library, Scene(vehicles=CARS)) as channel,
        pytest.raises(Refused, match=r"a step from 0 s over .* s is out of range"),
    ):
        channel.step(t, h, [])


def test_a_start_out_of_range(library: Library) -> None:
    with Instance(library) as channel:
        channel.enter_initialization(4e6)
        with pytest.raises(Refused, match=r"the start time 4e\+06 s is out of range"):
            channel.call("ExitInitializationMode")


def test_the_last_second_works_as_the_first(library: Library) -> None:
    scene, start = Scene(vehicles=CARS), 3_999_998.0
    found = []
    for begin in (0.0, start):
        with Channel(library, scene, start=begin, medium_access=False) as channel:
            received = channel.step(begin, 1.0, [packet(1, 4, time=int(begin) * 10**9 + MS)])
            state = channel.save()
            channel.restore(state)
            channel.step(begin + 1, 0.5, [])
        found.append((received["time"] - int(begin) * 10**9).tolist())
    assert found[0] == found[1]


GOOD = packets([packet(1, 4)])


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"PK", "packets: 2 bytes are too few"),
        (b"RCPT" + GOOD[4:], "packets: not a `PKTS` frame of version 1"),
        (GOOD[:4] + b"\2" + GOOD[5:], "packets: not a `PKTS` frame of version 1"),
        (GOOD[:12] + b"\x30" + GOOD[13:], "packets: records have 72 bytes, not 48"),
        (GOOD[:-1], "packets: a frame of 1 records has 88 bytes, not 87"),
        (GOOD + b"\0", "packets: a frame of 1 records has 88 bytes, not 89"),
        (GOOD[:8] + b"\xff" * 4 + GOOD[12:], "packets: a frame of 4294967295 records"),
    ],
)
def test_malformed_frames(library: Library, data: bytes, message: str) -> None:
    with Channel(library, Scene(vehicles=CARS)) as channel:
        channel.send(data)
        with pytest.raises(Refused, match=re.escape(message)):
            channel.step(0.0, 0.1)


def test_an_empty_signal_is_no_packets(library: Library) -> None:
    with Channel(library, Scene(vehicles=CARS)) as channel:
        channel.send(b"")
        assert len(channel.step(0.0, 0.1)) == 0


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"bitrate": 5e6}, "bitrate is 5e+06 bit/s; the rates of a 10 MHz channel are 3e6, 4.5e6"),
        ({"bitrate": NAN}, "`bitrate` is not a number"),
        ({"noise_floor": NAN}, "`noise_floor` is not a number"),
        ({"wall_loss": -1.0}, "wall_loss"),
        ({"maximum_range": INF}, "maximum_range"),
        ({"carrier_frequency": 0.0}, "carrier_frequency"),
        ({"busy_window": 0.0}, "busy_window"),
        ({"packet_lifetime": -1.0}, "packet_lifetime"),
        ({"model": 3.0}, "model"),
        ({"fading": 0.0}, "fading"),
        (
            {"cca_threshold": -100.0},
            "cca_threshold is -100 dBm; with a noise_floor of -98 dBm the medium would never be",
        ),
    ],
)
def test_wrong_parameters(library: Library, parameters: dict[str, float], message: str) -> None:
    with pytest.raises(Refused, match=re.escape(message)):
        Channel(library, Scene(vehicles=CARS), **parameters)


def test_the_record_layout_is_the_one_these_tests_damage() -> None:
    assert PACKET.itemsize == 72
