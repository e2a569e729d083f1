"""Our importer, with its recorder."""

import tempfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from time import process_time_ns

import numpy as np
from typing_extensions import override

from adapters.fmi import FmuComponentType
from benchmarks.benchmark import Case, Measurement
from benchmarks.importer.chain import STEP_NS, Chain
from benchmarks.importer.model import fmu
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.observer import Observer, SimulationResult
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.stretch import Stretch
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Time


class Stopwatch(Observer):
    """Reads the CPU time at the first communication point, at the last, and around the end.

    FMUs are unloaded between the last point and the end; that is no part of what it adds up.

    Args:
        watched: the recorder, or nobody.

    Attributes:
        recording_ns: CPU time of the recorder, its beginning left out [ns].
    """

    sees_stretches = True

    def __init__(self, watched: Observer) -> None:
        self._watched = watched
        self._began: int | None = None
        self._latest = 0
        self.recording_ns = 0
        self._end_ns = 0

    @property
    def spent_ns(self) -> int:
        """From the first point to the last, and of the end [ns]."""
        return self._latest - (self._began or 0) + self._end_ns

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        self._watched.begin(system, start, stop)

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        before = process_time_ns()
        if self._began is None:
            self._began = before
        self._watched.observe(t, published, values)
        self._count(before)

    @override
    def wants(self, system: System) -> Collection[Endpoint]:
        return self._watched.wants(system)

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        before = process_time_ns()
        self._watched.observe_stretch(stretch)
        self._count(before)

    @override
    def end(self, result: SimulationResult) -> None:
        before = process_time_ns()
        self._watched.end(result)
        self._end_ns = process_time_ns() - before
        self.recording_ns += self._end_ns

    def _count(self, before: int) -> None:
        self._latest = process_time_ns()
        self.recording_ns += self._latest - before


def system_of(chain: Chain) -> System:
    """The chain as components."""
    types = {model: FmuComponentType(fmu(model)) for model in {m for _, m in chain.members}}
    components = {name: types[model].create(name, {}) for name, model in chain.members}
    connections = [
        Connection(Endpoint(before, output.name), Endpoint(after, input_.name))
        for before, output, after, input_ in chain.wires
    ]
    return System(components, dict.fromkeys(components, STEP_NS), connections)


@dataclass(frozen=True, slots=True, kw_only=True)
class OursRun(Case):
    """Gauss-Seidel in the order of the chain, all outputs recorded to disk.

    Attributes:
        chain: of FMUs.
        steps: communication steps.
        compiled: let compiled code step the FMUs.
    """

    chain: Chain
    steps: int
    compiled: bool

    @override
    def measure(self) -> Measurement:
        """Run once.

        Returns:
            `step_us`: CPU time of a step of one FMU; of this `recording_us` in the recorder.
        """
        system = system_of(self.chain)
        algorithm = GaussSeidel(tuple(system.components))
        with tempfile.TemporaryDirectory() as folder:
            watch = Stopwatch(Recorder(Path(folder)))
            result = simulate(
                system, algorithm, start=0, stop=self.steps * STEP_NS, seed=0, observers=[watch],
                compiled=self.compiled,
            )  # fmt: skip
        values = result.values[self.chain.members[-1][0]]
        last = {name: np.asarray(value).item() for name, value in values.items()}
        self.chain.check("nlosim", last, self.steps)
        each = 1e-3 / (self.steps * self.chain.length)
        return {"step_us": watch.spent_ns * each, "recording_us": watch.recording_ns * each}
