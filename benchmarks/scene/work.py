"""What is measured, each in a process of its own."""

import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time_ns
from typing import Final

import numpy as np

from adapters.sumo import SumoTraffic, connection
from adapters.sumo.options import sumo_options
from adapters.sumo.parameters import TrafficParameters
from benchmarks.benchmark import Measurement
from benchmarks.scene.process import peak_mib
from orchestrator.recording import Recording
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from orchestrator.timebase import NANOSECONDS_PER_SECOND, nanoseconds

_SEED: Final = 1


@dataclass(slots=True)
class _Clock:
    """CPU time of this process, user and system [s]."""

    seconds: float = 0.0


@contextmanager
def _timed() -> Iterator[_Clock]:
    """Times the block."""
    clock, before = _Clock(), process_time_ns()
    yield clock
    clock.seconds = (process_time_ns() - before) / NANOSECONDS_PER_SECOND


def cpu_s() -> float:
    """CPU time of all threads of this process and of the processes that it started [s].

    Windows does not tell of the latter.
    """
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def run(path: Path, settings: Sequence[str], transport: str) -> Measurement:
    """Run a scenario, recorded.

    Args:
        path: of the scenario.
        settings: as `--set` takes them.
        transport: how components marked `process` are reached.

    Returns:
        `cpu_s`: CPU seconds of all cores, loading and recording included; `simulated_s`; `wall_s`:
        of the same; `loading_s`: the part of it before and after the run that `nlosim run` times;
        `radios`: mean number of vehicles that have one; `lidars`; `recorded_bytes`; `peak_mib`; and
        the wall time of each component, of recording (`recording_s`) and of the orchestrator.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        cpu, wall = cpu_s(), perf_counter()
        outcome = run_scenario(
            load_scenario(path, settings), out, transport=transport, figure=False
        )
        cpu, wall = cpu_s() - cpu, perf_counter() - wall
        recorded = sum(each.stat().st_size for each in out.rglob("*") if each.is_file())
        recording = Recording(out)
        radios = np.mean([np.count_nonzero(each) for each in recording["traffic.vehicle.equipped"]])
        lidars = np.mean([np.count_nonzero(each) for each in recording["traffic.vehicle.lidar"]])
    spent = outcome.wall_time
    return {
        "cpu_s": cpu,
        "simulated_s": outcome.simulated,
        "wall_s": wall,
        "loading_s": wall - spent.total,
        "radios": float(radios),
        "lidars": float(lidars),
        "recorded_bytes": recorded,
        **peak_mib(),
        **{f"{name}_s": spent_s for name, spent_s in spent.components.items()},
        "recording_s": spent.observers,
        "orchestrator_s": spent.orchestrator,
    }


def adapter(parameters: TrafficParameters, steps: int) -> Measurement:
    """Step the traffic component alone, and read its outputs.

    Args:
        parameters: of the component; nobody is driven.
        steps: of SUMO, after the one that populates the scene.

    Returns:
        `cpu_s`: CPU seconds of all steps, set-up excluded.
    """
    h = nanoseconds(parameters.step_length)
    with closing(SumoTraffic(parameters)) as traffic:
        traffic.setup(0, np.random.default_rng(_SEED))
        with _timed() as clock:
            for k in range(steps):
                traffic.step({}, k * h, h)
                traffic.outputs()
    return {"cpu_s": clock.seconds}


def sumo(parameters: TrafficParameters, steps: int) -> Measurement:
    """Step SUMO alone, by libsumo, with the options that the traffic component gives it.

    Args:
        parameters: of the component.
        steps: of SUMO, after the first.

    Returns:
        `cpu_s`: CPU seconds of all steps, set-up excluded.
    """
    seed = int(np.random.default_rng(_SEED).integers(2**31))
    options = [part for option in sumo_options(parameters, seed).items() for part in option]
    with closing(connection.start("libsumo", options)) as bare:
        bare.step()
        with _timed() as clock:
            for _ in range(steps):
                bare.step()
    return {"cpu_s": clock.seconds}
