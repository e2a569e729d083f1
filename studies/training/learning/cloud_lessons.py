"""Samples as arrays for point transformers: clouds, and what the expert did at each moment.

Batches draw what the radio delivers, as those of the BEV networks do; every cloud is encoded once
in a batch, however many moments of it know the scan.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.point_transformer import CENTIMETRE
from orchestrator.signal import Array
from studies.training.learning.batches import Delivered
from studies.training.learning.lessons import (
    MOMENT,
    SCANNED,
    MomentRow,
    Moments,
    ScannedRow,
    moment_row,
    newest,
    scanned_row,
)
from studies.training.learning.sample import Sample


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CloudLessons(Moments):
    """What is learned from by clouds.

    Attributes:
        points: levelled sensor frame [cm], int16, shape (scan, point, 3); those after the first
            `count` are zero.
        count: points of each scan, shape (scan,).
        height: of the sensor over the ground [m], shape (scan,).
    """

    points: Array
    count: Array
    height: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class CloudBatch:
    """Moments of a batch, and the clouds that they know.

    Attributes:
        clouds: levelled sensor frame [m], shape (cloud, point, 3); repeats come last.
        distinct: so many points of each cloud are no repeats, int64, shape (cloud,).
        cloud: which cloud a scan is, int64, shape (batch, scan); 0 where there is none.
        arrived: whether there is a scan and the radio delivered this keypoint of it, shape (batch,
            scan, keypoint); clouds may have fewer keypoints.
        place: of the sensor in the ego vehicle's frame: x, y [m], cosine and sine of its heading,
            height over the ground [m]; shape (batch, scan, 5).
        circumstances: speed over the length scale, age [s], own, of another; shape (batch, scan,
            4).
        ego: numbers about the ego vehicle, shape (batch, EGO).
        expert: its command, shape (batch, 3).
        yields: whether it yields to somebody, shape (batch,).
    """

    clouds: Tensor
    distinct: Tensor
    cloud: Tensor
    arrived: Tensor
    place: Tensor
    circumstances: Tensor
    ego: Tensor
    expert: Tensor
    yields: Tensor


def cloud_lessons(samples: Iterable[Sample], architecture: Architecture) -> CloudLessons:
    """What the samples of one run teach.

    Args:
        samples: in order of time.
        architecture: of the network that is to learn from them.

    Raises:
        ValueError: the samples have fewer points than the network reads, or no scan with points.
    """
    clouds: list[Array] = []
    heights: list[float] = []
    scanned: list[ScannedRow] = []
    moments: list[MomentRow] = []
    earlier: dict[int, list[int]] = {}
    for sample in samples:
        _check(sample, architecture)
        own = -1
        for scan, points in zip(sample.scans, sample.points, strict=True):
            is_own = scan.vehicle == sample.ego
            if len(points) == 0 or not (is_own or architecture.cooperative):
                continue
            if is_own:
                own = len(clouds)
            else:
                earlier.setdefault(scan.vehicle, []).insert(0, len(clouds))
            clouds.append(points[: architecture.points])
            heights.append(scan.height)
            scanned.append(scanned_row(scan))
        moments.append(moment_row(sample, own, newest(earlier.values(), scanned)))
    if not clouds:
        raise ValueError("no scan of a run has a point that the network would read")
    stored = np.zeros((len(clouds), architecture.points, 3), np.int16)
    for row, points in zip(stored, clouds, strict=True):
        row[: len(points)] = points
    return CloudLessons(
        points=stored,
        count=np.array([len(points) for points in clouds], np.int64),
        height=np.array(heights),
        scans=np.array(scanned, SCANNED),
        moments=np.array(moments, MOMENT),
    )


def _check(sample: Sample, architecture: Architecture) -> None:
    if sample.most_points < architecture.points:
        raise ValueError(
            f"the samples have at most {sample.most_points} points of a scan, and this network "
            f"reads {architecture.points}: set `components.policy.parameters.points` to "
            f"{architecture.points}"
        )


def cloud_batch_of(
    known: CloudLessons,
    moments: Array,
    arrived: Delivered,
    rng: np.random.Generator,
    device: torch.device,
) -> CloudBatch:
    """The arrays of a batch.

    Args:
        known: what the moments are of.
        moments: MOMENT records, shape (batch,).
        arrived: what they know.
        rng: draws the order of the points, and which of them are repeated.
        device: where the tensors go.
    """
    is_there = arrived.scans >= 0
    scans, cloud = np.unique(arrived.scans[is_there], return_inverse=True)
    which = np.zeros(is_there.shape, np.int64)
    which[is_there] = cloud
    points = known.points[scans]  # a copy
    for each, count in zip(points, known.count[scans].tolist(), strict=True):
        each[:] = _filled(each, count, rng)

    def tensor(values: Array) -> Tensor:
        return torch.from_numpy(np.ascontiguousarray(values)).to(device)

    return CloudBatch(
        clouds=tensor(points).float() * CENTIMETRE,
        distinct=tensor(known.count[scans]),
        cloud=tensor(which),
        arrived=tensor(arrived.keypoints & is_there[:, :, None]),
        place=tensor(_place(known, arrived.scans, moments)),
        circumstances=tensor(_circumstances(known, arrived.scans, moments)),
        ego=tensor(moments["numbers"]),
        yields=tensor(moments["yields"] != 0),
        expert=tensor(moments["expert"]),
    )


def _filled(points: Array, count: int, rng: np.random.Generator) -> Array:
    """The `count` points in another order, then some of them again."""
    order = rng.permutation(count)
    again = rng.integers(count, size=len(points) - count)
    filled: Array = points[np.concatenate([order, order[again]])]
    return filled


def _place(known: CloudLessons, scans: Array, moments: Array) -> Array:
    ego, sensor = moments["place"][:, None], known.scans["place"][scans]
    east, north = sensor[..., 0] - ego[..., 0], sensor[..., 1] - ego[..., 1]
    cosine, sine = np.cos(ego[..., 2]), np.sin(ego[..., 2])
    turn = sensor[..., 2] - ego[..., 2]
    x, y = east * cosine + north * sine, north * cosine - east * sine
    place = [x, y, np.cos(turn), np.sin(turn), known.height[scans]]
    return np.stack(place, axis=-1).astype(np.float32)


def _circumstances(known: CloudLessons, scans: Array, moments: Array) -> Array:
    numbers = np.zeros((*scans.shape, 4), np.float32)
    numbers[..., 0] = moments["numbers"][:, :1]
    numbers[..., 1] = (moments["time"][:, None] - known.scans["time"][scans]) / 1e9
    numbers[:, 0, 2], numbers[:, 1:, 3] = 1.0, 1.0
    return numbers
