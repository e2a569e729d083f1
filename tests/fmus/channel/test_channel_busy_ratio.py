"""The channel busy ratio: the share of a window in which a radio finds the medium busy."""

import numpy as np
import pytest

from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Scene, Vehicle

from .harness import AIRTIME, MS, US, Channel, noise, packet

PAIR = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1)])  # on one spot: no propagation delay
WINDOW = 0.1
SCHEDULED = {"medium_access": False}


def _ratios(channel: Channel) -> list[float]:
    found: Array = channel.get("busy_ratio", 2)
    return [float(x) for x in found]


def test_the_ratio_is_the_airtime_over_the_window_at_sender_and_receiver(library: Library) -> None:
    with Channel(library, PAIR, **SCHEDULED) as channel:
        channel.step(0.0, WINDOW, [packet(k, 0, time=k * MS) for k in range(20)])
        assert _ratios(channel) == [20 * AIRTIME / 1e8] * 2


def test_with_medium_access_a_sender_is_busy_from_its_decision_on(library: Library) -> None:
    with Channel(library, PAIR) as channel:
        channel.step(0.0, WINDOW, [packet(k, 0, time=k * MS) for k in range(20)])
        turnaround = 20 * US / 1e8
        assert _ratios(channel) == pytest.approx(
            [20 * AIRTIME / 1e8 + turnaround, 20 * AIRTIME / 1e8], abs=1e-12
        )


def test_it_is_told_for_complete_windows_and_kept_until_the_next(library: Library) -> None:
    with Channel(library, PAIR, **SCHEDULED) as channel:
        told = []
        for k in range(6):
            channel.step(k * 0.05, 0.05, [packet(1, 0)] if k == 0 else [])
            told.append(_ratios(channel)[1])
    assert told == [0, AIRTIME / 1e8, AIRTIME / 1e8, 0, 0, 0]


def test_a_frame_over_the_end_of_a_window_counts_in_both(library: Library) -> None:
    with Channel(library, PAIR, **SCHEDULED) as channel:
        channel.step(0.0, WINDOW, [packet(1, 0, time=100 * MS - 100 * US)])
        first = _ratios(channel)
        channel.step(WINDOW, WINDOW, [])
        second = _ratios(channel)
    assert first == [1e-3] * 2
    assert second == [(AIRTIME - 100 * US) / 1e8] * 2


def test_overlapping_frames_count_once(library: Library) -> None:
    scene = Scene(vehicles=[Vehicle(id=k) for k in range(3)])
    with Channel(library, scene, **SCHEDULED, cca_threshold=-97.0) as channel:
        channel.step(0.0, WINDOW, [packet(k, k, time=k * 200 * US) for k in range(2)])
        assert channel.get("busy_ratio", 3).tolist() == [(AIRTIME + 200 * US) / 1e8] * 3


def test_frames_below_the_sensitivity_do_not_count_unless_their_energy_does(
    library: Library,
) -> None:
    scene = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1, position=(500.0, 0.0, 0.0))])
    found = []
    for threshold in (-65.0, -80.0):  # the frames arrive with -75.8 dBm
        parameters = {"sensitivity": -70.0, "cca_threshold": threshold, **SCHEDULED}
        with Channel(library, scene, **parameters) as channel:
            channel.step(0.0, WINDOW, [packet(1, 0)])
            found.append(_ratios(channel)[1])
    assert found == [0, AIRTIME / 1e8]


@pytest.mark.parametrize(("power_offset", "share"), [(0.0, 0.05), (-40.0, 0.0)])
def test_noise_counts_while_it_is_above_the_threshold(
    library: Library, power_offset: float, share: float
) -> None:
    jammer = noise(1, 0, time=MS, duration=5 * MS, power_offset=power_offset)
    scene = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1, position=(10.0, 0.0, 0.0))])
    with Channel(library, scene) as channel:
        channel.step(0.0, WINDOW, [jammer])
        assert _ratios(channel) == pytest.approx([0, share], abs=1e-9)


@pytest.mark.parametrize(
    ("channel_offset", "begin", "busy"),
    [(-2, 1200, 2200), (2, 1200, 368), (-3, 1200, 368), (0, 1200, 2200), (-2, 5000, 2368)],
)
def test_the_energy_is_that_at_the_lower_edge_of_the_channel(
    library: Library, channel_offset: int, begin: int, busy: int
) -> None:
    """A frame for 368 us from 1 ms on, and noise for 2 ms [us]."""
    jammer = noise(
        2, 0, time=begin * US, duration=2 * MS, channel_offset=channel_offset, power_offset=9.0
    )
    with Channel(library, PAIR, **SCHEDULED) as channel:
        channel.step(0.0, WINDOW, [packet(1, 0, time=MS), jammer])
        assert _ratios(channel)[1] == busy * US / 1e8


def test_the_window_is_a_parameter(library: Library) -> None:
    with Channel(library, PAIR, **SCHEDULED, busy_window=0.001) as channel:
        channel.step(0.0, 0.001, [packet(1, 0)])
        assert _ratios(channel) == [AIRTIME / 1e6] * 2


def test_a_vehicle_that_enters_within_a_window_tells_its_part_of_it(library: Library) -> None:
    with Channel(library, Scene(vehicles=PAIR.vehicles[:1]), **SCHEDULED) as channel:
        channel.step(0.0, 0.06, [packet(k, 0, time=k * MS) for k in range(90)])
        channel.change(PAIR)
        channel.step(0.06, 0.04, [])
        # frames that were on air when it entered are nothing to it
        assert _ratios(channel) == pytest.approx([90 * AIRTIME / 1e8, 30 * AIRTIME / 4e7], abs=1e-9)


def test_steps_of_any_size_give_equal_ratios(library: Library) -> None:
    rng = np.random.default_rng(1)
    times = np.sort(rng.integers(0, 300 * MS, 300))
    records = [packet(k, k % 2, time=int(time)) for k, time in enumerate(times)]
    found = []
    for steps in (3, 30, 300):
        with Channel(library, PAIR) as channel:
            told = []
            for k in range(steps):
                channel.step(0.3 * k / steps, 0.3 / steps, records if k == 0 else [])
                if (k + 1) % (steps // 3) == 0:
                    told.append(_ratios(channel))
        found.append(told)
    assert found[0] == found[1] == found[2]
    assert all(0.3 < ratio < 0.5 for told in found[0] for ratio in told)


@pytest.mark.parametrize("begin", [0, 50 * MS, 1234567 * US + 89])
def test_a_long_step_tells_what_many_short_ones_do(library: Library, begin: int) -> None:
    """Windows in which nothing happens are passed over; the noise ends 1.5 s after it began."""
    window = {"busy_window": 0.01, **SCHEDULED}
    sent = [noise(1, 0, time=begin, duration=1500 * MS), packet(2, 1, time=begin + 1700 * MS)]
    ends = [begin / 1e9 + after for after in (0.7, 1.4999, 1.503, 1.5104, 1.7003, 1.72, 9.0)]
    for end in ends:
        with Channel(library, PAIR, **window) as channel:
            channel.step(0.0, end, sent)
            at_once = _ratios(channel)
        with Channel(library, PAIR, **window) as channel:
            count = 397
            for k in range(count):
                channel.step(end * k / count, end * (k + 1) / count - end * k / count, sent)
            assert _ratios(channel) == pytest.approx(at_once, abs=1e-12)
    assert at_once == [0, 0]


def test_a_step_of_a_month_ends(library: Library) -> None:
    with Channel(library, PAIR, **SCHEDULED, busy_window=1e-3) as channel:
        received = channel.step(0.0, 2.6e6, [packet(1, 0), packet(2, 0, time=10**15)])
        assert _ratios(channel) == [0, 0]
        assert len(received) == 2
