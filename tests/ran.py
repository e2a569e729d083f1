"""What a run left, and whether another one left the same."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.errors import ComponentError
from orchestrator.observer import SimulationResult
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Time

MS = 1_000_000


@dataclass
class Ran:
    """What a run left."""

    fingerprint: str
    time: Time
    values: Mapping[str, Signals]
    error: str


def ran(
    system: System,
    algorithm: CosimulationAlgorithm,
    out: Path,
    *,
    compiled: bool,
    start: Time = 0,
    stop: Time = 180 * MS,
    **settings: Any,
) -> Ran:
    recorder = Recorder(out)
    results: list[SimulationResult] = []
    error = ""
    try:
        results.append(
            simulate(
                system, algorithm, start=start, stop=stop, seed=3,
                observers=[recorder], compiled=compiled, **settings,
            )
        )  # fmt: skip
    except ComponentError as found:
        error = str(found)
    time = results[0].time if results else -1
    return Ran(recorder.fingerprint, time, results[0].values if results else {}, error)


def check_equal(plain: Ran, compiled: Ran) -> None:
    assert plain.error == compiled.error
    assert plain.time == compiled.time
    assert plain.fingerprint == compiled.fingerprint
    for name, values in plain.values.items():
        for connector, value in values.items():
            other = compiled.values[name][connector]
            assert type(value) is type(other)
            np.testing.assert_array_equal(value, other)
            if isinstance(value, np.ndarray) and isinstance(other, np.ndarray):
                assert value.dtype == other.dtype
                assert not other.flags.writeable
