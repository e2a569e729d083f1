"""The Binary inputs of units: packets, scans, received matrices; sound, strange or damaged."""

from typing import Final

import numpy as np

from fmus.messages.apm import Apm, encode, join
from fmus.messages.records import APM_LAYER_CELL, NOISE, PACKET, POINT, SENSOR, frame
from orchestrator.signal import Array
from tests.reliability.episodes.scenes import FARTHEST, ids
from tests.reliability.episodes.values import HOSTILE, coordinates

_FAR: Final = 1e6
_LONGEST: Final = 4095 - 38


def packets(rng: np.random.Generator, numbers: Array, now: int, first: int) -> bytes:
    """Packets that vehicles send.

    Args:
        rng: the source of chance.
        numbers: of the vehicles that have a radio, shape (vehicle,).
        now: the communication point [ns].
        first: the number of the first packet.
    """
    count = int(rng.choice((0, 1, 3, 20, 60))) if len(numbers) else 0
    records = np.zeros(count, PACKET)
    records["id"] = first + rng.permutation(count)
    width = 10 ** rng.uniform(0, 9.5)
    limit = int(3.9e15)
    times = now + (rng.uniform(-0.2, 1, count) * width * (rng.random() < 0.8)).astype(np.int64)
    records["time"] = np.clip(times, -limit, limit)
    for record in records:
        way = rng.permutation(numbers)[: int(rng.integers(1, 5))]
        record["source"] = way[0]
        record["destination"] = way[-1] if len(way) > 1 else -1
        relays = way[1:-1]
        record["route"] = [*relays, *[-1] * (2 - len(relays))]
    records["duration"] = 10 ** rng.uniform(0, 9.3, count) * (rng.random(count) < 0.3)
    records["power_offset"] = rng.choice((0, 1, 10, 300), count) * rng.uniform(-1, 1, count)
    records["size"] = np.minimum(10 ** rng.uniform(0, 3.7, count), _LONGEST)
    records["access_category"] = rng.integers(0, 4, count)
    records["kind"] = rng.choice((0, 1, 2, 3, NOISE), count)
    is_noise = records["kind"] == NOISE
    records["duration"] += is_noise
    records["channel_offset"] = rng.choice((-3, -1, 0, 1, 3, 32767, -32768), count) * is_noise
    order = np.lexsort((records["id"], records["time"]))
    return frame("PKTS", records[order])


def scans(rng: np.random.Generator, now: int) -> tuple[bytes, Array]:
    """Scans of some sensors, and the vehicles that carry them, shape (vehicle,)."""
    carriers = ids(rng, int(rng.choice((0, 1, 2, 4))))
    sensors = np.zeros(len(carriers), SENSOR)
    points: list[Array] = []
    for sensor, carrier in zip(sensors, carriers, strict=True):
        found = _points(rng)
        sensor["vehicle"], sensor["time"] = carrier, max(now, 0)
        sensor["position"] = coordinates(rng, 1, 3, FARTHEST)[0]
        sensor["heading"], sensor["pitch"], sensor["roll"] = _angles(rng)
        sensor["first"], sensor["count"] = sum(len(each) for each in points), len(found)
        points.append(found)
    return frame("LPTS", sensors, b"".join(each.tobytes() for each in points)), carriers


def _angles(rng: np.random.Generator) -> Array:
    most = rng.choice((0.0, 1.0, 10.0, 1e6))
    angles: Array = most * rng.uniform(-1, 1, 3)
    return angles


def _points(rng: np.random.Generator) -> Array:
    count = int(rng.choice((0, 1, 2, 30, 400, 2000), p=(0.1, 0.1, 0.1, 0.3, 0.3, 0.1)))
    records = np.zeros(count, POINT)
    if rng.random() < 0.6:  # bodies and ground before a sensor
        angle, distance = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, 60, count)
        height = rng.choice((-2.0, -1.5, -0.5, 1.0), count)
        found = np.stack([distance * np.cos(angle), distance * np.sin(angle), height], axis=1)
        if rng.random() < 0.5:
            found = np.round(found)
    else:
        found = coordinates(rng, count, 3, float(rng.choice((1e3, 1e8, 1e30))))
    records["position"] = found
    records["intensity"] = rng.random(count)
    records["instance"] = rng.choice((-1, -2, 0, 5, 2**31 - 1, -(2**31)), count)
    return records


def received(rng: np.random.Generator, now: int) -> bytes:
    """Matrices of other vehicles, plain and compressed, some of them damaged."""
    messages = []
    for _ in range(int(rng.integers(0, 5))):
        message = encode(_apm(rng, now), compressed=bool(rng.random() < 0.3))
        messages.append(damaged(rng, message) if rng.random() < 0.3 else message)
    return join(messages)


def _apm(rng: np.random.Generator, now: int) -> Apm:
    shape = tuple(rng.choice((1, 2, 7, 20), 2))
    levels = int(rng.choice((0, 0, 1, 15, 255)))
    cells = rng.integers(0, levels + 1 if levels else int(rng.choice((2, 300, 2**32 - 1))), shape)
    cells[rng.random(shape) < rng.choice((0.0, 0.5, 1.0))] = 0
    layer = None
    if rng.random() < 0.5:
        bytes_of = rng.integers(0, 256, (*shape, 4), np.uint8)
        bytes_of[cells == 0] = 0
        layer = bytes_of.view(APM_LAYER_CELL)[..., 0]
    place = coordinates(rng, 1, 2, _FAR)[0]
    return Apm(
        vehicle=int(rng.choice((0, 1, 2, 7, 2**31 - 1))),
        time=max(0, now - int(10 ** rng.uniform(0, 10)) * int(rng.integers(0, 2))),
        position=place,
        heading=float(_angles(rng)[0]),
        center=place + rng.uniform(-1, 1, 2) * rng.choice((0.0, 50.0, 1e5)),
        cell=float(np.float32(10 ** rng.uniform(-6, 8))),
        cells=cells.astype(np.uint32),
        layer=layer,
        levels=levels,
    )


def damaged(rng: np.random.Generator, data: bytes) -> bytes:
    """The bytes with some of them changed, a hostile number in them, cut short or longer."""
    found = bytearray(data)
    for _ in range(int(rng.integers(1, 4))):
        if not found:
            break
        at = int(rng.integers(0, len(found)))
        match rng.integers(0, 4):
            case 0:
                found[at] ^= 1 << int(rng.integers(0, 8))
            case 1:
                word = at - at % 8
                number = np.float64(rng.choice(HOSTILE)).tobytes()
                found[word : word + 8] = number[: len(found) - word]
            case 2:
                word = at - at % 4
                number = np.uint32(rng.choice((0, 1, 2**31, 2**32 - 1))).tobytes()
                found[word : word + 4] = number[: len(found) - word]
            case _:
                del found[at:]
    return bytes(found) + bytes(int(rng.choice((0, 0, 0, 8))))
