"""What units read of components that the engine does not step."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from orchestrator.algorithm.mixing import PastValues
from orchestrator.plan import layouts
from orchestrator.plan.memory import Outputs
from orchestrator.plan.past import Past
from orchestrator.signal import Connector, Signal, Signals
from orchestrator.timebase import StepSize


class OutsideSources:
    """Outputs of one component that the engine does not step, as its units see them.

    Args:
        component: its name.
        names: of the outputs that units read.
        connectors: of the component.
        step_size: of the component [ns].
        histories: the past of these outputs, where somebody asks for it.
        library: the engine.
    """

    def __init__(
        self,
        *,
        component: str,
        names: Sequence[str],
        connectors: Mapping[str, Connector],
        step_size: StepSize,
        histories: Mapping[str, PastValues | None],
        library: Any,
    ) -> None:
        own = {name: connectors[name] for name in names}
        self.outputs = Outputs(own, {name: fixed_shape(c) for name, c in own.items()})
        self._component = component
        self._library = library
        self._versions = np.zeros(len(names), np.uint64)
        self._row = {name: k for k, name in enumerate(names)}
        self._known: dict[str, Signal] = {}
        self._pasts: dict[str, Past] = {}
        for name, history in histories.items():
            if history is not None:
                place = self.outputs.places[name]
                source = self.source(name)
                self._pasts[name] = Past(history, source, step_size, place.dtype, place.shape)

    def past(self, name: str) -> layouts.Past:
        """What an output showed lately."""
        return self._pasts[name].table

    def source(self, name: str) -> layouts.Source:
        """An output, as the engine finds it."""
        return self.outputs.source(name, int(self._versions.ctypes.data) + 8 * self._row[name])

    def renew(self, values: Mapping[str, Signals]) -> None:
        """Take over what was published since."""
        for name, row in self._row.items():
            value = values[self._component][name]
            if value is not self._known.get(name):
                self._known[name] = value
                self.outputs.put(name, value, self._library)
                self._versions[row] += 1
        for past in self._pasts.values():
            past.enter()

    def release(self) -> None:
        """Free what the engine allocated."""
        self.outputs.release(self._library)


def fixed_shape(connector: Connector) -> tuple[int, ...]:
    """The shape of a signal without named axes."""
    return tuple(length for length in connector.shape if isinstance(length, int))
