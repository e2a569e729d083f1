"""Samples as arrays: of every scan its keypoints to be, of every moment what the expert did.

Which places of a scan become keypoints is a choice of the network, by saliency. In training
the truth chooses in its place: moving vehicles first, then standing ones, then others, in random
order each. Saliency learns to choose alike.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Final, Self, TypeAlias

import numpy as np

from fmus.driving.network.architecture import EGO, Architecture
from fmus.driving.network.encoder import first_of_each, place
from fmus.driving.network.patches import INPUTS, History, Patches, Stack, patches
from fmus.driving.network.scan import Scan
from fmus.messages.records import NO_VEHICLE
from fmus.physics.plane import Frame, turned
from orchestrator.signal import Array
from orchestrator.timebase import Time
from studies.training.learning.sample import Sample

MESSAGES: Final = 10
"""Scans of others, the newest first, that a moment may have messages of."""
_EDGE: Final = 0.5
"""So far outside a body [m] a place is still one of it: half its diagonal, nearly."""
_REACH: Final = 80.0
"""Bodies farther from the sensor [m], along an axis, are out of its sight."""
_SILENT: Final = 0.15
"""Share of the moments in which early fusion has no cloud of others."""
_MOVING: Final = 1.0
"""Faster bodies move [m/s]."""
_WORLD: Final = Frame(x=0.0, y=0.0, heading=0.0)
_Place: TypeAlias = tuple[float, float, float]
"""The x, y [m] and heading [rad] of a frame."""
ScannedRow: TypeAlias = tuple[Time, _Place]
MomentRow: TypeAlias = tuple[_Place, Array, Array, bool, int, list[int], Time]

KEYPOINT: Final = np.dtype(
    [
        ("image", "u1", INPUTS // 8),
        ("place", "<f4", 3),  # inputs of the encoder
        ("at", "<f4", 3),  # x, y in the sensor's frame, z over the ground [m]
        ("vehicle", "?"),
        ("moving", "?"),
        ("threat", "?"),  # of the vehicle that the expert yields to
        ("velocity", "<f4", 2),  # in the sensor's frame [m/s]
        ("present", "?"),
    ]
)
SCANNED: Final = np.dtype([("time", "<i8"), ("place", "<f8", 3)])
MOMENT: Final = np.dtype(
    [
        ("place", "<f8", 3),  # of the ego vehicle
        ("numbers", "<f4", EGO),
        ("expert", "<f4", 3),
        ("yields", "<i4"),  # 1 if the expert yields to somebody
        ("own", "<i4"),  # index of the scan; -1 if there is none
        ("others", "<i4", MESSAGES),  # the newest first; -1 where there is none
        ("time", "<i8"),
    ]
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moments:
    """What is learned from, whatever the encoder reads of a scan.

    All other fields of a subclass have a row for each scan.

    Attributes:
        scans: SCANNED records, shape (scan,).
        moments: MOMENT records, shape (moment,).
    """

    scans: Array
    moments: Array

    def __len__(self) -> int:
        return len(self.moments)

    @classmethod
    def of(cls, parts: Sequence[Self]) -> Self:
        """All parts, of which there is one at least, one after the other."""
        of_scans = [field.name for field in fields(cls) if field.name != "moments"]
        return cls(
            **{name: np.concatenate([getattr(part, name) for part in parts]) for name in of_scans},
            moments=_joined([part.moments for part in parts], [len(part.scans) for part in parts]),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Lessons(Moments):
    """What is learned from by keypoints.

    Attributes:
        keypoints: KEYPOINT records, shape (scan, architecture.keypoints).
    """

    keypoints: Array


def _joined(moments: Sequence[Array], scans: Sequence[int]) -> Array:
    """One array of MOMENT records, shape (moments,), of several parts.

    Args:
        moments: of each part MOMENT records, shape (moments of the part,).
        scans: how many scans each part has; those of all parts come one after the other.
    """
    parts = []
    for each, offset in zip(moments, np.cumsum([0, *scans]), strict=False):
        part = each.copy()
        part["own"] = np.where(part["own"] < 0, -1, part["own"] + offset)
        part["others"] = np.where(part["others"] < 0, -1, part["others"] + offset)
        parts.append(part)
    return np.concatenate(parts)


def lessons(
    samples: Iterable[Sample], architecture: Architecture, rng: np.random.Generator
) -> Lessons:
    """What the samples of one run teach.

    Args:
        samples: in order of time.
        architecture: of the network that is to learn from them.
        rng: draws the order of places that are equally important.

    Raises:
        ValueError: the samples have no scan that the network would read.
    """
    keypoints: list[Array] = []
    scanned: list[ScannedRow] = []
    moments: list[MomentRow] = []
    histories: dict[int, History] = {}
    earlier: dict[int, list[int]] = {}
    shared = _Shared(rng)
    for sample in samples:
        own = -1
        laid_over = shared.stacks(sample) if architecture.early else []
        for scan in sample.scans:
            is_other = scan.vehicle != sample.ego
            if is_other and (architecture.early or not architecture.cooperative):
                continue
            history = histories.setdefault(scan.vehicle, History())
            history.add(scan)
            index = len(keypoints)
            found = patches(history.stack, laid_over)
            keypoints.append(_keypoints(found, scan, sample, architecture, rng))
            scanned.append(scanned_row(scan))
            if scan.vehicle == sample.ego:
                own = index
            else:
                earlier.setdefault(scan.vehicle, []).insert(0, index)
        moments.append(moment_row(sample, own, newest(earlier.values(), scanned)))
    if not keypoints:
        raise ValueError(
            f"the {len(moments)} samples of a run have no scan that the network would read; the "
            "lidar must scan at communication points of the policy, before it"
        )
    return Lessons(
        keypoints=np.stack(keypoints),
        scans=np.array(scanned, SCANNED),
        moments=np.array(moments, MOMENT),
    )


def scanned_row(scan: Scan) -> ScannedRow:
    """The SCANNED record of a scan."""
    return scan.time, _place(scan.frame)


def moment_row(sample: Sample, own: int, others: list[int]) -> MomentRow:
    """The MOMENT record of a sample, with the scans of these indices."""
    yields = sample.threat != NO_VEHICLE
    return _place(sample.frame), sample.numbers, sample.expert, yields, own, others, sample.time


def newest(earlier: Iterable[Sequence[int]], scanned: Sequence[ScannedRow]) -> list[int]:
    """Indices of the newest MESSAGES scans of all others, then -1.

    Args:
        earlier: scans of each of them, the newest first.
        scanned: all scans.
    """
    others = [index for known in earlier for index in known[:MESSAGES]]
    others.sort(key=lambda index: scanned[index][0], reverse=True)
    return (others + [-1] * MESSAGES)[:MESSAGES]


def _place(frame: Frame) -> _Place:
    return frame.x, frame.y, frame.heading


class _Shared:
    """Clouds of others as early fusion gets them: one period late, and now and then none."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self._last: tuple[Scan, ...] = ()
        self._histories: dict[int, History] = {}

    def stacks(self, sample: Sample) -> list[Stack]:
        for scan in self._last:
            self._histories.setdefault(scan.vehicle, History()).add(scan)
        self._last = tuple(scan for scan in sample.scans if scan.vehicle != sample.ego)
        if self._rng.random() < _SILENT:
            return []
        return [history.stack for history in self._histories.values()]


def _keypoints(
    found: Patches,
    scan: Scan,
    sample: Sample,
    architecture: Architecture,
    rng: np.random.Generator,
) -> Array:
    """KEYPOINT records of a scan, shape (architecture.keypoints,)."""
    number, velocity = _truth(found, scan, sample.bodies)
    vehicle = number != NO_VEHICLE
    moving = vehicle & (np.hypot(velocity[:, 0], velocity[:, 1]) > _MOVING)
    importance = vehicle + 1.0 * moving + 0.5 * rng.random(len(vehicle))
    order = np.argsort(-importance, kind="stable")
    order = order[first_of_each(found, order, architecture.spacing)][: architecture.keypoints]
    rows = np.zeros(architecture.keypoints, KEYPOINT)
    chosen = rows[: len(order)]
    chosen["image"] = np.packbits(found.images(order).astype(np.bool_), axis=1)
    chosen["place"] = place(found)[order]
    chosen["at"] = np.stack([found.x, found.y, found.z], axis=1)[order]
    chosen["vehicle"], chosen["moving"] = vehicle[order], moving[order]
    chosen["threat"] = vehicle[order] & (number[order] == sample.threat)
    chosen["velocity"] = velocity[order]
    chosen["present"] = True
    return rows


def _truth(found: Patches, scan: Scan, bodies: Array) -> tuple[Array, Array]:
    """Whose body is at each place, and its velocity in the sensor's frame [m/s]."""
    x, y = scan.frame.to(_WORLD, found.x, found.y)
    number = np.full(len(x), NO_VEHICLE)
    velocity = np.zeros((len(x), 2))
    offset = bodies["place"][:, :2] - (scan.frame.x, scan.frame.y)
    near = bodies[(np.abs(offset).max(axis=1) < _REACH) & (bodies["number"] != scan.vehicle)]
    center, size = near["place"].astype(np.float64), near["size"].astype(np.float64)
    reach = 0.5 * size.sum(axis=1, keepdims=True) + _EDGE
    close = np.abs(x - center[:, :1]) < reach
    close &= np.abs(y - center[:, 1:2]) < reach
    for k in np.flatnonzero(close.any(axis=1)):
        rows = np.flatnonzero(close[k])
        center_x, center_y, heading = center[k].tolist()
        length, width = size[k].tolist()
        ahead, left = turned(x[rows] - center_x, y[rows] - center_y, -heading)
        inside = (np.abs(ahead) < 0.5 * length + _EDGE) & (np.abs(left) < 0.5 * width + _EDGE)
        number[rows[inside]] = near["number"][k]
        velocity_x, velocity_y = near["velocity"][k]
        velocity[rows[inside]] = turned(velocity_x, velocity_y, -scan.frame.heading)
    return number, velocity
