"""The BEV encoder and its messages: what a receiver reads is what the sender saw."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.encoder import PLACE_SCALE, BevEncoder, place
from fmus.driving.network.fixed_point import WEIGHT_BITS, Dense, rounded, rounded_weights
from fmus.driving.network.messages import seen, to_message, to_observed
from fmus.driving.network.patches import patches
from fmus.driving.network.scan import scan_of
from fmus.driving.network.sensors import RAW_POINTS, BevSensor, Sender, raw_cloud, raw_message
from fmus.messages.features import read_features, write_features
from orchestrator.signal import Array
from tests.fmus.driving.network.world import PERIOD, SMALL, changed, network, seen_from, street


def clouds(count: int = 4, vehicle: int = 1) -> list[Cloud]:
    """Of a sensor that drives along the street."""
    return [
        seen_from((0.8 * k, -1.0), 0.1, street(moved=0.5 * k), time=k * PERIOD, vehicle=vehicle)
        for k in range(count)
    ]


def saliency(architecture: Architecture, cloud: Cloud) -> tuple[Array, Array]:
    """Of all places, by their x and y: the formula, layer by layer, in integers."""
    weights = {n: rounded_weights(w) for n, w in network(architecture).weights.items()}
    found = patches([scan_of(cloud)])
    at = Dense(weight=weights["encoder.place.weight"], bias=weights["encoder.place.bias"])
    image = (weights["encoder.image.weight"] * 2**WEIGHT_BITS).astype(np.int64)
    sums = (found.image.astype(np.int64) @ image) / 2**WEIGHT_BITS
    hidden = np.maximum(rounded(sums + at(place(found))), 0.0)
    judge = Dense(
        weight=weights["encoder.judgements.weight"], bias=weights["encoder.judgements.bias"]
    )
    return np.stack([found.x, found.y], axis=1), judge(hidden).sum(axis=1)


@pytest.mark.parametrize("spacing", [1, 2, 5])
@pytest.mark.parametrize("keypoints", [1, 8, 400])
def test_keypoints_are_the_most_salient_places(spacing: int, keypoints: int) -> None:
    """In their order; at most one of a square of blocks; no more than a message has."""
    architecture = changed(keypoints=keypoints, spacing=spacing)
    checkpoint = network(architecture)
    (cloud,) = clouds(1)
    found = BevEncoder(architecture, checkpoint.weights).encode([scan_of(cloud)])
    at, salient = saliency(architecture, cloud)
    expected: list[tuple[float, float]] = []
    squares = set()
    for row in np.argsort(-salient, kind="stable"):
        square = tuple(np.floor(at[row] / (0.8 * spacing)).tolist())
        if square not in squares and len(expected) < keypoints:
            squares.add(square)
            expected.append(tuple(at[row].tolist()))
    assert list(zip(found.x.tolist(), found.y.tolist(), strict=True)) == expected
    assert len(expected) == min(keypoints, len(squares))
    assert found.features.shape == (len(expected), architecture.features)


def test_scalars_are_rectified_and_vectors_are_not() -> None:
    found = BevSensor(network()).encode(clouds(1)[0])
    scalars = SMALL.features - 2 * SMALL.vectors
    assert (found.features[:, :scalars] >= 0.0).all()
    assert (found.features[:, scalars:] < 0.0).any()
    assert (rounded(found.features) == found.features).all()


def test_nothing_seen_makes_no_keypoint() -> None:
    empty = seen_from((0.0, 0.0), 0.0, np.zeros((5, 3)))
    found = BevSensor(network()).encode(empty)
    assert found.features.shape == (0, SMALL.features)
    (message,) = read_features(write_features([to_message(empty, found, SMALL, 0)]))
    assert to_observed(message, 0).features.shape == (0, SMALL.features)


def test_places_are_in_units_of_the_scale() -> None:
    found = patches([scan_of(clouds(1)[0])])
    distance = np.hypot(found.x, found.y)
    expected = np.stack([found.x, found.y, distance], axis=1) / PLACE_SCALE
    np.testing.assert_allclose(place(found), expected, atol=2.0**-9)


def test_the_past_matters() -> None:
    """Equal newest scans, other earlier ones: other features."""
    fresh, experienced = BevSensor(network()), BevSensor(network())
    *before, last = clouds()
    for cloud in before:
        experienced.encode(cloud)
    alone, found = fresh.encode(last), experienced.encode(last)
    assert alone.features.tobytes() != found.features.tobytes()


def test_the_same_scan_twice_is_as_once() -> None:
    once, twice = BevSensor(network()), BevSensor(network())
    for cloud in clouds():
        twice.encode(cloud)
        assert once.encode(cloud).features.tobytes() == twice.encode(cloud).features.tobytes()


@pytest.mark.parametrize("count", [0, 3, 8])
def test_a_receiver_reads_what_the_sender_saw(count: int) -> None:
    """The first keypoints of a message; all numbers are those of the sender, to the bit."""
    *_, cloud = clouds()
    keypoints = BevSensor(network()).encode(cloud)
    (message,) = read_features(write_features([to_message(cloud, keypoints, SMALL, 5)]))
    assert (message.capacity, message.dimensions) == (SMALL.keypoints, SMALL.features)
    assert message.encoder == 5
    partial = dataclasses.replace(message, keypoints=message.keypoints[:count])
    own, received = seen(cloud, keypoints, PERIOD * 4), to_observed(partial, PERIOD * 4)
    for name in ("x", "y", "z", "features"):
        assert getattr(received, name).tobytes() == getattr(own, name)[:count].tobytes(), name
    assert received.frame == own.frame == cloud.frame
    assert received.age == own.age == pytest.approx(0.1)
    assert own.own
    assert not received.own


def test_on_the_air_heights_are_from_the_sensor() -> None:
    (cloud,) = clouds(1)
    message = to_message(cloud, BevSensor(network()).encode(cloud), SMALL, 0)
    heights = message.keypoints[:, 2].astype(float) + cloud.height
    assert set(np.round(heights, 5).tolist()) <= {1.0, 2.8}
    assert message.position.tolist() == [0.0, -1.0, 2.0]


def test_raw_points_go_there_and_back() -> None:
    (cloud,) = clouds(1)
    (message,) = read_features(write_features([raw_message(cloud)]))
    back = raw_cloud(message)
    for name in ("x", "y", "z"):
        assert getattr(back, name).tobytes() == getattr(cloud, name).tobytes()
    assert (back.vehicle, back.time, back.frame, back.height) == (1, 0, cloud.frame, cloud.height)
    assert (message.capacity, message.dimensions, message.size) == (RAW_POINTS, 0, 786_432)
    assert message.encoder == 0


@given(count=st.integers(RAW_POINTS - 2, 3 * RAW_POINTS))
@settings(max_examples=5, deadline=None)
def test_too_many_raw_points_are_thinned_evenly(count: int) -> None:
    ramp = np.arange(count, dtype=np.float32)
    cloud = dataclasses.replace(clouds(1)[0], x=ramp, y=ramp, z=ramp)
    rows = raw_message(cloud).keypoints[:, 0]
    assert len(rows) == min(count, RAW_POINTS)
    assert (rows[0], rows[-1]) == (0.0, count - 1.0)
    steps = np.diff(rows)
    assert steps.min() >= 1.0
    assert steps.max() - steps.min() <= 1.0


def test_early_fusion_encodes_what_others_send_with_the_own_scan() -> None:
    """A cloud of another counts, and its history; nothing is left of it when it is gone."""
    early = network(changed(early=True))
    assert Sender(early).message(clouds(1)[0]).dimensions == 0
    own = clouds()
    other = [
        seen_from((30.0, 1.0), 2.0, street(moved=0.5 * k), time=k * PERIOD, vehicle=2)
        for k in range(4)
    ]
    alone, helped, left = BevSensor(early), BevSensor(early), BevSensor(early)
    for k in range(4):
        by_itself = alone.encode(own[k]).features.tobytes()
        assert by_itself != helped.encode(own[k], [other[k]]).features.tobytes()
        left_again = left.encode(own[k], [other[k]] if k < 3 else []).features.tobytes()
    assert left_again == by_itself
    late = BevSensor(early)
    for k in range(3):
        late.encode(own[k])
    at_once = late.encode(own[3], [other[3]]).features.tobytes()
    again = BevSensor(early)
    for k in range(4):
        with_history = again.encode(own[k], [other[k]]).features.tobytes()
    assert at_once != with_history


def test_more_of_a_cloud_of_another_replaces_what_arrived_before() -> None:
    early = network(changed(early=True))
    own = clouds(3)
    whole = seen_from((30.0, 1.0), 2.0, street(), vehicle=2)
    part = dataclasses.replace(whole, x=whole.x[:99], y=whole.y[:99], z=whole.z[:99])
    one, other = BevSensor(early), BevSensor(early)
    one.encode(own[0], [part])
    other.encode(own[0], [whole])
    found = [sensor.encode(own[1], [whole]).features.tobytes() for sensor in (one, other)]
    assert found[0] == found[1]
