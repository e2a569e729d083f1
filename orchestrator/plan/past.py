"""What outputs showed lately, in memory of the engine and in that of Python."""

from typing import Any, Final

import numpy as np

from orchestrator.algorithm.mixing import PastValues
from orchestrator.plan import layouts
from orchestrator.signal import Array, Signal
from orchestrator.timebase import StepSize, Time

MOST_BYTES: Final = 1 << 28
"""That the past of an output may take in memory of the engine."""


def rows_of(span: StepSize, step_size: StepSize) -> int:
    """How many values an output may show over `span` [ns], and one before; of `step_size` [ns]."""
    return int(span // step_size) + 3


class Past:
    """The past of one output.

    Args:
        values: as Python keeps them.
        source: the output.
        step_size: of its component [ns].
        dtype, shape: of its values.

    Attributes:
        table: what the engine reads.
    """

    def __init__(
        self,
        values: PastValues,
        source: layouts.Source,
        step_size: StepSize,
        dtype: "np.dtype[Any]",
        shape: tuple[int, ...],
    ) -> None:
        rows = rows_of(values.span, step_size)
        self._values = values
        self._times: Array = np.zeros(rows, np.int64)
        self._rows: Array = np.zeros((rows, *shape), dtype)
        self._newest: tuple[Time, Signal] | None = None
        self._known = 0
        self.table = layouts.Past(
            source=source,
            time=self._times.ctypes.data,
            row=self._rows.ctypes.data,
            size=self._rows[0].nbytes,
            rows=rows,
        )

    def enter(self) -> None:
        """Take over what Python noted since the last stretch."""
        fresh: list[tuple[Time, Signal]] = []
        for entry in reversed(self._values.entries):
            if entry is self._newest:
                break
            fresh.append(entry)
        else:
            self.table.count = 0
        for time, value in reversed(fresh):
            row = self.table.count % len(self._times)
            self._times[row], self._rows[row] = time, value
            self.table.count += 1
        self._known = self.table.count

    def leave(self) -> None:
        """Let Python know what was noted in a stretch."""
        count, rows = self.table.count, len(self._times)
        later: list[tuple[Time, Signal]] = []
        for number in range(max(self._known, count - rows), count):
            value = np.array(self._rows[number % rows])
            value.flags.writeable = False
            later.append((int(self._times[number % rows]), value))
        self._values.extend(later)
        self._newest = self._values.entries[-1] if self._values.entries else None
