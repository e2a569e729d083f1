"""Left and right swapped: a scene in the mirror is a scene, too, and the expert's way in it.

Bodies, cells, routes and commands are mirrored at the ego vehicle's axis. Blocks, images and the
squares that keypoints are chosen of are symmetric about the axis of their sensor, so what comes out
is what the mirrored scans would have given, but for earlier cells of a moving sensor that fall on
the border of two cells. The teacher does not know left from right: a mirrored scene is one from the
other side, in a country that drives on the left.
"""

from dataclasses import replace

import torch
from torch import Tensor

from fmus.driving.network.patches import CHANNELS, INPUTS, WINDOW
from studies.training.learning.batches import Batch


def mirrored(batch: Batch, which: Tensor) -> Batch:
    """The batch with some moments mirrored; done twice, it is the batch again.

    Args:
        batch: of moments.
        which: moments that are mirrored, bool, shape (batch,).
    """
    sign = torch.where(which, -1.0, 1.0)[:, None]  # (batch, 1)
    seen = batch.seen
    image = seen.image.clone()
    image[which] = _swapped(image[which])
    return replace(
        batch,
        seen=replace(
            seen,
            image=image,
            place=_signed(seen.place, 1, sign),
            turn=seen.turn * sign,
            geometry=_signed(seen.geometry, 1, sign),
        ),
        ego=torch.cat([batch.ego[:, :2], _alternating(batch.ego[:, 2:], sign)], dim=1),
        expert=torch.cat([batch.expert[:, :2], batch.expert[:, 2:] * sign], dim=1),
        velocity=_signed(batch.velocity, 1, sign),
    )


def _swapped(image: Tensor) -> Tensor:
    """Images, shape (batch, keypoint, INPUTS), their columns in the opposite order."""
    shape = image.shape[:-1]
    return image.reshape(*shape, CHANNELS, WINDOW, WINDOW).flip(-1).reshape(*shape, INPUTS)


def _signed(values: Tensor, column: int, sign: Tensor) -> Tensor:
    """Values, shape (batch, keypoint, number), one column of which is multiplied by `sign`."""
    changed = values.clone()
    changed[..., column] *= sign
    return changed


def _alternating(values: Tensor, sign: Tensor) -> Tensor:
    """Places, shape (batch, x and y in turns), whose second coordinates are multiplied."""
    changed = values.clone()
    changed[:, 1::2] *= sign
    return changed
