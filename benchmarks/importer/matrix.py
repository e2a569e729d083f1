"""A matrix that moves through two FMUs, and what it takes to copy it."""

import ctypes
from dataclasses import dataclass
from time import process_time_ns
from typing import Final

import numpy as np
from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.importer.chain import STEP_NS, Chain, DifferentResultError
from benchmarks.importer.floor import FloorRun
from benchmarks.importer.model import floor_library
from benchmarks.importer.ours import Stopwatch, system_of
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.observer import NoProgress
from orchestrator.signal import Array
from orchestrator.simulation import simulate

_OUTPUT: Final = "Float64_out_1"


@dataclass(frozen=True, slots=True, kw_only=True)
class MatrixRun(Case):
    """A source changes one element at each step, a second FMU copies its input to its output.

    The FMUs make three copies: the output of the first is got, the input of the second is set, and
    the second steps. Nobody reads what it gives. The floor is a loop of C with the same calls.

    Attributes:
        side: rows and columns of the matrix.
        steps: communication steps.
    """

    side: int
    steps: int

    @override
    def measure(self) -> Measurement:
        """Run once, then the loop of C, then copy as often by NumPy and by `memcpy`.

        Returns:
            CPU times: `step_us` and `floor_us` of both FMUs, ours and in the loop; `numpy_us` and
            `memcpy_us` of one copy.

        Raises:
            DifferentResultError: the matrix that came out is not the one that went in.
        """
        shape = (self.side, self.side)
        chain = Chain("matrix", 3, 2, shape)
        system = system_of(chain)
        watch = Stopwatch(NoProgress())
        stop = self.steps * STEP_NS
        result = simulate(
            system, GaussSeidel(("c0", "c1")), start=0, stop=stop, seed=0, observers=[watch]
        )
        values = np.asarray(result.values["c1"][_OUTPUT])
        if not np.array_equal(values, self._expected()):
            raise DifferentResultError(f"the matrix of {shape} came out as another one")
        floor = FloorRun(chain=chain, steps=self.steps, is_recorded=False).measure()
        numpy_ns, memcpy_ns = _copies(values, self.steps)
        each = 1e-3 / self.steps
        return {
            "step_us": watch.spent_ns * each,
            "floor_us": floor["step_us"] * chain.length,
            "numpy_us": numpy_ns * each,
            "memcpy_us": memcpy_ns * each,
        }

    def _expected(self) -> Array:
        elements: Array = np.zeros(self.side * self.side)
        for count in range(1, self.steps + 1):
            elements[count % len(elements)] = count * 0.001
        return elements.reshape(self.side, self.side)


def _copies(values: Array, times: int) -> tuple[int, int]:
    """CPU time of copies by NumPy and by `memcpy` [ns]."""
    target = np.empty_like(values)
    target.fill(1.0)
    before = process_time_ns()
    for _ in range(times):
        np.copyto(target, values)
    numpy_ns = process_time_ns() - before
    library = ctypes.CDLL(str(floor_library()))
    library.floor_copy.argtypes = (
        ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int64
    )  # fmt: skip
    before = process_time_ns()
    library.floor_copy(target.ctypes.data, values.ctypes.data, values.nbytes, times)
    return numpy_ns, process_time_ns() - before
