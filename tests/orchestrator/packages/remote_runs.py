"""Runs of the components in `remote_units`, for the tests of every transport."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from typing_extensions import override

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.limits import Deadlines
from orchestrator.observer import Observer, SimulationResult
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Transport
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Time

SWARM = "remote_units:Swarm"
RECKLESS = "remote_units:Reckless"
STEP = 10_000_000  # 10 ms


class Trace(Observer):
    """Keeps the bits of every value at every communication point, and what was seen last."""

    def __init__(self) -> None:
        self.bits: list[tuple[object, ...]] = []
        self.last: dict[str, Signals] = {}
        self.times: list[Time] = []

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.times.append(t)
        self.last = {name: dict(signals) for name, signals in values.items()}
        for name in sorted(values):
            for connector, value in sorted(values[name].items()):
                plain = value if isinstance(value, bytes) else (value.dtype, value.shape,
                                                                value.tobytes())  # fmt: skip
                self.bits.append((t, name, connector, plain))

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def swarms(folder: Path) -> list[ComponentSpec]:
    """Two swarms that push and see each other."""
    return [
        ComponentSpec(name="near", type=SWARM, values={"folder": folder, "most": 5}),
        ComponentSpec(name="far", type=SWARM, values={"weights": (0.1, 3e-300)}),
    ]


def swarm_system(components: Mapping[str, Component]) -> System:
    """`near` sees the landmarks of `far`, which never change, and its particles."""
    ends = [("near.landmark", "far.scenery"), ("far.landmark", "near.scenery")]
    return System(
        components,
        dict.fromkeys(components, STEP),
        [Connection(Endpoint.parse(a), Endpoint.parse(b)) for a, b in ends],
    )


def run_swarms(components: Mapping[str, Component], steps: int = 100) -> Trace:
    """The trace of a run of `swarm_system`."""
    trace = Trace()
    simulate(swarm_system(components), Jacobi(), start=0, stop=steps * STEP, seed=11,
             observers=[trace])  # fmt: skip
    return trace


def run_reckless(
    transport: Transport, steps: int = 6, deadlines: Deadlines | None = None, **values: Any
) -> Trace:
    """The trace of a run in which one component behaves and the other, `b`, does not."""
    specs = [
        ComponentSpec(name="a", type=RECKLESS, values={}),
        ComponentSpec(name="b", type=RECKLESS, values=values),
    ]
    trace = Trace()
    with launch(specs, transport, deadlines=deadlines) as components:
        system = System(components, dict.fromkeys(components, STEP), [])
        simulate(system, Jacobi(), start=0, stop=steps * STEP, seed=1, observers=[trace])
    return trace
