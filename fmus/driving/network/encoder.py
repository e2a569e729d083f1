"""The BEV encoder: keypoints with features from the last scans of one lidar.

Each place where the newest scan saw something has an image from above of what lay around it in
the last scans. A layer reads image and place; from it come the saliency of the place, by which
keypoints are chosen, and the features of those.
"""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from fmus.driving.network.architecture import Architecture
from fmus.driving.network.fixed_point import BinaryDense, Dense, rectified, rounded
from fmus.driving.network.keypoints import Keypoints
from fmus.driving.network.patches import Patches, Stack, patches
from fmus.driving.network.scan import CELL
from orchestrator.signal import Array

PLACE_SCALE: Final = 32.0
"""Coordinates of places are divided by this length [m], to be numbers of the order of 1."""
_BLOCK: Final = 2.0 * CELL


class BevEncoder:
    """See the module.

    Args:
        architecture: of the network.
        weights: by the names of `Architecture.shapes`.
    """

    def __init__(self, architecture: Architecture, weights: Mapping[str, Array]) -> None:
        self._architecture = architecture
        self._image = BinaryDense.of(weights["encoder.image.weight"])
        self._place = Dense.of(weights["encoder.place.weight"], weights["encoder.place.bias"])
        self._judge = Dense.of(
            weights["encoder.judgements.weight"], weights["encoder.judgements.bias"]
        )
        self._features = Dense.of(
            weights["encoder.features.weight"], weights["encoder.features.bias"]
        )

    def encode(self, stack: Stack, others: Sequence[Stack] = ()) -> Keypoints:
        """Keypoints by falling saliency, at most as many as the network's messages have.

        Args:
            stack: scans of the sensor, the newest first; it must be there.
            others: of other sensors, laid over them.
        """
        found = patches(stack, others)
        sums = self._image(found.image)
        sums += self._place(place(found))
        hidden = rectified(rounded(sums))
        saliency = self._judge(hidden).sum(axis=1)
        chosen = self._chosen(found, saliency)
        features = self._features(hidden[chosen])
        scalars = self._architecture.features - 2 * self._architecture.vectors
        features[:, :scalars] = rectified(features[:, :scalars])
        return Keypoints(
            x=found.x[chosen],
            y=found.y[chosen],
            z=found.z[chosen],
            features=features,
        )

    def _chosen(self, found: Patches, saliency: Array) -> Array:
        """Rows of the most salient places, of each square of `spacing` blocks only the best."""
        order = np.argsort(-saliency, kind="stable")
        return order[first_of_each(found, order, self._architecture.spacing)][
            : self._architecture.keypoints
        ]


def first_of_each(found: Patches, order: Array, spacing: int) -> Array:
    """Positions in `order` of the places that come first in their square of blocks.

    Args:
        found: the places.
        order: rows of `found`, the best first, int64, shape (place,).
        spacing: blocks along the side of a square.

    Returns:
        Ascending, int64, shape (square,), for the squares that have a place.
    """
    if spacing == 1:
        return np.arange(len(order))
    side = spacing * _BLOCK
    square = np.floor(found.x / side).astype(np.int64) * 4096 + np.floor(found.y / side).astype(
        np.int64
    )
    _, first = np.unique(square[order], return_index=True)
    return np.sort(first)


def place(found: Patches) -> Array:
    """Where the places are, as inputs of the encoder: x, y and distance; shape (place, 3).

    What a lidar sees of a body depends on the direction and the distance it is seen from.
    """
    distance = np.sqrt(found.x * found.x + found.y * found.y)
    return rounded(np.stack([found.x, found.y, distance], axis=1) / PLACE_SCALE)
