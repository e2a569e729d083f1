"""Left and right swapped: its algebra, and scenes that were mirrored before they were seen."""

from dataclasses import fields, replace
from typing import Final

import numpy as np
import pytest
import torch
from torch import Tensor

from fmus.driving.network.architecture import EGO, GEOMETRY, Architecture
from fmus.driving.network.patches import CHANNELS, WINDOW
from fmus.driving.network.scan import SIDE, Scan
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from studies.training.learning.batches import Batch, Delivered, batch_of
from studies.training.learning.lessons import lessons
from studies.training.learning.mirror import mirrored
from studies.training.learning.model import DrivingModel
from studies.training.learning.sample import Sample
from tests.fmus.driving.network.world import network
from tests.studies.training.lessons_world import sample
from tests.studies.training.test_learning_bev import learner

ARCHITECTURE: Final = Architecture(keypoints=600, features=24, vectors=5)
COUNT: Final = 8


def batch_of_all(samples: list[Sample]) -> Batch:
    """Every moment with its own scan and the newest of the sharer; everything arrives."""
    known = lessons(samples, ARCHITECTURE, np.random.default_rng(0))
    scans = np.stack([known.moments["own"], known.moments["others"][:, 0]], axis=1)
    arrived = np.ones((*scans.shape, ARCHITECTURE.keypoints), np.bool_)
    columns = np.arange(ARCHITECTURE.keypoints)
    delivered = Delivered(scans=scans, keypoints=arrived)
    return batch_of(known, known.moments, delivered, columns, torch.device("cpu"))


def scenes() -> list[Sample]:
    return [sample(k) for k in range(1, COUNT + 1)]


def tensors(batch: Batch) -> dict[str, Tensor]:
    parts = {f.name: getattr(batch, f.name) for f in fields(batch) if f.name != "seen"}
    return {**parts, **{f.name: getattr(batch.seen, f.name) for f in fields(batch.seen)}}


def test_twice_is_not_at_all() -> None:
    batch = batch_of_all(scenes())
    which = torch.arange(COUNT) % 3 != 0
    once = mirrored(batch, which)
    for name, value in tensors(mirrored(once, which)).items():
        assert torch.equal(value, tensors(batch)[name]), name
    assert not torch.equal(once.seen.image, batch.seen.image)


def test_only_those_chosen_are_mirrored() -> None:
    batch = batch_of_all(scenes())
    which = torch.arange(COUNT) % 2 == 0
    whole, some = (tensors(mirrored(batch, w)) for w in (torch.ones_like(which), which))
    for name, value in tensors(batch).items():
        assert torch.equal(some[name][which], whole[name][which]), name
        assert torch.equal(some[name][~which], value[~which]), name


def in_the_mirror(frame: Frame) -> Frame:
    return Frame(x=frame.x, y=-frame.y, heading=-frame.heading)


def scan_in_the_mirror(scan: Scan) -> Scan:
    rest, column = np.divmod(scan.cells, SIDE)
    cells = np.sort(rest * SIDE + SIDE - 1 - column).astype(np.int32)
    return replace(scan, frame=in_the_mirror(scan.frame), cells=cells)


def sample_in_the_mirror(each: Sample) -> Sample:
    """The world with y turned round: what the lidars would have seen, what the expert had done."""
    bodies, numbers = each.bodies.copy(), each.numbers.copy()
    bodies["place"][:, 1:] *= -1.0
    bodies["velocity"][:, 1] *= -1.0
    numbers[3::2] *= -1.0
    return replace(
        each,
        frame=in_the_mirror(each.frame),
        numbers=numbers,
        expert=each.expert * (1.0, 1.0, -1.0),
        scans=tuple(map(scan_in_the_mirror, each.scans)),
        bodies=bodies,
    )


def sorted_by_place(batch: Batch) -> dict[str, Array]:
    """The keypoints of each moment and scan by where they are, for their order is drawn."""
    found = {name: value.numpy() for name, value in tensors(batch).items()}
    absent = ~found["there"]
    keys = np.round(found["geometry"][..., :2] * 8.0, 2)
    order = np.lexsort((keys[..., 1], keys[..., 0], found["geometry"][..., 6], absent), axis=1)
    by_keypoint = {n for n, v in found.items() if v.ndim >= 2 and v.shape[1] == absent.shape[1]}
    for name in by_keypoint:
        value = found[name]
        rows = order.reshape(*order.shape, *[1] * (value.ndim - 2))
        found[name] = np.take_along_axis(value, np.broadcast_to(rows, value.shape), axis=1)
    return found


def test_a_mirrored_moment_is_a_moment_of_the_mirrored_world() -> None:
    """To the bit in what the newest scans show; of earlier cells less than 1 in 2000 differ."""
    every = torch.ones(COUNT, dtype=torch.bool)
    found = sorted_by_place(mirrored(batch_of_all(scenes()), every))
    expected = sorted_by_place(batch_of_all([*map(sample_in_the_mirror, scenes())]))
    there = expected["there"]
    assert there.sum() > 800
    assert (found["there"] == there).all()
    for name in ("vehicle", "moving", "present"):
        assert (found[name] == expected[name]).all(), name
    for name in ("place", "geometry", "turn", "velocity"):
        np.testing.assert_allclose(found[name][there], expected[name][there], atol=1e-5)
    for name in ("ego", "expert", "yields", "sees_threat"):
        np.testing.assert_array_equal(found[name], expected[name])
    shape = (-1, CHANNELS, WINDOW * WINDOW)
    differ = (found["image"] != expected["image"])[there].reshape(shape)
    assert not differ[:, :2].any()
    assert differ[:, 2:].mean() < 1 / 2000


def weights_in_the_mirror(weights: dict[str, Array]) -> dict[str, Array]:
    """Of the network that does in the mirror what the other one does."""
    found = {name: np.array(value) for name, value in weights.items()}
    image = found["encoder.image.weight"].reshape(CHANNELS, WINDOW, WINDOW, -1)
    found["encoder.image.weight"] = image[:, :, ::-1].reshape(weights["encoder.image.weight"].shape)
    found["encoder.place.weight"][1] *= -1.0
    scalars = ARCHITECTURE.features - 2 * ARCHITECTURE.vectors
    for name in ("encoder.features.weight", "encoder.features.bias"):
        found[name][..., scalars + 1 :: 2] *= -1.0
    found["fusion.first.weight"][scalars + 1 : ARCHITECTURE.features : 2] *= -1.0
    found["fusion.first.weight"][-GEOMETRY + 1] *= -1.0
    found["head.first.weight"][-EGO + 3 :: 2] *= -1.0
    for name in ("head.second.weight", "head.second.bias"):
        found[name][..., 2] *= -1.0
    return found


@pytest.mark.parametrize("seed", range(3))
def test_a_network_of_mirrored_weights_drives_alike_in_the_mirror(seed: int) -> None:
    """The same pedals, the wheel the other way; to the rounding of float32."""
    batch = batch_of_all(scenes())
    weights = dict(network(ARCHITECTURE, seed).weights)
    plain, reflected = DrivingModel(ARCHITECTURE), DrivingModel(ARCHITECTURE)
    plain.layers.load(weights)
    reflected.layers.load(weights_in_the_mirror(weights))
    swapped = mirrored(batch, torch.ones(COUNT, dtype=torch.bool))
    with torch.no_grad():
        here = plain(batch.seen, batch.ego)
        there = reflected(swapped.seen, swapped.ego)
        unchanged = plain(swapped.seen, swapped.ego)
    sign = torch.tensor([1.0, 1.0, -1.0])
    torch.testing.assert_close(there.command, here.command * sign, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(there.judgements, here.judgements, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(
        there.velocity, here.velocity * torch.tensor([1.0, -1.0]), atol=1e-3, rtol=1e-4
    )
    assert (unchanged.command - here.command * sign).abs().max() > 0.01


def test_a_learner_with_a_mirror_learns_from_other_moments() -> None:
    """Half of them, so the losses differ; it learns from them as well."""
    plain, swapped = (learner(mirror=mirror).epoch() for mirror in (False, True))
    assert plain.training != swapped.training
    assert swapped.training < 2.0 * plain.training
