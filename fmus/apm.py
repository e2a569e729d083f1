"""The abstract perception matrix (APM) as a message on the air and as NumPy arrays.

An APM is what a vehicle tells others about its perception: a grid of square cells around it,
aligned with its heading, and in each cell the number of sensor points that fell into it
("NLOS Dies Twice", section "Sensor Fusion Match & Trigger"). An optional second layer carries
the height and the velocity of the highest object in each cell (section "Relay Selection").

`fmus/perception/` computes these messages natively; everything else that reads or writes them
uses this module. `fmus.records` declares the byte layout.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from fmus.records import APM_CELL, APM_HEADER, APM_LAYER_CELL, APM_LAYER_FLAG, FRAME

Float: TypeAlias = npt.NDArray[np.float64]
Layer: TypeAlias = npt.NDArray[np.void]

HEIGHT_STEP: Final = 0.05
"""One unit of a layer's `height` [m]."""
VELOCITY_STEP: Final = 0.25
"""One unit of a layer's `vx` and `vy` [m/s]."""

_MESSAGE_MAGIC: Final = b"APMM"
_SIGNAL_MAGIC: Final = b"APMS"
_VERSION: Final = 1
_ALIGNMENT: Final = 8
_PREFIX: Final = np.dtype([("size", "<u4"), ("zero", "<u4")])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Apm:
    """One abstract perception matrix.

    Rows run along the heading from the rear to the front, columns across it from right to left.

    Attributes:
        vehicle: the source.
        time: of the scan [ns].
        position: of the source, world frame [m], shape (2,).
        heading: of the row axis, counter-clockwise from east [rad].
        center: of the matrix, world frame [m], shape (2,).
        cell: side k of one cell [m]; the message carries it in single precision.
        cells: points in each cell, uint32, shape (rows, columns).
        layer: mobility and height, `APM_LAYER_CELL`, shape (rows, columns); None if not sent.
    """

    vehicle: int
    time: int
    position: Float
    heading: float
    center: Float
    cell: float
    cells: npt.NDArray[np.uint32]
    layer: Layer | None = None

    def locate(self, points: Float) -> npt.NDArray[np.int64]:
        """Row and column of each world point; outside the matrix they are out of range.

        Args:
            points: world frame [m], shape (..., 2).

        Returns:
            Indices, shape (..., 2); a point on a border belongs to the cell in front or left.
        """
        forward, left = _axes(self.heading)
        offset = np.asarray(points, np.float64) - self.center
        along = np.stack([offset @ forward, offset @ left], axis=-1)
        return np.floor(along / self.cell + np.array(self.cells.shape) / 2).astype(np.int64)

    def world(self, indices: npt.ArrayLike) -> Float:
        """World positions of (fractional) indices; cell (i, j) spans [i, i + 1) x [j, j + 1).

        Args:
            indices: row and column, shape (..., 2); `locate(world(index + 0.5)) == index`.

        Returns:
            World frame [m], shape (..., 2).
        """
        forward, left = _axes(self.heading)
        along = (np.asarray(indices, np.float64) - np.array(self.cells.shape) / 2) * self.cell
        return self.center + along[..., :1] * forward + along[..., 1:] * left

    def cell_centers(self) -> Float:
        """World positions of the cells' centres [m], shape (rows, columns, 2)."""
        return self.world(np.moveaxis(np.indices(self.cells.shape), 0, -1) + 0.5)

    def contains(self, indices: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
        """Whether row and column indices, shape (..., 2), lie in the matrix; shape (...,)."""
        below = (indices < np.array(self.cells.shape)).all(axis=-1)
        inside: npt.NDArray[np.bool_] = np.logical_and((indices >= 0).all(axis=-1), below)
        return inside


def layer_height(layer: Layer) -> Float:
    """Height above the ground of the highest object in each cell [m]; 0 where there is none."""
    return layer["height"] * HEIGHT_STEP


def layer_velocity(layer: Layer) -> Float:
    """Velocity of the highest object in each cell, world frame [m/s], shape (..., 2)."""
    return np.stack([layer["vx"], layer["vy"]], axis=-1) * VELOCITY_STEP


def message_size(rows: int, columns: int, *, layer: bool) -> int:
    """Bytes of a message on the air: header, four per cell, four more with the layer."""
    per_cell = APM_CELL.itemsize + (APM_LAYER_CELL.itemsize if layer else 0)
    return APM_HEADER.itemsize + rows * columns * per_cell


def encode(apm: Apm) -> bytes:
    """The message that carries `apm`.

    Raises:
        ValueError: `apm` cannot be sent, e.g. its layer has another shape than its cells.
    """
    if apm.cells.dtype != APM_CELL or apm.cells.ndim != 2:
        raise ValueError(
            f"cells are {apm.cells.dtype}{list(apm.cells.shape)}, must be uint32[rows, columns]"
        )
    rows, columns = apm.cells.shape
    if max(rows, columns) > np.iinfo(np.uint16).max:
        raise ValueError(f"a matrix of {rows} x {columns} cells does not fit: at most 65535 each")
    if apm.layer is not None and (
        apm.layer.dtype != APM_LAYER_CELL or apm.layer.shape != apm.cells.shape
    ):
        raise ValueError(
            f"the layer is {apm.layer.dtype}{list(apm.layer.shape)}, must be APM_LAYER_CELL"
            f"{[rows, columns]} as the cells"
        )
    header = np.zeros((), APM_HEADER)
    header["magic"], header["version"] = _MESSAGE_MAGIC, _VERSION
    header["flags"] = 0 if apm.layer is None else APM_LAYER_FLAG
    header["vehicle"], header["time"] = apm.vehicle, apm.time
    header["position"], header["heading"], header["center"] = apm.position, apm.heading, apm.center
    header["cell"], header["rows"], header["columns"] = apm.cell, rows, columns
    _check_header(header)
    layer = b"" if apm.layer is None else apm.layer.tobytes()
    return header.tobytes() + apm.cells.tobytes() + layer


def decode(message: bytes) -> Apm:
    """The APM in `message`; its arrays are read-only views.

    Raises:
        ValueError: `message` is not an APM message, and why.
    """
    if len(message) < APM_HEADER.itemsize:
        raise ValueError(
            f"an APM message has at least {APM_HEADER.itemsize} bytes, not {len(message)}"
        )
    header = np.frombuffer(message, APM_HEADER, 1)[0]
    _check_header(header)
    shape = (int(header["rows"]), int(header["columns"]))
    layered = bool(header["flags"] & APM_LAYER_FLAG)
    expected = message_size(*shape, layer=layered)
    if len(message) != expected:
        layer = "with" if layered else "without"
        raise ValueError(
            f"an APM message of {shape[0]} x {shape[1]} cells {layer} layer has {expected} bytes, "
            f"not {len(message)}"
        )
    count, start = shape[0] * shape[1], APM_HEADER.itemsize
    cells = np.frombuffer(message, APM_CELL, count, start).reshape(shape)
    start += cells.nbytes
    return Apm(
        vehicle=int(header["vehicle"]),
        time=int(header["time"]),
        position=header["position"],
        heading=float(header["heading"]),
        center=header["center"],
        cell=float(header["cell"]),
        cells=cells,
        layer=np.frombuffer(message, APM_LAYER_CELL, count, start).reshape(shape)
        if layered
        else None,
    )


def join(messages: Iterable[bytes]) -> bytes:
    """`messages` as one "APMS" Binary signal, in their order."""
    blocks = []
    for message in messages:
        prefix = np.array([(len(message), 0)], _PREFIX).tobytes()
        blocks.append(prefix + message + bytes(-len(message) % _ALIGNMENT))
    head = np.array([(_SIGNAL_MAGIC, _VERSION, len(blocks), 0)], FRAME)
    return head.tobytes() + b"".join(blocks)


def split(apms_signal: bytes) -> list[bytes]:
    """The messages in an "APMS" Binary signal; none if it is empty. They are not decoded.

    Raises:
        ValueError: `apms_signal` is not such a signal, and why.
    """
    if not apms_signal:
        return []
    if len(apms_signal) < FRAME.itemsize:
        raise ValueError(f"an `APMS` frame has at least 16 bytes, not {len(apms_signal)}")
    head = np.frombuffer(apms_signal, FRAME, 1)[0]
    if head["magic"] != _SIGNAL_MAGIC or head["version"] != _VERSION or head["record_size"] != 0:
        raise ValueError(f"not an `APMS` frame of version 1: {apms_signal[:16]!r}")
    messages, start = [], FRAME.itemsize
    for index in range(int(head["count"])):
        if len(apms_signal) < start + _PREFIX.itemsize:
            raise ValueError(f"`APMS` frame is cut short before message {index}")
        size = int(np.frombuffer(apms_signal, _PREFIX, 1, start)[0]["size"])
        start += _PREFIX.itemsize
        end = start + size + -size % _ALIGNMENT
        if len(apms_signal) < end:
            raise ValueError(f"`APMS` frame is cut short in message {index} of {size} bytes")
        messages.append(apms_signal[start : start + size])
        start = end
    if start != len(apms_signal):
        raise ValueError(f"`APMS` frame has {len(apms_signal) - start} bytes after its messages")
    return messages


def _axes(heading: float) -> tuple[Float, Float]:
    """Unit vectors forward and to the left of `heading` [rad]."""
    cosine, sine = np.cos(heading), np.sin(heading)
    return np.array([cosine, sine]), np.array([-sine, cosine])


def _check_header(header: Any) -> None:
    """Raise ValueError if a header says what no APM can mean."""
    if header["magic"] != _MESSAGE_MAGIC or header["version"] != _VERSION:
        raise ValueError(
            f"not an APM message of version {_VERSION}: "
            f"magic {bytes(header['magic'])!r}, version {header['version']}"
        )
    if header["flags"] & ~np.uint16(APM_LAYER_FLAG):
        raise ValueError(f"an APM message has unknown flags {int(header['flags']):#06x}")
    if header["vehicle"] < 0:
        raise ValueError(f"an APM message comes from vehicle {header['vehicle']}, must be >= 0")
    if header["rows"] == 0 or header["columns"] == 0:
        raise ValueError(f"an APM of {header['rows']} x {header['columns']} cells is empty")
    if not (np.isfinite(header["cell"]) and header["cell"] > 0):
        raise ValueError(f"an APM has cells of {header['cell']} m, must be finite and > 0")
    for name in ("position", "heading", "center"):
        if not np.isfinite(header[name]).all():
            raise ValueError(f"the {name} of an APM is not finite: {header[name]}")
