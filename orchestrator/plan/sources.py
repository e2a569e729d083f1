"""Where units find the outputs that they read: in other units, or brought in from outside."""

import abc
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np

from orchestrator.algorithm.mixing import MixSources
from orchestrator.plan import layouts
from orchestrator.plan.outside import OutsideSources
from orchestrator.signal import Signals
from orchestrator.system import System


class Readable(abc.ABC):
    """A unit as others read it."""

    @abc.abstractmethod
    def source(self, output: str) -> layouts.Source:
        """A published output, as the engine finds it."""

    @abc.abstractmethod
    def past(self, output: str) -> layouts.Past:
        """What an output showed lately."""

    @abc.abstractmethod
    def shape(self, output: str) -> tuple[int, ...]:
        """The shape of an output, over the whole run."""


class Sources:
    """Where units find outputs.

    Args:
        system: all components.
        units: what the engine steps, by name.
        mixing: what mixed inputs see, with the past of outputs.
        library: the engine.
    """

    def __init__(
        self, system: System, units: Mapping[str, Readable], mixing: MixSources, library: Any
    ) -> None:
        read: defaultdict[str, dict[str, None]] = defaultdict(dict)
        for name in units:
            ends = [(feed.component, feed.output) for feed in system.feeds[name]]
            ends += [(t.component, t.output) for mix in system.mixes[name] for t in mix.terms]
            for component, output in ends:
                if component not in units:
                    read[component][output] = None
        self._system = system
        self._units = units
        self._outside = {
            name: OutsideSources(
                component=name,
                names=list(outputs),
                connectors=system.connectors[name],
                step_size=system.step_sizes[name],
                histories={output: mixing.history(name, output) for output in outputs},
                library=library,
            )
            for name, outputs in read.items()
        }

    def of(self, component: str, output: str) -> layouts.Source:
        """An output, as the engine finds it."""
        if component in self._outside:
            return self._outside[component].source(output)
        return self._units[component].source(output)

    def past(self, component: str, output: str) -> layouts.Past:
        """What an output showed lately."""
        if component in self._outside:
            return self._outside[component].past(output)
        return self._units[component].past(output)

    def shape(self, component: str, output: str) -> tuple[int, ...]:
        """The shape of an output, over the whole run."""
        if component in self._outside:
            return self._outside[component].outputs.places[output].shape
        return self._units[component].shape(output)

    def dtype(self, component: str, output: str) -> "np.dtype[Any]":
        """The element type of an output."""
        return np.dtype(self._system.connectors[component][output].dtype)

    def renew(self, values: Mapping[str, Signals]) -> None:
        """Bring in what was published since the last stretch."""
        for each in self._outside.values():
            each.renew(values)

    def release(self) -> None:
        """Free what the engine allocated."""
        for each in self._outside.values():
            each.release()
