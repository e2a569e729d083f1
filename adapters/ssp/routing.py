"""Connections of a scenario for flows through systems."""

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from adapters.fmi.variable import FmuVariable
from adapters.ssp.carrying import carried
from adapters.ssp.draft import ConnectionDraft
from adapters.ssp.flows import Flow, Network, Path
from adapters.ssp.interfaces import Interface, connector
from adapters.ssp.model import AS_IT_IS, Linear
from adapters.ssp.node import Findings
from orchestrator.unit_conversion import UnitsDifferError, conversion, unit_of


def routed(
    network: Network,
    interfaces: Mapping[str, Interface],
    names: Mapping[Path, str],
    findings: Findings,
) -> tuple[ConnectionDraft, ...]:
    """The connections from outputs to inputs of components.

    Args:
        network: of the system.
        interfaces: by `Component.source`.
        names: of the components of the scenario.
        findings: connections that a scenario cannot have are added.
    """
    found = []
    for flow in network.flows:
        if flow.is_driven:
            variables = _variables(flow, network, interfaces)
            if variables is not None:
                found.append(_connection(flow, network, names, variables, findings))
    return tuple(each for each in found if each is not None)


def inner(network: Network, interfaces: Mapping[str, Interface]) -> dict[Path, tuple[str, ...]]:
    """The variables inside of components that connections begin at, which makes them outputs."""
    found: dict[Path, dict[str, None]] = {}
    for flow in network.flows:
        variables = _variables(flow, network, interfaces) if flow.is_driven else None
        if variables is not None and variables[0].causality in {"local", "calculatedParameter"}:
            found.setdefault(flow.source.path, {})[flow.source.connector] = None
    return {path: tuple(names) for path, names in found.items()}


def _variables(
    flow: Flow, network: Network, interfaces: Mapping[str, Interface]
) -> tuple[FmuVariable, FmuVariable] | None:
    """Those at both ends; `None` if there are none, which is told at the connectors."""
    found = []
    for spot in (flow.source, flow.target):
        fmu = interfaces[network.components[spot.path].source].description
        found.append(fmu.variables.get(spot.connector))
    first, last = found
    return None if first is None or last is None else (first, last)


def _connection(
    flow: Flow,
    network: Network,
    names: Mapping[Path, str],
    variables: tuple[FmuVariable, FmuVariable],
    findings: Findings,
) -> ConnectionDraft | None:
    output, input_ = variables
    where = flow.hops[-1].link.where
    if input_.causality != "input":
        what = f"`{input_.name}` is a {input_.causality} of its FMU; only inputs are driven"
        findings.add(where, what)
        return None
    total = carried(flow.hops, network.ports, findings)
    if total is None:
        return None
    source, target = flow.source, flow.target
    return ConnectionDraft(
        entry={
            "from": f"{names[source.path]}.{source.connector}",
            "to": f"{names[target.path]}.{target.connector}",
            **_way(total, _own(output, input_), is_kept=_is_kept(flow)),
            **_notes(flow, findings),
        },
        where=tuple(dict.fromkeys(hop.link.where for hop in reversed(flow.hops))),
    )


def _is_kept(flow: Flow) -> bool:
    """Whether some connection says that units are not converted."""
    return any(not hop.link.converts for hop in flow.hops)


def _own(output: FmuVariable, input_: FmuVariable) -> Linear | None:
    """What a scenario does with values on their way by itself; `None` if it refuses."""
    ends = connector(output), connector(input_)
    try:
        if not conversion(*ends):
            return AS_IT_IS
    except UnitsDifferError:
        return None
    source, target = map(unit_of, ends)
    if source is None or target is None:
        return AS_IT_IS
    offset = Fraction(0) if output.is_relative else source.offset - target.offset
    return Linear(source.factor / target.factor, offset / target.factor)


def _way(total: Linear, own: Linear | None, *, is_kept: bool) -> dict[str, Any]:
    """Gain and offset, behind the conversion of units or in place of it."""
    if total == own:
        return {}
    if own is None or is_kept:
        rest, said = total, {"convert": False}
    else:
        gain = total.factor / own.factor
        rest, said = Linear(gain, total.offset - gain * own.offset), {}
    return {
        **({} if rest.factor == 1 else {"gain": float(rest.factor)}),
        **({} if rest.offset == 0 else {"offset": float(rest.offset)}),
        **said,
    }


def _notes(flow: Flow, findings: Findings) -> dict[str, str]:
    """Delay and sample, which nlosim notes down at connections from component to component."""
    for hop in flow.hops:
        if hop.link.said and len(flow.hops) > 1:
            what = "a delay or a sample of nlosim, on a connection with a connector of a system"
            findings.add(hop.link.where, what)
    return dict(flow.hops[0].link.said)
