"""What one component reads: its inputs, from what others publish."""

from collections.abc import Mapping, Sequence
from typing import Any

from orchestrator.algorithm.mixing import MixedInput, MixSources
from orchestrator.signal import Causality, Connector, Signal, Signals
from orchestrator.system import Feed
from orchestrator.transformation import Mix


class Inputs:
    """The inputs of one component, and where they come from.

    Args:
        connectors: of the component, by name.

    Attributes:
        sources: the names of the components it reads.
        reads: component and name of each output that it reads.
        driven: the inputs that come from one or several of these.
        mixed: those that are made of outputs, where they do not arrive as they are.
    """

    __slots__ = ("_feeds", "_makers", "_starts", "driven", "mixed", "reads", "sources")

    def __init__(self, connectors: Mapping[str, Connector]) -> None:
        self.sources: frozenset[str] = frozenset()
        self.reads: frozenset[tuple[str, str]] = frozenset()
        self.driven: frozenset[str] = frozenset()
        self._starts = {
            input_: connector.start_value()
            for input_, connector in connectors.items()
            if connector.causality is Causality.INPUT
        }
        self._feeds: tuple[tuple[str, Signals, str], ...] = ()
        self._makers: tuple[str, ...] = ()
        self.mixed: tuple[MixedInput, ...] = ()

    def connect(self, feeds: tuple[Feed, ...], published: Mapping[str, Signals]) -> None:
        """Read the inputs in `feeds` from what the components `published`, from now on."""
        self.sources = frozenset(feed.component for feed in feeds)
        self.reads = frozenset((feed.component, feed.output) for feed in feeds)
        self.driven = frozenset(feed.input for feed in feeds)
        self._feeds = tuple((feed.input, published[feed.component], feed.output) for feed in feeds)
        self._makers = tuple(feed.component for feed in feeds)

    def mix(self, mixes: tuple[Mix, ...], sources: MixSources) -> None:
        """Make the inputs in `mixes` of what `sources` has, from now on; after `connect`."""
        self.sources = self.sources.union(*(mix.components for mix in mixes))
        self.reads = self.reads.union((t.component, t.output) for mix in mixes for t in mix.terms)
        self.driven = self.driven.union(mix.input for mix in mixes)
        self.mixed = tuple(MixedInput(mix, self._starts[mix.input], sources) for mix in mixes)

    def memory(self) -> list[Any]:
        """What was sampled, as `orchestrator.packing` takes it."""
        return [[each.held, each.held_from] for m in self.mixed for each in m.readings]

    def recall(self, memory: Sequence[Any]) -> None:
        """Know what `memory` told, in place of all else."""
        readings = [each for m in self.mixed for each in m.readings]
        for each, (held, held_from) in zip(readings, memory, strict=True):
            each.held, each.held_from = held, held_from

    def known(self) -> dict[str, Signal]:
        """The inputs now; those whose source has not published yet carry their start values."""
        inputs = self._starts.copy()
        for name, values, output in self._feeds:
            if output in values:
                inputs[name] = values[output]
        for mixed in self.mixed:
            inputs[mixed.input] = mixed.value()
        return inputs

    def foreseen(self, unpublished: Mapping[str, Signals]) -> dict[str, Signal]:
        """The inputs, with what some components are going to publish, by name; none is mixed."""
        inputs = self._starts.copy()
        for (name, values, output), maker in zip(self._feeds, self._makers, strict=True):
            inputs[name] = unpublished.get(maker, values)[output]
        return inputs

    def now(self) -> dict[str, Signal]:
        """The inputs, where every source has published."""
        inputs = self._starts.copy()
        for name, values, output in self._feeds:
            inputs[name] = values[output]
        for mixed in self.mixed:
            inputs[mixed.input] = mixed.value()
        return inputs
