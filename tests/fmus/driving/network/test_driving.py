"""Fusion and head: no order, no world frame, and a loss is one voice less."""

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.driving.network.architecture import EGO
from fmus.driving.network.driver import LOOKAHEAD, DrivingNetwork, Head, along, ego_numbers
from fmus.driving.network.fixed_point import rounded, rounded_weights
from fmus.driving.network.fusion import Fusion, Observed, geometry
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from tests.fmus.driving.network.world import SMALL, network

SEEDS = st.integers(0, 10**6)
STEP = 2.0**-8
ROUTE = np.array([[0.0, 0.0], [12.0, 1.0], [30.0, 9.0], [31.0, 40.0]])
CHECKPOINT = network()
FUSION = Fusion(SMALL, CHECKPOINT.weights)
NETWORK = DrivingNetwork(SMALL, CHECKPOINT.weights)
HERE = Frame(x=3.0, y=4.0, heading=0.7)


def observed(seed: int, *counts: int) -> list[Observed]:
    """Scans of so many keypoints each; the first is the own one."""
    rng = np.random.default_rng(seed)
    return [
        Observed(
            frame=Frame(x=rng.uniform(-30, 30), y=rng.uniform(-30, 30), heading=rng.uniform(-3, 3)),
            x=rounded(rng.uniform(-50, 50, count)),
            y=rounded(rng.uniform(-50, 50, count)),
            z=rng.choice([1.0, 2.8], count),
            features=rounded(rng.normal(size=(count, SMALL.features))),
            age=float(rng.integers(0, 10)) / 10,
            own=k == 0,
        )
        for k, count in enumerate(counts)
    ]


def rows_of(each: Observed, rows: Array) -> Observed:
    return dataclasses.replace(
        each, x=each.x[rows], y=each.y[rows], z=each.z[rows], features=each.features[rows]
    )


def fused(them: Sequence[Observed], ego: Frame = HERE, speed: float = 8.0) -> Array:
    return FUSION.fuse(them, ego, speed)


@given(seed=SEEDS)
@settings(max_examples=40, deadline=None)
def test_order_does_not_matter(seed: int) -> None:
    """Neither of the keypoints nor of the messages: to the bit."""
    rng = np.random.default_rng(seed)
    them = observed(seed, 8, 5, 0, 7)
    shuffled = [rows_of(each, rng.permutation(len(each.x))) for each in them]
    moved = [shuffled[k] for k in rng.permutation(4)]
    assert fused(moved).tobytes() == fused(them).tobytes()


@given(seed=SEEDS)
@settings(max_examples=40, deadline=None)
def test_a_lost_keypoint_is_one_voice_less(seed: int) -> None:
    """What is fused of two parts is the larger one of each; it never grows by a loss."""
    rng = np.random.default_rng(seed)
    them = observed(seed, 8, 8, 8)
    kept = [rng.random(len(each.x)) < 0.5 for each in them]
    arrived = fused([rows_of(each, keep) for each, keep in zip(them, kept, strict=True)])
    lost = fused([rows_of(each, ~keep) for each, keep in zip(them, kept, strict=True)])
    assert np.maximum(arrived, lost).tobytes() == fused(them).tobytes()
    assert (arrived >= 0.0).all()


def test_without_keypoints_there_is_silence() -> None:
    for them in ([], observed(1, 0), observed(1, 0, 0)):
        assert fused(them).tobytes() == np.zeros(SMALL.pooled).tobytes()
    command = NETWORK.drive([], frame=HERE, speed=8.0, wanted_speed=8.0, route=ROUTE)
    assert np.isfinite(command).all()


def moved(frame: Frame, by: Frame) -> Frame:
    """The frame after the world has been turned and shifted."""
    x, y = moved_points(np.array([[frame.x, frame.y]]), by)[0]
    return Frame(x=float(x), y=float(y), heading=frame.heading + by.heading)


def moved_points(points: Array, by: Frame) -> Array:
    cosine, sine = math.cos(by.heading), math.sin(by.heading)
    turn = np.array([[cosine, sine], [-sine, cosine]])
    return np.asarray(points @ turn + np.array([by.x, by.y]))


@given(seed=SEEDS)
@settings(max_examples=40, deadline=None)
def test_the_command_does_not_depend_on_where_the_world_is(seed: int) -> None:
    """Where no number lies at the middle of two steps, which is the rule, to the bit."""
    rng = np.random.default_rng(seed)
    by = Frame(x=rng.uniform(-99, 99), y=rng.uniform(-99, 99), heading=rng.uniform(-3, 3))
    them = observed(seed, 8, 8)
    there = [dataclasses.replace(each, frame=moved(each.frame, by)) for each in them]
    given = {"speed": 7.3, "wanted_speed": 8.1}
    one = NETWORK.drive(them, frame=HERE, route=ROUTE, **given)
    other = NETWORK.drive(there, frame=moved(HERE, by), route=moved_points(ROUTE, by), **given)
    assert one.tobytes() == other.tobytes()


def through(names: tuple[str, str], change: Array) -> Array:
    """By how much the outputs of two layers may change if their inputs change by so much.

    Through each layer times the magnitudes of its weights, and half a step of rounding in either
    of both results; neither maximum nor limits make it more.
    """
    for name in names:
        weight = np.abs(rounded_weights(CHECKPOINT.weights[f"{name}.weight"]))
        change = change @ weight + STEP
    return change


@given(seed=SEEDS, heading=st.floats(-3, 3))
@settings(max_examples=40, deadline=None)
def test_where_numbers_are_between_two_steps_the_command_changes_by_a_bounded_amount(
    seed: int, heading: float
) -> None:
    """Sensors that head where the ego heads: an eighth of all numbers are halves of a step."""
    by = Frame(x=12.3, y=-4.5, heading=heading)
    them = [
        dataclasses.replace(each, frame=Frame(x=float(k), y=2.0, heading=0.0))
        for k, each in enumerate(observed(seed, 8, 8))
    ]
    ego = Frame(x=0.0, y=0.0, heading=0.0)
    there = [dataclasses.replace(each, frame=moved(each.frame, by)) for each in them]
    vectors, place, rest = np.full(2 * SMALL.vectors, STEP), np.full(2, STEP), np.zeros(5)
    scalars = np.zeros(SMALL.features - len(vectors))
    pooled = through(
        ("fusion.first", "fusion.second"), np.concatenate([scalars, vectors, place, rest])
    )
    assert (np.abs(fused(them, ego) - fused(there, moved(ego, by))) <= pooled).all()
    speeds, route = np.zeros(2), np.full(EGO - 2, STEP)
    bound = through(("head.first", "head.second"), np.concatenate([pooled, speeds, route]))
    given = {"speed": 7.3, "wanted_speed": 8.1}
    one = NETWORK.drive(them, frame=ego, route=ROUTE, **given)
    other = NETWORK.drive(there, frame=moved(ego, by), route=moved_points(ROUTE, by), **given)
    assert abs(one[2] - other[2]) <= bound[2]


def test_geometry_is_where_a_keypoint_is_for_the_ego() -> None:
    """The ego heads north at (10, 20); a sensor at (10, 30) heading west sees 4 m to its left."""
    each = Observed(
        frame=Frame(x=10.0, y=30.0, heading=math.pi),
        x=np.array([1.0]),
        y=np.array([4.0]),
        z=np.array([1.0]),
        features=np.zeros((1, SMALL.features)),
        age=0.25,
        own=False,
    )
    found = geometry(each, Frame(x=10.0, y=20.0, heading=math.pi / 2), 4.0)
    assert found.tolist() == [[6.0 / 8, 1.0 / 8, 1.0 / 8, 4.0 / 8, 0.25, 0.0, 1.0]]
    mine = geometry(dataclasses.replace(each, own=True), each.frame, 0.0)
    assert mine.tolist() == [[1.0 / 8, 4.0 / 8, 1.0 / 8, 0.0, 0.25, 1.0, 0.0]]


def test_vectors_turn_with_their_sensor() -> None:
    """A sensor that heads to the ego's left: its (1, 0) is the ego's (0, 1)."""
    (one,) = observed(6, 8)
    scalars = SMALL.features - 2 * SMALL.vectors
    features = one.features.copy()
    features[:, scalars::2] = -one.features[:, scalars + 1 :: 2]
    features[:, scalars + 1 :: 2] = one.features[:, scalars::2]
    left = Frame(x=3.0, y=4.0, heading=HERE.heading + 0.5 * math.pi)
    ahead = dataclasses.replace(left, heading=HERE.heading)
    turned = dataclasses.replace(one, frame=ahead, x=-one.y, y=one.x, features=features)
    np.testing.assert_allclose(
        fused([dataclasses.replace(one, frame=left)]), fused([turned]), atol=4 * STEP
    )


def test_vectors_turn_and_scalars_do_not() -> None:
    """A sensor that heads the other way, with turned vectors and places, says the same."""
    (one,) = observed(5, 8)
    scalars = SMALL.features - 2 * SMALL.vectors
    features = one.features.copy()
    features[:, scalars:] *= -1.0
    back = Frame(x=one.frame.x, y=one.frame.y, heading=one.frame.heading + math.pi)
    other = dataclasses.replace(one, frame=back, x=-one.x, y=-one.y, features=features)
    np.testing.assert_allclose(fused([other]), fused([one]), atol=8 * STEP)
    features[:, :scalars] *= -1.0
    assert np.abs(fused([dataclasses.replace(other, features=features)]) - fused([one])).max() > 0.1


@given(
    lengths=st.lists(st.floats(0.5, 20.0), min_size=1, max_size=5),
    angles=st.lists(st.floats(-1.5, 1.5), min_size=5, max_size=5),
    distance=st.floats(0.0, 60.0),
)
@settings(max_examples=60, deadline=None)
def test_places_along_a_route(lengths: list[float], angles: list[float], distance: float) -> None:
    """Walked step by step; beyond its end the route goes straight on."""
    edges = [
        length * np.array([math.cos(a), math.sin(a)])
        for length, a in zip(lengths, angles, strict=False)
    ]
    route = np.concatenate([[[1.0, 2.0]], np.cumsum(edges, axis=0) + np.array([1.0, 2.0])])
    rest, expected = distance, route[0]
    for k, (length, edge) in enumerate(zip(lengths, edges, strict=True)):
        part = rest if k == len(lengths) - 1 else min(rest, length)
        expected = expected + part / length * edge
        rest -= part
    np.testing.assert_allclose(along(route, [distance])[0], expected, atol=1e-9)
    doubled = np.repeat(route, 2, axis=0)
    np.testing.assert_allclose(along(doubled, [distance])[0], expected, atol=1e-9)


def test_the_ego_numbers_of_a_circle() -> None:
    """On a left turn of radius 20 m, s ahead is (R sin s/R, R (1 - cos s/R))."""
    angle = np.linspace(0.0, 2.0, 4001)
    center = np.array([5.0, -3.0])
    heading = 0.4
    across = heading - 0.5 * math.pi + angle
    route = center + 20.0 * np.stack([np.cos(across), np.sin(across)], axis=1)
    ego = Frame.at(route[0], heading)
    found = ego_numbers(ego, 6.0, 8.0, route) * 8.0
    assert found[:2].tolist() == [6.0, 8.0]
    s = np.array(LOOKAHEAD) / 20.0
    np.testing.assert_allclose(found[2::2], 20.0 * np.sin(s), atol=0.02)
    np.testing.assert_allclose(found[3::2], 20.0 * (1.0 - np.cos(s)), atol=0.02)
    beside = Frame(x=ego.x - math.sin(heading), y=ego.y + math.cos(heading), heading=heading)
    shifted = ego_numbers(beside, 6.0, 8.0, route) * 8.0
    np.testing.assert_allclose(shifted[3::2], found[3::2] - 1.0, atol=0.04)


def head_saying(accelerate: float, brake: float, steer: float) -> Array:
    weights = {n: np.zeros(s) for n, s in SMALL.shapes.items() if n.startswith("head")}
    weights["head.second.bias"] = np.array([accelerate, brake, steer])
    return Head(SMALL, weights).command(np.zeros(SMALL.pooled), np.zeros(EGO))


@given(accelerate=st.floats(-2, 2), brake=st.floats(-2, 2), steer=st.floats(-3, 3))
def test_one_pedal_at_a_time(accelerate: float, brake: float, steer: float) -> None:
    pedals = [min(max(float(rounded(np.array(v))), 0.0), 1.0) for v in (accelerate, brake)]
    found = head_saying(accelerate, brake, steer)
    stronger = 0 if pedals[0] > pedals[1] else 1
    assert found[stronger] == pytest.approx(pedals[stronger], abs=STEP)
    assert found[1 - stronger] == 0.0
    assert found[2] == pytest.approx(min(max(steer, -1.0), 1.0), abs=STEP)


def test_if_both_pedals_are_pressed_alike_it_brakes() -> None:
    assert head_saying(0.5, 0.5, -0.25).tolist() == [0.0, 0.5, -0.25]
