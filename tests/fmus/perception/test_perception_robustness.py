"""Restored states continue bit for bit; malformed input is refused with its place, never more."""

import contextlib
import re
import struct

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.apm import encode, join
from fmus.messages.records import FRAME, POINT, SENSOR
from tests.fmus.driver import Library, Refused
from tests.fmus.messages.apm.apms import apm_of

from .harness import Outputs, Perception
from .scene import Scan, car, cloud, look

EGO = 1


def drive(k: int) -> bytes:
    """What three sensors see of two cars in step `k`; the third sensor enters late."""
    boxes = [car(5, 14 - 0.9 * k, 7), car(6, -20 + 1.3 * k, -5, height=3.0)]
    origins = [(1, (0.3 * k, 0.0)), (2, (25.0, 3.0 - 0.4 * k)), (3, (-9.0, 11.0))]
    scans = [look(vehicle, at, boxes, time=k * 10**8) for vehicle, at in origins]
    return cloud(*scans[: 2 if k < 4 else 3])


def advance(unit: Perception, steps: range) -> list[Outputs]:
    """The outputs of these steps; every third transmission is lost."""
    found, sent = [], unit.outputs().messages if unit.time else []
    for k in steps:
        received = join([message for i, message in enumerate(sent) if (i + k) % 3])
        found.append(unit.step(drive(k), received, ego=EGO))
        sent = found[-1].messages
    return found


def bytes_of(outputs: list[Outputs]) -> list[tuple[bytes, ...]]:
    return [
        (o.apms_signal, o.objects_signal, o.centers.tobytes(), o.ranges.tobytes(),
         o.sharers.tobytes(), o.benefits.tobytes())
        for o in outputs
    ]  # fmt: skip


def test_a_restored_state_continues_bit_for_bit(library: Library) -> None:
    with Perception(library) as unit:
        advance(unit, range(5))
        state, time = unit.save(), unit.time
        expected = bytes_of(advance(unit, range(5, 9)))
        assert any(sharers for *_, sharers, _ in expected), "the scene must have matches"
        unit.restore(state)
        unit.time = time
        assert bytes_of(advance(unit, range(5, 9))) == expected
    with Perception(library) as fresh:
        fresh.begin()
        fresh.restore(state)
        fresh.time = time
        assert bytes_of(advance(fresh, range(5, 9))) == expected


def test_a_lost_track_is_forgotten(library: Library) -> None:
    """After `track_timeout`; else the state of a long run would grow without end."""

    def state_sizes(*, is_seen: bool) -> list[int]:
        sizes = []
        with Perception(library, track_timeout=0.5) as unit:
            for k in range(10):
                boxes = [car(5, 14, 7), car(6, -20, -5)] if is_seen and k == 0 else []
                unit.step(cloud(look(1, (9.0, 2.0), boxes, time=k * 10**8)))
                sizes.append(len(unit.save()))
        return sizes

    seen, unseen = state_sizes(is_seen=True), state_sizes(is_seen=False)
    assert [a > b for a, b in zip(seen, unseen, strict=True)] == [True] * 6 + [False] * 4
    assert seen[6:] == unseen[6:]


def test_two_runs_give_the_same_bytes(library: Library) -> None:
    runs = []
    for _ in range(2):
        with Perception(library) as unit:
            runs.append(bytes_of(advance(unit, range(8))))
    assert runs[0] == runs[1]


def fnv(data: bytes) -> int:
    """FNV-1a over 64 bits, the checksum of a serialized state."""
    value = 14695981039346656037
    for byte in data:
        value = (value ^ byte) * 1099511628211 % 2**64
    return value


HEADER = 40
"""What a state begins with [byte]."""
TRACK = 168
"""A track in a state [byte]: sensor, number, time, then 14 numbers, then counts."""


def sealed(state: bytes, place: int, piece: bytes) -> bytes:
    """The state with other bytes from `place` on, and the checksum that fits."""
    envelope = 24  # magic, checksum, size
    body = bytearray(state[envelope:])
    body[place - envelope : place - envelope + len(piece)] = piece
    return state[:8] + fnv(bytes(body)).to_bytes(8, "little") + state[16:envelope] + bytes(body)


@pytest.mark.parametrize("number", range(14))
def test_a_state_whose_tracks_are_no_numbers_is_refused(library: Library, number: int) -> None:
    """Axis, sides, velocity, travel, strayed sides; an axis of another length is none."""
    with Perception(library) as unit:
        advance(unit, range(3))
        good = unit.save()
        place = good.index(b"PRCP") + HEADER + 24 + 8 * number
        for value in (np.nan, np.inf, *([2.0] if number < 2 else [])):
            with Perception(library) as other:
                other.begin()
                other.restore(good)
                with pytest.raises(Refused):
                    other.restore(sealed(good, place, struct.pack("<d", value)))


def test_damaged_states_are_refused_or_harmless(library: Library) -> None:
    with Perception(library, layer=False, rows=2, columns=2) as unit:
        advance(unit, range(3))
        good = unit.save()
        start = good.index(b"PRCP")
        end = start + HEADER + TRACK
        for place in [*range(start, end), *range(end, len(good), 23)]:
            damaged = sealed(good, place, bytes([good[place] ^ 0x81]))
            with Perception(library, layer=False, rows=2, columns=2) as other:
                other.begin()
                with contextlib.suppress(Refused):
                    other.restore(damaged)
                    other.time = unit.time
                    advance(other, range(3, 4))


def test_before_the_first_scan_there_are_empty_frames(library: Library) -> None:
    with Perception(library) as unit:
        unit.begin()
        result = unit.outputs()
        assert result.messages == []
        assert len(result.objects) == 0
        assert len(result.apms_signal) == len(result.objects_signal) == FRAME.itemsize
        unit.set_inputs(b"")
        unit.advance()
        assert bytes_of([unit.outputs()]) == bytes_of([result])


def test_a_sensor_that_sees_nothing_has_an_empty_matrix(library: Library) -> None:
    with Perception(library) as unit:
        (apm,) = unit.step(cloud(Scan(vehicle=4, points=np.zeros((0, 3)))), ego=4).apms
    assert not apm.cells.any()


# ---- sizes


@pytest.mark.parametrize("name", ["rows", "columns"])
def test_a_matrix_without_rows_or_columns_is_refused_by_name(library: Library, name: str) -> None:
    with pytest.raises(Refused, match=rf"element 0 of `{name}` is 0, allowed are 1 to 1024"):
        Perception(library, **{name: 0})


@pytest.mark.parametrize(
    ("size", "cell"), [(1, 0.5), (1, 50.0), (1024, 0.1), (1024, 5.0), (1024, 1000.0)]
)
def test_the_smallest_and_the_largest_matrix_work(library: Library, size: int, cell: float) -> None:
    """The whole matrix within the horizon is blind, and a sharer sees all of it."""
    road = [np.array([(-9e8, -9e8), (9e8, -9e8), (9e8, 9e8), (-9e8, 9e8)])]
    sharer = apm_of([[1]], vehicle=2, heading=1.0, cell=4 * size * cell)
    settings = {"rows": size, "columns": size, "cell": cell, "region_share": 0.0}
    settings |= {"near_field": 0.0, "horizon": 40.0, "window_largest": 1024, "n_blind_zone": 4096}
    settings |= {"benefit_threshold": 0.0}
    with Perception(library, **settings) as unit:
        empty = cloud(Scan(vehicle=EGO, points=np.zeros((0, 3))))
        result = unit.step(empty, join([encode(sharer)]), ego=EGO, road=road)
    (apm,) = result.apms
    assert apm.cells.shape == (size, size)
    expected = min((size * cell) ** 2, np.pi * 40.0**2)
    (found,) = result.benefits
    assert found == pytest.approx(expected, rel=0.05)


# ---- malformed points


def with_sensor(field: str, value: object, index: int = 1) -> bytes:
    """Two scans, with one field of one SENSOR record replaced."""
    points = np.ones((4, 3))
    signal = bytearray(cloud(Scan(vehicle=3, points=points), Scan(vehicle=8, points=points)))
    start = FRAME.itemsize + index * SENSOR.itemsize
    record = np.frombuffer(signal, SENSOR, 1, start).copy()
    record[field] = value
    signal[start : start + SENSOR.itemsize] = record.tobytes()
    return bytes(signal)


def with_point(value: float) -> bytes:
    """Two scans; one coordinate of the third point of the second one is replaced."""
    points = np.ones((4, 3))
    signal = bytearray(cloud(Scan(vehicle=3, points=points), Scan(vehicle=8, points=points)))
    start = len(signal) - 2 * POINT.itemsize + 4
    signal[start : start + 4] = np.float32(value).tobytes()
    return bytes(signal)


GOOD = with_sensor("vehicle", 8)


@pytest.mark.parametrize(
    ("points", "wrong"),
    [
        (b"LPTS", "points: a frame has at least 16 bytes, not 4"),
        (b"APMS" + GOOD[4:], "points: not an `LPTS` frame of version 1"),
        (GOOD[:4] + b"\2" + GOOD[5:], "points: not an `LPTS` frame of version 1"),
        (GOOD[:12] + b"\1" + GOOD[13:], "points: sensor records have 72 bytes, not 1"),
        (GOOD[:100], "points: the frame of 2 sensors is cut short at 100 bytes"),
        (GOOD[:8] + b"\xff" * 4 + GOOD[12:], "the frame of 4294967295 sensors is cut short"),
        (GOOD[:-1], "points: 159 bytes after the sensors are no whole number of points"),
        (GOOD[:-20], "points: the sensor of vehicle 8 has points 4..8, but there are 7"),
        (with_sensor("first", 2**32 - 1), "has points 4294967295..4294967299, but there are 8"),
        (with_sensor("count", 2**32 - 1), "has points 4..4294967299, but there are 8"),
        (with_sensor("vehicle", -1), "points: sensor 1 is on vehicle -1, must be 0..2^31-1"),
        (with_sensor("vehicle", 2**31), "points: sensor 1 is on vehicle 2147483648"),
        (with_sensor("vehicle", 3), "points: sensors 0 and 1 are both on vehicle 3"),
        (with_sensor("time", -5), "points: the scan of vehicle 8 was taken at -5 ns"),
        (with_sensor("time", 2**63 - 1), "the scan of vehicle 8 was taken at 9223372036854775807"),
        (with_sensor("position", [0, np.inf, 2]), "points: position[1] of the sensor of vehicle 8"),
        (with_sensor("heading", np.nan), "points: heading of the sensor of vehicle 8 is"),
        (with_sensor("pitch", 1e300), "points: pitch of the sensor of vehicle 8 is 1e+300"),
        (with_sensor("roll", -np.inf), "points: roll of the sensor of vehicle 8 is -inf"),
        (with_point(np.nan), "points: point 2 of the sensor of vehicle 8 is (1, "),
        (with_point(np.inf), "points: point 2 of the sensor of vehicle 8 is (1, inf, "),
    ],
)
def test_malformed_points_are_refused_with_the_place(
    library: Library, points: bytes, wrong: str
) -> None:
    with Perception(library) as unit, pytest.raises(Refused, match=re.escape(wrong)):
        unit.step(points, ego=8)


def test_a_route_that_is_not_finite_is_refused(library: Library) -> None:
    route = np.array([[0.0, 1.0], [2.0, np.nan]])
    with Perception(library) as unit, pytest.raises(Refused, match=r"route\.vertex\[1, 1\] is"):
        unit.step(GOOD, ego=8, route=route)


def test_contradicting_parameters_are_refused(library: Library) -> None:
    with (
        Perception(library, window_smallest=3, window_largest=2) as unit,
        pytest.raises(Refused, match="window_smallest is 3 cells, must not exceed"),
    ):
        unit.begin()


def test_points_beyond_every_matrix_are_ignored(library: Library) -> None:
    points = np.array([[3e38, 3e38, 0], [-3e38, 1, 1], [1e9, -1e9, -3e38], [1, 1, 3e38]])
    with Perception(library) as unit:
        (apm,) = unit.step(cloud(Scan(vehicle=4, points=points, instances=5)), ego=4).apms
    assert not apm.cells.any()


@given(st.binary(max_size=120), st.integers(0, 400), st.binary(max_size=12))
def test_noise_is_refused_or_understood_never_anything_else(
    library: Library, noise: bytes, place: int, patch: bytes
) -> None:
    patched = GOOD[:place] + patch + GOOD[place + len(patch) :]
    for points in (noise, b"LPTS\1\0\0\0" + noise, patched):
        with Perception(library) as unit, contextlib.suppress(Refused):
            result = unit.step(points, join([noise, b"APMM" + noise]), ego=8)
            assert len(result.apms) <= 2
