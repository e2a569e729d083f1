"""Runs that are cut off and gone on with, for the tests of checkpoints."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import PortableState
from orchestrator.component import Capability, Component
from orchestrator.observer import Observer, SimulationResult
from orchestrator.recording.recorder import Recorder
from orchestrator.resuming.continuation import Continuation, Settings, continuation_of
from orchestrator.resuming.keeper import Keeper
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time
from orchestrator.transformation import PLAIN

IN, OUT = Causality.INPUT, Causality.OUTPUT
MS = 1_000_000
S = 1000 * MS


class Noise(Component, PortableState):
    """y' = u + noise, with a text of any length beside it.

    Args:
        is_portable: whether its state can be saved.
    """

    connectors: Mapping[str, Connector] = {
        "u": Connector(causality=IN),
        "late": Connector(causality=IN),
        "y": Connector(causality=OUT),
        "many": Connector(causality=OUT, shape=("k",)),
        "text": Connector(causality=OUT, dtype=None, mime_type="application/x-test; version=1"),
    }

    def __init__(self, *, is_portable: bool = False) -> None:
        self._is_portable = is_portable
        self._rng = np.random.default_rng(0)
        self._count, self._y = 0, 0.0
        self.steps = 0

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        if kind is PortableState and not self._is_portable:
            return None
        return super().capability(kind)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng, self._count, self._y = rng, 0, 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self.steps += 1
        self._count += 1
        self._y += float(inputs["u"]) + float(inputs["late"]) / 3 + self._rng.random() - 0.5
        self._y *= 0.9

    @override
    def outputs(self) -> Signals:
        many = self._y * np.arange(self._count % 4)
        return {
            "y": np.array(self._y),
            "many": many,
            "text": bytes(self._count % 7) + many.tobytes(),
        }

    @override
    def dump(self) -> bytes:
        return json.dumps([self._rng.bit_generator.state, self._count, self._y]).encode()

    @override
    def load(self, content: bytes) -> None:
        self._rng.bit_generator.state, self._count, self._y = json.loads(content)


class Cut(Observer):
    """Ends a run at a time, as Ctrl-C does.

    Args:
        at: the time [ns].
    """

    sees_stretches = True

    def __init__(self, at: Time) -> None:
        self._at = at

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        if t >= self._at:
            raise KeyboardInterrupt

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def run(
    folder: Path,
    system: System,
    algorithm: CosimulationAlgorithm,
    stop: Time,
    *,
    every: Duration,
    cut: Time | None = None,
    continuation: Continuation | None = None,
    include: Sequence[str] = ("*",),
) -> tuple[str, SimulationResult]:
    """The fingerprint of a run, and its result; up to a cut, if there is one, with no result."""
    folder.mkdir(exist_ok=True)
    if continuation is not None:
        continuation.clear()
    Settings(
        every=every, transport=None, figure=False, page=False, hosts=None, default_measures=False
    ).write(folder)
    again = None if continuation is None else continuation.again
    recorder = Recorder(folder, include=include, again=again)
    found = None if continuation is None else continuation.found
    keeper = Keeper(folder, every, recorder, found)
    observers = [recorder] if cut is None else [recorder, Cut(cut)]
    result = simulate(
        system, algorithm, start=0, stop=stop, seed=3, observers=observers, checkpoints=keeper
    )
    return recorder.fingerprint, result


def cut_and_resumed(
    folder: Path,
    made: Callable[[], System],
    algorithm: CosimulationAlgorithm,
    stop: Time,
    *,
    every: Duration,
    cut: Time,
    include: Sequence[str] = ("*",),
) -> tuple[Continuation, str, SimulationResult]:
    """A run that is cut off, and gone on with."""
    try:
        run(folder, made(), algorithm, stop, every=every, cut=cut, include=include)
    except KeyboardInterrupt:
        pass
    else:
        raise AssertionError("the run was not cut off")
    continuation = continuation_of(folder, {})
    fingerprint, result = run(
        folder, made(), algorithm, stop, every=every, include=include, continuation=continuation
    )
    return continuation, fingerprint, result


def contents(folder: Path) -> Mapping[str, bytes]:
    """The bytes of every file of a recording."""
    signals = folder / "signals"
    return {
        str(path.relative_to(signals)): path.read_bytes()
        for path in sorted(signals.rglob("*"))
        if path.is_file()
    }


def link(source: str, target: str, **way: object) -> Connection:
    """A connection, with what happens on the way."""
    ends = [Endpoint(*each.split(".")) for each in (source, target)]
    return Connection(ends[0], ends[1], replace(PLAIN, **way))  # type: ignore[arg-type]


def one(*, is_portable: bool = True) -> System:
    """One component, every 10 ms."""
    return System({"a": Noise(is_portable=is_portable)}, {"a": 10 * MS}, [])


def interrupted(folder: Path) -> None:
    """A run of 1 s with checkpoints every 100 ms, cut off at 550 ms."""
    with pytest.raises(KeyboardInterrupt):
        run(folder, one(), Jacobi(), S, every=100 * MS, cut=550 * MS)
