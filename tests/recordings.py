"""Recordings that are made of samples."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.recording.reader import Recording
from orchestrator.recording.recorder import Recorder
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.testing import FunctionComponent


def output(*shape: int | str, **fields: Any) -> Connector:
    """An output of a shape."""
    return Connector(causality=Causality.OUTPUT, shape=shape, **fields)


def record(
    directory: Path,
    connectors: Mapping[str, Connector],
    samples: Sequence[Signals],
    *,
    component: str = "source",
    step: int = 100_000_000,
    manifest: Mapping[str, Any] | None = None,
) -> Recording:
    """A recording of `samples` of one component, `step` [ns] after each other."""
    source = FunctionComponent(connectors, lambda state, inputs, t: (None, samples[t // step]))
    system = System({component: source}, {component: step}, [])
    recorder = Recorder(directory, manifest=manifest or {})
    stop = (len(samples) - 1) * step
    simulate(system, Jacobi(), start=0, stop=stop, seed=0, observers=[recorder])
    return Recording(directory)
