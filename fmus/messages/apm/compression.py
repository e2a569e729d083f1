"""The compressed form of an APM that counts points: bytes of runs, small numbers and references.

docs/formats.md describes it; `fmus/perception/compression.c` is the same code in C, and both make
the same bytes. `fmus.messages.apm` calls these functions: messages are encoded and decoded there.
"""

from collections.abc import Iterable, Iterator
from itertools import islice
from typing import Final

import numpy as np
import numpy.typing as npt

from fmus.messages.records import APM_CELL, APM_LAYER_CELL

CELLS_PER_BYTE: Final = 32
"""A byte of a compressed matrix stands for at most so many cells."""

# What the first byte of an item of the cells says: a run of 1..32 cells without points; 1..208
# points; the upper part of 209..3792 points, whose lower part is the next byte; or that the number
# of points is in the next 2 or 4 bytes.
_SMALL: Final = CELLS_PER_BYTE
_MEDIUM: Final = 240
_WORD: Final = 254
_LONG_WORD: Final = 255
_FIRST_MEDIUM: Final = _MEDIUM - _SMALL + 1
_FIRST_WORD: Final = _FIRST_MEDIUM + (_WORD - _MEDIUM) * 256

# What the first byte of an item of the layer says: a run of 1..128 cells without an object; number
# 0..126 of an object that came before, or that another one follows.
_LAYER_RUN: Final = 128
_NUMBERS: Final = 127
_OTHER: Final = 255

_NOTHING: Final = bytes(APM_LAYER_CELL.itemsize)


def compress(
    cells: npt.NDArray[np.uint32], layer: npt.NDArray[np.void] | None = None
) -> bytes | None:
    """The compressed form of a matrix that counts points.

    Args:
        cells: points in each cell, uint32, shape (rows, columns).
        layer: `APM_LAYER_CELL`, shape (rows, columns); None if there is none.

    Returns:
        The form; None if the layer says something about a cell without points.
    """
    code = bytearray()
    run = 0
    for index in cells.ravel().tolist():
        if index == 0:
            run += 1
            continue
        code += _run(run, CELLS_PER_BYTE)
        code += _index(index)
        run = 0
    code += _run(run, CELLS_PER_BYTE)
    if layer is not None:
        seen = cells != 0
        if layer[~seen].tobytes().strip(b"\0"):
            return None
        code += _layer(_cells_of(layer[seen].tobytes()))
    return bytes(code)


def decompress(
    code: bytes, shape: tuple[int, int], *, layered: bool
) -> tuple[npt.NDArray[np.uint32], npt.NDArray[np.void] | None]:
    """The matrix of a compressed form, as `compress` takes it.

    Args:
        code: the compressed form.
        shape: rows and columns, whose product bounds the memory that is used.
        layered: whether `code` has a layer.

    Returns:
        The points in each cell, uint32, and the layer, `APM_LAYER_CELL`, or None if there is none;
        both of the shape `shape`.

    Raises:
        ValueError: `code` is not the compressed form of such a matrix, and why.
    """
    rest = iter(code)
    cells = np.array(_read_cells(rest, shape[0] * shape[1]), APM_CELL).reshape(shape)
    layer = None
    if layered:
        layer = np.zeros(shape, APM_LAYER_CELL)
        seen = cells != 0
        layer[seen] = np.frombuffer(_read_layer(rest, int(np.count_nonzero(seen))), APM_LAYER_CELL)
    if left := len(bytes(rest)):
        raise ValueError(f"a compressed APM has {left} bytes too many")
    return cells, layer


# ---- writing


def _run(run: int, longest: int) -> bytes:
    """The items of a run of `run` cells that may be empty."""
    full, rest = divmod(run, longest)
    return bytes([longest - 1]) * full + (bytes([rest - 1]) if rest else b"")


def _index(index: int) -> bytes:
    """The item of a cell with points."""
    if index < _FIRST_MEDIUM:
        return bytes([_SMALL + index - 1])
    if index < _FIRST_WORD:
        upper, lower = divmod(index - _FIRST_MEDIUM, 256)
        return bytes([_MEDIUM + upper, lower])
    if index < 1 << 16:
        return bytes([_WORD]) + index.to_bytes(2, "little")
    return bytes([_LONG_WORD]) + index.to_bytes(4, "little")


def _cells_of(layer: bytes) -> list[bytes]:
    """Four bytes each."""
    size = APM_LAYER_CELL.itemsize
    return [layer[start : start + size] for start in range(0, len(layer), size)]


def _layer(cells: Iterable[bytes]) -> bytes:
    """The items of the layer of the cells that have points."""
    code = bytearray()
    known: dict[bytes, int] = {}
    run = 0
    for cell in cells:
        if cell == _NOTHING:
            run += 1
            continue
        code += _run(run, _LAYER_RUN)
        run = 0
        thing, points = cell[:3], cell[3:]
        if thing in known:
            code += bytes([_LAYER_RUN + known[thing]]) + points
            continue
        if len(known) < _NUMBERS:
            known[thing] = len(known)
        code += bytes([_OTHER]) + cell
    return bytes(code + _run(run, _LAYER_RUN))


# ---- reading


def _take(code: Iterator[int], size: int) -> bytes:
    """The next `size` bytes."""
    taken = bytes(islice(code, size))
    if len(taken) < size:
        raise ValueError("a compressed APM is cut short")
    return taken


def _next_byte(code: Iterator[int]) -> int:
    """The next byte."""
    for byte in code:
        return byte
    raise ValueError("a compressed APM is cut short")


def _read_cells(code: Iterator[int], count: int) -> list[int]:
    """The points in each of `count` cells."""
    cells: list[int] = []
    while len(cells) < count:
        first = _next_byte(code)
        if first >= CELLS_PER_BYTE:
            cells.append(_read_index(code, first))
            continue
        run = first + 1
        if run > count - len(cells):
            raise ValueError(f"a run of {run} cells of a compressed APM passes its last cell")
        cells += [0] * run
    return cells


def _read_index(code: Iterator[int], first: int) -> int:
    """The points of the item that begins with `first`, which is no run."""
    if first >= _WORD:
        return int.from_bytes(_take(code, 2 if first == _WORD else 4), "little")
    if first < _MEDIUM:
        return first - _SMALL + 1
    return _FIRST_MEDIUM + (first - _MEDIUM) * 256 + _next_byte(code)


def _read_layer(code: Iterator[int], count: int) -> bytes:
    """The layer of the `count` cells that have points."""
    layer = bytearray()
    known: list[bytes] = []
    while (left := count - len(layer) // len(_NOTHING)) > 0:
        first = _next_byte(code)
        if first >= _LAYER_RUN:
            layer += _read_object(code, first, known) + _take(code, 1)
            continue
        run = first + 1
        if run > left:
            raise ValueError(
                f"a run of {run} cells of the layer of a compressed APM passes its last cell"
            )
        layer += _NOTHING * run
    return bytes(layer)


def _read_object(code: Iterator[int], first: int, known: list[bytes]) -> bytes:
    """Height and velocity of the item that begins with `first`, which is no run."""
    if first == _OTHER:
        thing = _take(code, 3)
        if len(known) < _NUMBERS:
            known.append(thing)
        return thing
    if first - _LAYER_RUN >= len(known):
        raise ValueError(f"the layer of a compressed APM has no object {first - _LAYER_RUN} yet")
    return known[first - _LAYER_RUN]
