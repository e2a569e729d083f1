"""Components on hosts, while the combinations of an experiment are checked."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Self

from orchestrator.errors import Problem, ScenarioError
from orchestrator.hosts_file import Hosts
from orchestrator.placement import on_hosts, only_hosts, placing
from orchestrator.scenario.diagnosis import spell
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.wiring import Place, in_process
from orchestrator.statement import statement


class Meeting:
    """Meets the components that are on hosts once, for all combinations.

    Args:
        hosts: where hosts are; `None`: all components are here.
        tell: is called with a line whenever hosts are waited for.
    """

    def __init__(self, hosts: Hosts | None, tell: Callable[[str], None]) -> None:
        self.hosts = hosts
        self._tell = tell
        self._stack = ExitStack()
        self._place: Place | None = None
        self._said: Mapping[str, Mapping[str, str]] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stack.close()

    def place(self, scenario: Scenario) -> Place:
        """What creates the components of a combination, those on hosts there.

        Raises:
            ScenarioError: what is on hosts differs from what it is in the first combination, or is
                something else there.
            ComponentError: a host is not there.
        """
        away = on_hosts(scenario, self.hosts)
        said = {name: _said(scenario, name) for name in away}
        if self._place is None:
            self._said, self._place = said, in_process
            if away:
                placed = only_hosts(scenario, self.hosts)
                self._place = self._stack.enter_context(placing(placed, self._tell)).create
        if problems := list(_differing(scenario, self._said, said)):
            raise ScenarioError(problems)
        return self._place


def overlooked(scenario: Scenario) -> Iterator[str]:
    """What is on hosts for those who name a hosts file, if nobody does: a line for each."""
    for name, use in scenario.components.items():
        if use.host is not None:
            where = scenario.document.key(("components", name, "host"))
            here = f"`{name}` is here: `host: {use.host}` takes effect with `--hosts FILE`"
            yield f"{where}: {here}"


def _said(scenario: Scenario, name: str) -> Mapping[str, str]:
    """Digests of what is said of a component, and its host."""
    return {**statement(scenario, name).entry, "host": str(scenario.components[name].host)}


def _differing(
    scenario: Scenario,
    first: Mapping[str, Mapping[str, str]],
    now: Mapping[str, Mapping[str, str]],
) -> Iterator[Problem]:
    for name in {**first, **now}:
        before, said = first.get(name, {}), now.get(name, {})
        for path in {**before, **said}:
            if before.get(path) != said.get(path):
                what = f"`{name}` is on a host, which serves it to all runs alike"
                address = _written(scenario, ("components", name, *path.split(".")))
                where = scenario.document.value(address)
                yield Problem(where, f"{spell(address)}: {what}; vary what is here")


def _written(scenario: Scenario, address: tuple[Any, ...]) -> tuple[Any, ...]:
    """The nearest address above that the scenario has."""
    while address not in scenario.document.places:
        address = address[:-1]
    return address
