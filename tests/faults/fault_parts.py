"""Components that do something they should not do; scenarios of the campaign name this file."""

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from typing_extensions import override

from orchestrator.capabilities import PortableState
from orchestrator.component import Capability, Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time


class Part(Component, PortableState):
    """y = u / 2 + a random number; some noise beside it. What it does it does once."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        deed: str = parameter("none", doc="one of `DEEDS`, or `gate`")
        at: int = parameter(0, doc="number of the step in which it is done")
        folder: Path = parameter(Path(), doc="where a gate says that it is reached")
        has_child: bool = parameter(False, doc="start a process with a session of its own")
        busy: float = parameter(0.0, unit="s", doc="how long a step takes")
        is_portable: bool = parameter(False, doc="whether its state can be saved")

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT),
        "noise": Connector(causality=Causality.OUTPUT, shape=(100,)),
    }

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        self._count, self._y, self._noise = 0, 0.0, np.zeros(100)

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        if kind is PortableState and not self._p.is_portable:
            return None
        return super().capability(kind)

    @override
    def dump(self) -> bytes:
        state = [self._rng.bit_generator.state, self._count, self._y, self._noise.tolist()]
        return json.dumps(state).encode()

    @override
    def load(self, content: bytes) -> None:
        self._rng.bit_generator.state, self._count, self._y, noise = json.loads(content)
        self._noise = np.array(noise)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng = rng
        self._count, self._y, self._noise = 0, 0.0, np.zeros(100)
        if self._p.has_child:
            subprocess.Popen(["sleep", "300"], start_new_session=True)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._count += 1
        time.sleep(self._p.busy)
        done = self._p.folder / "done"
        if self._count == self._p.at and self._p.deed != "none" and not done.exists():
            done.touch()
            if self._p.deed == "gate":
                _wait_at(self._p.folder)
            else:
                DEEDS[self._p.deed]()
        self._y = 0.5 * float(np.asarray(inputs["u"])) + self._rng.random()
        self._noise = self._rng.normal(size=100)

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(self._y), "noise": self._noise}


def _wait_at(folder: Path) -> None:
    (folder / "reached").touch()
    until = time.monotonic() + 25
    while not (folder / "go").exists() and time.monotonic() < until:
        time.sleep(0.005)


def _raise() -> None:
    raise ValueError("the moon is too bright")


def _flood() -> None:
    for _ in range(100):
        sys.stdout.write("The same procedure as every year.\n" * 3000)


def _cut() -> None:
    """Shut down every connection that this process has."""
    for entry in list(Path("/proc/self/fd").iterdir()):
        with suppress(OSError):
            connection = socket.socket(fileno=os.dup(int(entry.name)))
            with connection:
                connection.shutdown(socket.SHUT_RDWR)


DEEDS = {
    "none": lambda: None,
    "raise": _raise,
    "kill": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "crash": lambda: ctypes.string_at(0),
    "quit": lambda: os._exit(3),
    "hang": lambda: time.sleep(300),
    "hold": lambda: ctypes.PyDLL(None).sleep(300),
    "stop": lambda: os.kill(os.getpid(), signal.SIGSTOP),
    "flood": _flood,
    "cut": _cut,
}
