"""The FMUs of a system: what they offer, and whether connectors say the same."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from adapters.fmi.connectors import parameters
from adapters.fmi.description import FmuDescription, read_description
from adapters.fmi.options import option_parameters
from adapters.fmi.sizes import Sizes
from adapters.fmi.starts import PREFIX, start_parameters
from adapters.fmi.variable import FmuVariable
from adapters.ssp.grammar import REALS, WHOLES
from adapters.ssp.implementation import interfaces as kinds
from adapters.ssp.model import Component, Element, Group, Port, UnitUse
from adapters.ssp.node import Findings
from orchestrator.errors import Location
from orchestrator.parameters import Parameter
from orchestrator.signal import Causality, Connector
from orchestrator.suggestion import suggestion
from orchestrator.unit_conversion import unit_of
from orchestrator.units import Unit

_FAMILIES: Final = {
    **dict.fromkeys(REALS, "number"),
    **dict.fromkeys(WHOLES, "whole number"),
    "Enumeration": "whole number",
    "Boolean": "truth",
    "String": "text",
    "Binary": "binary",
}
"""Types that are taken for each other."""


@dataclass(frozen=True, slots=True)
class Interface:
    """What an FMU offers to a scenario.

    Attributes:
        description: of the FMU.
        parameters: by the names that scenarios use, start values included.
        options: how it is run, likewise.
        kinds: `CoSimulation`, `ModelExchange`, ...
    """

    description: FmuDescription
    parameters: Mapping[str, Parameter]
    options: Mapping[str, Parameter]
    kinds: frozenset[str]

    @classmethod
    def of(cls, path: Path) -> "Interface":
        """That of an FMU, which need not run on this machine.

        Raises:
            ComponentTypeError: it is no FMI 2.0 or 3.0 co-simulation FMU.
        """
        fmu = read_description(path)
        chosen = Sizes(fmu, {}).chosen
        return cls(
            fmu,
            parameters(fmu, chosen) | start_parameters(fmu, chosen),
            option_parameters(fmu),
            kinds(path),
        )

    def called(self, name: str) -> str | None:
        """The parameter of a scenario that sets a variable; `None` if none does."""
        return next((n for n in (name, PREFIX + name) if n in self.parameters), None)

    def unit(self, name: str) -> UnitUse | None:
        """The unit of a variable, if the FMU says one."""
        variable = self.description.variables[name]
        if _is_silent(variable):
            return None
        definition = unit_of(connector(variable))
        return UnitUse(name=variable.unit, definition=definition, where=Location("", 1, 1))


def completed(group: Group, interfaces: Mapping[str, Interface], findings: Findings) -> Group:
    """The system, with the units of FMUs at connectors that say none.

    Args:
        group: the system.
        interfaces: by `Component.source`.
        findings: whatever connectors say otherwise than their FMUs is added.
    """
    elements: dict[str, Element] = {}
    for name, element in group.elements.items():
        if isinstance(element, Group):
            elements[name] = completed(element, interfaces, findings)
        elif isinstance(element, Component) and element.source in interfaces:
            variables = interfaces[element.source].description.variables
            ports = {n: _port(p, variables, findings) for n, p in element.ports.items()}
            elements[name] = replace(element, ports=ports)
        else:
            elements[name] = element
    return replace(group, elements=elements)


def _port(port: Port, variables: Mapping[str, FmuVariable], findings: Findings) -> Port:
    """A connector of a component, held against the variable of its FMU."""
    variable = variables.get(port.name)
    if variable is None:
        what = f"the FMU has no variable `{port.name}`; {suggestion(port.name, variables)}"
        findings.add(port.where, what)
        return port
    is_constant = variable.variability == "constant"
    kind = "constant" if is_constant and port.kind == "constant" else variable.causality
    if port.kind not in {kind, "inout", "unspecified"}:
        findings.add(port.where, f"`{port.name}` is {_a(port.kind)} here, {_a(kind)} of the FMU")
    said, own = _FAMILIES.get(port.type or ""), _FAMILIES.get(variable.type)
    if said is not None and said != own:
        what = f"`{port.name}` is {_a(port.type or '')} here, {_a(variable.type)} of the FMU"
        findings.add(port.where, what)
    return replace(
        port,
        kind=kind,
        unit=_unit(port, variable, findings),
        is_relative=variable.is_relative,
    )


def _unit(port: Port, variable: FmuVariable, findings: Findings) -> UnitUse | None:
    """The unit of a connector: what an FMU says counts, as its values are in that."""
    if _is_silent(variable):
        return port.unit
    own = connector(variable)
    definition = unit_of(own)
    if port.unit is not None and not _agree(port.unit, own, definition):
        what = f"`{port.name}` is in {port.unit.name} here, in {own.unit} by the FMU"
        findings.add(port.unit.where, what)
    where = port.where if port.unit is None else port.unit.where
    return UnitUse(name=own.unit, definition=definition, where=where)


def _is_silent(variable: FmuVariable) -> bool:
    """Whether an FMU does not say the unit of a variable."""
    return variable.unit == "1" and variable.definition is None


def _agree(said: UnitUse, own: Connector, definition: Unit | None) -> bool:
    """Whether a connector and its FMU speak of the same unit."""
    if said.definition is None or definition is None:
        return said.name == own.unit
    one, other = (
        (unit.exponents, float(unit.factor), float(unit.offset), unit.reference)
        for unit in (said.definition, definition)
    )
    return one == other


def connector(variable: FmuVariable) -> Connector:
    """The unit of a variable, as the connections of a scenario convert it."""
    is_input = variable.causality == "input"
    return Connector(
        causality=Causality.INPUT if is_input else Causality.OUTPUT,
        unit=variable.unit,
        definition=variable.definition,
        is_relative=variable.is_relative,
    )


def _a(word: str) -> str:
    """A word with its article."""
    return f"{'an' if word[:1] in 'aeiouAEIO' else 'a'} `{word}`"
