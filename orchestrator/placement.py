"""Where the components of a scenario run: in this process, or behind a transport."""

from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Final

from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError, Problem, ScenarioError
from orchestrator.installed import installed_class
from orchestrator.remote.component import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.protocol import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport, Transport
from orchestrator.scenario.diagnosis import once
from orchestrator.scenario.isolation import IN_PROCESS, LOCAL, LOOPBACK, usual_transport
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.outputs import belonging_here
from orchestrator.scenario.paths import anchored
from orchestrator.scenario.processes import crowding, unlimited
from orchestrator.scenario.wiring import Place, in_process

GROUP: Final = "orchestrator.transports"

_BUILT_IN: Final[Mapping[str, type[Transport]]] = {
    LOOPBACK: LoopbackTransport,
    LOCAL: LocalTransport,
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


@dataclass(frozen=True, slots=True)
class Placement:
    """Which components of a scenario are reached through a transport.

    Attributes:
        scenario: whose components they are.
        transport: the name of that transport; `in-process` if it reaches none.
        remote: those that are, by name.
        remarks: what is not wrong, but may not be meant.
    """

    scenario: Scenario
    transport: str
    remote: Mapping[str, ComponentUse]
    remarks: tuple[Problem, ...]


def placement(transport: str | None, scenario: Scenario) -> Placement:
    """Which components of `scenario` are reached how.

    Args:
        transport: `in-process`, `loopback`, `local`, or an installed one: through it the
            components are reached that the scenario marks `process`, always or on request. `None`:
            those that it marks so always are in processes of their own, all others in this one.
        scenario: whose components will be created.

    Raises:
        ComponentTypeError: there is no such transport.
        ScenarioError: components that would be in this process cannot be in one, or one that would
            be in another belongs here.
    """
    uses, document = scenario.components, scenario.document
    remote = {name: use for name, use in uses.items() if use.process.is_behind(transport)}
    named = transport or (usual_transport() if remote else IN_PROCESS)
    makes_processes = named != IN_PROCESS and transport_type(named).makes_processes
    here = {n: use for n, use in uses.items() if not (makes_processes and n in remote)}
    misplaced = [*crowding(document, here), *belonging_here(document, remote)]
    if misplaced:
        raise ScenarioError(once(document, misplaced))
    return Placement(scenario, named, remote, tuple(unlimited(document, here)))


@contextmanager
def placing(placed: Placement) -> Iterator[Place]:
    """What creates the components of a scenario; when the block is left, all hosts end.

    Args:
        placed: which of them are reached how.

    Raises:
        ScenarioError: a component type refuses its parameters.
        ComponentError: a host did not start.
    """
    if not placed.remote:
        yield in_process
        return
    specs = [_spec(use) for use in placed.remote.values()]
    limits = {name: use.limits for name, use in placed.remote.items()}
    with ExitStack() as stack:
        launching = launch(specs, transport_type(placed.transport)(), limits=limits)
        try:
            remote: Mapping[str, Component] = stack.enter_context(launching)
        except ComponentTypeError as error:
            raise ScenarioError(_located(placed.scenario, str(error))) from error
        yield lambda use: remote[use.name] if use.name in remote else in_process(use)


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
    return ComponentSpec(name=use.name, type=source, values=anchored(use.values))
