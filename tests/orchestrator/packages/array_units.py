"""Components with arrays that tests of connections wire together."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.component import Component, RestorableComponent
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time


class Counting(Component):
    """`x[k]` is ten times the number of steps so far, plus k."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        size: int = parameter(4, minimum=1, doc="how many elements")
        unit: str = parameter("1", doc="of the elements")
        dtype: str = parameter("float64", doc="type of the elements")

    def __init__(self, parameters: Parameters) -> None:
        p = parameters
        self._connectors = {
            "x": Connector(causality=Causality.OUTPUT, shape=(p.size,), unit=p.unit, dtype=p.dtype),
            "n": Connector(causality=Causality.OUTPUT, unit=p.unit),
        }
        self._parameters = p
        self._steps = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._steps = 0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._steps += 1

    @override
    def outputs(self) -> Signals:
        p = self._parameters
        return {
            "x": (10 * self._steps + np.arange(p.size)).astype(p.dtype),
            "n": np.asarray(float(self._steps)),
        }


class Keeping(RestorableComponent[dict[str, np.ndarray[Any, Any]]]):
    """Shows what it has seen."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        size: int = parameter(4, minimum=1, doc="how many elements")
        unit: str = parameter("1", doc="of the elements")
        dtype: str = parameter("float64", doc="type of the elements")

    def __init__(self, parameters: Parameters) -> None:
        p = parameters
        start = np.full(p.size, -1).astype(p.dtype)
        scalar = np.asarray(-1.0)
        self._connectors = {
            "u": Connector(
                causality=Causality.INPUT, shape=(p.size,), unit=p.unit, dtype=p.dtype, start=start
            ),
            "v": Connector(causality=Causality.INPUT, unit=p.unit, start=scalar),
            "y": Connector(
                causality=Causality.OUTPUT,
                shape=(p.size,),
                unit=p.unit,
                dtype=p.dtype,
                feedthrough=frozenset({"u"}),
            ),
            "w": Connector(causality=Causality.OUTPUT, unit=p.unit, feedthrough=frozenset({"v"})),
        }
        self._seen: dict[str, np.ndarray[Any, Any]] = {"u": start, "v": scalar}

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        pass

    @override
    def initialise(self, inputs: Signals) -> None:
        self.step(inputs, 0, 0)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._seen = {name: np.array(value) for name, value in inputs.items()}

    @override
    def outputs(self) -> Signals:
        return {"y": self._seen["u"].copy(), "w": self._seen["v"].copy()}

    @override
    def save(self) -> dict[str, np.ndarray[Any, Any]]:
        return self._seen

    @override
    def restore(self, state: dict[str, np.ndarray[Any, Any]]) -> None:
        self._seen = state
