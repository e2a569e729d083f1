"""Components that other processes import by name, `remote_units:Swarm`."""

import ctypes
import json
import logging
import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.absence import Need, Undriven
from orchestrator.capabilities import (
    InitialEvaluation,
    PointEvaluation,
    PortableState,
    VariableSteps,
)
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import ComponentTypeError
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.timebase import Duration, Time

INPUT = Causality.INPUT
OUTPUT = Causality.OUTPUT


class Swarm(Component):
    """Particles that come and go, driven by a force and by noise."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        most: int = parameter(7, doc="particles at most")
        folder: Path = parameter(Path(), doc="ends up in the message")
        weights: tuple[float, ...] = parameter((1.0, 0.5), doc="of the two forces")

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        self._rng = np.random.default_rng(0)
        self._outputs: dict[str, Any] = {}
        self._last: object = None
        self._changes = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "force": Connector(
                causality=INPUT,
                shape=(2,),
                start=np.array([0.0, -0.0]),
                undriven=Undriven("they drift", Need.IF_OFFERED, frozenset({"scenery"})),
                parameter=("weights", 1),
            ),
            "scenery": Connector(causality=INPUT, dtype=np.float32, shape=("mark", 2)),
            "id": Connector(causality=OUTPUT, dtype=np.int64, shape=("particle",)),
            "position": Connector(causality=OUTPUT, shape=("particle", 2), unit="m"),
            "mean": Connector(causality=OUTPUT, feedthrough=frozenset({"force"})),
            "is_crowded": Connector(causality=OUTPUT, dtype=np.bool_),
            "message": Connector(causality=OUTPUT, dtype=None, mime_type="text/plain", start=b"-"),
            "landmark": Connector(causality=OUTPUT, dtype=np.float32, shape=("mark", 2)),
            "changes": Connector(causality=OUTPUT, dtype=np.int32),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng = rng
        self._last = None
        self._changes = 0
        self._outputs = {"landmark": np.ones((3, 2), np.float32)}

    @override
    def initialise(self, inputs: Signals) -> None:
        self._advance(inputs, 0)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._advance(inputs, t + h)

    @override
    def outputs(self) -> Signals:
        return self._outputs

    def _advance(self, inputs: Signals, t: Time) -> None:
        # a component that looks for unchanged objects must see the same ones everywhere
        if inputs["scenery"] is not self._last:
            self._last = inputs["scenery"]
            self._changes += 1
        count = int(self._rng.integers(0, self._p.most + 1))
        weighted = np.asarray(inputs["force"]) * np.array(self._p.weights)
        position = self._rng.normal(size=(2, count)).T + weighted  # not contiguous
        self._outputs = {
            "landmark": self._outputs["landmark"],
            "id": np.arange(count),
            "position": position,
            "mean": np.array(float(weighted.mean())),
            "is_crowded": np.array(count > 3),
            "message": f"{t} {self._p.folder}".encode(),
            "changes": np.array(self._changes, np.int32),
        }


class Echo(Component):
    """Returns what it is given."""

    def __init__(self) -> None:
        self._value: Any = np.zeros(0)

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "u": Connector(causality=INPUT, shape=("sample",)),
            "y": Connector(causality=OUTPUT, shape=("sample",)),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._value = np.zeros(0)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._value = inputs["u"]

    @override
    def outputs(self) -> Signals:
        return {"y": self._value}


class Reckless(Component):
    """Counts its steps until it does something a component should not do."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        deed: str = parameter("nothing", doc="one of `DEEDS`")
        at: int = parameter(3, doc="number of the step")
        where: str = parameter("step", doc="create, setup, step or close")
        pause: float = parameter(0.0, unit="s", doc="how long a step takes")

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        self._count = 0
        self._maybe("create")

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "trigger": Connector(causality=INPUT),
            "count": Connector(causality=OUTPUT, dtype=np.int64),
            "pid": Connector(causality=OUTPUT, dtype=np.int64),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._maybe("setup")

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._count += 1
        time.sleep(self._p.pause)
        if self._count == self._p.at:
            self._maybe("step")

    @override
    def outputs(self) -> Signals:
        if self._p.deed == "write_nonsense" and self._count == self._p.at:
            return {"count": np.array(self._count), "pid": 1.5}  # type: ignore[dict-item]
        return {"count": np.array(self._count), "pid": np.array(os.getpid())}

    @override
    def close(self) -> None:
        self._maybe("close")

    def _maybe(self, where: str) -> None:
        if where == self._p.where:
            DEEDS[self._p.deed]()


def _raise() -> None:
    raise ValueError("the moon is too bright")


def _refuse() -> None:
    raise ComponentTypeError("`most` and `least` contradict each other")


def _kill_itself() -> None:
    print("goodbye")  # noqa: T201
    os.kill(os.getpid(), signal.SIGKILL)


def _crash() -> None:
    ctypes.string_at(0)


def _hold_the_gil() -> None:
    ctypes.PyDLL(None).sleep(30)


def _log() -> None:
    logging.getLogger("reckless").warning("fuel is %s", "low")


def _leave_a_child() -> None:
    child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
    print(f"child {child.pid}", flush=True)  # noqa: T201


def _fork_and_quit() -> None:
    if os.fork() == 0:
        os.setsid()  # out of reach, with a copy of every descriptor but the output
        os.closerange(0, 3)
        time.sleep(15)
    os._exit(3)


def _hand_down() -> None:
    listing = ["ls", "-l", "/proc/self/fd"]
    if (
        b"socket"
        in subprocess.run(listing, close_fds=False, capture_output=True, check=False).stdout
    ):
        raise RuntimeError("a child has a socket of its parent")


def _have_no_segments() -> None:
    if ".zenoh" in Path("/proc/self/maps").read_text():
        raise RuntimeError("this process has shared memory of Zenoh, which outlives it")


def _read_input() -> None:
    sys.stdin.read()


DEEDS = {
    "nothing": lambda: None,
    "write_nonsense": lambda: None,
    "raise": _raise,
    "refuse": _refuse,
    "exit": lambda: sys.exit(3),
    "quit": lambda: os._exit(3),
    "kill_itself": _kill_itself,
    "crash": _crash,
    "freeze": lambda: os.kill(os.getpid(), signal.SIGSTOP),
    "sleep": lambda: time.sleep(30),
    "hold_the_gil": _hold_the_gil,
    "print": lambda: print("hello from the unit"),  # noqa: T201
    "log": _log,
    "leave_a_child": _leave_a_child,
    "fork_and_quit": _fork_and_quit,
    "close_all": lambda: os.closerange(3, 200),
    "hand_down": _hand_down,
    "have_no_segments": _have_no_segments,
    "read_input": _read_input,
}


class Drawing(RestorableComponent[tuple[dict[str, Any], float]]):
    """y = u / 2 + a random number."""

    def __init__(self) -> None:
        self._rng = np.random.default_rng(0)
        self._y = 0.0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        feedthrough = frozenset({"u"})
        return {
            "u": Connector(causality=INPUT),
            "y": Connector(causality=OUTPUT, feedthrough=feedthrough),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng, self._y = rng, 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._y = 0.5 * float(np.asarray(inputs["u"])) + self._rng.random()

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(self._y)}

    @override
    def save(self) -> tuple[dict[str, Any], float]:
        return dict(self._rng.bit_generator.state), self._y

    @override
    def restore(self, state: tuple[dict[str, Any], float]) -> None:
        self._rng.bit_generator.state, self._y = state


class Untried(Component):
    """y = u / 2, known at `initialise` and in a step only."""

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=INPUT),
        "y": Connector(causality=OUTPUT, feedthrough=frozenset({"u"})),
    }

    def __init__(self) -> None:
        self._y = 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._y = 0.0

    @override
    def initialise(self, inputs: Signals) -> None:
        self._y = 0.5 * float(np.asarray(inputs["u"]))

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self.initialise(inputs)

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(self._y)}


class Evaluated(Component, InitialEvaluation):
    """y = 1 - u / 2, also before it is initialised."""

    connectors: Mapping[str, Connector] = Untried.connectors

    def __init__(self) -> None:
        self._y = 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._y = 0.0

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return {"y": np.array(1 - 0.5 * float(np.asarray(inputs["u"])))}

    @override
    def initialise(self, inputs: Signals) -> None:
        self._y = float(np.asarray(self.evaluate(inputs)["y"]))

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self.initialise(inputs)

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(self._y)}


class Follower(RestorableComponent[float], VariableSteps):
    """y' = u - y / 2 from 1, by Euler, with any step; both are continuous."""

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=INPUT, variability=Variability.CONTINUOUS),
        "y": Connector(causality=OUTPUT, variability=Variability.CONTINUOUS),
    }

    def __init__(self) -> None:
        self._y = 1.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._y = 1.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._y += 1e-9 * h * (float(np.asarray(inputs["u"])) - 0.5 * self._y)

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(self._y)}

    @override
    def save(self) -> float:
        return self._y

    @override
    def restore(self, state: float) -> None:
        self._y = state


class Anew(Component, PointEvaluation):
    """x' = u / 4 - x by Euler, from 1; y = x - u / 2, at every time for every u."""

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=INPUT),
        "x": Connector(causality=OUTPUT),
        "y": Connector(causality=OUTPUT, feedthrough=frozenset({"u"})),
    }

    def __init__(self) -> None:
        self._x, self._u = 1.0, 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x, self._u = 1.0, 0.0

    @override
    def initialise(self, inputs: Signals) -> None:
        self._u = float(np.asarray(inputs["u"]))

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return {"x": np.array(self._x), "y": np.array(self._x - np.asarray(inputs["u"]) / 2)}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._u = float(np.asarray(inputs["u"]))
        self._x += 1e-9 * h * (0.25 * self._u - self._x)

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(self._x), "y": np.array(self._x - self._u / 2)}


class Lasting(Component, PortableState):
    """x' = u + noise; it kills itself in some steps, each time it comes there or once."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        marks: Path = parameter(Path(), doc="where it notes that it has killed itself")
        at: tuple[int, ...] = parameter((), doc="numbers of the steps")
        always: bool = parameter(False, doc="whether it does so again")
        forgets: bool = parameter(False, doc="whether it does not take up its sum again")

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=INPUT),
        "y": Connector(causality=OUTPUT),
    }

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        self._rng = np.random.default_rng(0)
        self._count, self._y = 0, 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng, self._count, self._y = rng, 0, 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._count += 1
        mark = self._p.marks / f"{self._count}"
        if self._count in self._p.at and (self._p.always or not mark.exists()):
            mark.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        self._y += float(np.asarray(inputs["u"])) + self._rng.random()

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(self._y)}

    @override
    def dump(self) -> bytes:
        return json.dumps([self._rng.bit_generator.state, self._count, self._y]).encode()

    @override
    def load(self, content: bytes) -> None:
        self._rng.bit_generator.state, self._count, total = json.loads(content)
        if not self._p.forgets:
            self._y = total


class Slow(Component):
    """Takes its time at the start."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        creating: float = parameter(0.0, unit="s", doc="how long it takes to be created")
        setting_up: float = parameter(0.0, unit="s", doc="how long it takes to be set up")

    connectors: Mapping[str, Connector] = {}

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        time.sleep(parameters.creating)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        time.sleep(self._p.setting_up)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        pass

    @override
    def outputs(self) -> Signals:
        return {}


class Steady(Component):
    """Gives the very same array in all steps of all runs, and what it was given."""

    connectors = {  # noqa: RUF012
        "u": Connector(causality=INPUT, shape=(2,)),
        "y": Connector(causality=OUTPUT, shape=(2,)),
        "seen": Connector(causality=OUTPUT, shape=(2,)),
    }
    _Y = np.array([3.0, 4.0])

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._seen = np.zeros(2)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._seen = np.array(inputs["u"])

    @override
    def outputs(self) -> Signals:
        return {"y": self._Y, "seen": self._seen}
