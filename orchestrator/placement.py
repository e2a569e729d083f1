"""Where the components of a scenario run: in this process, behind a transport, or on hosts."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError, Problem, ScenarioError
from orchestrator.hosts_file import Hosts
from orchestrator.installed import installed_class
from orchestrator.network import HostsTransport, SeveralTransports, Wanted, network
from orchestrator.remote.launching import launch
from orchestrator.remote.local import LocalTransport
from orchestrator.remote.specification import ComponentSpec
from orchestrator.remote.transport import LoopbackTransport, Transport
from orchestrator.scenario.absent import absence
from orchestrator.scenario.diagnosis import once, spell
from orchestrator.scenario.isolation import IN_PROCESS, LOCAL, LOOPBACK, usual_transport
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.outputs import belonging_here
from orchestrator.scenario.paths import anchored
from orchestrator.scenario.processes import crowding, unlimited
from orchestrator.scenario.wiring import Place, in_process
from orchestrator.statement import Statement, connectors_of, statement

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
        hosts: where hosts are; `None` if there is no hosts file.
        away: those that are on hosts, by name.
    """

    scenario: Scenario
    transport: str
    remote: Mapping[str, ComponentUse]
    remarks: tuple[Problem, ...]
    hosts: Hosts | None = None
    away: Mapping[str, ComponentUse] = field(default_factory=lambda: MappingProxyType({}))


@dataclass(slots=True)
class Places:
    """What creates the components of a scenario where they belong.

    Attributes:
        create: creates one.
        found: what hosts say of the components that they have, by name.
    """

    create: Place
    found: Mapping[str, Statement] = field(default_factory=lambda: MappingProxyType({}))


def _to_nobody(line: str) -> None:
    del line


def on_hosts(scenario: Scenario, hosts: Hosts | None) -> Mapping[str, ComponentUse]:
    """The components that are on hosts, by name; none without a hosts file."""
    found = {name: use for name, use in scenario.components.items() if use.host is not None}
    return MappingProxyType({} if hosts is None else found)


def placement(transport: str | None, scenario: Scenario, hosts: Hosts | None = None) -> Placement:
    """Which components of `scenario` are reached how.

    Args:
        transport: `in-process`, `loopback`, `local`, or an installed one: through it the
            components are reached that the scenario marks `process`, always or on request. `None`:
            those that it marks so always are in processes of their own, all others in this one.
        scenario: whose components will be created.
        hosts: of the hosts file; without it, what the scenario says of hosts means nothing.

    Raises:
        ComponentTypeError: there is no such transport.
        ScenarioError: components that would be in this process cannot be in one, one that would
            be elsewhere belongs here, or is not here; or there is no such host.
    """
    document = scenario.document
    away = on_hosts(scenario, hosts)
    uses = {name: use for name, use in scenario.components.items() if name not in away}
    remote = {name: use for name, use in uses.items() if use.process.is_behind(transport)}
    named = transport or (usual_transport() if remote else IN_PROCESS)
    makes_processes = named != IN_PROCESS and transport_type(named).makes_processes
    here = {n: use for n, use in uses.items() if not (makes_processes and n in remote)}
    misplaced = [*crowding(document, here), *belonging_here(document, {**remote, **away})]
    for name, use in uses.items():
        misplaced += absence(document, name, use.type, use.host)
    if hosts is not None:
        misplaced += _unknown_hosts(scenario, hosts, away)
    if misplaced:
        raise ScenarioError(once(document, misplaced))
    remarks = tuple(unlimited(document, here))
    return Placement(scenario, named, remote, remarks, hosts, away)


def only_hosts(scenario: Scenario, hosts: Hosts | None) -> Placement:
    """All components in this process but those on hosts, for whoever looks and does not simulate.

    Raises:
        ScenarioError: there is no such host.
    """
    away = on_hosts(scenario, hosts)
    problems = [] if hosts is None else [*_unknown_hosts(scenario, hosts, away)]
    if problems:
        raise ScenarioError(problems)
    return Placement(scenario, IN_PROCESS, {}, (), hosts, away)


def _unknown_hosts(
    scenario: Scenario, hosts: Hosts, away: Mapping[str, ComponentUse]
) -> Iterator[Problem]:
    for name, use in away.items():
        try:
            hosts.endpoint(use.host or "")
        except ValueError as error:
            address = ("components", name, "host")
            where = scenario.document.value(address)
            yield Problem(where, f"{spell(address)}: {error}")


@contextmanager
def placing(placed: Placement, tell: Callable[[str], None] = _to_nobody) -> Iterator[Places]:
    """What creates the components of a scenario; when the block is left, all hosts end.

    Args:
        placed: which of them are reached how.
        tell: is called with a line whenever there is something new to wait for.

    Raises:
        ScenarioError: a component type refuses its parameters, or another host has something else.
        ComponentError: a host did not start, or is not there.
    """
    elsewhere = {**placed.away, **placed.remote}
    if not elsewhere:
        yield Places(in_process)
        return
    specs = [*map(_no_code, placed.away), *map(spec_of, placed.remote.values())]
    limits = {name: use.limits for name, use in elsewhere.items()}
    with ExitStack() as stack:
        parts: list[tuple[Transport, frozenset[str]]] = []
        away: HostsTransport | None = None
        if placed.hosts is not None and placed.away:
            away = _to_hosts(placed, placed.hosts, tell)
            parts.append((away, frozenset(placed.away)))
        if placed.remote:
            parts.append((transport_type(placed.transport)(), frozenset(placed.remote)))
        transport = parts[0][0] if len(parts) == 1 else SeveralTransports(parts)
        try:
            remote: Mapping[str, Component] = stack.enter_context(
                launch(specs, transport, limits=limits)
            )
        except ComponentTypeError as error:
            raise ScenarioError(_located(placed.scenario, str(error))) from error
        found = {} if away is None else away.found
        yield Places(lambda use: remote[use.name] if use.name in remote else in_process(use), found)


def _to_hosts(placed: Placement, hosts: Hosts, tell: Callable[[str], None]) -> HostsTransport:
    wanted = {
        name: Wanted(
            host=use.host or "",
            statement=statement(placed.scenario, name, connectors_of(use)),
            deadlines=use.limits.deadlines,
        )
        for name, use in placed.away.items()
    }
    return network().transport(hosts, wanted, placed.scenario.name, tell)


def _no_code(name: str) -> ComponentSpec:
    """What is said of a component on another host: that it is to be created, as it is there."""
    return ComponentSpec(name=name, type="", values={})


def _located(scenario: Scenario, errors: str) -> list[Problem]:
    """One problem per line of `errors`, at the component that it names."""
    problems = []
    for line in errors.splitlines():
        named = [name for name in scenario.components if f"`{name}`" in line]
        address = ("components", *named[:1])
        problems.append(Problem(scenario.document.key(address), line))
    return problems


def spec_of(use: ComponentUse) -> ComponentSpec:
    """What a host needs to create a component."""
    source = use.reference() if use.fmu is None else use.fmu
    assert source is not None  # noqa: S101 - a component has one of the two
    return ComponentSpec(name=use.name, type=source, values=anchored(use.values))
