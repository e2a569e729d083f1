"""Driving networks with a point transformer of random weights, and clouds for them."""

from typing import Any

import numpy as np

from fmus.driving.network.architecture import POINT_TRANSFORMER, Architecture
from fmus.driving.network.checkpoint import Checkpoint
from fmus.driving.network.cloud import Cloud
from fmus.driving.network.point_transformer import weights_of
from fmus.driving.point_transformer import PointTransformerEncoder
from fmus.physics.plane import Frame

HEIGHT = 1.75
EAST = Frame(x=0.0, y=0.0, heading=0.0)


def architecture(keypoints: int = 16, features: int = 128, **sizes: Any) -> Architecture:
    """Small, but for the encoder."""
    small = {"fused": 24, "pooled": 16, "head": 12} | sizes
    return Architecture(
        keypoints=keypoints, features=features, vectors=0, encoder=POINT_TRANSFORMER, **small
    )


def network(shape: Architecture | None = None, seed: int = 0) -> Checkpoint:
    """The encoder as training finds it; fusion and head such that commands depend on all inputs."""
    shape = shape or architecture()
    rng = np.random.default_rng(seed)
    weights = {
        name: rng.normal(0.0, 1.0 / np.sqrt(size[0]), size)
        for name, size in shape.decision_shapes.items()
    }
    encoder = PointTransformerEncoder(blocks=shape.blocks, seed=seed)
    return Checkpoint(
        architecture=shape, weights={**weights, **weights_of(encoder)}, origin={"seed": str(seed)}
    )


def cloud(
    points: int = 400,
    *,
    seed: int = 0,
    reach: int = 60,
    vehicle: int = 7,
    time: int = 300_000_000,
    frame: Frame = EAST,
) -> Cloud:
    """Points within the crop and `reach` [m], at multiples of a centimetre.

    Hardly two are in the same voxel.
    """
    rng = np.random.default_rng(seed)
    x, y = rng.integers(-100 * reach, 100 * reach, (2, points)) / 100
    z = rng.integers(-240, -40, points) / 100
    return Cloud(
        vehicle=vehicle,
        time=time,
        frame=frame,
        height=HEIGHT,
        x=x.astype(np.float32),
        y=y.astype(np.float32),
        z=z.astype(np.float32),
    )
