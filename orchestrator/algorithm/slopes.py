"""How fast outputs change, where that is known."""

from collections.abc import Collection, Mapping

from orchestrator.algorithm.history import is_approximated
from orchestrator.capabilities import OutputSlopes
from orchestrator.component import Component
from orchestrator.signal import Connector, Signals


class KnownSlopes:
    """The slopes of the outputs of one component.

    Args:
        component: the one that knows them, or not.
        connectors: its own, by name.
    """

    __slots__ = ("_source", "_through")

    def __init__(self, component: Component, connectors: Mapping[str, Connector]) -> None:
        self._source = component.capability(OutputSlopes)  # type: ignore[type-abstract]
        self._through = {n: c.feedthrough for n, c in connectors.items() if is_approximated(c, c)}

    @property
    def continuous(self) -> Collection[str]:
        """The connectors whose real signals are continuous functions of time."""
        return self._through.keys()

    def now(self, held: frozenset[str]) -> Signals:
        """Those at the current communication point, by output.

        A component that does not know how an input changes takes it to be constant. The slopes of
        outputs with direct feedthrough from there would be wrong, and are left out.

        Args:
            held: inputs that change, and of which the component was not told how.
        """
        found = {} if self._source is None else self._source.slopes()
        return {n: slope for n, slope in found.items() if held.isdisjoint(self._through.get(n, ()))}
