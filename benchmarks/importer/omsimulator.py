"""OMSimulator 3, where its Python interface is installed with its library."""

import ctypes
import importlib
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import process_time_ns
from typing import Any

from typing_extensions import override

from benchmarks.benchmark import Case, Measurement
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.model import fmu


def _found() -> tuple[Any, str]:
    """The package, or why there is none."""
    try:
        return importlib.import_module("OMSimulator"), ""
    except (ImportError, OSError) as error:  # its package on PyPI loads the library later
        return None, " ".join(str(error).split())


_omsimulator, WHY_NOT = _found()


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing of the library gets to the standard output, which is for the table."""
    sys.stdout.flush()
    kept = os.dup(1)
    with Path(os.devnull).open("wb") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        ctypes.CDLL(None).fflush(None)  # what C has buffered
        os.dup2(kept, 1)
        os.close(kept)


@dataclass(frozen=True, slots=True, kw_only=True)
class OmsimulatorRun(Case):
    """All FMUs step, then values are exchanged; every output is written to a CSV file.

    A value needs one more step for each FMU that it comes by. The last step is half as long.

    Attributes:
        chain: of FMUs of FMI 2.0 or 3.0.
        steps: communication steps.
    """

    chain: Chain
    steps: int

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `step_us`: CPU time of a step of one FMU, of all threads.
        """
        with tempfile.TemporaryDirectory() as folder, _quiet():
            running = self._system().instantiate()
            running.setLogFile(str(Path(folder) / "log.txt"))
            running.setResultFile(str(Path(folder) / "all.csv"))
            h = STEP_NS * 1e-9
            running.setFixedStepSize(h)
            running.removeSignalsFromResults(".*")
            running.addSignalsToResults(".*_out_.*")
            running.setStopTime((self.steps - 0.5) * h)  # times are sums: a whole one may be missed
            running.initialize()
            before_ns = process_time_ns()
            running.simulate()
            spent = process_time_ns() - before_ns
            last = self._last(running)
            running.terminate()
            running.setLogFile("")  # else it speaks of its log when this process ends
            running.delete()
        self.chain.check("OMSimulator", last, self.steps - self.chain.length + 1)
        return {"step_us": spent * 1e-3 / (self.steps * self.chain.length)}

    def _system(self) -> Any:
        package = _omsimulator.SSP()
        name_of = _omsimulator.CRef
        for model in {model.name: model for _, model in self.chain.members}.values():
            package.addResource(str(fmu(model)), new_name=f"resources/{model.name}.fmu")
        for name, model in self.chain.members:
            package.addComponent(name_of("default", name), f"resources/{model.name}.fmu")
        for before, output, after, input_ in self.chain.wires:
            package.addConnection(
                name_of("default", before, output.name), name_of("default", after, input_.name)
            )
        return package

    def _last(self, running: Any) -> dict[str, float]:
        name, model = self.chain.members[-1]
        return {
            each.name: running.getValue(_omsimulator.CRef("default", name, each.name))
            for each in model.variables()
            if not each.is_input
        }
