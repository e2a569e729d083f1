"""Ours: components in processes, and the simulation loop."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
from typing_extensions import override

from benchmarks.distributed.participant import Participant
from benchmarks.distributed.ring import PARALLEL, Ring
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.remote.launching import launch
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Transport
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System

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
        with TemporaryDirectory() as folder:
            stamps = Path(folder) / "stamps.json"
            self._run(ring, steps, str(stamps))
            found: Sequence[int] = json.loads(stamps.read_text())
        return found

    def _run(self, ring: Ring, steps: int, stamps: str) -> None:
        names = [f"member-{number}" for number in range(ring.members)]
        specs = [
            ComponentSpec(
                name=name,
                type="benchmarks.distributed.member:Member",
                values={
                    "number": number,
                    "members": ring.members,
                    "size": ring.size,
                    "stamps": stamps if number == 0 else "",
                },
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
            )
            found = [np.asarray(result.values[name]["y"]) for name in names]
            right = [ring.is_last(number, value, steps) for number, value in enumerate(found)]
            ring.check(self.label, right, steps)
