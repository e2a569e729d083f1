"""Nobody is named who does not exist: a check across components, by what connectors declare.

One output gives numbers (`Meaning.numbers`), to vehicles for example; another one, or the input
that it drives, says that it names vehicles (`Meaning.names`). A number that nobody ever had ends
the run. Who was there and has left may be named still: messages are older than the truth.
"""

from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.errors import ComponentError
from orchestrator.observer import Observer, SimulationResult
from orchestrator.recording.reader import Recording
from orchestrator.signal import Causality, Signals
from orchestrator.stretch import Stretch
from orchestrator.system import Endpoint, System
from orchestrator.timebase import Time
from orchestrator.transformation import PLAIN


@dataclass(slots=True)
class _Naming:
    """An output whose elements are numbers of somebody."""

    what: str
    nobody: int
    reader: str
    last: Any = None


def giving(system: System) -> dict[Endpoint, str]:
    """Outputs that give numbers, and to what."""
    return {
        Endpoint(component, name): connector.meaning.numbers
        for component, connectors in system.connectors.items()
        for name, connector in connectors.items()
        if connector.causality is Causality.OUTPUT
        and connector.meaning is not None
        and connector.meaning.numbers
    }


def checks(system: System, before: Recording | None = None) -> tuple[Observer, ...]:
    """The check of a run, if anything in its system is to be checked.

    Args:
        system: of the run.
        before: what was recorded of it, where it is gone on with. If the numbers that were given
            are not in it, nobody can say who is unknown.
    """
    given = giving(system)
    if not {each.what for each in _naming(system).values()} & set(given.values()):
        return ()
    known: dict[str, list[int]] = defaultdict(list)
    if before is not None:
        if any(str(end) not in before for end in given):
            return ()
        for end, what in given.items():
            known[what] += np.unique(before[str(end)].values).tolist()
    return (KnownNumbers(known),)


class KnownNumbers(Observer):
    """Ends a run in which an output names somebody whose number nobody has given.

    Args:
        known: numbers that were given before, by what has them: of a run that is gone on with.
    """

    sees_stretches = True

    def __init__(self, known: Mapping[str, Iterable[int]] | None = None) -> None:
        self._known: dict[str, set[int]] = defaultdict(set)
        for what, numbers in (known or {}).items():
            self._known[what].update(numbers)
        self._giving: dict[str, dict[str, str]] = defaultdict(dict)
        self._naming: dict[str, dict[str, _Naming]] = defaultdict(dict)
        self._given: dict[Endpoint, Any] = {}

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        given = giving(system)
        for end, what in given.items():
            self._giving[end.component][end.connector] = what
        for end, naming in _naming(system).items():
            if naming.what in given.values():
                self._naming[end.component][end.connector] = naming

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        for component in published:
            for name, what in self._giving.get(component, {}).items():
                value, end = values[component][name], Endpoint(component, name)
                if value is not self._given.get(end):
                    self._given[end] = value
                    self._known[what].update(np.asarray(value).reshape(-1).tolist())
        for component in published:
            for name, naming in self._naming.get(component, {}).items():
                value = values[component][name]
                if value is not naming.last:
                    naming.last = value
                    self._check(component, t, name, naming)

    def _check(self, component: str, t: Time, name: str, naming: _Naming) -> None:
        known = self._known[naming.what]
        for number in np.asarray(naming.last).reshape(-1).tolist():
            if number != naming.nobody and number not in known:
                read = f", which `{naming.reader}` reads," if naming.reader else ""
                raise ComponentError(
                    component,
                    t,
                    f"output `{name}`{read} is {number}, and there has been no {naming.what} of "
                    f"this number ({len(known)} until now)",
                )

    @override
    def wants(self, system: System) -> Collection[Endpoint]:
        return (*giving(system), *_naming(system))

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        """Look at the last values; those before are of FMUs that compiled code steps."""
        self.observe(stretch.time, tuple(stretch.samples), stretch.values)

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def _naming(system: System) -> dict[Endpoint, _Naming]:
    """Outputs that name somebody, as they say themselves, or as an input says they drive."""
    found: dict[Endpoint, _Naming] = {}
    for component, connectors in system.connectors.items():
        for name, connector in connectors.items():
            said = connector.meaning
            if connector.causality is Causality.OUTPUT and said is not None and said.names:
                found[Endpoint(component, name)] = _Naming(said.names, said.nobody, "")
    for link in system.connections:
        said = system.connectors[link.target.component][link.target.connector].meaning
        if said is not None and said.names and link.way == PLAIN and link.source not in found:
            found[link.source] = _Naming(said.names, said.nobody, str(link.target))
    return found
