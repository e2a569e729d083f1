"""What a policy writes down for learning: all scans, the ego vehicle, the truth, the expert.

A sample is a Binary signal: FRAME `SMPL` with one SAMPLE record, then a SCAN record per lidar, a
BODY record per vehicle, the cells of all scans, int32, and their points, if recorded, int16 (x, y
and z each) in centimetres.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.network.architecture import EGO
from fmus.driving.network.scan import Scan
from fmus.messages.records import FRAME, frame, unframe
from fmus.physics.plane import Frame
from orchestrator.signal import Array
from orchestrator.timebase import Time

SAMPLE_MIME: Final = "application/x-nlosim-sample; version=2"
SAMPLE: Final = np.dtype(
    [
        ("time", "<i8"),  # [ns]
        ("ego", "<i8"),  # number of the ego vehicle
        ("place", "<f8", 3),  # of the ego vehicle: x, y [m], heading [rad]
        ("numbers", "<f8", EGO),  # `fmus.driving.network.driver.ego_numbers`
        ("expert", "<f8", 3),  # its command: accelerate, brake, steer
        ("threat", "<i8"),  # number of the vehicle that it yields to, -1 if there is none
        ("scans", "<u4"),
        ("bodies", "<u4"),
        ("points", "<u4"),  # of each scan at most; 0: they are not recorded
    ]
)
SCAN: Final = np.dtype(
    [
        ("vehicle", "<i8"),
        ("time", "<i8"),  # [ns]
        ("place", "<f8", 3),  # of the sensor: x, y [m], heading [rad]
        ("height", "<f8"),  # of the sensor over the ground [m]
        ("cells", "<u8"),  # how many
        ("points", "<u8"),  # how many
    ]
)
BODY: Final = np.dtype(
    [
        ("number", "<i8"),
        ("place", "<f8", 3),  # centre x, y [m], heading [rad]
        ("size", "<f8", 2),  # length, width [m]
        ("velocity", "<f8", 2),  # world frame [m/s]
    ]
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Sample:
    """One moment.

    Attributes:
        time: [ns].
        ego: number of the ego vehicle.
        frame: of the ego vehicle.
        numbers: `fmus.driving.network.driver.ego_numbers`, shape (EGO,).
        expert: its command, shape (3,).
        threat: number of the vehicle that it yields to, -1 if there is none.
        scans: of all lidars, taken at `time`.
        bodies: of all vehicles, BODY records.
        most_points: that are recorded of a scan; 0: they are not.
        points: of each scan, some of them, in its levelled frame [cm], int16, shape (point, 3), in
            random order; nothing if they are not recorded.
    """

    time: Time
    ego: int
    frame: Frame
    numbers: Array
    expert: Array
    threat: int
    scans: tuple[Scan, ...]
    bodies: Array
    most_points: int = 0
    points: tuple[Array, ...] = ()


def write_sample(sample: Sample) -> bytes:
    """The sample as a Binary signal; undone by `read_sample`."""
    head = np.zeros(1, SAMPLE)
    head["time"], head["ego"] = sample.time, sample.ego
    head["place"] = _place(sample.frame)
    head["numbers"], head["expert"] = sample.numbers, sample.expert
    head["threat"] = sample.threat
    head["scans"], head["bodies"] = len(sample.scans), len(sample.bodies)
    head["points"] = sample.most_points
    rows = np.zeros(len(sample.scans), SCAN)
    for row, scan in zip(rows, sample.scans, strict=True):
        row["vehicle"], row["time"], row["height"] = scan.vehicle, scan.time, scan.height
        row["place"], row["cells"] = _place(scan.frame), len(scan.cells)
    if sample.most_points:
        rows["points"] = [len(points) for points in sample.points]
    cells = b"".join(np.asarray(scan.cells, "<i4").tobytes() for scan in sample.scans)
    points = b"".join(np.asarray(points, "<i2").tobytes() for points in sample.points)
    tail = rows.tobytes() + np.asarray(sample.bodies, BODY).tobytes() + cells + points
    return frame("SMPL", head, tail)


def read_sample(data: bytes) -> Sample:
    """The sample in a Binary signal.

    Raises:
        ValueError: it is none.
    """
    heads = unframe("SMPL", data, SAMPLE)
    if len(heads) != 1:
        raise ValueError(f"a sample has one SAMPLE record, not {len(heads)}")
    head = heads[0]
    begin = FRAME.itemsize + SAMPLE.itemsize
    scans, bodies = int(head["scans"]), int(head["bodies"])
    if len(data) < begin + scans * SCAN.itemsize + bodies * BODY.itemsize:
        raise ValueError("the sample is cut short")
    rows = np.frombuffer(data, SCAN, scans, begin)
    begin += rows.nbytes
    truth = np.frombuffer(data, BODY, bodies, begin)
    begin += truth.nbytes
    counts = rows["cells"].astype(np.int64), rows["points"].astype(np.int64)
    total = int(counts[0].sum()), int(counts[1].sum())
    if len(data) - begin != 4 * total[0] + 6 * total[1]:
        raise ValueError("the sample has another number of cells or points than its scans")
    cells = np.frombuffer(data, "<i4", total[0], begin)
    points = np.frombuffer(data, "<i2", 3 * total[1], begin + cells.nbytes).reshape(-1, 3)
    parts = np.split(cells, np.cumsum(counts[0])[:-1])
    return Sample(
        time=int(head["time"]),
        ego=int(head["ego"]),
        frame=_frame(head["place"]),
        numbers=head["numbers"],
        expert=head["expert"],
        threat=int(head["threat"]),
        scans=tuple(_scan(row, part) for row, part in zip(rows, parts, strict=False)),
        bodies=truth,
        most_points=int(head["points"]),
        points=tuple(np.split(points, np.cumsum(counts[1])[:-1])[:scans]) if head["points"] else (),
    )


def _scan(row: np.void, cells: Array) -> Scan:
    return Scan(
        vehicle=int(row["vehicle"]),
        time=int(row["time"]),
        frame=_frame(row["place"]),
        height=float(row["height"]),
        cells=cells,
    )


def _place(of: Frame) -> tuple[float, float, float]:
    return of.x, of.y, of.heading


def _frame(place: Array) -> Frame:
    x, y, heading = place.tolist()
    return Frame(x=x, y=y, heading=heading)
