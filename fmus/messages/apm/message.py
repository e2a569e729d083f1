"""The abstract perception matrix as a message on the air.

`fmus.messages.records` declares the byte layout; docs/formats.md describes it.
"""

from typing import Any, Final

import numpy as np
import numpy.typing as npt

from fmus.messages.apm.compression import CELLS_PER_BYTE, compress, decompress
from fmus.messages.apm.matrix import Apm, Layer
from fmus.messages.apm.seen_compression import SEEN_CELLS_PER_BYTE, compress_seen, decompress_seen
from fmus.messages.records import (
    APM_CELL,
    APM_COMPRESSED_FLAG,
    APM_HEADER,
    APM_LAYER_CELL,
    APM_LAYER_FLAG,
    APM_LEVELS,
    APM_LEVELS_SHIFT,
    APM_MOST_CELLS,
)

_MAGIC: Final = b"APMM"
_VERSION: Final = 1
_MOST_LEVELS: Final = APM_LEVELS >> APM_LEVELS_SHIFT


def message_size(rows: int, columns: int, *, layer: bool) -> int:
    """Size of a plain message on the air [byte]; a compressed one is never longer.

    That is the header, four bytes per cell, and four more per cell with the layer.
    """
    per_cell = APM_CELL.itemsize + (APM_LAYER_CELL.itemsize if layer else 0)
    return APM_HEADER.itemsize + rows * columns * per_cell


def encode(apm: Apm, *, compressed: bool = False) -> bytes:
    """The message that carries `apm`.

    Args:
        apm: what to send.
        compressed: whether to use the compressed form where it is shorter than the plain one.

    Raises:
        ValueError: `apm` cannot be sent, e.g. its layer has another shape than its cells.
    """
    if not 0 <= apm.levels <= _MOST_LEVELS:
        raise ValueError(f"an APM of {apm.levels} levels does not fit: 0 to {_MOST_LEVELS}")
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
    header["magic"], header["version"] = _MAGIC, _VERSION
    header["flags"] = apm.levels << APM_LEVELS_SHIFT | (0 if apm.layer is None else APM_LAYER_FLAG)
    header["vehicle"], header["time"] = apm.vehicle, apm.time
    header["position"], header["heading"], header["center"] = apm.position, apm.heading, apm.center
    header["cell"], header["rows"], header["columns"] = apm.cell, rows, columns
    _check_header(header)
    _check_cells(apm.cells, apm.levels)
    payload = apm.cells.tobytes() + (b"" if apm.layer is None else apm.layer.tobytes())
    if compressed:
        shorter = compressed_payload(apm)
        if shorter is not None and len(shorter) < len(payload):
            header["flags"] |= APM_COMPRESSED_FLAG
            payload = shorter
    return header.tobytes() + payload


def compressed_payload(apm: Apm) -> bytes | None:
    """Cells and layer of an APM in the compressed form, which may be the longer one.

    None if it has no such form: points are counted, and the layer says something about a cell
    without any.
    """
    if apm.levels:
        return compress_seen(apm.cells, apm.layer, apm.levels)
    return compress(apm.cells, apm.layer)


def read_header(message: bytes) -> np.void:
    """The `APM_HEADER` of a message whose cells are not of interest.

    Raises:
        ValueError: `message` does not begin as an APM message, and why.
    """
    if len(message) < APM_HEADER.itemsize:
        raise ValueError(
            f"an APM message has at least {APM_HEADER.itemsize} bytes, not {len(message)}"
        )
    header: np.void = np.frombuffer(message, APM_HEADER, 1)[0]
    _check_header(header)
    return header


def shifted(message: bytes, by: int) -> bytes:
    """`message` as if its scan had been taken `by` [ns] later; all else is the same bytes.

    Raises:
        ValueError: `message` does not begin as an APM message, and why.
    """
    read_header(message)
    changed = bytearray(message)
    np.frombuffer(changed, APM_HEADER, 1)["time"] += by
    return bytes(changed)


def decode(message: bytes) -> Apm:
    """The APM in `message`; of a plain one the arrays are read-only views.

    Takes at most 80 MB of memory. That is for a message that counts points at most 600 bytes for
    each of its own, for one with `levels` at most 20 for each of its cells and 1 MB.

    Raises:
        ValueError: `message` is not an APM message, and why.
    """
    header = read_header(message)
    flags = int(header["flags"])
    read = _compressed if flags & APM_COMPRESSED_FLAG else _plain
    shape, levels = (int(header["rows"]), int(header["columns"])), flags >> APM_LEVELS_SHIFT
    cells, layer = read(message, shape, levels, layered=bool(flags & APM_LAYER_FLAG))
    return Apm(
        vehicle=int(header["vehicle"]),
        time=int(header["time"]),
        position=header["position"],
        heading=float(header["heading"]),
        center=header["center"],
        cell=float(header["cell"]),
        cells=cells,
        layer=layer,
        levels=levels,
    )


def _plain(
    message: bytes, shape: tuple[int, int], levels: int, *, layered: bool
) -> tuple[npt.NDArray[np.uint32], Layer | None]:
    """Cells and layer of a plain message."""
    expected = message_size(*shape, layer=layered)
    if len(message) != expected:
        with_layer = "with" if layered else "without"
        raise ValueError(
            f"an APM message of {shape[0]} x {shape[1]} cells {with_layer} layer has "
            f"{expected} bytes, not {len(message)}"
        )
    count, start = shape[0] * shape[1], APM_HEADER.itemsize
    cells = np.frombuffer(message, APM_CELL, count, start).reshape(shape)
    _check_cells(cells, levels)
    if not layered:
        return cells, None
    layer = np.frombuffer(message, APM_LAYER_CELL, count, start + cells.nbytes)
    return cells, layer.reshape(shape)


def _compressed(
    message: bytes, shape: tuple[int, int], levels: int, *, layered: bool
) -> tuple[npt.NDArray[np.uint32], Layer | None]:
    """Cells and layer of a compressed message."""
    code = message[APM_HEADER.itemsize :]
    if shape[0] * shape[1] > len(code) * (SEEN_CELLS_PER_BYTE if levels else CELLS_PER_BYTE):
        raise ValueError(
            f"a compressed APM of {shape[0]} x {shape[1]} cells does not fit into "
            f"{len(message)} bytes"
        )
    if levels:
        return decompress_seen(code, shape, levels, layered=layered)
    return decompress(code, shape, layered=layered)


def _check_header(header: Any) -> None:
    """Raise ValueError if a header says what no APM can mean."""
    if header["magic"] != _MAGIC or header["version"] != _VERSION:
        raise ValueError(
            f"not an APM message of version {_VERSION}: "
            f"magic {bytes(header['magic'])!r}, version {header['version']}"
        )
    if header["flags"] & ~np.uint16(APM_LAYER_FLAG | APM_COMPRESSED_FLAG | APM_LEVELS):
        raise ValueError(f"an APM message has unknown flags {int(header['flags']):#06x}")
    if header["vehicle"] < 0:
        raise ValueError(f"an APM message comes from vehicle {header['vehicle']}, must be >= 0")
    if header["rows"] == 0 or header["columns"] == 0:
        raise ValueError(f"an APM of {header['rows']} x {header['columns']} cells is empty")
    if int(header["rows"]) * int(header["columns"]) > APM_MOST_CELLS:
        raise ValueError(
            f"an APM of {header['rows']} x {header['columns']} cells is too large: "
            f"at most {APM_MOST_CELLS} cells"
        )
    if not (np.isfinite(header["cell"]) and header["cell"] > 0):
        raise ValueError(f"an APM has cells of {header['cell']} m, must be finite and > 0")
    for name in ("position", "heading", "center"):
        if not np.isfinite(header[name]).all():
            raise ValueError(f"the {name} of an APM is not finite: {header[name]}")


def _check_cells(cells: npt.NDArray[np.uint32], levels: int) -> None:
    """Raise ValueError if more is seen of a cell than all."""
    if levels and (most := int(cells.max())) > levels:
        raise ValueError(f"an APM of {levels} levels has a cell of {most}")
