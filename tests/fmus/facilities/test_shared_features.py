"""Features beside the objects: who sends them, how large they are, what the ego knows, how old."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.facilities import AlwaysOnFacilities, CpmFacilities, Facilities
from fmus.facilities.received_features import ReceivedFeatures
from fmus.messages.apm import join
from fmus.messages.features import FeaturesMessage, read_features, write_features
from fmus.messages.records import NO_VEHICLE, OBJECT, REQUEST, SENSOR_DATA, unframe
from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array, Signal
from tests.fmus.facilities.world import (
    EGO,
    RELAY,
    SHARER,
    Run,
    apm_of,
    delivered,
    features_of,
    objects_of,
)

SHARING = (Facilities, AlwaysOnFacilities)
E32 = {"capacity": 32, "dimensions": 256}
E16 = {"capacity": 128, "dimensions": 128}


def data_in(packets: Array) -> Array:
    return packets.compress(packets["kind"] == SENSOR_DATA)


def scan(time: int, *vehicles: int, **shape: int) -> dict[str, Signal]:
    """Objects of the sharer and features of `vehicles` at one time [ns]."""
    sent = [features_of(vehicle, time, **shape) for vehicle in vehicles or (SHARER,)]
    return {"objects": objects_of(SHARER, time), "features": write_features(sent)}


def asked(run: Run, relay: int = NO_VEHICLE, **held: Any) -> None:
    """The ego asks the sharer, who hears it; that matters where sharing is on demand."""
    request = run.step(match__trigger=np.array(True), relay=np.array(relay), **held)
    run.step(receptions=delivered(request[request["kind"] == REQUEST], SHARER), **held)


def ready(component: Any, relay: int = NO_VEHICLE, **parameters: Any) -> Run:
    """A run in which the sharer shares from now on."""
    run = Run(component(component.Parameters(**parameters)))
    asked(run, relay)
    return run


def known(run: Run) -> list[tuple[int, int, int]]:
    """Source, time and number of keypoints of each scan."""
    read = read_features(run.output("received.features"))
    return [(m.vehicle, m.time, len(m.keypoints)) for m in read]


@pytest.mark.parametrize("component", SHARING)
def test_objects_and_features_of_a_scan_come_in_one_message(component: Any) -> None:
    run = ready(component)
    data = data_in(run.step(**scan(5)))
    assert data["source"].tolist() == [SHARER]
    run.step(**scan(5), receptions=delivered(data, EGO))
    (message,) = read_features(run.output("received.features"))
    assert write_features([message]) == scan(5)["features"]
    assert len(unframe("OBJS", run.output("received.objects"), OBJECT)) == 2


@pytest.mark.parametrize("component", SHARING)
@pytest.mark.parametrize(
    ("parameters", "shape", "size"),
    [
        ({"load": "full"}, E32, 33_152),
        ({"load": "full", "compression": 16}, E16, 67_072),
        ({"load": "full"}, {"capacity": 1000, "dimensions": 0}, 12_000),
        ({"load": "full"}, {"capacity": 32, "dimensions": 64}, 8576),
        ({"load": "probe"}, E32, 200),
        ({"sensor_data_size": 5000}, E32, 5000),
    ],
)
@pytest.mark.parametrize("sent", [0, 5])
def test_the_size_is_that_of_the_features_padding_included(
    component: Any, parameters: dict[str, Any], shape: dict[str, int], size: int, sent: int
) -> None:
    data = data_in(ready(component, **parameters).step(**scan(5, sent=sent, **shape)))
    assert data["size"].sum() == size


@pytest.mark.parametrize("component", SHARING)
def test_features_of_the_other_compression_are_refused(component: Any) -> None:
    run = ready(component, load="full")
    error = (
        "`features` of vehicle 20 have 128 keypoints of 3 \\+ 128 numbers, 67072 B: that is "
        "`compression: 16`, and the parameter is 32; set it to 16"
    )
    with pytest.raises(ValueError, match=error):
        run.step(**scan(5, **E16))
    ready(component, load="probe").step(**scan(5, **E16))


@pytest.mark.parametrize("component", SHARING)
def test_two_messages_of_one_vehicle_are_refused(component: Any) -> None:
    with pytest.raises(ValueError, match="`features` has two messages of vehicle 20"):
        ready(component).step(**scan(5, SHARER, SHARER))


@pytest.mark.parametrize("component", SHARING)
def test_keypoints_in_packets_of_another_size_are_refused(component: Any) -> None:
    given = {"loss_granularity": "keypoint", "sensor_data_size": 500}
    with pytest.raises(ComponentTypeError, match="carry no keypoints; use `load: full`"):
        component(component.Parameters(**given))


@pytest.mark.parametrize("component", SHARING)
@pytest.mark.parametrize("granularity", ["frame", "packets", "keypoint"])
def test_a_probe_stands_for_the_message_at_each_granularity(
    component: Any, granularity: str
) -> None:
    run = ready(component, loss_granularity=granularity)
    data = data_in(run.step(**scan(5, **E32)))
    assert len(data) == 1
    run.step(**scan(5, **E32), receptions=delivered(data, EGO))
    assert known(run) == [(SHARER, 5, 6)]


@pytest.mark.parametrize("component", SHARING)
@pytest.mark.parametrize(
    ("granularity", "useful"),
    [
        ("frame", [True, False, True]),
        ("packets", [False, False, True]),
        ("keypoint", [False, False, True]),
    ],
)
def test_objects_alone_at_each_granularity(
    component: Any, granularity: str, useful: list[bool]
) -> None:
    """The first packet, the others, all; without features keypoints are as packets."""
    parts = [slice(1), slice(1, None), slice(None)]
    for part, expected in zip(parts, useful, strict=True):
        run = ready(component, load="full", loss_granularity=granularity)
        data = data_in(run.step(objects=objects_of(SHARER, 5)))
        assert len(data) == 24
        run.step(objects=objects_of(SHARER, 5), receptions=delivered(data[part], EGO))
        assert bool(len(unframe("OBJS", run.output("received.objects"), OBJECT))) == expected
        assert known(run) == []


@pytest.mark.parametrize("component", SHARING)
def test_each_scan_is_sent_once_when_its_features_are_there(component: Any) -> None:
    """Also where the encoder is late, or perception tells nothing (new)."""
    run = ready(component)
    assert len(data_in(run.step(**scan(5)))) == 1
    late = {"features": scan(5)["features"], "objects": objects_of(SHARER, 6)}
    assert len(data_in(run.step(**late))) == 0
    assert len(data_in(run.step(**scan(6)))) == 1
    assert len(data_in(run.step(**scan(6)))) == 0
    blind = {"features": scan(7)["features"], "objects": objects_of(SHARER, 6)}
    assert len(data_in(run.step(**blind))) == 1
    both = write_features([features_of(SHARER, 7), features_of(RELAY, 8)])
    data = data_in(run.step(features=both, objects=objects_of(SHARER, 8)))
    assert SHARER not in data["source"], "another vehicle's scan is not its own"


def test_always_on_shares_features_of_all_with_a_radio_without_perception() -> None:
    run = Run(AlwaysOnFacilities(AlwaysOnFacilities.Parameters()))
    features = write_features([features_of(v, 5) for v in (SHARER, RELAY)])
    data = data_in(run.step(features=features))
    assert sorted(data["source"]) == [SHARER, RELAY]
    silent = np.array([True, False, True])
    features = write_features([features_of(v, 6) for v in (SHARER, RELAY)])
    assert data_in(run.step(features=features, vehicle__equipped=silent))["source"] == [RELAY]


def test_a_relay_passes_features_on_and_does_not_read_them() -> None:
    run = ready(Facilities, relay=RELAY, load="full", loss_granularity="keypoint")
    data = data_in(run.step(**scan(5, **E32)))
    assert (data["route"][:, 0] == RELAY).all()
    run.step(**scan(5, **E32), receptions=delivered(data, RELAY))
    assert known(run) == []
    run.step(**scan(5, **E32), receptions=delivered(data[:4], EGO))
    assert known(run) == [(SHARER, 5, 4)]


NO_FEATURES: dict[str, Callable[[], Component]] = {
    "demanded": lambda: Facilities(Facilities.Parameters(answer="demanded", load="full")),
    "CPM": lambda: CpmFacilities(CpmFacilities.Parameters()),
}


@pytest.mark.parametrize("kind", NO_FEATURES)
def test_what_was_demanded_and_cpms_bring_no_features(kind: str) -> None:
    """Their packets are the same with and without."""

    def sent(*, with_features: bool) -> Array:
        run = Run(NO_FEATURES[kind]())
        steps: list[Array] = []
        zones: dict[str, Any] = {
            "blind_zone__center": np.zeros((1, 2)),
            "blind_zone__range": np.full(1, 90.0),
        }
        asked(run, apms=join([apm_of(EGO), apm_of(SHARER)]), **zones)
        for time in range(1, 21):
            inputs = scan(time, **E32) if with_features else {"objects": objects_of(SHARER, time)}
            inputs["apms"] = join([apm_of(EGO, time), apm_of(SHARER, time)])
            heard = delivered(steps[-1], EGO) if steps else b""
            steps.append(run.step(**inputs, receptions=heard))
            assert known(run) == []
        return np.concatenate(steps)

    packets = sent(with_features=True)
    assert len(data_in(packets)) > 1
    np.testing.assert_array_equal(packets, sent(with_features=False))


def received(most: int = 3, maximum_age: int = 100) -> ReceivedFeatures:
    return ReceivedFeatures(maximum_age, most)


def all_of(features: FeaturesMessage) -> Array:
    return np.ones(len(features.keypoints), np.bool_)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.sampled_from([3, 7]), st.integers(0, 60)), max_size=12),
    st.integers(1, 4),
    st.integers(60, 170),
)
def test_of_each_source_the_newest_fresh_scans_are_known(
    arrivals: list[tuple[int, int]], most: int, now: int
) -> None:
    """By the time of the scan, in whatever order they arrive."""
    features = received(most)
    for source, time in arrivals:
        message = features_of(source, time)
        features.add(message, all_of(message))
    expected = []
    for source in (3, 7):
        times = sorted({time for vehicle, time in arrivals if vehicle == source})[-most:]
        expected += [(source, time) for time in times if now - time <= 100]
    read = read_features(features.output(now))
    assert [(m.vehicle, m.time) for m in read] == expected


@settings(deadline=None)
@given(st.lists(st.sets(st.integers(0, 5), min_size=1), min_size=1, max_size=6))
def test_late_keypoints_add_to_those_of_their_scan(parts: list[set[int]]) -> None:
    features, message = received(), features_of(SHARER, 9)
    for k, part in enumerate(parts):
        before = features.output(10)
        features.add(message, np.isin(np.arange(6), list(part)))
        have = sorted(set().union(*parts[: k + 1]))
        (read,) = read_features(features.output(10))
        np.testing.assert_array_equal(read.keypoints, message.keypoints[have])
        is_news = not part <= set().union(*parts[:k])
        assert (features.output(10) is not before) == is_news


def test_a_scan_is_known_up_to_its_maximum_age_however_late_it_came() -> None:
    features = received(maximum_age=100)
    message = features_of(SHARER, 9)
    features.add(message, all_of(message))
    assert len(read_features(features.output(109))) == 1
    assert read_features(features.output(110)) == []
    features.add(message, all_of(message))
    assert read_features(features.output(111)) == []


@pytest.mark.parametrize("component", SHARING)
@pytest.mark.parametrize("most", [1, 3])
def test_the_parameter_says_how_many_scans_are_known(component: Any, most: int) -> None:
    run = ready(component, received_scans=most)
    for time in range(5, 10):
        data = data_in(run.step(**scan(time)))
        run.step(**scan(time), receptions=delivered(data, EGO))
    assert known(run) == [(SHARER, time, 6) for time in range(10 - most, 10)]


def test_late_packets_complete_an_older_scan() -> None:
    run = ready(AlwaysOnFacilities, load="full", loss_granularity="keypoint")
    first = data_in(run.step(**scan(5, **E32)))
    second = data_in(run.step(**scan(6, **E32)))
    run.step(**scan(6, **E32), receptions=delivered(second[:2], EGO))
    run.step(**scan(6, **E32), receptions=delivered(first[3:5], EGO))
    assert known(run) == [(SHARER, 5, 2), (SHARER, 6, 2)]
    run.step(**scan(6, **E32), receptions=delivered(first[:3], EGO))
    assert known(run) == [(SHARER, 5, 5), (SHARER, 6, 2)]
