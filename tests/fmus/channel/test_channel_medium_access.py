"""EDCA: who may send when, who has to wait and for how long."""

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.messages.records import FATES
from orchestrator.signal import Array
from tests.fmus.driver import Library
from tests.fmus.scene import Scene, Vehicle

from .harness import (
    AIRTIME,
    BACKGROUND,
    BEST_EFFORT,
    LIGHT_SPEED,
    MS,
    US,
    VIDEO,
    VOICE,
    Channel,
    outcomes,
    packet,
)

SLOT = 13 * US
TURNAROUND = 1 * US
AIFS = {BACKGROUND: 149 * US, BEST_EFFORT: 110 * US, VIDEO: 71 * US, VOICE: 58 * US}
WINDOW = {BACKGROUND: 15, BEST_EFFORT: 15, VIDEO: 7, VOICE: 3}
CATEGORIES = sorted(AIFS)
ALONE = Scene(vehicles=[Vehicle(id=0)])
# on one spot: no propagation delay
PAIR = Scene(vehicles=[Vehicle(id=0), Vehicle(id=1)])
# 500 m apart; the outer ones hear each other only if the range allows it
ROW = Scene(vehicles=[Vehicle(id=k, position=(500.0 * k, 0.0, 0.0)) for k in range(3)])


def _sent(
    library: Library,
    scene: Scene,
    records: Sequence[Array],
    duration: float = 10.0,
    **parameters: float,
) -> Array:
    """What went on air, or did not."""
    with Channel(library, scene, **parameters) as channel:
        channel.step(0.0, duration, records)
        return channel.transmissions()


def _starts(sent: Array) -> dict[int, int]:
    return {int(r["packet"]): int(r["time"]) for r in sent}


def _backoffs(gaps: Array, category: int) -> Array:
    """The slots waited, given the time from idle medium to start on air; whole, not negative."""
    slots, rest = np.divmod(gaps - AIFS[category] - TURNAROUND, SLOT)
    assert (rest == 0).all()
    assert (slots >= 0).all()
    return slots


def _assert_uniform(slots: Array, window: int) -> None:
    """Chi-square test against the uniform distribution on 0..window, at about 1e-4."""
    assert slots.max() <= window
    counts = np.bincount(slots, minlength=window + 1)
    expected = len(slots) / (window + 1)
    chi_square = ((counts - expected) ** 2 / expected).sum()
    assert chi_square < window + 4 * np.sqrt(2 * window) + 4


@given(st.sampled_from(CATEGORIES), st.integers(0, 1_000_000))
@settings(max_examples=60, deadline=None)
def test_on_an_idle_medium_a_frame_starts_at_the_next_slot_boundary(
    library: Library, category: int, time: int
) -> None:
    (sent,) = _sent(library, ALONE, [packet(1, 0, time=time, category=category)])
    decided = sent["time"] - TURNAROUND
    if time <= AIFS[category]:
        assert decided == AIFS[category]
    else:
        assert (decided - AIFS[category]) % SLOT == 0
        assert 0 < decided - time <= SLOT
    assert sent["queued"] == time
    assert FATES[sent["fate"]] == "sent"


@pytest.mark.parametrize("radios", [4, 1])
def test_packets_that_come_at_once_are_sent_in_the_order_of_their_categories(
    library: Library, radios: int
) -> None:
    """By four radios, and from the four queues of one."""
    scene = Scene(vehicles=[Vehicle(id=k) for k in range(radios)])
    sent = _sent(library, scene, [packet(k, k % radios, category=k) for k in CATEGORIES])
    assert sent["packet"].tolist() == [VOICE, VIDEO, BEST_EFFORT, BACKGROUND]
    gaps = np.diff(sent["time"], prepend=-AIRTIME) - AIRTIME
    # nobody heard anything when the packets came, so nobody has drawn a backoff
    assert gaps.tolist() == [AIFS[int(k)] + TURNAROUND for k in sent["access_category"]]


def test_a_packet_that_comes_when_another_category_may_send_competes_with_it(
    library: Library,
) -> None:
    time = AIFS[BEST_EFFORT]
    records = [packet(1, 0, category=BEST_EFFORT), packet(2, 0, time=time, category=VOICE)]
    starts = _starts(_sent(library, ALONE, records))
    assert starts[2] == time + TURNAROUND
    slots = _backoffs(np.array([starts[1] - starts[2] - AIRTIME]), BEST_EFFORT)
    assert slots <= 2 * WINDOW[BEST_EFFORT] + 1


@pytest.mark.parametrize("seed", range(1, 6))
def test_a_packet_that_comes_before_a_frame_is_heard_draws_no_backoff(
    library: Library, seed: int
) -> None:
    # the frame is heard 0.1 us after its start by one, 2 us after it by the other
    scene = Scene(vehicles=[Vehicle(id=k, position=(x, 0, 0)) for k, x in enumerate((0, 30, 600))])
    start = AIFS[VOICE] + TURNAROUND
    records = [packet(1, 0), packet(2, 2, time=start + US)]
    starts = _starts(_sent(library, scene, records, seed=seed))
    assert starts[1] == start
    delay = int(600 / LIGHT_SPEED * 1e9)
    assert starts[2] == start + delay + AIRTIME + AIFS[VOICE] + TURNAROUND


@pytest.mark.parametrize("category", CATEGORIES)
def test_on_a_busy_medium_a_frame_waits_for_its_end_aifs_and_a_backoff(
    library: Library, category: int
) -> None:
    rounds = 600
    records = []
    for k in range(rounds):
        records.append(packet(2 * k, 0, time=5 * k * MS))
        records.append(packet(2 * k + 1, 1, time=5 * k * MS + 200 * US, category=category))
    starts = _starts(_sent(library, PAIR, records))
    idle = np.array([starts[2 * k] for k in range(rounds)]) + AIRTIME
    start = np.array([starts[2 * k + 1] for k in range(rounds)])
    _assert_uniform(_backoffs(start - idle, category), WINDOW[category])


@pytest.mark.parametrize("category", CATEGORIES)
def test_a_saturated_sender_waits_for_aifs_and_a_uniform_backoff(
    library: Library, category: int
) -> None:
    frames = 1500
    records = [packet(k, 0, category=category) for k in range(frames)]
    sent = _sent(library, ALONE, records)
    assert sent["packet"].tolist() == list(range(frames))  # first come, first served
    cycles = np.diff(sent["time"])
    window = WINDOW[category]
    _assert_uniform(_backoffs(cycles - AIRTIME, category), window)
    mean = AIFS[category] + window / 2 * SLOT + TURNAROUND + AIRTIME
    deviation = SLOT * np.sqrt(((window + 1) ** 2 - 1) / 12 / len(cycles))
    assert cycles.mean() == pytest.approx(mean, abs=4 * deviation)


@pytest.mark.parametrize(
    ("winner", "loser"), [(VOICE, VIDEO), (VOICE, BACKGROUND), (VIDEO, BEST_EFFORT)]
)
def test_of_two_queues_at_once_the_higher_wins_and_the_other_doubles_its_window(
    library: Library, winner: int, loser: int
) -> None:
    rounds = 600
    records = []
    for k in range(rounds):  # on an idle medium both may send at the next slot boundary
        time = 10 * k * MS + MS
        records.append(packet(3 * k, 0, time=time, category=winner))
        records.append(packet(3 * k + 1, 0, time=time, category=loser))
        records.append(packet(3 * k + 2, 0, time=time, category=loser))
    starts = _starts(_sent(library, ALONE, records))
    first, second, third = (np.array([starts[3 * k + n] for k in range(rounds)]) for n in range(3))
    assert (first - np.arange(rounds) * 10 * MS - MS <= SLOT + TURNAROUND).all()
    _assert_uniform(_backoffs(second - first - AIRTIME, loser), 2 * WINDOW[loser] + 1)
    # after a frame that was sent the window is the smallest one again
    _assert_uniform(_backoffs(third - second - AIRTIME, loser), WINDOW[loser])


def _share_of_collisions(window: int) -> float:
    """Of two saturated senders that hear each other at once, by the Markov chain of their backoffs.

    Who sends draws anew; the other one has counted one slot more than the sender has.
    """
    draws = np.full(window + 1, 1 / (window + 1))
    pair = np.outer(draws, draws)
    for _ in range(200):
        following = np.trace(pair) * np.outer(draws, draws)
        for a, b in itertools.permutations(range(window + 1), 2):
            left = abs(b - a) - 1
            if a < b:
                following[:, left] += pair[a, b] * draws
            else:
                following[left, :] += pair[a, b] * draws
        pair = following
    return float(np.trace(pair))


@pytest.mark.parametrize("category", [VOICE, BEST_EFFORT])
def test_two_saturated_senders_share_fairly_and_collide_when_backoffs_are_equal(
    library: Library, category: int
) -> None:
    frames = 1500
    records = [packet(k, k % 2, category=category) for k in range(2 * frames)]
    sent = _sent(library, PAIR, records)[:-200]  # both are saturated until then
    starts, counts = np.unique(sent["time"], return_counts=True)
    assert (np.diff(starts) > AIRTIME).all()  # frames overlap only if they begin at once
    expected = _share_of_collisions(WINDOW[category])
    collisions = (counts == 2).mean()
    sigma = np.sqrt(expected * (1 - expected) / len(starts))
    assert collisions == pytest.approx(expected, abs=4 * sigma)
    assert (sent["transmitter"] == 0).mean() == pytest.approx(0.5, abs=4 * 0.5 / len(sent) ** 0.5)


def test_hidden_terminals_collide_and_those_who_hear_each_other_do_not(library: Library) -> None:
    records = [packet(1, 0, time=MS), packet(2, 2, time=MS + 100 * US)]
    found = {}
    for maximum_range in (600.0, 1100.0):
        with Channel(library, ROW, maximum_range=maximum_range, frame_capture=False) as channel:
            found[maximum_range] = outcomes(channel.step(0.0, 0.1, records))
    assert found[600.0] == {(1, 1): "C", (2, 1): "B"}
    assert set(found[1100.0].values()) == {"R"}


def test_a_sender_hears_nothing_and_frames_that_it_missed_do_not_defer_it(library: Library) -> None:
    """Frame 2 begins while 0 sends, and ends later: 0 finds the medium idle before that."""
    records = [packet(1, 0, time=MS), packet(2, 2, time=MS + 300 * US), packet(3, 0, time=MS)]
    with Channel(library, ROW, maximum_range=600.0) as channel:
        channel.step(0.0, 0.1, records)
        starts = _starts(channel.transmissions())
    waited = starts[3] - starts[1] - AIRTIME
    assert waited in {AIFS[VOICE] + TURNAROUND + k * SLOT for k in range(4)}


def test_a_full_queue_refuses_frames(library: Library) -> None:
    records = [packet(k, 0, category=VIDEO) for k in range(5)] + [packet(9, 0, category=VOICE)]
    sent = _sent(library, ALONE, records, queue_limit=2)
    fates = {int(r["packet"]): FATES[r["fate"]] for r in sent}
    assert fates == {0: "sent", 1: "sent", 9: "sent"} | dict.fromkeys((2, 3, 4), "queue full")
    refused = sent[sent["duration"] == 0]
    assert refused["packet"].tolist() == [2, 3, 4]
    assert (refused["time"] == 0).all()


@pytest.mark.parametrize("medium_access", [True, False])
def test_frames_expire_that_have_waited_longer_than_their_lifetime(
    library: Library, *, medium_access: bool
) -> None:
    lifetime = 2 * MS
    records = [packet(k, 0, time=k * 100 * US, category=k % 4) for k in range(80)]
    sent = _sent(
        library, ALONE, records, packet_lifetime=lifetime * 1e-9, medium_access=medium_access
    )
    waited = sent["time"] - sent["queued"]
    expired = sent["fate"] == FATES.index("expired")
    assert sorted(sent["packet"].tolist()) == list(range(80))
    assert expired.any()
    assert (waited[expired] > lifetime).all()
    assert (waited[~expired] <= lifetime + TURNAROUND).all()
    assert set(sent["fate"].tolist()) == {FATES.index("sent"), FATES.index("expired")}


def test_a_frame_that_expires_costs_the_others_no_time(library: Library) -> None:
    records = [
        packet(0, 1, time=MS, duration=3 * MS),
        packet(1, 0, time=2 * MS, category=VOICE),  # expires in its AIFS, after 4 ms
        packet(2, 0, time=3 * MS, category=BEST_EFFORT),
    ]
    sent = _sent(library, PAIR, records, packet_lifetime=2.05e-3)
    assert {int(r["packet"]): FATES[r["fate"]] for r in sent} == {
        0: "sent",
        1: "expired",
        2: "sent",
    }
    starts = _starts(sent)
    slots = _backoffs(np.array([starts[2] - starts[0] - 3 * MS]), BEST_EFFORT)
    assert slots <= WINDOW[BEST_EFFORT]


@given(
    st.lists(
        st.tuples(st.integers(0, 3), st.integers(0, 3_000), st.integers(0, 1000)),
        min_size=1,
        max_size=25,
    )
)
@settings(max_examples=40, deadline=None)
def test_without_medium_access_frames_start_at_their_times_or_when_the_radio_is_free(
    library: Library, sendings: list[tuple[int, int, int]]
) -> None:
    scene = Scene(vehicles=[Vehicle(id=k, position=(9.0 * k, 0.0, 0.0)) for k in range(4)])
    records = sorted(
        (
            packet(k, source, time=time * US, size=size)
            for k, (source, time, size) in enumerate(sendings)
        ),
        key=lambda r: (int(r["time"]), int(r["id"])),
    )
    sent = _sent(library, scene, records, medium_access=False)
    free = dict.fromkeys(range(4), 0)
    expected = {}
    airtime = {int(r["packet"]): int(r["duration"]) for r in sent}
    for record in records:
        source, number = int(record["source"]), int(record["id"])
        expected[number] = max(int(record["time"]), free[source])
        free[source] = expected[number] + airtime[number]
    assert _starts(sent) == expected
