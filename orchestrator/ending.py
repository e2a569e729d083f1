"""When a run ends before its stop time: an output says so, or a component asks for it."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.early_end import EarlyEnd
from orchestrator.errors import SystemStructureError
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.suggestion import suggestion
from orchestrator.system import Endpoint
from orchestrator.timebase import Time, seconds


class Ending(abc.ABC):
    """What ends a run early, but for requests of components."""

    @abc.abstractmethod
    def is_reached(self, values: Mapping[str, Signals]) -> bool:
        """Whether the run ends at this communication point, at which `values` are published."""

    @abc.abstractmethod
    def early_end(self, reached: Time) -> EarlyEnd | None:
        """Why it ended at `reached` [ns]; `None` if it is not because of this."""


@dataclass(frozen=True, slots=True)
class NotEarly(Ending):
    """Nothing: the run ends at its stop time."""

    @override
    def is_reached(self, values: Mapping[str, Signals]) -> bool:
        return False

    @override
    def early_end(self, reached: Time) -> EarlyEnd | None:
        return None


@dataclass(frozen=True, slots=True)
class WhenTrue(Ending):
    """A Boolean output that is true.

    Attributes:
        until: the output.
    """

    until: Endpoint

    @override
    def is_reached(self, values: Mapping[str, Signals]) -> bool:
        return bool(values[self.until.component][self.until.connector])

    @override
    def early_end(self, reached: Time) -> EarlyEnd | None:
        text = f"`{self.until}` is true at t = {seconds(reached):.9g} s"
        return EarlyEnd(by=(str(self.until),), text=text)


def ending(components: Mapping[str, Component], until: Endpoint | None) -> Ending:
    """What ends a run of `components` early: the output `until`, if one is given.

    Raises:
        SystemStructureError: `until` is no such output.
    """
    if until is None:
        return NotEarly()
    problem = ending_problem(components, until)
    if problem is not None:
        raise SystemStructureError([f"cannot run until `{until}`: {problem}"])
    return WhenTrue(until)


def ending_problem(components: Mapping[str, Component], until: Endpoint) -> str | None:
    """Why a run of `components` cannot end when `until` is true; `None` if it can."""
    if until.component not in components:
        hint = suggestion(until.component, components)
        return f"there is no component `{until.component}`; {hint}"
    connectors = components[until.component].connectors
    suitable = [name for name, connector in connectors.items() if _is_suitable(connector)]
    if until.connector not in connectors:
        hint = suggestion(until.connector, suitable or connectors)
        return f"`{until.component}` has no connector `{until.connector}`; {hint}"
    if until.connector in suitable:
        return None
    connector = connectors[until.connector]
    names = ", ".join(f"`{until.component}.{name}`" for name in suitable)
    offer = f"write one of {names}" if suitable else f"`{until.component}` has none"
    kind = f"an {connector.causality.value} of type {connector.kind()}"
    return f"it is {kind}, and must be an output of type bool[]; {offer}"


def _is_suitable(connector: Connector) -> bool:
    is_output = connector.causality is Causality.OUTPUT
    return is_output and connector.dtype == np.bool_ and connector.shape == ()
