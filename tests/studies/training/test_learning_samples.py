"""Samples and lessons: what is recorded is read, and what is learned from is true."""

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given, settings, strategies as st

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.fusion import Observed, geometry
from fmus.driving.network.patches import INPUTS, History, patches
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from studies.training.learning.batches import batch_of, delivered
from studies.training.learning.lessons import MESSAGES, MOMENT, Lessons, lessons
from studies.training.learning.sample import BODY, Sample, read_sample, write_sample
from tests.fmus.driving.network.world import PERIOD, SMALL, changed
from tests.studies.training.lessons_world import EGO_ID, SHARER, SPEED, bodies, sample

SMALL_WITH_ALL = changed(keypoints=500)
"""So many keypoints that every place is one."""


def known(samples: list[Sample], architecture: Architecture = SMALL, seed: int = 0) -> Lessons:
    return lessons(samples, architecture, np.random.default_rng(seed))


def same(one: Any, other: Any) -> bool:
    """Whether two values, of whatever type a sample has, are equal."""
    if dataclasses.is_dataclass(one):
        names = [field.name for field in dataclasses.fields(one)]
        return all(same(getattr(one, name), getattr(other, name)) for name in names)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(np.array_equal(one, other))


@pytest.mark.parametrize("sharers", [(), (SHARER,), (SHARER, 11)])
def test_a_sample_is_read_as_it_was_written(sharers: tuple[int, ...]) -> None:
    written = sample(3, sharers=sharers)
    assert same(read_sample(write_sample(written)), written)
    bare = dataclasses.replace(written, scans=(), bodies=np.zeros(0, BODY))
    assert same(read_sample(write_sample(bare)), bare)
    empty = tuple(dataclasses.replace(s, cells=s.cells[:0]) for s in written.scans)
    assert same(read_sample(write_sample(dataclasses.replace(written, scans=empty))).scans, empty)


def test_a_damaged_sample_is_refused() -> None:
    data = write_sample(sample(3))
    for cut in (data[:-1], data[:-4], data + b"abcd"):
        with pytest.raises(ValueError, match="another number of cells"):
            read_sample(cut)
    with pytest.raises(ValueError, match="the sample is cut short"):
        read_sample(data[:300])
    with pytest.raises(ValueError, match="not a `SMPL` frame"):
        read_sample(b"FEAT" + data[4:])
    with pytest.raises(ValueError, match="one SAMPLE record, not 0"):
        read_sample(b"")


def truth(x: float, y: float, k: int, sensor: Frame, vehicle: int) -> tuple[bool, Array]:
    """Whether the place is in a body grown by 0.5 m, and the velocity of that; by brute force."""
    there = sensor.to(Frame(x=0.0, y=0.0, heading=0.0), np.array([x]), np.array([y]))
    east, north = float(there[0][0]), float(there[1][0])
    for body in bodies(k):
        own = Frame(x=body["place"][0], y=body["place"][1], heading=body["place"][2])
        ahead, left = Frame(x=0.0, y=0.0, heading=0.0).to(own, np.array([east]), np.array([north]))
        inside = (
            abs(ahead[0]) < body["size"][0] / 2 + 0.5 and abs(left[0]) < body["size"][1] / 2 + 0.5
        )
        if body["number"] != vehicle and inside:
            turn = complex(*body["velocity"]) * np.exp(-1j * sensor.heading)
            return True, np.array([turn.real, turn.imag])
    return False, np.zeros(2)


def test_every_place_is_taught_what_is_there() -> None:
    found = known([sample(k) for k in range(1, 6)], SMALL_WITH_ALL)
    assert len(found.scans) == 10
    last = sample(5)
    for scan, rows in zip(last.scans, found.keypoints[-2:], strict=True):
        there = rows[rows["present"]]
        assert there["vehicle"].sum() > 10
        assert there["moving"].sum() > 3
        for row in there:
            x, y, _ = row["at"].tolist()
            is_vehicle, velocity = truth(x, y, 5, scan.frame, scan.vehicle)
            assert bool(row["vehicle"]) == is_vehicle
            assert bool(row["moving"]) == (np.hypot(*velocity) > 1.0)
            np.testing.assert_allclose(row["velocity"], velocity, atol=1e-5)
        assert not rows[~rows["present"]]["vehicle"].any()
    speeds = np.hypot(*found.keypoints[-1]["velocity"].T)
    assert set(np.round(speeds, 3).tolist()) >= {0.0, SPEED}


@pytest.mark.parametrize(("away", "belongs"), [(0.7, True), (0.8, False)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_place_beside_a_small_body_is_of_it(away: float, axis: int, *, belongs: bool) -> None:
    """A person, half of whose size is less than the half metre around it, stands before a wall."""
    first = sample(1)
    found = known([first], SMALL_WITH_ALL)
    sensor = first.scans[0].frame
    rows = found.keypoints[0]
    wall = rows[rows["present"] & ~rows["vehicle"]][0]
    at = sensor.to(Frame(x=0.0, y=0.0, heading=0.0), *(wall["at"][k : k + 1] for k in (0, 1)))
    person = np.zeros(1, BODY)
    person["number"], person["size"] = 77, (0.5, 0.5)
    person["place"][0, :2] = [float(each[0]) for each in at]
    person["place"][0, axis] -= away
    person["velocity"] = (1.5, 0.0)
    beside = dataclasses.replace(first, bodies=np.concatenate([first.bodies, person]))
    taught = known([beside], SMALL_WITH_ALL).keypoints[0]
    (row,) = taught[taught["present"] & (taught["at"] == wall["at"]).all(axis=1)]
    assert (bool(row["vehicle"]), bool(row["moving"])) == (belongs, belongs)


def test_the_places_of_a_threat_are_marked() -> None:
    """From the moment on in which the expert yields to it."""
    found = known([sample(k) for k in range(1, 9)], SMALL_WITH_ALL)
    for k, moment in enumerate(found.moments):
        rows = found.keypoints[moment["own"]]
        expected = rows["moving"] & (np.hypot(*rows["velocity"].T) < 1.01 * SPEED)
        if k + 1 <= 5:
            assert not rows["threat"].any()
        else:
            assert (rows["threat"] == expected).all()
            assert rows["threat"].any()


def test_images_are_those_of_the_encoder() -> None:
    samples = [sample(k) for k in range(1, 6)]
    found = known(samples, SMALL_WITH_ALL)
    histories = {EGO_ID: History(), SHARER: History()}
    for k, each in enumerate(samples):
        for number, scan in enumerate(each.scans):
            histories[scan.vehicle].add(scan)
            expected = patches(histories[scan.vehicle].stack)
            rows = found.keypoints[2 * k + number]
            rows = rows[rows["present"]]
            assert len(rows) == len(expected.x)
            at = np.stack([expected.x, expected.y, expected.z], axis=1).astype(np.float32)
            order = np.lexsort(at.T), np.lexsort(rows["at"].T)
            assert (at[order[0]] == rows["at"][order[1]]).all()
            images = np.unpackbits(rows["image"][order[1]], axis=1, count=INPUTS)
            assert (images == expected.image[order[0]]).all()


@pytest.mark.parametrize("spacing", [1, 4])
def test_the_teacher_chooses_what_moves_then_what_stands_then_the_rest(spacing: int) -> None:
    samples = [sample(k) for k in range(1, 6)]
    everything = known(samples, changed(keypoints=500, spacing=spacing))
    for count in (3, 12, 60):
        found = known(samples, changed(keypoints=count, spacing=spacing))
        for rows, all_rows in zip(found.keypoints, everything.keypoints, strict=True):
            rank = rows["vehicle"].astype(int) + rows["moving"]
            assert (np.diff(rank) <= 0).all()
            assert rows["present"].sum() == min(count, all_rows["present"].sum())
            of_all = all_rows["vehicle"].astype(int) + all_rows["moving"]
            for kind in (2, 1):
                before = (of_all > kind).sum()
                assert (rank == kind).sum() == min((of_all == kind).sum(), max(count - before, 0))


def test_equally_important_places_are_in_random_order() -> None:
    samples = [sample(k) for k in range(1, 3)]
    one, again, other = (known(samples, seed=seed) for seed in (1, 1, 2))
    assert one.keypoints.tobytes() == again.keypoints.tobytes() != other.keypoints.tobytes()


def test_moments_know_the_own_scan_and_the_newest_of_others() -> None:
    samples = [sample(k, sharers=(SHARER, 11)) for k in range(1, 9)]
    found = known(samples)
    for k, moment in enumerate(found.moments):
        assert moment["own"] == 3 * k
        others = moment["others"]
        there = others[others >= 0]
        assert len(there) == min(2 * (k + 1), MESSAGES)
        assert (others[len(there) :] == -1).all()
        times = found.scans["time"][there]
        assert (np.diff(times) <= 0).all()
        assert times[0] == moment["time"] == (k + 1) * PERIOD
        assert len(set(there.tolist())) == len(there)
        assert not set((there % 3).tolist()) & {0}


def test_a_network_without_others_learns_from_its_own_scans() -> None:
    samples = [sample(k) for k in range(1, 9)]
    both = known(samples, SMALL_WITH_ALL)
    blind = known(samples, changed(SMALL_WITH_ALL, cooperative=False))
    early = known(samples, changed(SMALL_WITH_ALL, early=True))
    for alone in (blind, early):
        assert (alone.moments["own"] == np.arange(8)).all()
        assert (alone.moments["others"] == -1).all()
    for k in range(8):
        mine = both.keypoints[2 * k]["present"].sum()
        assert blind.keypoints[k]["present"].sum() == mine
        assert early.keypoints[k]["present"].sum() >= mine
    more = early.keypoints["present"].sum(axis=1) > blind.keypoints["present"].sum(axis=1)
    assert not more[0]  # clouds of others come one period late
    assert more[1:].sum() >= 4  # and now and then none


def test_parts_keep_their_scans() -> None:
    parts = [
        known([sample(k, seed) for k in range(1, n)], seed=seed) for seed, n in ((1, 4), (2, 6))
    ]
    whole = Lessons.of(parts)
    assert len(whole) == 8
    offsets = [(0, 0), (3, 6)]
    for part, (first, shift) in zip(parts, offsets, strict=True):
        for k, moment in enumerate(part.moments):
            joined = whole.moments[first + k]
            for own, index in [
                (moment["own"], joined["own"]),
                *zip(moment["others"], joined["others"], strict=True),
            ]:
                assert index == (own + shift if own >= 0 else -1)
                if own >= 0:
                    assert whole.scans[index] == part.scans[own]


def test_samples_without_scans_are_refused() -> None:
    bare = dataclasses.replace(sample(1), scans=())
    with pytest.raises(ValueError, match="the 2 samples of a run have no scan"):
        known([bare, bare])


def moments(count: int, reach: int = MESSAGES) -> Array:
    """Each knows an own scan and `reach` others, all of them different."""
    rows = np.zeros(count, MOMENT)
    rows["own"] = np.arange(count)
    rows["others"] = count + np.arange(count * MESSAGES).reshape(count, MESSAGES)
    rows["others"][:, reach:] = -1
    return rows


@given(
    seed=st.integers(0, 10**6), messages=st.integers(0, MESSAGES), reach=st.integers(0, MESSAGES)
)
@settings(max_examples=30, deadline=None)
def test_what_is_delivered_is_in_order_and_known(seed: int, messages: int, reach: int) -> None:
    rows = moments(50, reach)
    found = delivered(rows, messages, 6, np.random.default_rng(seed))
    assert found.scans.shape == (50, 1 + messages)
    assert found.keypoints.shape == (50, 1 + messages, 6)
    assert (found.scans[:, 0] == rows["own"]).all()
    assert found.keypoints[:, 0].all()
    for row, others in zip(found.scans[:, 1:].tolist(), rows["others"].tolist(), strict=True):
        there = [scan for scan in row if scan >= 0]
        assert row == there + [-1] * (messages - len(there))
        assert all(a < b for a, b in pairwise(there))
        assert set(there) <= set(others)


def test_rates_of_loss() -> None:
    """Mean of the rates: 2.9 / 7; a message is 0, 1 or 2 periods late; a fifth loses keypoints."""
    count, mean = 20_000, 2.9 / 7
    rows = moments(count)
    found = delivered(rows, MESSAGES, 4, np.random.default_rng(1))
    arrived = (found.scans[:, 1:, None] == rows["others"][:, None]).any(axis=1).mean(axis=0)
    np.testing.assert_allclose(arrived[2:], 1.0 - mean, atol=0.015)
    np.testing.assert_allclose(arrived[:2], [(1.0 - mean) / 3, (1.0 - mean) * 2 / 3], atol=0.015)
    assert found.keypoints[:, 1:].mean() == pytest.approx(1.0 - 0.2 * mean, abs=0.01)
    none = ((found.scans[:, 1:] >= 0).sum(axis=1) == 0).mean()
    assert none == pytest.approx(1 / 7 + 0.9**9 / 7, abs=0.03)


def test_batches_see_what_the_network_sees() -> None:
    """Geometry and turn as `fmus.driving.network.fusion` has them, to its rounding."""
    samples = [sample(k) for k in range(1, 7)]
    found = known(samples)
    arrived = delivered(found.moments, 2, SMALL.keypoints, np.random.default_rng(3))
    batch = batch_of(found, found.moments, arrived, np.arange(SMALL.keypoints), torch.device("cpu"))
    shape = (6, 3, SMALL.keypoints)
    numbers = batch.seen.geometry.numpy().reshape(*shape, -1)
    there, turns = batch.there.numpy().reshape(shape), batch.seen.turn.numpy().reshape(shape)
    assert (batch.seen.present.numpy().reshape(shape) == there & arrived.keypoints).all()
    assert there.any(axis=(0, 2)).all()
    for k, scans in enumerate(arrived.scans.tolist()):
        place = found.moments["place"][k].tolist()
        ego = Frame(x=place[0], y=place[1], heading=place[2])
        for number, scan in enumerate(scans):
            if scan < 0:
                assert not there[k, number].any()
                continue
            rows = found.keypoints[scan]
            x, y, heading = found.scans["place"][scan].tolist()
            observed = Observed(
                frame=Frame(x=x, y=y, heading=heading),
                x=rows["at"][:, 0].astype(float),
                y=rows["at"][:, 1].astype(float),
                z=rows["at"][:, 2].astype(float),
                features=np.zeros((len(rows), 0)),
                age=float(found.moments["time"][k] - found.scans["time"][scan]) / 1e9,
                own=number == 0,
            )
            expected = geometry(observed, ego, 8.0 * float(found.moments["numbers"][k, 0]))
            np.testing.assert_allclose(numbers[k, number], expected, atol=2.0**-9 + 1e-5)
            np.testing.assert_allclose(turns[k, number], observed.frame.turn(ego), atol=1e-6)
