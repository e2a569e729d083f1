"""CPMs: what the encoding does to their contents, how long they are, which bits they have."""

import contextlib
import dataclasses
import importlib.util
import math
import os
import re
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.facilities import CpmFacilities, cpm
from fmus.facilities.cpm import Cpm, CpmError, Segment, decode, encode
from fmus.facilities.perceived_object import to_element, to_record
from fmus.messages.records import OBJECT
from orchestrator.errors import ComponentTypeError
from tests.fmus.boxes import put

asn1tools: Any = pytest.importorskip("asn1tools", reason="the extra `cpm` is not installed")

MILLISECOND = 1_000_000


@st.composite
def objects(draw: st.DrawFn, time: int, count: int) -> np.ndarray:
    seeds = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seeds)
    rows = np.zeros(count, OBJECT)
    rows["sensor"] = 20
    rows["instance"] = rng.permutation(2**16)[:count]
    rows["time"] = time - rng.integers(0, 2040, count) * MILLISECOND
    rows["position"] = rng.uniform(-1000, 1000, (count, 2))
    rows["angle"] = rng.uniform(0, np.radians(89.9), count)
    rows["size"] = rng.uniform(0, 25.4, (count, 2))
    rows["height"] = rng.uniform(0.0, 5.0, count)
    rows["velocity"] = rng.uniform(-160, 160, (count, 2))
    return rows


@st.composite
def messages(draw: st.DrawFn) -> Cpm:
    time = draw(st.integers(0, 10**6)) * MILLISECOND
    count = draw(st.integers(0, 40))
    return Cpm(
        station=20,
        time=time,
        position=np.array([draw(st.floats(-300, 300)), draw(st.floats(-300, 300))]),
        heading=draw(st.floats(-10, 10)),
        objects=draw(objects(time, count)),
        ages=np.arange(count) * 50 * MILLISECOND,
        perceived=count,
        sensor_range=draw(st.none() | st.floats(0.1, 409.5)),
        segment=draw(st.none() | st.builds(Segment, number=st.integers(1, 8), total=st.just(8))),
    )


def plain(count: int, **changes: Any) -> Cpm:
    values: dict[str, Any] = {
        "station": 20,
        "time": 0,
        "position": np.zeros(2),
        "heading": 0.0,
        "objects": np.zeros(count, OBJECT),
        "ages": np.zeros(count, np.int64),
        "perceived": count,
    }
    return Cpm(**(values | changes))


@settings(deadline=None)
@given(messages())
def test_what_arrives_is_what_was_sent_within_the_resolution_of_the_message(sent: Cpm) -> None:
    found = decode(encode(sent))
    assert (found.station, found.time, found.segment) == (sent.station, sent.time, sent.segment)
    assert found.position == pytest.approx(sent.position, abs=0.006)  # half of 1e-7 degrees
    turn = math.remainder(found.heading - sent.heading, 2 * math.pi)
    assert abs(turn) <= math.radians(0.1) + 1e-9
    if sent.sensor_range is None:
        assert found.sensor_range is None
    else:
        assert found.sensor_range == pytest.approx(sent.sensor_range, abs=0.1)
    for name in ("sensor", "time", "instance"):
        np.testing.assert_array_equal(found.objects[name], sent.objects[name])
    np.testing.assert_array_equal(found.ages, np.minimum(sent.ages, 2047 * MILLISECOND))
    _assert_rounded_up(found.objects["velocity"], sent.objects["velocity"], 0.01)
    _assert_rounded_up(found.objects["position"], sent.objects["position"], 0.01)
    _assert_rounded_up(found.objects["size"], np.maximum(sent.objects["size"], 0.1), 0.1)
    _assert_rounded_up(found.objects["angle"], sent.objects["angle"], math.radians(0.1))
    _assert_rounded_up(found.objects["height"], np.maximum(sent.objects["height"], 0.1), 0.1)


@settings(deadline=None)
@given(messages())
def test_a_message_that_is_sent_on_does_not_change(sent: Cpm) -> None:
    """The first encoding rounds; another one of what arrived finds nothing left to round."""
    once = decode(encode(sent))
    assert encode(once) == encode(dataclasses.replace(sent, heading=once.heading))


@settings(max_examples=20)
@given(st.integers(0, 12), st.randoms(use_true_random=False))
def test_a_damaged_message_is_refused_by_name(count: int, random: Random) -> None:
    """Whatever the bits are, it is a message or a `CpmError`, and never takes long."""
    whole = encode(plain(count, sensor_range=50.0))
    for _ in range(10):
        damaged = bytearray(whole[: random.randint(0, len(whole))])
        for _ in range(random.randint(0, 4) if damaged else 0):
            damaged[random.randrange(len(damaged))] ^= 1 << random.randrange(8)
        with contextlib.suppress(CpmError):
            assert isinstance(decode(bytes(damaged)), Cpm)
    with pytest.raises(CpmError, match="no collective perception message"):
        decode(b"")


@pytest.mark.parametrize(
    ("field", "value", "found"),
    [
        ("velocity", (500.0, -500.0), (163.82, -163.83)),
        ("height", 99.0, 25.5),
        ("height", 0.0, 0.1),
    ],
)
def test_what_does_not_fit_becomes_the_end_of_the_range(
    field: str, value: object, found: object
) -> None:
    message = plain(1)
    message.objects[field] = value
    assert decode(encode(message)).objects[field][0] == pytest.approx(found)


def test_a_box_turned_by_quarters_is_one_whose_sides_change_places() -> None:
    """Whichever side others call the first one: 100 degrees are 10, along the other side."""
    message = plain(1)
    message.objects["size"] = 4.5, 1.75
    row = to_element(message.objects[0], 0, message.time, np.array(message.position))
    found = []
    for steps in (100, 1000, 1900, 2800):
        row["angles"] = {"zAngle": {"value": steps, "confidence": 127}}
        one = to_record(row, 20, message.time, np.zeros(2))
        assert one["angle"] == pytest.approx(math.radians(10.0))
        found.append(one["size"].tolist())
    long, across = [pytest.approx(each) for each in ([4.5, 1.8], [1.8, 4.5])]
    assert found == [long, across, long, across]


def test_an_angle_that_is_rounded_to_a_quarter_turn_is_none() -> None:
    message = plain(1)
    message.objects["size"], message.objects["angle"] = (4.0, 2.0), math.radians(89.95)
    (found,) = decode(encode(message)).objects
    assert (found["angle"], *found["size"]) == pytest.approx((0.0, 2.0, 4.0))


def test_a_body_of_unknown_length_is_taken_for_25_5_m() -> None:
    message = plain(1)
    message.objects["size"] = [40.0, 3.0]
    assert decode(encode(message)).objects["size"][0] == pytest.approx([25.5, 3.0])


def test_track_numbers_go_round_after_16_bits() -> None:
    message = plain(1)
    message.objects["instance"] = 2**16 + 5
    assert decode(encode(message)).objects["instance"].tolist() == [5]


def test_a_scan_older_than_two_seconds_is_sent_as_two_seconds_old() -> None:
    message = plain(1, time=10_000 * MILLISECOND)
    assert decode(encode(message)).objects["time"].tolist() == [(10_000 - 2048) * MILLISECOND]


def test_sizes() -> None:
    """Header, management and vehicle container; 254 bits per object (docs/physics-sharing.md)."""
    sizes = {n: len(encode(plain(n))) for n in (0, 1, 2, 10, 30, 60)}
    assert sizes == {0: 32, 1: 68, 2: 100, 10: 355, 30: 990, 60: 1943}
    assert len(encode(plain(0, sensor_range=50.0))) == 32 + 8
    for n in (10, 30, 60):
        assert 31.5 < (sizes[n] - sizes[1]) / (n - 1) < 32.0
    assert all(len(encode(plain(n))) <= cpm.longest(n) for n in (0, 1, 10, 60))


def test_the_bits_are_those_of_etsis_modules() -> None:
    """Made once from ETSI's modules, TS 103 324 V2.1.1 and CDD V2.4.1, and values by hand."""
    message = plain(
        1,
        station=4711,
        time=12_340 * MILLISECOND,
        position=np.array([12.5, -7.25]),
        heading=0.75,
        sensor_range=50.0,
        ages=np.array([700 * MILLISECOND]),
    )
    message.objects["instance"], message.objects["time"] = 99, 12_300 * MILLISECOND
    put(message.objects, [20.0, 3.0], [24.5, 4.75])
    message.objects["height"], message.objects["velocity"] = 1.5, [-8.25, 0.5]
    assert encode(message).hex() == GOLDEN


GOLDEN = (
    "020e00001267026941bc1ef296cda7ab825cad87ffffff08eddd0fa00301d7fc206004022107d204"
    "2200805a7b0031bec203cffff81167ffe798dfa018fe0003f077c47e59f57800020064"
)


@pytest.mark.skipif(
    "ETSI_ASN1" not in os.environ,
    reason="ETSI_ASN1 does not name a folder with the modules from forge.etsi.org/rep/ITS/asn1",
)
@settings(deadline=None, max_examples=200)
@given(messages())
def test_etsis_own_modules_read_and_write_the_same_bits(sent: Cpm) -> None:
    codec = _etsis_codec(Path(os.environ["ETSI_ASN1"]))
    encoded = encode(sent)
    message = codec.decode("CollectivePerceptionMessage", encoded)
    names = {
        1: "OriginatingVehicleContainer",
        3: "SensorInformationContainer",
        5: "PerceivedObjectContainer",
    }
    for container in message["payload"]["cpmContainers"]:
        name = names[container["containerId"]]
        content = codec.decode(name, container["containerData"])
        container["containerData"] = codec.encode(name, content)
    assert codec.encode("CollectivePerceptionMessage", message) == encoded


def test_without_the_library_the_error_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(ComponentTypeError, match=r"pip install 'nlosim\[cpm\]'"):
        CpmFacilities(CpmFacilities.Parameters())


_CODECS: dict[Path, Any] = {}


def _etsis_codec(folder: Path) -> Any:
    """ETSI's modules, with two constraints written so that asn1tools 0.169 sees what they mean.

    It takes a union of values for its first value, and keeps the extension marker of a size
    constraint that another constraint follows.
    """
    if folder not in _CODECS:
        text = "\n".join(
            path.read_text("utf-8", "replace") for path in sorted(folder.glob("*.asn"))
        )
        text, unions = re.subn(r"\(unknown\|passengerCar\.\.tram\|agricultural\)", "(0..14)", text)
        text, sizes = re.subn(
            r"(WrappedCpmContainers\s*::=.*?SIZE)\(1\.\.8,\.\.\.\)", r"\1(1..8)", text
        )
        assert unions <= 1
        assert sizes <= 1
        _CODECS[folder] = asn1tools.compile_string(text, "uper")
    return _CODECS[folder]


def _assert_rounded_up(found: np.ndarray, sent: np.ndarray, step: float) -> None:
    assert (found >= sent - 1e-6).all()
    assert (found < sent + step + 1e-6).all()
