"""What frames do to each other: interference, lock, capture, half duplex, carrier sense."""

import math
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given, settings, strategies as st

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Scene, Vehicle

from .harness import AIRTIME, LIGHT_SPEED, MS, US, Channel, noise, outcomes, packet
from .reference import Receiver, Sending, receive

NOISE_FLOOR = -98.0
POWER = 26.0
# free space, packets on air at their times; snir of the centre alone unless a test says otherwise
PLAIN = {"medium_access": False, "vehicle_shadowing": False, "frame_capture": False}
CENTERED = {**PLAIN, "band_edges": False}


def _around(*distances: float) -> Scene:
    """Vehicle 0 and others at these distances from it, in different directions."""
    cars = [Vehicle(id=0)]
    for k, d in enumerate(distances, start=1):
        cars.append(Vehicle(id=k, position=(d * math.cos(2.0 * k), d * math.sin(2.0 * k), 0.0)))
    return Scene(vehicles=cars)


def _power(distance: float, power_offset: float = 0.0) -> float:
    """Received over free space [mW]."""
    wavelength = LIGHT_SPEED / 5.9e9
    gain = (wavelength / (4 * math.pi * distance)) ** 2
    return float(10 ** ((POWER + power_offset) / 10) * gain)


def _db(factor: float) -> float:
    return 10 * math.log10(factor)


def _at_0(
    library: Library, scene: Scene, records: Sequence[Array], **parameters: float
) -> dict[int, Any]:
    """Receptions of vehicle 0, by packet."""
    with Channel(library, scene, **parameters) as channel:
        received = channel.step(0.0, 0.1, records)
    return {int(r["packet"]): r for r in received if r["receiver"] == 0}


# when each interferer begins after the frame [us], how strong it is [dB], and which of them are on
# air together when they are strongest; airtime 368 us, arrival 0.3 us after the frame's
@pytest.mark.parametrize(
    ("begins", "strengths", "together"),
    [
        ((100,), (0,), {1}),
        ((-337, 300), (9, 0), {2}),  # the first one is over when the preamble is
        ((-336, 300), (9, 0), {1}),  # 0.3 us later it is not
        ((368, 300), (9, 0), {2}),  # begins after the end
        ((367, 300), (0, 0), {1, 2}),  # both on air in the last microsecond
        ((-300, 69), (3, 0), {1}),  # over when the second one begins
        ((-300, 67), (3, 0), {1, 2}),
        ((-200, 100, 300), (0, 0, 0), {2, 3}),  # the first one ends at 168 us
        ((-250, 50, 200), (0, 0, -9), {1, 2}),  # the third one is weak
        ((-100, -100, 200), (0, 0, 0), {1, 2, 3}),
    ],
)
def test_the_snir_counts_the_most_that_is_on_air_at_once(
    library: Library, begins: tuple[int, ...], strengths: tuple[int, ...], together: set[int]
) -> None:
    records = [packet(0, 1, time=MS)] + [
        packet(k, k + 1, time=MS + begin * US, power_offset=strength - 20)
        for k, (begin, strength) in enumerate(zip(begins, strengths, strict=True), start=1)
    ]
    records.sort(key=lambda r: (int(r["time"]), int(r["id"])))
    # too weak to be locked to, not too weak to interfere
    scene = _around(200.0, 300.0, 300.0, 300.0)
    found = _at_0(library, scene, records, **CENTERED, sensitivity=-75.0)
    interference = sum(_power(300.0, strengths[k - 1] - 20) for k in together)
    expected = _db(_power(200.0) / (interference + 10 ** (NOISE_FLOOR / 10)))
    assert found[0]["snir_db"] == pytest.approx(expected, abs=1e-5)
    assert all(OUTCOMES[found[k]["outcome"]] == "U" for k in range(1, len(begins) + 1))


@pytest.mark.parametrize("strength", [-3, -10, -20, -40, -60])
def test_interference_counts_however_weak_it_is(library: Library, strength: float) -> None:
    noise_floor = 10 ** (NOISE_FLOOR / 10)
    offset = NOISE_FLOOR + strength - _db(_power(300.0))
    records = [packet(0, 1, time=MS), packet(1, 2, time=MS + 100 * US, power_offset=offset)]
    scene = _around(200.0, 300.0)
    found = _at_0(library, scene, records, **CENTERED, weak_receptions=False)
    expected = _db(_power(200.0) / (noise_floor * (1 + 10 ** (strength / 10))))
    # what is 50 dB below the noise is left out
    assert found[0]["snir_db"] == pytest.approx(expected, abs=4.4e-5)


@pytest.mark.parametrize(
    ("strength", "margin", "counts"),
    [(-15, 20.0, True), (-25, 20.0, False), (-25, 30.0, True), (-1, 0.0, False), (-70, 80.0, True)],
)
def test_interference_below_the_margin_is_left_out(
    library: Library, strength: float, margin: float, counts: bool
) -> None:
    noise_floor = 10 ** (NOISE_FLOOR / 10)
    offset = NOISE_FLOOR + strength - _db(_power(300.0))
    records = [packet(0, 1, time=MS), packet(1, 2, time=MS + 100 * US, power_offset=offset)]
    scene = _around(200.0, 300.0)
    quiet = {**CENTERED, "interference_margin": margin}
    found = _at_0(library, scene, records, **quiet, weak_receptions=False)
    noise = noise_floor * (1 + 10 ** (strength / 10) * counts)
    assert found[0]["snir_db"] == pytest.approx(_db(_power(200.0) / noise), abs=1e-8)
    # what is told of anyway counts in any case
    told = _at_0(library, scene, records, **quiet, weak_receptions=True)
    noise = noise_floor * (1 + 10 ** (strength / 10))
    assert told[0]["snir_db"] == pytest.approx(_db(_power(200.0) / noise), abs=1e-8)


def test_what_comes_from_far_interferes_after_it_has_ended_at_its_transmitter(
    library: Library,
) -> None:
    far = 15_000.0  # 50 us away, and too weak to be noticed
    first = packet(0, 2, time=MS)
    second = packet(1, 1, time=MS + AIRTIME + US)
    quiet = {"weak_receptions": False, "maximum_range": 2 * far}
    found = _at_0(library, _around(200.0, far), [first, second], **CENTERED, **quiet)
    assert list(found) == [1]
    expected = _db(_power(200.0) / (_power(far) + 10 ** (NOISE_FLOOR / 10)))
    assert found[1]["snir_db"] == pytest.approx(expected, abs=1e-5)


def test_a_frame_that_was_given_up_for_a_stronger_one_does_not_end_its_reception(
    library: Library,
) -> None:
    records = [
        packet(0, 1, time=MS, power_offset=-20),
        packet(1, 2, time=MS + 100 * US),
        packet(2, 3, time=MS + 400 * US, power_offset=-20),  # the first one is over
    ]
    capturing = {**CENTERED, "frame_capture": True}
    found = _at_0(library, _around(200.0, 200.0, 200.0), records, **capturing)
    assert [OUTCOMES[found[k]["outcome"]] for k in range(3)] == ["C", "R", "B"]


@st.composite
def _traffic(draw: st.DrawFn) -> tuple[Scene, list[Array], dict[str, float]]:
    places = draw(
        st.lists(
            st.tuples(st.integers(-700, 700), st.integers(-700, 700)),
            min_size=2, max_size=5, unique=True,
        )
    )  # fmt: skip
    cars = [Vehicle(id=k, position=(float(x), float(y), 0.0)) for k, (x, y) in enumerate(places)]
    records = []
    for number in range(draw(st.integers(1, 9))):
        source = draw(st.integers(0, len(cars) - 1))
        time = draw(st.integers(0, 1200)) * US
        offset = draw(st.integers(-30, 5))
        if draw(st.integers(0, 3)) == 0:
            records.append(
                noise(number, source, time=time, power_offset=offset,
                      duration=draw(st.integers(1, 900)) * US,
                      channel_offset=draw(st.integers(-4, 4)))
            )  # fmt: skip
        else:
            size = draw(st.integers(0, 400))
            records.append(packet(number, source, time=time, power_offset=offset, size=size))
    parameters = {"sensitivity": draw(st.sampled_from([-94.0, -85.0, -75.0]))}
    if draw(st.booleans()):
        parameters |= {"frame_capture": True, "capture_margin": draw(st.sampled_from([3.0, 10.0]))}
    records.sort(key=lambda r: (int(r["time"]), int(r["id"])))
    return Scene(vehicles=cars), records, {**PLAIN, **parameters}


@given(_traffic())
@settings(max_examples=150, deadline=None)
def test_random_overlaps_end_as_a_look_at_every_instant_says(
    library: Library, case: tuple[Scene, list[Array], dict[str, float]]
) -> None:
    scene, records, parameters = case
    with Channel(library, scene, **parameters) as channel:
        received = channel.step(0.0, 0.1, records)
        sent = channel.transmissions()
    of = {int(r["id"]): r for r in records}
    sendings = [
        Sending(
            number=int(t["packet"]), source=int(t["transmitter"]), start=int(t["time"]),
            duration=int(t["duration"]), power_dbm=POWER + float(of[t["packet"]]["power_offset"]),
            is_noise=bool(of[t["packet"]]["kind"] == 4),
            channel_offset=int(of[t["packet"]]["channel_offset"]),
        )
        for t in sent
    ]  # fmt: skip
    assert len(sendings) == len(records)
    margin = parameters["capture_margin"] if parameters["frame_capture"] else math.inf
    for car in scene.vehicles:
        receiver = Receiver(
            id=car.id, noise_dbm=NOISE_FLOOR, sensitivity_dbm=parameters["sensitivity"],
            capture_margin_db=margin,
        )  # fmt: skip
        distances = {other.id: math.dist(car.position, other.position) for other in scene.vehicles}
        expected = receive(receiver, distances, sendings)
        found = {int(r["packet"]): r for r in received if r["receiver"] == car.id}
        assert found.keys() == expected.keys()
        for number, fate in expected.items():
            letter = OUTCOMES[found[number]["outcome"]]
            assert letter in ("RNC" if fate.letter == "D" else fate.letter)
            assert found[number]["time"] == -(-fate.end // 1000)
            assert found[number]["snir_db"] == pytest.approx(fate.snir_db, abs=1e-5, nan_ok=True)


def test_a_receiver_stays_with_the_first_frame(library: Library) -> None:
    records = [packet(1, 1, time=MS), packet(2, 2, time=MS + 100 * US)]
    found = _at_0(library, _around(200.0, 100.0), records, **PLAIN)
    assert [OUTCOMES[found[k]["outcome"]] for k in (1, 2)] == ["C", "B"]
    assert found[1]["snir_db"] < 0
    assert math.isnan(found[2]["snir_db"])


@pytest.mark.parametrize(
    ("start", "letter"),
    [(-367, "T"), (-369, "R"), (-100, "T"), (0, "T"), (100, "T"), (367, "T"), (369, "R")],
)
def test_a_radio_that_sends_receives_nothing(library: Library, start: int, letter: str) -> None:
    """The frame begins before, with or during an own one; `start` is that of the own one [us]."""
    records = [packet(1, 1, time=2 * MS), packet(2, 0, time=2 * MS + start * US)]
    records.sort(key=lambda r: int(r["time"]))
    assert OUTCOMES[_at_0(library, _around(20.0), records, **PLAIN)[1]["outcome"]] == letter


@pytest.mark.parametrize("start", [-AIRTIME, AIRTIME])
def test_a_frame_that_ends_where_an_own_one_begins_is_received_and_vice_versa(
    library: Library, start: int
) -> None:
    on_one_spot = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1)])
    records = [packet(1, 1, time=MS), packet(2, 0, time=MS + start)]
    records.sort(key=lambda r: int(r["time"]))
    assert OUTCOMES[_at_0(library, on_one_spot, records, **PLAIN)[1]["outcome"]] == "R"


@pytest.mark.parametrize(("distance", "letter"), [(300.0, "C"), (6000.0, "N")])
def test_lost_to_interference_only_if_noise_alone_would_have_spared_it(
    library: Library, distance: float, letter: str
) -> None:
    scene = _around(distance, 100.0)
    records = [packet(1, 1, time=MS), noise(2, 2, time=MS, duration=MS)]
    parameters = {**PLAIN, "sensitivity": -110.0, "maximum_range": 9000.0}
    assert OUTCOMES[_at_0(library, scene, records, **parameters)[1]["outcome"]] == letter


@pytest.mark.parametrize(
    ("parameters", "stronger_by", "letters"),
    [
        ({"frame_capture": True}, 10.01, "CR"),
        ({"frame_capture": True}, 9.99, "CB"),
        ({"frame_capture": True, "capture_margin": 20.0}, 19.99, "CB"),
        ({"frame_capture": True, "capture_margin": 20.0}, 20.01, "CR"),
        ({"frame_capture": False}, 40.0, "CB"),
        ({"frame_capture": True, "model": 2.0}, 40.0, "CB"),
    ],
)
def test_a_much_stronger_frame_captures_the_receiver(
    library: Library, parameters: dict[str, float], stronger_by: float, letters: str
) -> None:
    others = _db(_power(200.0, -20) + 10 ** (NOISE_FLOOR / 10))  # noise is a tenth of it
    offset = others + stronger_by - _db(_power(300.0))
    records = [
        packet(1, 1, time=MS, power_offset=-20),
        packet(2, 2, time=MS + 100 * US, power_offset=offset),
    ]  # fmt: skip
    found = _at_0(library, _around(200.0, 300.0), records, **{**PLAIN, **parameters})
    assert "".join(OUTCOMES[found[k]["outcome"]] for k in (1, 2)) == letters


def test_after_a_capture_the_receiver_is_free_when_the_stronger_frame_ends(
    library: Library,
) -> None:
    records = [
        packet(1, 1, time=MS, duration=2 * MS),
        packet(2, 2, time=MS + 100 * US),
        packet(3, 3, time=MS + 500 * US),  # while the abandoned frame is still on air
    ]
    found = _at_0(library, _around(900.0, 30.0, 40.0), records, **{**PLAIN, "frame_capture": True})
    assert {k: OUTCOMES[r["outcome"]] for k, r in found.items()} == {1: "C", 2: "R", 3: "R"}


@pytest.mark.parametrize(
    ("channel_offset", "bands"),
    [(0, "lcu"), (1, "cu"), (-1, "lc"), (2, "u"), (-2, "l"), (3, ""), (-3, ""), (4, ""), (-4, "")],
)
def test_noise_beside_the_channel_hurts_where_both_overlap(
    library: Library, channel_offset: int, bands: str
) -> None:
    beside = noise(2, 2, time=MS, duration=MS, power_offset=-20, channel_offset=channel_offset)
    found = _at_0(library, _around(200.0, 300.0), [packet(1, 1, time=MS), beside], **PLAIN)
    snir = []
    for edge, band in ((-5e6, "l"), (0.0, "c"), (5e6, "u")):
        fall = (5.9e9 / (5.9e9 + edge)) ** 2
        interference = _power(300.0, -20) * fall if band in bands else 0.0
        snir.append(_db(_power(200.0) * fall / (interference + 10 ** (NOISE_FLOOR / 10))))
    assert found[1]["snir_db"] == pytest.approx(min(snir), abs=1e-5)


@pytest.mark.parametrize(("strength", "keeps"), [(15.0, True), (0.0, False)])
def test_an_unlocked_frame_keeps_the_medium_busy_only_if_it_is_strong(
    library: Library, strength: float, *, keeps: bool
) -> None:
    """1 and 2 are hidden from each other; 0 is locked to 1, 2 ends later, 0 wants to send."""
    cars = [Vehicle(id=k, position=(x, 0.0, 0.0)) for k, x in enumerate((0.0, -500.0, 500.0))]
    records = [
        packet(1, 1, time=MS),
        packet(2, 2, time=MS + 200 * US, power_offset=strength),  # -75.8 dBm or 15 dB more
        packet(3, 0, time=MS + 250 * US),
    ]
    parameters = {"maximum_range": 600.0, "frame_capture": False}
    with Channel(library, Scene(vehicles=cars), **parameters) as channel:
        received = channel.step(0.0, 0.1, records)
        start = {int(t["packet"]): int(t["time"]) for t in channel.transmissions()}
    assert outcomes(received)[2, 0] == ("B" if keeps else "T")
    end = start[2 if keeps else 1] + AIRTIME + 500 / LIGHT_SPEED * 1e9
    slots = (start[3] - end - 59 * US) / (13 * US)
    assert slots == pytest.approx(round(slots), abs=1e-3)
    assert round(slots) in range(4)
