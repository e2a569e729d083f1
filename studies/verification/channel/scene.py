"""Vehicles, buildings and links as inputs of the channel."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.messages.records import NO_VEHICLE
from orchestrator.signal import Array

VEINS_ANTENNA_HEIGHT: Final = 1.895
"""Of every vehicle in Veins, its parameter `antennaOffsetZ` [m]."""


def vehicles(
    ids: npt.ArrayLike,
    front: npt.ArrayLike,
    heading: npt.ArrayLike,
    size: npt.ArrayLike,
    offset: npt.ArrayLike = 0.0,
) -> dict[str, Array]:
    """Equipped vehicles.

    Args:
        ids: ascending, shape (n,).
        front: a point on the axis of each body [m], shape (n, 2).
        heading: [rad], shape (n,).
        size: length, width, height [m], shape (n, 3).
        offset: of `front` behind the front bumper [m]; Veins: `hostPositionOffset`.
    """
    number = np.asarray(ids, np.int64)
    n = len(number)
    angle, body = np.asarray(heading, float), np.asarray(size, float).reshape(n, 3)
    behind = body[:, 0] / 2 - np.asarray(offset, float)
    axis = np.stack([np.cos(angle), np.sin(angle)], axis=-1).reshape(n, 2)
    position = np.zeros((n, 3))
    position[:, :2] = np.asarray(front, float).reshape(n, 2) - behind[:, None] * axis
    return {
        "vehicle.id": number,
        "vehicle.position": position,
        "vehicle.heading": angle,
        "vehicle.size": body,
        "vehicle.antenna_height": np.full(n, VEINS_ANTENNA_HEIGHT),
        "vehicle.equipped": np.full(n, fill_value=True),
    }


def buildings(rings: Sequence[npt.ArrayLike]) -> dict[str, Array]:
    """Buildings with these open rings of corners [m], shape (corners, 2) each."""
    corners = [np.asarray(ring, float).reshape(-1, 2) for ring in rings]
    owners = [np.full(len(ring), k, np.int32) for k, ring in enumerate(corners)]
    return {
        "building.vertex": np.concatenate([np.empty((0, 2)), *corners]),
        "building.index": np.concatenate([np.empty(0, np.int32), *owners]),
        "building.height": np.full(len(rings), 10.0),
    }


def links(
    transmitter: npt.ArrayLike,
    receiver: npt.ArrayLike,
    carrier: npt.ArrayLike | None = None,
    size: npt.ArrayLike = 200,
) -> dict[str, Array]:
    """Links to be probed.

    Args:
        transmitter: antennas at the one end [m], shape (n, 3).
        receiver: antennas at the other end [m], shape (n, 3).
        carrier: vehicles that carry them, shape (n, 2); none if not given.
        size: of a packet [byte], shape (n,) or one for all.
    """
    tx: Array = np.asarray(transmitter, float).reshape(-1, 3)
    n = len(tx)
    nobody = np.full((n, 2), NO_VEHICLE)
    return {
        "probe.transmitter": tx,
        "probe.receiver": np.asarray(receiver, float).reshape(n, 3),
        "probe.carrier": np.array(nobody if carrier is None else carrier, np.int64).reshape(n, 2),
        "probe.size": np.array(np.broadcast_to(size, n), np.uint32),
    }
