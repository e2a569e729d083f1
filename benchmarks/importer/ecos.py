"""The importer ecos, where the package `ecospy` is installed."""

import importlib
import tempfile
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
        return importlib.import_module("ecospy"), ""
    except (ImportError, OSError) as error:  # it needs the library of `tbb`, too
        return None, " ".join(str(error).split())


_ecospy, WHY_NOT = _found()


@dataclass(frozen=True, slots=True, kw_only=True)
class EcosRun(Case):
    """All FMUs step, then values are exchanged; every output is written to a CSV file.

    A value needs one more step for each FMU that it comes by.

    Attributes:
        chain: of FMUs of FMI 2.0.
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
        _ecospy.EcosLib.set_log_level("err")  # it writes to the standard output
        with (
            tempfile.TemporaryDirectory() as folder,
            _ecospy.EcosSimulationStructure() as structure,
        ):
            for name, model in self.chain.members:
                structure.add_model(name, str(fmu(model)))
            for before, output, after, input_ in self.chain.wires:
                connect = {
                    "Real": structure.make_real_connection,
                    "Integer": structure.make_int_connection,
                    "Boolean": structure.make_bool_connection,
                }[output.type]
                connect(f"{before}::{output.name}", f"{after}::{input_.name}")
            h = STEP_NS * 1e-9
            with _ecospy.EcosSimulation(structure=structure, step_size=h) as simulation:
                simulation.add_csv_writer(str(Path(folder) / "all.csv"), identifiers=self._all())
                simulation.init()
                before_ns = process_time_ns()
                simulation.step(self.steps)
                spent = process_time_ns() - before_ns
                last = self._last(simulation)
                simulation.terminate()
        self.chain.check("ecos", last, self.steps - self.chain.length + 1)
        return {"step_us": spent * 1e-3 / (self.steps * self.chain.length)}

    def _all(self) -> list[str]:
        return [
            f"{name}::{each.name}"
            for name, model in self.chain.members
            for each in model.variables()
            if not each.is_input
        ]

    def _last(self, simulation: Any) -> dict[str, float]:
        name, model = self.chain.members[-1]
        get = {
            "Real": simulation.get_real,
            "Integer": simulation.get_integer,
            "Boolean": simulation.get_bool,
        }
        return {
            each.name: get[each.type](f"{name}::{each.name}")
            for each in model.variables()
            if not each.is_input
        }
