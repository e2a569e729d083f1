"""Layout of the Binary signals that the units exchange.

Every Binary signal is empty (no data yet) or starts with a 16-byte `FRAME`: a four-letter
magic, the version, the number of records and the size of one record. All numbers are
little-endian. For the native units records.h is made from here, see `fmus.native.c_records`.
docs/formats.md describes the layouts for readers in other languages.
"""

import struct
from typing import Final

import numpy as np

NO_VEHICLE: Final = -1
"""Stands for "nobody": no relay on a route, no sharer chosen; as a destination, broadcast."""

FRAME: Final = np.dtype(
    [("magic", "S4"), ("version", "<u4"), ("count", "<u4"), ("record_size", "<u4")]
)
_HEAD: Final = struct.Struct("<4sIII")  # the same; quicker for a single one

# ---- points: FRAME "LPTS", `count` SENSOR records, then the POINTs of all sensors
POINTS_MIME: Final = "application/x-nlosim-points; version=1"
SENSOR: Final = np.dtype(
    [
        ("vehicle", "<i8"),  # the vehicle that carries the sensor
        ("time", "<i8"),  # of the scan [ns]
        ("position", "<f8", 3),  # of the sensor, world frame [m]
        ("heading", "<f8"),  # of the sensor's x axis, counter-clockwise from east [rad]
        ("pitch", "<f8"),  # nose down positive [rad]
        ("roll", "<f8"),  # right side down positive [rad]
        ("first", "<u4"),  # index of the sensor's first point
        ("count", "<u4"),  # number of its points
    ]
)
POINT: Final = np.dtype(
    [
        ("position", "<f4", 3),  # sensor frame: x forward, y left, z up [m]
        ("intensity", "<f4"),  # 0..1
        ("instance", "<i4"),  # vehicle id; GROUND; or BUILDING - index of the building
    ]
)
GROUND: Final = -1
BUILDING: Final = -2

# ---- objects: FRAME "OBJS", `count` OBJECT records
OBJECTS_MIME: Final = "application/x-nlosim-objects; version=2"
OBJECT: Final = np.dtype(
    [
        ("sensor", "<i8"),  # the vehicle whose sensor sees the object
        ("time", "<i8"),  # of the scan [ns]
        ("instance", "<i8"),  # track number: of the sensor, not of a vehicle
        ("points", "<i8"),  # points on it in this scan
        ("position", "<f8", 2),  # middle of the box around its points, world frame [m]
        ("angle", "<f8"),  # of the box's first side, counter-clockwise from east, 0 to < pi/2 [rad]
        ("size", "<f8", 2),  # of the box, along that side and across [m]
        ("height", "<f8"),  # of its highest point above the ground [m]
        ("velocity", "<f8", 2),  # tracked, world frame [m/s]
    ]
)

# ---- APMs: FRAME "APMS" (record_size 0), then `count` messages, each an u4 size, an u4 zero,
#      the message and zero padding to a multiple of 8 bytes. The air carries the message only.
APMS_MIME: Final = "application/x-nlosim-apms; version=1"
APM_HEADER: Final = np.dtype(
    [
        ("magic", "S4"),  # "APMM"
        ("version", "<u2"),  # 1
        ("flags", "<u2"),  # bit 0: the layer follows the cells; 1: compressed; 8 to 15: levels
        ("vehicle", "<i8"),  # the source
        ("time", "<i8"),  # of the scan [ns]
        ("position", "<f8", 2),  # of the source, world frame [m]
        ("heading", "<f8"),  # of the row axis, counter-clockwise from east [rad]
        ("center", "<f8", 2),  # of the matrix, world frame [m]
        ("cell", "<f4"),  # k, the side of one cell [m]
        ("rows", "<u2"),  # m, along the heading, rear to front
        ("columns", "<u2"),  # n, across it, right to left
    ]
)
APM_CELL: Final = np.dtype("<u4")  # index of the cell, row by row: 4 bytes, so 20 x 20 = 1600
APM_LAYER_CELL: Final = np.dtype(
    [
        ("height", "u1"),  # of the highest object in the cell, steps of 0.05 m; 0 = none
        ("vx", "i1"),  # its velocity, world frame, steps of 0.25 m/s
        ("vy", "i1"),
        ("points", "u1"),  # points on it, 255 = 255 or more
    ]
)
APM_LAYER_FLAG: Final = 1
APM_COMPRESSED_FLAG: Final = 2
APM_LEVELS: Final = 0xFF00
"""Bits of the flags: the index of a cell whose ground is all seen; 0 if the cells count points."""
APM_LEVELS_SHIFT: Final = 8
APM_MOST_CELLS: Final = 1 << 20
"""Rows times columns of the largest APM that is sent or read."""

# ---- features: FRAME "FEAT", `count` FEATURES records, then the float32 numbers of all keypoints,
#      message by message: per keypoint its position in the levelled sensor frame (x along the
#      heading, y left, z up from the sensor [m]), then its features
FEATURES_MIME: Final = "application/x-nlosim-features; version=2"
FEATURES: Final = np.dtype(
    [
        ("vehicle", "<i8"),  # that carries the sensor
        ("time", "<i8"),  # of the scan [ns]
        ("position", "<f8", 3),  # of the sensor, world frame [m]
        ("heading", "<f8"),  # of the sensor's x axis, counter-clockwise from east [rad]
        ("keypoints", "<u4"),  # here, by falling importance; after losses, those that arrived
        ("capacity", "<u4"),  # keypoints of a complete message
        ("dimensions", "<u4"),  # features of a keypoint
        ("first", "<u4"),  # index of the message's first number among those of all
        ("encoder", "<u8"),  # which one made the features; 0: none, or it does not say
    ]
)

# ---- packets: FRAME "PKTS", `count` PACKET records, by (time, id)
PACKETS_MIME: Final = "application/x-nlosim-packets; version=1; events"
PACKET: Final = np.dtype(
    [
        ("id", "<i8"),  # unique in the run
        ("time", "<i8"),  # handed to the radio [ns]; may lie ahead of the communication point
        ("source", "<i8"),  # vehicle
        ("destination", "<i8"),  # vehicle, or NO_VEHICLE for broadcast
        ("route", "<i8", 2),  # relays in order, NO_VEHICLE where there is none
        ("duration", "<i8"),  # on air [ns]; 0: what size and bit rate make
        ("power_offset", "<f8"),  # over the radio's transmit power [dB]
        ("size", "<u4"),  # MAC service data unit [byte]
        ("access_category", "u1"),  # 0 background, 1 best effort, 2 video, 3 voice
        ("kind", "u1"),  # BSM, APM, SENSOR_DATA, REQUEST, NOISE
        ("channel_offset", "<i2"),  # of NOISE from the radios' carrier, steps of 5 MHz
    ]
)
BSM: Final = 0
APM: Final = 1
SENSOR_DATA: Final = 2
REQUEST: Final = 3
NOISE: Final = 4
"""Energy of another system or channel: goes on air at its time whatever the medium access says,
interferes and is never received."""

# ---- receptions: FRAME "RCPT", `count` RECEPTION records, by (time, packet, hop, receiver)
RECEPTIONS_MIME: Final = "application/x-nlosim-receptions; version=1; events"
RECEPTION: Final = np.dtype(
    [
        ("packet", "<i8"),
        ("time", "<i8"),  # end of the frame at the receiver [ns]
        ("transmitter", "<i8"),
        ("receiver", "<i8"),
        ("power_dbm", "<f8"),  # received, fading included
        ("snir_db", "<f8"),  # lowest over the frame; NaN where nothing was decoded
        ("hop", "u1"),  # 0 = sent by the source
        ("outcome", "u1"),  # see OUTCOMES
        ("link", "u1"),  # see LINKS
        ("kind", "u1"),  # of the packet
        ("addressed", "u1"),  # 1: receiver is the addressee of the hop, or broadcast
        ("reserved", "u1", 3),
    ]
)
OUTCOMES: Final = "RNCBTU"
"""Received; lost to noise, to interference (collision), to a busy receiver, to the receiver's
own transmission; under the sensitivity. The index is the number in `outcome`."""
# ---- transmissions: FRAME "SENT", `count` TRANSMISSION records, by (time, packet, hop)
TRANSMISSIONS_MIME: Final = "application/x-nlosim-transmissions; version=1; events"
TRANSMISSION: Final = np.dtype(
    [
        ("packet", "<i8"),
        ("time", "<i8"),  # start on air, or when it was given up [ns]
        ("queued", "<i8"),  # handed to the medium access of this hop [ns]
        ("transmitter", "<i8"),
        ("duration", "<i4"),  # on air [ns]; 0 if it was given up
        ("hop", "u1"),  # 0 = sent by the source
        ("fate", "u1"),  # see FATES
        ("access_category", "u1"),
        ("kind", "u1"),  # of the packet
    ]
)
FATES: Final = ("sent", "queue full", "expired", "gone")
"""What became of a frame at its transmitter; gone: the vehicle has left, or has no radio any more.
The index is the number in `fate`."""
LINKS: Final = ("LOS", "NLOSv", "NLOSb")
"""Line of sight; obstructed by vehicles only; obstructed by buildings (and maybe vehicles)."""


def frame(magic: str, records: np.ndarray, tail: bytes = b"") -> bytes:
    """A Binary signal of records.

    Args:
        magic: the four letters that name the signal.
        records: of one of the layouts above, shape (count,).
        tail: what follows the records, e.g. the points of all sensors.
    """
    head = _HEAD.pack(magic.encode(), 1, len(records), records.dtype.itemsize)
    return head + records.tobytes() + tail


def unframe(magic: str, data: bytes, dtype: np.dtype) -> np.ndarray:
    """The records in a Binary signal.

    Args:
        magic: the four letters that name the signal.
        data: the signal; what follows its records is not looked at.
        dtype: the layout of its records.

    Returns:
        A read-only view of the records, of type `dtype`, shape (count,); an empty signal has none.

    Raises:
        ValueError: `data` is not such a signal.
    """
    if not data:
        return np.empty(0, dtype)
    head = _HEAD.unpack_from(data) if len(data) >= FRAME.itemsize else None
    if head is None or head[:2] != (magic.encode(), 1):
        raise ValueError(f"not a `{magic}` frame of version 1: {data[:16]!r}")
    _, _, count, record_size = head
    if record_size != dtype.itemsize:
        raise ValueError(f"`{magic}` records have {dtype.itemsize} bytes, not {record_size}")
    if len(data) < FRAME.itemsize + count * dtype.itemsize:
        raise ValueError(f"`{magic}` frame of {count} records is cut short")
    return np.frombuffer(data, dtype, count, FRAME.itemsize)
