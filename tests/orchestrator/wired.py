"""Two components of `packages/array_units.py`, wired by a scenario file, and what came of it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.errors import ScenarioError
from orchestrator.observer import Observer, SimulationResult
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.wiring import assemble
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Time

HEAD = """\
schema: 1
title: Wired
time: {stop: 1 s}
coupling: {algorithm: ALGORITHM}
components:
  a: {type: counting, step: STEP_A, parameters: {A}}
  b: {type: keeping, step: STEP_B, parameters: {B}}
connections:
"""
FIRST_LINE = HEAD.count("\n") + 1
"""The line of the first connection."""


def wired(
    folder: Path,
    *connections: str,
    a: str = "",
    b: str = "",
    steps: tuple[str, str] = ("100 ms", "100 ms"),
    algorithm: str = "gauss-seidel",
) -> Path:
    """A scenario file with these entries of `connections`."""
    text = (
        HEAD.replace("ALGORITHM", algorithm).replace("{A}", f"{{{a}}}").replace("{B}", f"{{{b}}}")
    )
    text = text.replace("STEP_A", steps[0]).replace("STEP_B", steps[1])
    path = folder / "wired.yaml"
    path.write_text(text + "".join(f"  - {each}\n" for each in connections))
    return path


class _Watch(Observer):
    """Keeps what `b` shows at every communication point of its own."""

    def __init__(self, output: str) -> None:
        self.values: list[Any] = []
        self._output = output

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        if "b" in published:
            self.values.append(values["b"][self._output])

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def seen(path: Path, output: str = "y") -> np.ndarray[Any, Any]:
    """What `b` showed at its communication points: `y` of what comes to `u`, `w` to `v`.

    Returns:
        Shape (point, ...).
    """
    scenario = load_scenario(path)
    assembly = assemble(scenario)
    watch = _Watch(output)
    simulate(
        assembly.system,
        assembly.algorithm,
        start=scenario.start,
        stop=scenario.stop,
        seed=1,
        observers=[watch],
    )
    return np.array(watch.values)


def refused(path: Path) -> list[str]:
    """The problems of a scenario: line, and what is wrong."""
    with pytest.raises(ScenarioError) as error:
        assemble(load_scenario(path)).close()
    return [f"{p.where.line}: {p.what}" for p in error.value.problems]
