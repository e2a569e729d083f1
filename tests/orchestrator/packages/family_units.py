"""Units of several ego vehicles: a road that they share, and what drives one of them."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time

_IN, _OUT = Causality.INPUT, Causality.OUTPUT


class Road(Component):
    """Egos on a line, with a group of connectors for each."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        egos: tuple[str, ...] = parameter(doc="their names")
        caption: str = parameter("", doc="text")

    def __init__(self, parameters: Parameters) -> None:
        self._names = parameters.egos
        self._x = np.zeros(len(self._names))

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        each = [
            {
                f"{name}.id": Connector(causality=_OUT, dtype=np.int64),
                f"{name}.position": Connector(causality=_OUT, unit="m"),
                f"{name}.command": Connector(causality=_IN, unit="m/s"),
            }
            for name in self._names
        ]
        common = {
            "limit": Connector(causality=_OUT, unit="m/s"),
            "over": Connector(causality=_OUT, dtype=np.bool_),
        }
        return {key: value for group in (*each, common) for key, value in group.items()}

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = np.zeros(len(self._names))

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        speeds = [float(np.asarray(inputs[f"{name}.command"])) for name in self._names]
        self._x = self._x + np.array(speeds) * h / 1e9

    @override
    def outputs(self) -> Signals:
        found: dict[str, np.ndarray] = {
            "limit": np.array(9.0 - self._x.mean()),
            "over": np.array(bool(self._x.max() > 1e9)),
        }
        for number, name in enumerate(self._names):
            found[f"{name}.id"] = np.array(number)
            found[f"{name}.position"] = np.array(self._x[number])
        return found


class Driver(Component):
    """Drives one ego, with noise, below a limit."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        gain: float = parameter(1.0, unit="1/s", minimum=0.0, doc="speed per distance")
        plate: str = parameter("", doc="ends up in the message")

    def __init__(self, parameters: Parameters) -> None:
        self._p = parameters
        self._rng = np.random.default_rng(0)
        self._speed = 0.0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "ego.id": Connector(causality=_IN, dtype=np.int64),
            "ego.position": Connector(causality=_IN, unit="m"),
            "limit": Connector(causality=_IN, unit="m/s", start=np.array(1e9)),
            "wish": Connector(causality=_IN, unit="m/s"),
            "command": Connector(causality=_OUT, unit="m/s"),
            "message": Connector(causality=_OUT, dtype=None, mime_type="text/plain", start=b"-"),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng, self._speed = rng, 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        wanted = self._p.gain * float(np.asarray(inputs["ego.position"])) + self._rng.random()
        wanted += 0.01 * float(np.asarray(inputs["wish"]))
        self._speed = min(wanted, float(np.asarray(inputs["limit"])))

    @override
    def outputs(self) -> Signals:
        return {"command": np.array(self._speed), "message": self._p.plate.encode()}
