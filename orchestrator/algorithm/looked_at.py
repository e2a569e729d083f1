"""Which outputs anybody looks at: those that are connected, observed, or end the run."""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from contextlib import suppress

from orchestrator.algorithm.outputs import OutputCheck
from orchestrator.capabilities import OutputSelection
from orchestrator.component import Component
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.system import Endpoint, System


def looked_at(
    system: System, observed: Iterable[Endpoint], until: Endpoint | None
) -> Mapping[str, frozenset[str]]:
    """The outputs of each component that somebody looks at in a run.

    Args:
        system: the components and connections.
        observed: what observers want.
        until: what ends the run.
    """
    found: defaultdict[str, set[str]] = defaultdict(set)
    ends = [*observed, *(link.source for link in system.connections), *([until] if until else [])]
    for end in ends:
        found[end.component].add(end.connector)
    return {name: frozenset(found[name]) for name in system.components}


class LookedAt:
    """Those of the outputs of one component that are looked at, and checked: at first all.

    Args:
        component: whose outputs.
        connectors: of the component.

    Attributes:
        problems: see `OutputCheck.problems`.
    """

    __slots__ = ("_component", "_outputs", "_selection", "problems")

    def __init__(self, component: Component, connectors: Mapping[str, Connector]) -> None:
        self._component = component
        self._outputs = {n: c for n, c in connectors.items() if c.causality is Causality.OUTPUT}
        self._selection: OutputSelection | None = None
        self.problems = OutputCheck(connectors).problems

    def narrow(self, names: Collection[str]) -> frozenset[str]:
        """Look at these only, if the component can leave the others out; what is left."""
        kept = {name: c for name, c in self._outputs.items() if name in names}
        if len(kept) < len(self._outputs):
            self._selection = self._component.capability(OutputSelection)  # type: ignore[type-abstract]
            if self._selection is not None:
                self._selection.select(kept.keys())
                self._outputs, self.problems = kept, OutputCheck(kept).problems
        return frozenset(self._outputs)

    def rest(self) -> Signals:
        """All outputs as they are now, where some were left out; nothing otherwise.

        They are not checked. Nobody looked at them, so what goes wrong is no error of the run.
        """
        if self._selection is None:
            return {}
        with suppress(Exception):
            self._selection.select(None)
            return self._component.outputs()
        return {}
