"""The compressed form of an APM whose cells are shares of seen ground: decisions of a range coder.

docs/formats.md describes it; `fmus/perception/seen_compression.c` is the same code in C, and both
make the same bytes. `fmus.messages.apm` calls these functions; it encodes and decodes messages.
"""

from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.messages.apm.range_coder import Coder, Decision, Decoder, Encoder, decisions
from fmus.messages.records import APM_CELL, APM_LAYER_CELL

SEEN_CELLS_PER_BYTE: Final = 1 << 14
"""A byte of a compressed matrix stands for at most so many cells: no decision takes less than
log2(65536 / (65536 - 31)) bits."""

_BYTE: Final = 0xFF
_NOTHING: Final = bytes(APM_LAYER_CELL.itemsize)


def compress_seen(
    cells: npt.NDArray[np.uint32], layer: npt.NDArray[np.void] | None, levels: int
) -> bytes:
    """The compressed form of a matrix of shares of seen ground.

    Args:
        cells: share of each cell's ground that is seen, in units of 1 / `levels`, uint32, shape
            (rows, columns).
        layer: `APM_LAYER_CELL`, shape (rows, columns); None if there is none.
        levels: index of a cell whose ground is all seen, 1 to 255; no cell is above.
    """
    encoder = Encoder()
    _code_cells(encoder, cells.astype(np.uint8).tobytes(), cells.shape[1], levels)
    if layer is not None:
        _code_layer(encoder, layer.tobytes(), cells.shape[1])
    return encoder.finish()


def decompress_seen(
    code: bytes, shape: tuple[int, int], levels: int, *, layered: bool
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.void] | None]:
    """The matrix of a compressed form, as `compress_seen` takes it.

    Args:
        code: the compressed form.
        shape: rows and columns, whose product bounds the memory and the time that are used.
        levels: index of a cell whose ground is all seen, 1 to 255.
        layered: whether `code` has a layer.

    Returns:
        The share of each cell's ground that is seen, in units of 1 / `levels`, uint32, and the
        layer, `APM_LAYER_CELL`, or None if there is none; both of the shape `shape`.

    Raises:
        ValueError: `code` is not the compressed form of such a matrix, and why.
    """
    decoder = Decoder(code)
    count = shape[0] * shape[1]
    found = _code_cells(decoder, bytes(count), shape[1], levels)
    cells = np.frombuffer(found, np.uint8).astype(APM_CELL).reshape(shape)
    layer = None
    if layered:
        found = _code_layer(decoder, bytes(count * len(_NOTHING)), shape[1])
        layer = np.frombuffer(found, APM_LAYER_CELL).reshape(shape)
    decoder.finish()
    return cells, layer


def _code_cells(coder: Coder, cells: bytes, columns: int, levels: int) -> bytearray:
    """Code the cells row by row; returns them."""
    is_nothing, is_full = decisions(3**4), decisions(3**4)
    between = [decisions(_BYTE + 1) for _ in range(3**2)]
    found = bytearray()
    rear = bytearray(columns + 2)  # classes of a row, between two cells that nobody sees
    for start in range(0, len(cells), columns):
        row = bytearray(columns + 2)
        for j, index in enumerate(cells[start : start + columns], 1):
            context = 27 * rear[j] + 9 * row[j - 1] + 3 * rear[j - 1] + rear[j + 1]
            if coder.decide(is_nothing[context], yes=index == 0):
                found.append(0)
            elif levels == 1 or coder.decide(is_full[context], yes=index == levels):
                found.append(levels)
                row[j] = 2
            else:
                found.append(1 + coder.byte(between[context // 9], index - 1, levels - 2))
                row[j] = 1
        rear = row
    return found


def _code_layer(coder: Coder, layer: bytes, columns: int) -> bytearray:
    """Code the layer row by row; returns it."""
    has_object, is_same = decisions(2**4), decisions(2**4)
    parts = [decisions(_BYTE + 1) for _ in _NOTHING]
    found = bytearray()
    rear = [_NOTHING] * (columns + 2)
    size = len(_NOTHING)
    for start in range(0, len(layer), columns * size):
        row = [_NOTHING] * (columns + 2)
        for j in range(1, columns + 1):
            at = start + (j - 1) * size
            near = (rear[j], row[j - 1], rear[j - 1], rear[j + 1])
            context = sum(8 >> k for k, other in enumerate(near) if other != _NOTHING)
            cell = layer[at : at + size]
            if coder.decide(has_object[context], yes=cell != _NOTHING):
                expected = next((other[:3] for other in near if other != _NOTHING), _NOTHING[:3])
                row[j] = _code_object(coder, cell, expected, is_same[context], parts)
            found += row[j]
        rear = row
    return found


def _code_object(
    coder: Coder, cell: bytes, expected: bytes, is_same: Decision, parts: list[list[Decision]]
) -> bytes:
    """Code a cell of the layer in which something is; `expected` is the object beside it."""
    *parts_of_object, points = parts
    same = coder.decide(is_same, yes=cell[:3] == expected)
    found = expected if same else bytes(map(coder.byte, parts_of_object, cell))
    if found == expected and not same:
        raise ValueError("the layer of a compressed APM repeats an object instead of saying so")
    found += bytes([coder.byte(points, cell[3])])
    if found == _NOTHING:
        raise ValueError("the layer of a compressed APM has an object that is nothing")
    return found
