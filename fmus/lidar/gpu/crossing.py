"""Which rays meet which faces: where the edges of a face cross the columns of a scan.

A column is the half-plane of one azimuth through the sensor's z axis. It meets a face in
segments between edges; on each segment the slope (z over the distance from the axis) is
monotonic, so a segment covers consecutive channels. An edge is represented by the number of
channels above it, an integer: faces that share an edge share this number, and no ray slips between
them or meets both.
"""

import math
from dataclasses import dataclass
from typing import Final

import torch
from torch import Tensor

from fmus.lidar.gpu.pattern import Pattern
from fmus.lidar.gpu.ragged import expand, pick
from fmus.lidar.gpu.view import Vectors, View

_COLUMN_MARGIN: Final = 1e-6
"""How far the azimuths of an edge are widened, in columns; what is too much does not cross."""
_CHANNEL_BITS: Final = 10
"""Room for the number of channels above an edge, 0..512, in a key."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Segments:
    """Consecutive channels of a column that meet a face; int64, shape (segment,) each.

    Attributes:
        face, azimuth: which.
        first: the first channel.
        count: how many, at least 1.
    """

    face: Tensor
    azimuth: Tensor
    first: Tensor
    count: Tensor


def segments(view: View, pattern: Pattern) -> Segments:
    """The segments of all faces."""
    group, above = _sorted_crossings(view, pattern)
    face = torch.div(group, pattern.azimuths, rounding_mode="floor")
    # a face is turned towards its sensor: it is overhead if it looks down
    begin, end = _paired(group, above, view.normal[2][face] < 0.0, pattern.channels)
    some = torch.nonzero(end > begin)[:, 0]
    return Segments(
        face=face[some],
        azimuth=(group - face * pattern.azimuths)[some],
        first=begin[some],
        count=(end - begin)[some],
    )


def _columns(view: View, azimuths: int) -> tuple[Tensor, Tensor]:
    """Pairs of an edge and an azimuth that may cross, int64, shape (candidate,) each.

    An edge over half a turn passes the axis so closely that rounding chooses the side, but there
    its slope is beyond all channels.
    """
    angle = torch.atan2(view.start[1], view.start[0])
    turn = torch.atan2(view.end[1], view.end[0]) - angle
    turn = turn - 2.0 * math.pi * torch.round(turn / (2.0 * math.pi))
    scale = azimuths / (2.0 * math.pi)
    low, span = (angle + torch.clamp(turn, max=0.0)) * scale, turn.abs() * scale
    first = torch.ceil(low - _COLUMN_MARGIN).long()
    count = torch.floor(low + span + _COLUMN_MARGIN).long() - first + 1
    edge, number = expand(count)
    return edge, (pick(first, edge) + number) % azimuths


def _sorted_crossings(view: View, pattern: Pattern) -> tuple[Tensor, Tensor]:
    """Where edges cross columns, by face, azimuth and slope.

    With s = u x p, the side of a corner p on which a column with the unit vector u lies, an edge
    from p to q crosses the column's plane at the distance (p x q) / (s_q - s_p) from the axis and
    the slope (s_q z_p - s_p z_q) / (p x q). Both are the same bits for the edge from q to p.

    Returns:
        face * azimuths + azimuth, and the number of channels above; int64, shape (crossing,).
    """
    edge, azimuth = _columns(view, pattern.azimuths)
    px, py, pz = _of(view.start, edge)
    qx, qy, qz = _of(view.end, edge)
    ux, uy = pick(pattern.azimuth_x, azimuth), pick(pattern.azimuth_y, azimuth)
    side_p, side_q = ux * py - uy * px, ux * qy - uy * qx
    cross = px * qy - py * qx
    ahead = (side_q > side_p) == (cross > 0.0)
    met = ((side_p >= 0.0) != (side_q >= 0.0)) & ahead & (cross != 0.0)
    crossing = torch.nonzero(met)[:, 0]
    slope = ((side_q * pz - side_p * qz) / cross)[crossing]
    above = torch.searchsorted(pattern.slope, -slope)
    group = (pick(view.face, edge) * pattern.azimuths + azimuth)[crossing]
    key = torch.sort((group << _CHANNEL_BITS) | above).values
    return key >> _CHANNEL_BITS, key & ((1 << _CHANNEL_BITS) - 1)


def _of(vectors: Vectors, index: Tensor) -> Vectors:
    return pick(vectors[0], index), pick(vectors[1], index), pick(vectors[2], index)


def _paired(
    group: Tensor, above: Tensor, is_overhead: Tensor, channels: int
) -> tuple[Tensor, Tensor]:
    """First channel and the one after the last of the segments that crossings delimit.

    Crossings of a group delimit segments in turn (even-odd rule). Where their number is odd, the
    face also crosses the axis, over the first or under the last channel.

    Args:
        group: of each crossing, ascending, int64, shape (crossing,).
        above: the number of channels above it, ascending in each group, int64, shape (crossing,).
        is_overhead: whether the face crosses the axis overhead, if it does, shape (crossing,).
        channels: of the pattern.

    Returns:
        int64, shape (crossing,) each; a crossing that ends no segment has an empty one.
    """
    is_first = torch.ones_like(group, dtype=torch.bool)
    is_first[1:] = group[1:] != group[:-1]
    is_last = is_first.roll(-1)
    start = torch.nonzero(is_first)[:, 0]
    serial = torch.cumsum(is_first, 0) - 1
    size = torch.diff(start, append=start.new_tensor([len(group)]))
    place = torch.arange(len(group), device=group.device) - start[serial]
    is_odd = (size % 2 == 1)[serial]
    is_end = (place + (is_odd & is_overhead)) % 2 == 1
    begin = torch.where(is_end, torch.where(is_first, 0, above.roll(1)), above)
    end = torch.where(is_end, above, torch.where(is_last, channels, above))
    return begin, end
