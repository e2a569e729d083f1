"""Where the components of a scenario run: in this process, or behind a transport."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from typing import Final

from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError, Problem, ScenarioError
from orchestrator.installed import installed_class
from orchestrator.remote.component import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.protocol import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport, Transport
from orchestrator.scenario.diagnosis import once
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.outputs import belonging_here
from orchestrator.scenario.processes import crowding
from orchestrator.scenario.wiring import Place, in_process

GROUP: Final = "orchestrator.transports"
IN_PROCESS: Final = "in-process"

_BUILT_IN: Final[Mapping[str, type[Transport]]] = {
    "loopback": LoopbackTransport,
    "local": LocalTransport,
}


def transport_type(name: str) -> type[Transport]:
    """Load the transport called `name`.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    if name in _BUILT_IN:
        return _BUILT_IN[name]
    built_in = (IN_PROCESS, *_BUILT_IN)
    return installed_class(GROUP, name, Transport, "transport", built_in)  # type: ignore[type-abstract]


@contextmanager
def placing(transport: str, scenario: Scenario) -> Iterator[Place]:
    """What creates the components of `scenario`; when the block is left, all hosts end.

    Args:
        transport: `in-process`, `loopback`, `local`, or an installed one. Components that the
            scenario marks `process` are reached through it.
        scenario: whose components will be created.

    Raises:
        ComponentTypeError: there is no such transport.
        ScenarioError: a component type refuses its parameters, components that the transport
            puts into this process cannot be in one, or one that it puts into another must not be.
        ComponentError: a host did not start.
    """
    hosts = None if transport == IN_PROCESS else transport_type(transport)
    if hosts is None or not hosts.makes_processes:
        crowded = crowding(scenario.document, scenario.components)
        if crowded:
            raise ScenarioError(once(scenario.document, crowded))
    if hosts is None:
        yield in_process
        return
    away = list(belonging_here(scenario.document, scenario.components))
    if away:
        raise ScenarioError(once(scenario.document, away))
    specs = [_spec(use) for use in scenario.components.values() if use.process]
    with ExitStack() as stack:
        launching = launch(specs, hosts())
        try:
            remote: Mapping[str, Component] = stack.enter_context(launching)
        except ComponentTypeError as error:
            raise ScenarioError(_located(scenario, str(error))) from error
        yield lambda use: remote[use.name] if use.process else in_process(use)


def _located(scenario: Scenario, errors: str) -> list[Problem]:
    """One problem per line of `errors`, at the component that it names."""
    problems = []
    for line in errors.splitlines():
        named = [name for name in scenario.components if f"`{name}`" in line]
        address = ("components", *named[:1])
        problems.append(Problem(scenario.document.key(address), line))
    return problems


def _spec(use: ComponentUse) -> ComponentSpec:
    source = use.reference() if use.fmu is None else use.fmu
    assert source is not None  # noqa: S101 - a component has one of the two
    return ComponentSpec(name=use.name, type=source, values=use.values)
