"""What units read of components that the engine does not step."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from orchestrator.plan.memory import Outputs
from orchestrator.signal import Connector, Signal, Signals


class OutsideSources:
    """Outputs of one component that the engine does not step, as its units see them.

    Args:
        component: its name.
        names: of the outputs that units read.
        connectors: of the component.
        library: the engine.
    """

    def __init__(
        self,
        component: str,
        names: Sequence[str],
        connectors: Mapping[str, Connector],
        library: Any,
    ) -> None:
        own = {name: connectors[name] for name in names}
        self.outputs = Outputs(own, {name: fixed_shape(c) for name, c in own.items()})
        self._component = component
        self._library = library
        self._versions = np.zeros(len(names), np.uint64)
        self._row = {name: k for k, name in enumerate(names)}
        self._known: dict[str, Signal] = {}

    def version(self, name: str) -> int:
        """The address of the number that counts the values of an output."""
        return int(self._versions.ctypes.data) + 8 * self._row[name]

    def renew(self, values: Mapping[str, Signals]) -> None:
        """Take over what was published since."""
        for name, row in self._row.items():
            value = values[self._component][name]
            if value is not self._known.get(name):
                self._known[name] = value
                self.outputs.put(name, value, self._library)
                self._versions[row] += 1

    def release(self) -> None:
        """Free what the engine allocated."""
        self.outputs.release(self._library)


def fixed_shape(connector: Connector) -> tuple[int, ...]:
    """The shape of a signal without named axes."""
    return tuple(length for length in connector.shape if isinstance(length, int))
