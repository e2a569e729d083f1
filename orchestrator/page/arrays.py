"""Arrays within a page: planes of differences, deflated together, in letters."""

import base64
import hashlib
import math
import zlib
from collections.abc import Mapping
from typing import Any, Final, TypeAlias

import numpy as np

from orchestrator.signal import Array

Reference: TypeAlias = Mapping[str, Any]
"""Where an array is within all of them, and how it is written; goes into the JSON of the page."""

MISSING: Final = -32768
"""Stands for a number that is none, among numbers of 16 bits."""

_STEPS: Final = 65532
"""Steps between the least and the greatest of them; one at each end is for rounding the middle."""

_TYPES: Final = frozenset({"u1", "i2", "u2", "i4", "f4", "f8"})
_REAL: Final = frozenset({"f4", "f8"})


class Arrays:
    """The arrays of one page; equal ones are kept once."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0
        self._known: dict[bytes, Reference] = {}

    def add(self, values: Array, dtype: str, *, deltas: int = 0) -> Reference:
        """Keep an array.

        Args:
            values: any shape; it is flattened, row by row.
            dtype: as which it is kept: `u1`, `i2`, `u2`, `i4`, `f4` or `f8`; whole numbers
                have to fit.
            deltas: how often each number is replaced by its difference to the one before, modulo
                what the type holds; not of `f4` and `f8`.

        Returns:
            What a script gives to `NLOSIM.array` for it.

        Raises:
            ValueError: a number does not fit, or there is no such type.
        """
        if dtype not in _TYPES or (dtype in _REAL and deltas):
            what = f"arrays of a page are of {sorted(_TYPES)}; `f4` and `f8` have no differences"
            raise ValueError(what)
        flat = np.asarray(values).reshape(-1)
        kept = flat.astype(f"<{dtype}")
        if dtype not in _REAL and not np.array_equal(kept, flat):
            raise ValueError(f"there are numbers that are no `{dtype}`")
        if dtype not in _REAL:
            words = kept.view(f"<u{kept.itemsize}")
            for _ in range(deltas):
                words = np.diff(words, prepend=words.dtype.type(0))
            kept = words
        planes = kept.view(np.uint8).reshape(-1, kept.itemsize).T.tobytes()
        key = hashlib.sha256(f"{dtype} {deltas} ".encode() + planes).digest()
        if key not in self._known:
            self._known[key] = {
                "at": self._size,
                "n": len(flat),
                "type": dtype,
                "deltas": deltas,
            }
            self._parts.append(planes)
            self._size += len(planes)
        return self._known[key]

    def rounded(self, values: Array, step: float = 0.0, *, deltas: int = 1) -> Reference:
        """Keep real numbers with 16 bits each.

        Args:
            values: any shape; what is not finite is kept as missing.
            step: what they are multiples of, at least [their unit]; it is larger where the range
                of the numbers needs it. An error is at most half a step.
            deltas: as of `add`.

        Returns:
            What a script gives to `NLOSIM.numbers` for it.
        """
        flat = np.asarray(values, np.float64).reshape(-1)
        known = np.isfinite(flat)
        low, high = (
            (float(flat[known].min()), float(flat[known].max())) if known.any() else (0.0, 0.0)
        )
        span = high / 2 - low / 2  # the whole one may be more than a number can be
        step = max(step, span / (_STEPS // 2)) or 1.0
        middle = math.floor((low / 2 + high / 2) / step) * step
        if not math.isfinite(middle):
            middle = low / 2 + high / 2
        whole = np.full(len(flat), MISSING, np.int64)
        whole[known] = np.clip(np.rint(flat[known] / step - middle / step), -32767, 32767)
        return {"whole": self.add(whole, "i2", deltas=deltas), "step": step, "middle": middle}

    def letters(self) -> str:
        """All arrays, deflated without a head (RFC 1951), in base 64."""
        squeeze = zlib.compressobj(9, zlib.DEFLATED, -15)
        data = b"".join(map(squeeze.compress, self._parts)) + squeeze.flush()
        return base64.b64encode(data).decode()
