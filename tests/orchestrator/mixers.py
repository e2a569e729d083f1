"""Nets of components in processes that mix what they are given, and do what they should not."""

import logging
import os
import signal
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import EndRequest, EndRequesting
from orchestrator.component import Component
from orchestrator.limits import Deadlines, Limits
from orchestrator.parameters import parameter
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import Transport
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from orchestrator.transformation import Transformation
from tests.ran import MS, Ran, ran

KINDS: Mapping[str, tuple[Any, tuple[int, ...]]] = {
    "scalar": (np.float64, ()),
    "table": (np.float32, (2, 3)),
    "counts": (np.int32, (4,)),
    "truths": (np.bool_, (3,)),
    "bytes": (np.uint8, (5,)),
    "none": (np.float64, (0,)),
}


class Mixer(Component, EndRequesting):
    """Mixes what it is given with noise; at one of its steps it does something else, its deed."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        deed: str = parameter("", doc="what it does")
        at: int = parameter(5, doc="at which step")
        pause: float = parameter(0.0, unit="s", doc="how long a step takes")
        log: Path = parameter(Path(), doc="where it notes when its steps begin and end")

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        self._count = 0
        self._request: EndRequest | None = None
        self._values: Any = {}

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            f"{name}_{side}": Connector(causality=causality, dtype=dtype, shape=shape)
            for side, causality in (("in", Causality.INPUT), ("out", Causality.OUTPUT))
            for name, (dtype, shape) in KINDS.items()
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng = rng
        self._count = 0
        self._values = {
            f"{name}_out": np.full(shape, 1, dtype) for name, (dtype, shape) in KINDS.items()
        }

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._count += 1
        begin = time.monotonic()
        if self._p.pause:
            time.sleep(self._p.pause)
        if self._p.log.name:
            with self._p.log.open("a") as log:
                log.write(f"{begin} {time.monotonic()}\n")
        found = {}
        for name, (dtype, shape) in KINDS.items():
            value = np.asarray(inputs[f"{name}_in"])
            assert value.dtype == dtype
            assert value.shape == shape
            assert not value.flags.writeable
            if dtype == np.bool_:
                found[f"{name}_out"] = value ^ (self._rng.integers(0, 2, shape) > 0)
            elif np.issubdtype(dtype, np.integer):
                found[f"{name}_out"] = (value + self._rng.integers(0, 9, shape)).astype(dtype)
            else:
                noise = self._rng.normal(size=shape)
                found[f"{name}_out"] = np.asarray(0.5 * value + noise + (t + 2 * h) * 1e-9, dtype)
        inputs.clear()  # type: ignore[attr-defined]  # they are its own
        self._values = found
        if self._count == self._p.at and self._p.deed:
            DEEDS[self._p.deed](self, t, h)

    @override
    def outputs(self) -> Signals:
        return self._values  # type: ignore[no-any-return]

    @property
    @override
    def end_request(self) -> EndRequest | None:
        return self._request

    def raise_error(self, t: Time, h: Duration) -> None:
        raise ValueError("there is no way")

    def give_nan(self, t: Time, h: Duration) -> None:
        self._values["table_out"][1, 2] = np.nan

    def give_shape(self, t: Time, h: Duration) -> None:
        self._values["counts_out"] = np.zeros(3, np.int32)

    def give_type(self, t: Time, h: Duration) -> None:
        self._values["table_out"] = np.zeros((2, 3))

    def give_float(self, t: Time, h: Duration) -> None:
        self._values["scalar_out"] = 1.0

    def give_less(self, t: Time, h: Duration) -> None:
        del self._values["bytes_out"]

    def give_more(self, t: Time, h: Duration) -> None:
        self._values["surprise"] = np.zeros(1)

    def give_list(self, t: Time, h: Duration) -> None:
        self._values = list(self._values.items())

    def give_view(self, t: Time, h: Duration) -> None:
        """Nothing wrong: a mapping that is no dictionary, an array that is not contiguous."""
        table = np.arange(6, dtype=np.float32).reshape(3, 2).T
        self._values = MappingProxyType({**self._values, "table_out": table})

    def log(self, t: Time, h: Duration) -> None:
        logging.getLogger("mixer").warning("at %d", t)

    def end(self, t: Time, h: Duration) -> None:
        self._request = EndRequest(time=t + h, why="enough")

    def end_within(self, t: Time, h: Duration) -> None:
        self._request = EndRequest(time=t + h // 2, why="too much")

    def leave(self, t: Time, h: Duration) -> None:
        os._exit(3)

    def die(self, t: Time, h: Duration) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def hang(self, t: Time, h: Duration) -> None:
        time.sleep(60)

    def rest(self, t: Time, h: Duration) -> None:
        """Nothing wrong: longer than the engine waits."""
        time.sleep(0.3)


IN_TURN = GaussSeidel(("m0", "m1", "m2"))
DEEDS = {name: getattr(Mixer, name) for name in (
    "raise_error", "give_nan", "give_shape", "give_type", "give_float", "give_less", "give_more",
    "give_list", "give_view", "log", "end", "end_within", "leave", "die", "hang", "rest",
)}  # fmt: skip


Members: TypeAlias = "list[tuple[bool, int, dict[str, Any]]]"


def in_memory() -> Transport:
    """Values are in memory that both processes see."""
    return LocalTransport()


def packed() -> Transport:
    """Values are in messages."""
    return LocalTransport(shares=False)


@dataclass
class Net:
    """Mixers: whether each is in a process of its own, its step [ms], and its parameters."""

    members: Members
    ways: list[Connection]

    def run(
        self,
        out: Path,
        *,
        elsewhere: bool = True,
        compiled: bool = True,
        stop: Time = 72 * MS,
        algorithm: Any = None,
        transport: Callable[[], Transport] = in_memory,
        limits: Mapping[str, Limits] = MappingProxyType({}),
        **settings: Any,
    ) -> Ran:
        specs = [
            ComponentSpec(name=f"m{k}", type=f"{__name__}:Mixer", values=values)
            for k, (is_remote, _, values) in enumerate(self.members)
            if is_remote and elsewhere
        ]
        with launch(specs, transport(), deadlines=Deadlines(step=1.0), limits=limits) as there:
            components = {
                f"m{k}": there.get(f"m{k}") or Mixer(Mixer.Parameters(**values))
                for k, (_, _, values) in enumerate(self.members)
            }
            sizes = {f"m{k}": step * MS for k, (_, step, _) in enumerate(self.members)}
            system = System(components, sizes, self.ways)
            return ran(system, algorithm or Jacobi(), out, compiled=compiled, stop=stop, **settings)


def link(source: int, target: int, kind: str, **way: Any) -> Connection:
    ends = Endpoint(f"m{source}", f"{kind}_out"), Endpoint(f"m{target}", f"{kind}_in")
    return Connection(*ends, Transformation(**way))
