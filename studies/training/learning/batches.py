"""Batches for training: moments, with those keypoints that the radio would have delivered."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from torch import Tensor

from fmus.driving.network.architecture import GEOMETRY
from fmus.driving.network.fusion import LENGTH_SCALE
from fmus.driving.network.patches import INPUTS
from orchestrator.signal import Array
from studies.training.learning.lessons import Lessons
from studies.training.learning.model import Seen

_RATES: Final = (0.0, 0.0, 0.1, 0.3, 0.6, 0.9, 1.0)
"""Rates of loss, equally likely."""
_ERASURES: Final = 0.2
"""Share of the moments in which single keypoints are lost, too."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Batch:
    """Moments of a batch.

    Attributes:
        seen, ego: inputs of the network.
        expert: its command, shape (batch, 3).
        yields: whether it yields to somebody, shape (batch,).
        vehicle, moving: of places, shape (batch, keypoint).
        velocity: of places in the sensor's frame [m/s], shape (batch, keypoint, 2).
        there: whether there is a place, arrived or not, shape (batch, keypoint).
        sees_threat: whether a keypoint is of the vehicle that the expert yields to, shape (batch,).
    """

    seen: Seen
    ego: Tensor
    expert: Tensor
    yields: Tensor
    vehicle: Tensor
    moving: Tensor
    velocity: Tensor
    there: Tensor
    sees_threat: Tensor


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Delivered:
    """What a moment knows.

    Attributes:
        scans: indices, the own one first, -1 where there is none; shape (batch, 1 + messages).
        keypoints: which of them arrived, bool, shape (batch, 1 + messages, keypoint).
    """

    scans: Array
    keypoints: Array


def delivered(moments: Array, messages: int, keypoints: int, rng: np.random.Generator) -> Delivered:
    """Draw what arrives: a rate of loss for each moment, then every message, or keypoint, by it.

    A message takes up to two periods of the sensors to arrive. Of those that did, the newest
    `messages` are used.

    Args:
        moments: MOMENT records, shape (moments,).
        messages: most messages of others that a moment has.
        keypoints: of a message.
        rng: draws what is lost.
    """
    count, reach = moments["others"].shape
    scans = np.full((count, 1 + messages), -1, np.int64)
    scans[:, 0] = moments["own"]
    arrived = np.ones((count, 1 + messages, keypoints), np.bool_)
    rate = rng.choice(_RATES, (count, 1))
    lost = rng.random((count, reach)) < rate
    lost |= np.arange(reach) < rng.integers(0, 3, (count, 1))
    known = np.where(lost, -1, moments["others"])
    order = np.argsort(known < 0, axis=1, kind="stable")[:, :messages]
    scans[:, 1:] = np.take_along_axis(known, order, axis=1)
    erased = rng.random((count, 1, 1)) < _ERASURES
    draws = rng.random((count, messages, keypoints))
    arrived[:, 1:] = ~(erased & (draws < rate[:, :, None]))
    return Delivered(scans=scans, keypoints=arrived)


def batch_of(
    known: Lessons, moments: Array, arrived: Delivered, columns: Array, device: torch.device
) -> Batch:
    """The arrays of a batch.

    Args:
        known: what the moments are of.
        moments: MOMENT records, shape (batch,).
        arrived: what they know.
        columns: indices of the keypoints that are looked at in every scan, shape (looked at,).
        device: where the tensors go.
    """
    # (batch, scan, keypoint); a scan of -1 is masked below
    rows = known.keypoints[arrived.scans[:, :, None], columns]
    there = rows["present"] & (arrived.scans >= 0)[:, :, None]
    sensor = known.scans[arrived.scans]
    geometry, turn = _geometry(rows, sensor, moments)
    count = len(moments)

    def tensor(values: Array) -> Tensor:
        flat = values.reshape(count, -1, *values.shape[3:])
        return torch.from_numpy(np.ascontiguousarray(flat)).to(device)

    present = there & arrived.keypoints[:, :, columns]
    image = np.unpackbits(rows["image"], axis=-1, count=INPUTS)
    return Batch(
        seen=Seen(
            image=tensor(image).float(),
            place=tensor(rows["place"]),
            turn=tensor(turn),
            geometry=tensor(geometry),
            present=tensor(present),
        ),
        ego=torch.from_numpy(moments["numbers"].copy()).to(device),
        expert=torch.from_numpy(moments["expert"].copy()).to(device),
        yields=torch.from_numpy(moments["yields"] != 0).to(device),
        vehicle=tensor(rows["vehicle"]),
        moving=tensor(rows["moving"]),
        velocity=tensor(rows["velocity"]),
        there=tensor(there),
        sees_threat=tensor((present & rows["threat"]).any(axis=2)).any(dim=1),
    )


def _geometry(rows: Array, sensor: Array, moments: Array) -> tuple[Array, Array]:
    """`fmus.driving.network.fusion.geometry` of all keypoints, and the turn of their vectors."""
    ego = moments["place"][:, None, None]  # (batch, 1, 1, 3)
    place = sensor["place"][:, :, None]
    x, y = rows["at"][..., 0], rows["at"][..., 1]
    cosine, sine = np.cos(place[..., 2]), np.sin(place[..., 2])
    east = x * cosine - y * sine + place[..., 0] - ego[..., 0]
    north = x * sine + y * cosine + place[..., 1] - ego[..., 1]
    cosine, sine = np.cos(ego[..., 2]), np.sin(ego[..., 2])
    geometry = np.empty((*x.shape, GEOMETRY), np.float32)
    geometry[..., 0] = (east * cosine + north * sine) / LENGTH_SCALE
    geometry[..., 1] = (north * cosine - east * sine) / LENGTH_SCALE
    geometry[..., 2] = rows["at"][..., 2] / LENGTH_SCALE
    geometry[..., 3] = moments["numbers"][:, 0, None, None]
    geometry[..., 4] = ((moments["time"][:, None] - sensor["time"]) / 1e9)[:, :, None]
    geometry[..., 5], geometry[..., 6] = 0.0, 1.0
    geometry[:, 0, :, 5], geometry[:, 0, :, 6] = 1.0, 0.0
    turn = np.broadcast_to(place[..., 2] - ego[..., 2], x.shape).astype(np.float32)
    return geometry, turn
