"""Two cheap components of the area `soak`: values that stay finite for any number of steps."""

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time


class Lag(Component):
    """A first-order lag of its input, driven by noise of its own."""

    @property
    @override
    def connectors(self) -> dict[str, Connector]:
        return {
            "u": Connector(causality=Causality.INPUT),
            "x": Connector(causality=Causality.OUTPUT),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng = rng
        self._x = 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._x += 0.01 * (float(inputs["u"]) - 2 * self._x + self._rng.random())

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(self._x)}
