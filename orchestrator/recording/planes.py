"""Planes of bytes: the lowest byte of all numbers of a column, then the next one of all, ...

Of numbers that resemble each other the upper planes hardly change, and compress well. Compiled code
makes them five to ten times as fast as NumPy; what it makes is the same.
"""

import ctypes
import functools
from collections.abc import Callable
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from orchestrator.compiled import library

Make: TypeAlias = Callable[[int, int, int, bool, int], None]

_WIDTHS: Final = frozenset({2, 4, 8})


def planes(column: npt.NDArray[Any], *, are_deltas: bool = False) -> npt.NDArray[np.uint8]:
    """The planes of `column`, shape (byte of a number, number).

    Args:
        column: whole numbers of 1, 2, 4 or 8 bytes, one after the other, shape (number,).
        are_deltas: of the differences to the number before, without carry; of the first one to 0.
    """
    width = column.itemsize
    make = _compiled()
    if make is None or width not in _WIDTHS:
        return planes_in_numpy(column, are_deltas=are_deltas)
    made = np.empty((width, len(column)), np.uint8)
    make(_address(column), len(column), width, are_deltas, _address(made))
    return made


def planes_in_numpy(column: npt.NDArray[Any], *, are_deltas: bool) -> npt.NDArray[np.uint8]:
    """Planes as of `planes`, without compiled code, shape (byte of a number, number)."""
    if are_deltas:
        numbers = np.empty_like(column)
        numbers[:1] = column[:1]
        np.subtract(column[1:], column[:-1], out=numbers[1:])
        column = numbers
    rows: npt.NDArray[np.uint8] = column.view(np.uint8).reshape(-1, column.dtype.itemsize)
    return np.ascontiguousarray(rows.T)


def _address(array: npt.NDArray[Any]) -> int:
    return int(array.__array_interface__["data"][0])  # quicker than `array.ctypes.data`


@functools.cache
def _compiled() -> Make | None:
    """The function in compiled code; `None`: there is none, or of another release."""
    found = library()
    if found is None or not hasattr(found, "column_planes"):
        return None
    make = found.column_planes
    make.argtypes = (
        ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_int, ctypes.c_void_p
    )  # fmt: skip
    make.restype = None
    return make
