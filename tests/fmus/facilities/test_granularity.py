"""What a lost packet costs at each granularity, whatever is lost, in whatever order it comes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.facilities import AlwaysOnFacilities
from fmus.facilities.granularity import ALL_PACKETS, EachGrain, FirstPacket, Granularity
from fmus.facilities.outbox import Message, Outbox
from fmus.messages.features import FeaturesMessage, read_features, write_features
from fmus.messages.records import OBJECT, PACKET, RECEPTION, SENSOR_DATA, unframe
from orchestrator.signal import Array
from tests.fmus.facilities.world import (
    EGO,
    SHARER,
    Run,
    delivered,
    features_of,
    objects_of,
)

NAMES = ("frame", "packets", "keypoint")


@dataclass(frozen=True)
class Case:
    """A message, the longest packet, and the packets that arrive, in order, maybe repeatedly."""

    features: FeaturesMessage
    fragment: int
    order: Sequence[float]

    def batches(self, packets: Array) -> list[Array]:
        """The packets that arrive, one by one."""
        return [packets[[int(place * len(packets))]] for place in self.order]


@st.composite
def cases(draw: st.DrawFn) -> Case:
    capacity = draw(st.integers(1, 12))
    sent, dimensions = draw(st.integers(0, capacity)), draw(st.integers(0, 4))
    places = st.floats(0.0, 1.0, exclude_max=True)
    return Case(
        features=features_of(SHARER, 3, sent=sent, capacity=capacity, dimensions=dimensions),
        fragment=draw(st.integers(1, 90)),
        order=draw(st.lists(places, max_size=14)),
    )


class Link:
    """A sharer that broadcasts, in the full load, and what the ego has of it."""

    def __init__(self, granularity: Any, features: FeaturesMessage, **parameters: Any) -> None:
        given = AlwaysOnFacilities.Parameters(
            load="full", loss_granularity=granularity, processing_time=0.0, **parameters
        )
        self.run = Run(AlwaysOnFacilities(given))
        self.held = {"features": write_features([features]), "objects": objects_of(SHARER, 3)}
        sent = self.run.step(**self.held)
        self.packets: Array = sent[sent["kind"] == SENSOR_DATA]

    def hear(self, packets: Array) -> None:
        self.run.step(**self.held, receptions=delivered(packets, EGO))

    @property
    def keypoints(self) -> list[int] | None:
        """Numbers of those that are known; None without a record."""
        read = read_features(self.run.output("received.features"))
        assert len(read) <= 1
        return read[0].keypoints[:, 0].astype(int).tolist() if read else None

    @property
    def knows_objects(self) -> bool:
        return len(unframe("OBJS", self.run.output("received.objects"), OBJECT)) == 2


def heard(granularity: str, case: Case) -> tuple[Link, set[int]]:
    """After all of `case`, with the places of the packets that arrived."""
    link = Link(granularity, case.features, fragment_size=case.fragment)
    places = set()
    for batch in case.batches(link.packets):
        link.hear(batch)
        places.add(int(batch["id"][0] - link.packets["id"][0]))
    return link, places


@settings(deadline=None, max_examples=60)
@given(cases())
def test_keypoints_arrive_with_the_packets_that_carry_them(case: Case) -> None:
    """Which ones a packet carries follows from the sizes on the air alone."""
    link, places = heard("keypoint", case)
    sizes = link.packets["size"].astype(int)
    assert (sizes % case.features.keypoint_size == 0).all()
    carried = np.split(
        np.arange(case.features.capacity),
        np.cumsum(sizes // case.features.keypoint_size)[:-1],
    )
    expected = sorted(k for p in places for k in carried[p] if k < len(case.features.keypoints))
    is_whole = len(places) == len(sizes)
    assert link.keypoints == (expected if expected or is_whole else None)
    assert link.knows_objects == is_whole


@settings(deadline=None, max_examples=60)
@given(cases())
def test_of_frames_the_first_packet_decides_and_of_packets_all(case: Case) -> None:
    for name in ("frame", "packets"):
        link, places = heard(name, case)
        decides = 0 in places if name == "frame" else len(places) == len(link.packets)
        assert link.keypoints == (list(range(len(case.features.keypoints))) if decides else None)
        assert link.knows_objects == decides


@settings(deadline=None, max_examples=60)
@given(cases())
def test_what_arrives_was_sent(case: Case) -> None:
    """Bit for bit, in the order of the message, with the scan's own time and place."""
    for name in NAMES:
        link, _ = heard(name, case)
        sent = case.features
        for got in read_features(link.run.output("received.features")):
            rows = got.keypoints[:, 0].astype(int)
            assert (np.diff(rows) > 0).all()
            np.testing.assert_array_equal(got.keypoints, sent.keypoints[rows])
            expected = (SHARER, 3, sent.heading, sent.capacity, sent.dimensions)
            assert (got.vehicle, got.time, got.heading, got.capacity, got.dimensions) == expected
            np.testing.assert_array_equal(got.position, sent.position)


@settings(deadline=None, max_examples=30)
@given(cases())
def test_without_losses_all_granularities_are_equal(case: Case) -> None:
    signals = set()
    for name in NAMES:
        link = Link(name, case.features, fragment_size=case.fragment)
        link.hear(link.packets)
        assert link.knows_objects
        signals.add(link.run.output("received.features"))
    assert signals == {write_features([case.features])}


@settings(deadline=None, max_examples=30)
@given(cases())
def test_repeated_packets_change_nothing(case: Case) -> None:
    for name in NAMES:
        once, places = heard(name, case)
        twice, _ = heard(name, Case(case.features, case.fragment, [*case.order, *case.order]))
        assert once.run.output("received.features") == twice.run.output("received.features")
        for place in places:
            before = once.run.output("received.features")
            once.hear(once.packets[[place]])
            assert once.run.output("received.features") is before


@pytest.mark.parametrize("granularity", NAMES)
@pytest.mark.parametrize("outcome", list("NCBTU"))
def test_what_is_lost_leaves_no_record(granularity: str, outcome: str) -> None:
    link = Link(granularity, features_of(SHARER, 3), fragment_size=40)
    link.run.step(**link.held, receptions=delivered(link.packets, EGO, outcome))
    link.run.step(**link.held, receptions=delivered(link.packets, EGO, addressed=0))
    assert link.keypoints is None
    assert not link.knows_objects


def test_padding_alone_is_nothing_and_a_whole_message_of_padding_is_a_scan_without_keypoints() -> (
    None
):
    link = Link("keypoint", features_of(SHARER, 3, sent=2, capacity=4), fragment_size=20)
    assert len(link.packets) == 4
    link.hear(link.packets[2:])
    assert link.keypoints is None
    link.hear(link.packets[:1])
    assert link.keypoints == [0]
    empty = Link("keypoint", features_of(SHARER, 3, sent=0, capacity=2), fragment_size=20)
    empty.hear(empty.packets[:1])
    assert empty.keypoints is None
    empty.hear(empty.packets[1:])
    assert empty.keypoints == []


@pytest.mark.parametrize(
    ("capacity", "dimensions", "count", "longest"),
    [(128, 128, 64, 2 * 524), (32, 256, 32, 1036), (1000, 0, 9, 112 * 12), (3, 500, 3, 2012)],
)
def test_packets_hold_as_many_whole_keypoints_as_fit_and_at_least_one(
    capacity: int, dimensions: int, count: int, longest: int
) -> None:
    """So few packets as possible, of equal length but for one keypoint."""
    features = features_of(SHARER, 3, sent=1, capacity=capacity, dimensions=dimensions)
    compression = 16 if features.size == 67_072 else 32
    sizes = Link("keypoint", features, compression=compression).packets["size"].astype(int)
    assert len(sizes) == count
    assert sizes.max() == longest
    assert sizes.sum() == features.size
    assert np.ptp(sizes) in {0, features.keypoint_size}
    assert (np.diff(sizes) <= 0).all()


@given(st.integers(2, 40).flatmap(lambda n: st.tuples(st.just(n), st.sets(st.integers(0, n - 1)))))
def test_more_packets_never_bring_less(loss: tuple[int, set[int]]) -> None:
    """And packets bring a part of what keypoints bring, and of what frames bring."""
    count, arrived = loss
    kinds: list[Granularity] = [ALL_PACKETS, FirstPacket(), EachGrain(8)]
    usable = [set(kind.usable(arrived, count)) for kind in kinds]
    assert usable[0] <= usable[1]
    assert usable[0] <= usable[2] <= arrived
    for packet in range(count):
        more = [set(kind.usable(arrived | {packet}, count)) for kind in kinds]
        assert all(less <= rest for less, rest in zip(usable, more, strict=True))


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.integers(1, 30), st.integers(1, 9)), min_size=1, max_size=6),
    st.integers(1, 40),
    st.data(),
)
def test_messages_of_any_grain_share_an_outbox(
    sizes: list[tuple[int, int]], fragment: int, data: st.DataObject
) -> None:
    """Each packet has whole grains of its own message, and each receiver has what it heard."""
    outbox = Outbox(fragment, 10**9)
    messages = [
        Message(
            kind=SENSOR_DATA,
            time=0,
            source=k,
            size=grains * grain,
            content=k,
            granularity=EachGrain(grain),
        )
        for k, (grains, grain) in enumerate(sizes)
    ]
    rows = unframe("PKTS", outbox.send(messages), PACKET)
    chosen = data.draw(st.lists(st.sampled_from(range(len(rows))), max_size=12, unique=True))
    received = unframe("RCPT", delivered(rows[chosen], EGO), RECEPTION)
    found = outbox.arrivals(received)
    arrivals = {int(arrival.message.source): arrival for arrival in found}
    assert len(arrivals) == len(found), "each message is reported once"
    for k, (grains, grain) in enumerate(sizes):
        (mine,) = np.nonzero(rows["source"] == k)
        carried = rows["size"][mine].astype(int)
        assert carried.sum() == grains * grain
        assert (carried % grain == 0).all()
        assert (carried <= max(fragment, grain)).all()
        there = np.isin(mine, chosen).repeat(carried // grain)
        assert there.any() == (k in arrivals)
        if k in arrivals:
            np.testing.assert_array_equal(arrivals[k].grains(), there)
            assert arrivals[k].is_whole == there.all()
