"""`check_component` passes what keeps the contract and catches each way of breaking it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.component import ConcurrentComponent, RestorableComponent
from orchestrator.errors import ComponentError
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.testing import FunctionComponent, check_component
from orchestrator.timebase import Duration, Time


class Walk(RestorableComponent[Any], ConcurrentComponent):
    """A random walk that keeps the contract, but for one `sin`."""

    def __init__(self, sin: str = "none") -> None:
        self._sin = sin
        self._rng = np.random.default_rng(0)
        self._place = np.zeros(2)
        self._work: tuple[Signals, Time, Duration] = ({}, 0, 0)
        self._closed = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "wind": Connector(causality=Causality.INPUT, shape=(2,), unit="m/s"),
            "place": Connector(causality=Causality.OUTPUT, shape=(2,), unit="m"),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        if self._sin != "own randomness":
            self._rng = rng
        if self._sin != "remembers":
            self._place = np.zeros(2)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        wind = np.asarray(inputs["wind"])
        if self._sin == "writes to input":
            wind.flags.writeable = True
            wind += 1.0
        moved = self._place + wind + self._rng.normal(size=2)
        if self._sin == "reuses array":
            self._place[:] = moved
        else:
            self._place = moved

    @override
    def outputs(self) -> Signals:
        if self._sin == "draws in outputs":
            self._rng.random()
        if self._sin == "reuses array":
            return {"place": self._place[:]}
        if self._sin == "wrong type":
            return {"place": self._place.astype(np.float32)}
        return {"place": self._place}

    @override
    def save(self) -> Any:
        generator = None if self._sin == "forgets generator" else self._rng.bit_generator.state
        return self._place, generator

    @override
    def restore(self, state: Any) -> None:
        self._place, generator = state
        if generator is not None:
            self._rng.bit_generator.state = generator

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._work = (inputs, t, h)

    @override
    def finish_step(self) -> None:
        if self._sin != "does not finish":
            self.step(*self._work)

    @override
    def close(self) -> None:
        self._closed += 1
        if self._sin == "closes once" and self._closed % 2 == 0:
            raise RuntimeError("closed already")


def gust(t: Time) -> Signals:
    return {"wind": np.array([1.0, t * 1e-9])}


def test_a_component_that_keeps_the_contract_passes() -> None:
    check_component(Walk())
    check_component(Walk(), steps=5, h=1, seed=3, inputs=gust)


@pytest.mark.parametrize(
    ("sin", "message"),
    [
        ("own randomness", "at t = 0.1 s: output `place` differs between two runs with seed 0"),
        ("remembers", "at t = 0 s: output `place` differs between two runs with seed 0"),
        ("writes to input", "at t = 0 s: wrote to its input `wind`"),
        ("reuses array", "at t = 0 s: changed an array it had handed out, `place`"),
        ("draws in outputs", "output `place` changes when `outputs` is called more often"),
        ("wrong type", "at t = 0 s: output `place` is float32[2], declared float64[2]"),
        ("forgets generator", "at t = 0.1 s: output `place` differs after `restore`"),
        ("does not finish", "at t = 0.1 s: output `place` differs with `begin_step`"),
    ],
)
def test_each_sin_is_caught(sin: str, message: str) -> None:
    with pytest.raises(ComponentError) as error:
        check_component(Walk(sin), inputs=gust)
    assert str(error.value).startswith("component `Walk` at t = ")
    assert message in str(error.value)


def test_closing_twice_must_be_harmless() -> None:
    with pytest.raises(RuntimeError, match="closed already"):
        check_component(Walk("closes once"))


def test_a_function_component_keeps_the_contract() -> None:
    connectors = {
        "u": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
    }

    def total(state: float, inputs: Signals, t: Time) -> tuple[float, Signals]:
        state += float(np.asarray(inputs["u"])) + t
        return state, {"y": np.array(state)}

    check_component(
        FunctionComponent(connectors, total, state=1.0), inputs=lambda t: {"u": np.array(0.5)}
    )
