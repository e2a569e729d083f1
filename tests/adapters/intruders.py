"""Those who should not take part in a run, and the runs in which they try."""

import json
from collections.abc import Callable, Mapping
from time import sleep
from types import ModuleType
from typing import Any

import zenoh
from typing_extensions import override

from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component
from orchestrator.observer import Observer, SimulationResult
from orchestrator.remote.launching import launch
from orchestrator.signal import Signals
from orchestrator.simulation import simulate
from orchestrator.system import System
from orchestrator.timebase import Time

STEPS = 12


def intruder(endpoint: str, **settings: Any) -> zenoh.Session:
    """A session of somebody else that connects to `endpoint`; its settings by their paths."""
    config = zenoh.Config()
    for path, value in {
        "mode": "client",
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,  # its segments outlive whoever opened them
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 300,
        **settings,
    }.items():
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


def host_of(transport: Any, component: str) -> zenoh.Session:
    """A second session with what the host of `component` knows."""
    path = "transport/auth/usrpwd"
    word = transport._rooms[component].passwords[component]
    known = {f"{path}/user": component, f"{path}/password": word}
    return intruder(transport.endpoint, **{"connect/timeout_ms": 20000, **known})


class Meddler(Observer):
    """Does something at each communication point, and gives it time to arrive."""

    def __init__(self, deed: Callable[[Time], None]) -> None:
        self._deed = deed

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self._deed(t)
        sleep(0.005)

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def run_beside(
    runs: ModuleType,
    specs: Any,
    transport: Any,
    meddling: Callable[[Mapping[str, Component]], Callable[[Time], None]],
) -> list[tuple[object, ...]]:
    """The bits of a run of swarms while somebody meddles.

    Args:
        runs: the module `remote_runs`.
        specs: of the swarms.
        transport: open while the run goes on.
        meddling: is given the components, and gives what is done at each communication point.
    """
    trace = runs.Trace()
    with launch(specs, transport) as components:
        meddler = Meddler(meddling(components))
        system = runs.swarm_system(components)
        simulate(
            system, Jacobi(), start=0, stop=STEPS * runs.STEP, seed=11, observers=[meddler, trace]
        )
    bits: list[tuple[object, ...]] = trace.bits
    return bits
