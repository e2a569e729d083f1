"""Which values the parameters and start values of components get from parameter bindings."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from adapters.ssp.amounts import Amount, AmountError, amount, set_as
from adapters.ssp.flows import Flow, Network, Path, Spot
from adapters.ssp.interfaces import Interface
from adapters.ssp.model import (
    AS_IT_IS,
    SOURCES,
    Binding,
    Change,
    Component,
    Element,
    Group,
    Reference,
    UnitUse,
    Value,
)
from adapters.ssp.node import Findings
from orchestrator.errors import Location

_QUOTED: Final = 5
"""Names in a remark."""


@dataclass(frozen=True, slots=True)
class Setting:
    """A value that a scenario sets.

    Attributes:
        value: as a scenario writes it, in the unit of the parameter.
        where: what sets it.
    """

    value: Any
    where: Location


@dataclass(frozen=True, slots=True)
class _Given:
    """A value under the name that a binding gives it.

    Attributes:
        change: what its mapping does with it.
        converts: whether its unit is converted.
        rival: another value of the same name, or `None`; it matters if this one sets something.
    """

    name: str
    value: Value
    change: Change
    converts: bool
    rival: Value | None


class Settings:
    """The values of all bindings of a system, those of the systems around last.

    SSP 2.0, 5.3.2: bindings of systems come before those of what is in them, later ones before
    earlier ones; a name that nothing has is ignored, which is remarked on.
    """

    def __init__(
        self, network: Network, interfaces: Mapping[str, Interface], findings: Findings
    ) -> None:
        self._network = network
        self._interfaces = interfaces
        self._findings = findings
        self.found: dict[Path, dict[str, Setting]] = {path: {} for path in network.components}

    def apply(self, path: Path, element: Element) -> None:
        """Set what the bindings of an element, and of those in it, say."""
        if isinstance(element, Reference):
            return
        if isinstance(element, Group):
            for name, inner in element.elements.items():
                self.apply((*path, name), inner)
        for binding in element.bindings:
            idle: dict[str, list[_Given]] = {}
            for given in self._given(binding):
                why = self._set(path, element, given)
                if why:
                    idle.setdefault(why, []).append(given)
            for why, which in idle.items():
                self._findings.remark(which[0].value.where, f"{_quoted(which)}: {why}")

    def _given(self, binding: Binding) -> Iterator[_Given]:
        values: dict[str, Value] = {}
        rivals: dict[str, Value] = {}
        for value in binding.values:
            earlier = values.setdefault(value.name, value)
            if _meaning(earlier) != _meaning(value):
                rivals.setdefault(value.name, value)
        if binding.mapping is None:
            for name, value in values.items():
                yield _Given(name, value, AS_IT_IS, converts=True, rival=rivals.get(name))
            return
        for entry in binding.mapping:
            mapped = values.get(entry.source)
            if not entry.source:
                self._findings.leave_out(entry.where, "lines of a mapping that name no source")
            elif mapped is None:
                what = f"maps `{entry.source}`, which the parameter set does not have"
                self._findings.remark(entry.where, what)
            else:
                rival = rivals.get(entry.source)
                yield _Given(entry.target, mapped, entry.change, entry.converts, rival)

    def _set(self, path: Path, element: Component | Group, given: _Given) -> str:
        """Set everything of the name that is given; why nothing was set, if so."""
        spots = list(self._named(path, element, given.name))
        done = [self._set_at(spot, given) for spot in spots]
        if not any(done):
            return "nothing takes this value" if spots else "there is nothing of this name"
        if given.rival is not None:
            what = f"`{given.name}` has another value in line {given.value.where.line}"
            self._findings.add(given.rival.where, what)
        return ""

    def _named(self, path: Path, element: Element, name: str) -> Iterator[Spot]:
        """Everything that has a name, which may have dots, within an element."""
        if isinstance(element, Component):
            variables = self._interfaces[element.source].description.variables
            if name in variables:
                yield Spot(path, name)
        elif isinstance(element, Group):
            if name in element.ports:
                yield Spot(path, name)
            for first, inner in element.elements.items():
                if name.startswith(f"{first}."):
                    yield from self._named((*path, first), inner, name[len(first) + 1 :])

    def _set_at(self, spot: Spot, given: _Given) -> bool:
        """Set a variable of a component, or those that get their values from a connector."""
        if spot.path in self._network.components:
            self._put(spot, given, None)
            return True
        if self._network.ports[spot].kind in SOURCES:
            return False
        flows = [flow for flow in self._network.flows if flow.behind(spot)]
        for flow in flows:
            self._put(spot, given, flow)
        return bool(flows)

    def _put(self, spot: Spot, given: _Given, flow: Flow | None) -> None:
        """Set one variable, by way of the connections of a flow if there is one."""
        target = spot if flow is None else flow.target
        source = self._network.components[target.path].source
        interface, name = self._interfaces[source], target.connector
        variable = interface.description.variables.get(name)
        if variable is None:
            return  # told at the connector
        parameter = interface.called(name)
        shown = f"`{'.'.join((*target.path, name))}`"
        if parameter is None:
            what = f"causality {variable.causality}, type {variable.type}"
            self._findings.add(given.value.where, f"{shown} cannot be set: {what}")
            return
        try:
            found = self._arrived(spot, given, flow, is_relative=variable.is_relative)
            value = set_as(variable, found)
        except AmountError as error:
            self._findings.add(error.where or given.value.where, f"{shown}: {error}")
            return
        self.found[target.path][parameter] = Setting(value, given.value.where)

    def _arrived(
        self, spot: Spot, given: _Given, flow: Flow | None, *, is_relative: bool
    ) -> Amount:
        """A value as it arrives at a variable."""
        found = amount(given.value)
        unit = self._unit(spot)
        found = found.become(unit if given.converts else None, is_relative=is_relative)
        found = found.changed(given.change).of_unit(unit)
        for hop in () if flow is None else flow.behind(spot):
            unit = self._unit(hop.target)
            found = found.become(unit if hop.link.converts else None, is_relative=is_relative)
            found = found.changed(hop.link.change).of_unit(unit)
        return found

    def _unit(self, spot: Spot) -> UnitUse | None:
        """The unit of a connector; of a variable without one, that of the FMU."""
        port = self._network.ports.get(spot)
        if port is not None:
            return port.unit
        source = self._network.components[spot.path].source
        return self._interfaces[source].unit(spot.connector)


def _meaning(value: Value) -> tuple[str, tuple[str, ...], str]:
    """What tells values of the same name apart."""
    return value.type, value.texts, "" if value.unit is None else value.unit.name


def _quoted(which: Sequence[_Given]) -> str:
    """The first names, and how many there are besides."""
    names = ", ".join(f"`{each.name}`" for each in which[:_QUOTED])
    rest = len(which) - _QUOTED
    return (
        f"{names} {'sets' if len(which) == 1 else 'set'} nothing"
        if rest <= 0
        else (f"{names} and {rest} more set nothing")
    )
