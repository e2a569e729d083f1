"""Ours: components in processes, and the simulation loop."""

from collections.abc import Callable, Mapping, Sequence
from time import perf_counter_ns
from typing import Final

import numpy as np
from typing_extensions import override

from benchmarks.distributed.participant import Participant
from benchmarks.distributed.ring import PARALLEL, Ring
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.observer import Observer, SimulationResult
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Transport
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Time

_STEP: Final = 10_000_000
"""Communication step size of all members [ns]."""


class Ours(Participant):
    """`simulate` with every member in a process of its own.

    Args:
        label: what it is called.
        transport: makes the transport.
    """

    def __init__(self, label: str, transport: Callable[[], Transport]) -> None:
        self.label = label
        self._transport = transport

    @override
    def stamps(self, ring: Ring, steps: int) -> Sequence[int]:
        watch = _Watch()
        names = [f"member-{number}" for number in range(ring.members)]
        specs = [
            ComponentSpec(
                name=name,
                type="benchmarks.distributed.member:Member",
                values={"number": number, "members": ring.members, "size": ring.size},
            )
            for number, name in enumerate(names)
        ]
        ways = [
            Connection(Endpoint(names[number - 1], "y"), Endpoint(names[number], "u"))
            for number in range(ring.members)
        ]
        algorithm = Jacobi() if ring.algorithm == PARALLEL else GaussSeidel(tuple(names))
        with launch(specs, self._transport()) as members:
            result = simulate(
                System(members, dict.fromkeys(names, _STEP), ways),
                algorithm,
                start=0,
                stop=steps * _STEP,
                seed=0,
                observers=[watch],
            )
            found = [np.asarray(result.values[name]["y"]) for name in names]
            right = [ring.is_last(number, value, steps) for number, value in enumerate(found)]
            ring.check(self.label, right, steps)
        return watch.stamps


class _Watch(Observer):
    """Notes when each communication point is reached."""

    def __init__(self) -> None:
        self.stamps: list[int] = []

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.stamps.append(perf_counter_ns())

    @override
    def end(self, result: SimulationResult) -> None:
        pass
