"""Outputs that nobody looks at stay in the process of a component that can leave them out."""

import json
import os
import signal
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import OutputSelection, PortableState
from orchestrator.component import Component
from orchestrator.limits import Limits, OnFailure
from orchestrator.observer import Observer, SimulationResult
from orchestrator.parameters import parameter
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport, Transport
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.stretch import Stretch
from orchestrator.system import Endpoint, System
from orchestrator.timebase import Duration, Time

STEP = 10_000_000


class Pair(Component, OutputSelection, PortableState):
    """A number, and a thousand others, which are no numbers in the middle of a run."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        mark: Path = parameter(Path("nowhere"), doc="a folder; if it is empty, it dies once")

    connectors: Mapping[str, Connector] = {
        "one": Connector(causality=Causality.OUTPUT),
        "many": Connector(causality=Causality.OUTPUT, shape=(1000,)),
    }

    def __init__(self, parameters: Parameters) -> None:
        self._mark = parameters.mark
        self._names: Collection[str] | None = None
        self._steps = 0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._steps = 0

    @override
    def initialise(self, inputs: Signals) -> None:
        pass

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._steps += 1
        if self._steps == 5 and self._mark.is_dir() and not any(self._mark.iterdir()):
            (self._mark / "dead").touch()
            os.kill(os.getpid(), signal.SIGKILL)

    @override
    def outputs(self) -> Signals:
        many = np.full(1000, np.nan if 3 <= self._steps <= 7 else float(self._steps))
        found = {"one": np.array(float(self._steps)), "many": many}
        return {n: v for n, v in found.items() if self._names is None or n in self._names}

    @override
    def select(self, names: Collection[str] | None) -> None:
        self._names = names

    @override
    def dump(self) -> bytes:
        return json.dumps(self._steps).encode()

    @override
    def load(self, content: bytes) -> None:
        self._steps = json.loads(content)


class Wanting(Observer):
    """Looks at the one number."""

    sees_stretches = True

    def __init__(self) -> None:
        self.seen: list[float] = []

    @override
    def wants(self, system: System) -> Collection[Endpoint]:
        return [Endpoint("pair", "one")]

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.seen.append(float(np.asarray(values["pair"]["one"])))

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        rows = stretch.samples["pair"].rows
        assert list(rows) == ["one"]
        self.seen += np.frombuffer(rows["one"].data).tolist()

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def ran(components: Mapping[str, Component], algorithm: Any) -> tuple[list[float], Signals]:
    system = System(components, dict.fromkeys(components, STEP), [])
    wanting = Wanting()
    result = simulate(system, algorithm, start=0, stop=10 * STEP, seed=1, observers=[wanting])
    return wanting.seen, result.values["pair"]


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()], ids=["jacobi", "gauss-seidel"])
@pytest.mark.parametrize("transport", [LoopbackTransport, LocalTransport])
def test_what_nobody_looks_at_is_neither_sent_nor_checked_and_there_at_the_end(
    transport: type[Transport], algorithm: Any, lengths: list[int]
) -> None:
    """As in this process: 8 kB in the reply to the start, to the choice of all, and no other."""
    here = ran({"pair": Pair(Pair.Parameters())}, algorithm)
    spec = ComponentSpec(name="pair", type=f"{__name__}:Pair", values={})
    with launch([spec], transport()) as components:
        seen, values = ran(components, algorithm)
    assert seen == here[0] == [float(step) for step in range(11)]
    assert sum(length > 8000 for length in lengths) == 2
    assert values.keys() == here[1].keys() == {"one", "many"}
    assert np.asarray(values["many"]).tolist() == [10.0] * 1000


def test_one_that_is_started_again_leaves_out_the_same(tmp_path: Path, lengths: list[int]) -> None:
    spec = ComponentSpec(name="pair", type=f"{__name__}:Pair", values={"mark": tmp_path})
    limits = {"pair": Limits(on_failure=OnFailure.RESTART)}
    with launch([spec], LocalTransport(), limits=limits) as components:
        seen, values = ran(components, Jacobi())
    assert [path.name for path in tmp_path.iterdir()] == ["dead"]
    assert seen == [float(step) for step in range(11)]
    assert sum(length > 8000 for length in lengths) == 3  # it is started twice
    assert np.asarray(values["many"]).tolist() == [10.0] * 1000
