"""No relay: the baseline of the paper's Table II."""

from collections.abc import Mapping

import numpy as np
from typing_extensions import override

from fmus.relay.connectors import CONNECTORS, OUTPUTS
from orchestrator.component import Component
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Duration, Time


class Direct(Component):
    """No relay: the sharer's data take the direct link to the ego."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._outputs = {name: output.start_value() for name, output in OUTPUTS.items()}

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        pass

    @override
    def outputs(self) -> Signals:
        return self._outputs
