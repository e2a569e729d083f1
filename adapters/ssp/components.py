"""What SSP says of an FMU in a scenario: its connectors, its values, and notes."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

import numpy as np

from adapters.fmi.description import FmuDescription, read_description
from adapters.fmi.options import PREFIX as OPTION
from adapters.fmi.starts import PREFIX as START
from adapters.fmi.variable import FmuVariable
from adapters.ssp.common import COMPONENT
from adapters.ssp.grammar import REALS
from adapters.ssp.interfaces import connector as declared
from adapters.ssp.writing import Tag, tag
from orchestrator.scenario.model import ComponentUse
from orchestrator.scenario.values import written
from orchestrator.signal import Connector
from orchestrator.timebase import format_duration
from orchestrator.unit_conversion import unit_of
from orchestrator.unit_table import BASE_UNITS
from orchestrator.units import Unit

_BASES: Final = 8
"""The base units of SSP; `BASE_UNITS` has further ones behind them."""

_QUOTED: Final = 3
"""Variables in a message."""

_TEXT: Final = ("output", "String")

_NEW: Final = ("local", "structuralParameter")
"""Kinds of connectors that SSP 1.0 does not have."""

Refuse: TypeAlias = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Outline:
    """What SSP says of a component.

    Attributes:
        fmu: its path.
        connectors: those of the FMU that a scenario knows.
        parameters: of its parameter set.
        units: that they use.
        enumerations: likewise.
        notes: what only nlosim reads.
    """

    fmu: Path
    connectors: tuple[Tag, ...]
    parameters: tuple[Tag, ...]
    units: tuple[Unit, ...]
    enumerations: tuple[Tag, ...]
    notes: Mapping[str, str]

    def binding(self, version: str) -> Tag | None:
        """Its parameter set; `None` if it is empty."""
        if not self.parameters:
            return None
        values = Tag("ssv:Parameters", {}, self.parameters)
        whole = tag("ssv:ParameterSet", values, version=version, name="parameters")
        return tag(
            "ssd:ParameterBindings",
            tag("ssd:ParameterBinding", tag("ssd:ParameterValues", whole)),
        )


def outline(
    use: ComponentUse,
    connectors: Mapping[str, Connector],
    constants: frozenset[str],
    linked: frozenset[str],
    *,
    is_first_version: bool,
    refuse: Refuse,
    said: Mapping[str, Any],
) -> Outline:
    """What SSP says of a component of a scenario.

    Args:
        said: its entry in the scenario file, with defaults.
        use: whose type is an FMU.
        connectors: by name, with constants as start values.
        constants: the inputs that have one.
        linked: the connectors that have a connection. Other inputs are left out, as FMPy's runner
            takes all of them for connected; so are other outputs of text, which it cannot read.
        is_first_version: whether it is for SSP 1.0, which has no arrays and no 64-bit numbers.
        refuse: called with what cannot be said.
    """
    path = next(iter(use.type.input_files({})))
    fmu = read_description(path)
    outlining = _Outlining(
        use, fmu, connectors, said, is_first_version=is_first_version, refuse=refuse
    )
    return outlining.outline(constants, linked)


class _Outlining:
    """One component on its way."""

    def __init__(
        self,
        use: ComponentUse,
        fmu: FmuDescription,
        connectors: Mapping[str, Connector],
        said: Mapping[str, Any],
        *,
        is_first_version: bool,
        refuse: Refuse,
    ) -> None:
        self._said = said
        self._use = use
        self._fmu = fmu
        self._connectors = connectors
        self._is_first_version = is_first_version
        self._refuse = refuse
        self._unsaid: dict[str, str] = {}
        self._units: dict[str, Unit] = {}
        self._enumerations: list[Tag] = []

    def outline(self, constants: frozenset[str], linked: frozenset[str]) -> Outline:
        values, options = self._values(constants)
        shown = [self._fmu.variables[n] for n in dict.fromkeys((*self._connectors, *values))]
        ports = tuple(self._port(v) for v in shown if self._is_shown(v, linked))
        parameters = tuple(
            self._parameter(self._fmu.variables[name], value) for name, value in values.items()
        )
        if self._unsaid:
            self._refuse(_too_new(self._unsaid))
        said = {**self._said, "parameters": options}
        notes = {
            "step": format_duration(self._use.step),
            **{key: json.dumps(said[key]) for key in COMPONENT if said.get(key)},
        }
        return Outline(
            fmu=self._fmu.path,
            connectors=ports,
            parameters=parameters,
            units=tuple(self._units.values()),
            enumerations=tuple(self._enumerations),
            notes=notes,
        )

    def _is_shown(self, variable: FmuVariable, linked: frozenset[str]) -> bool:
        """Whether a variable is a connector."""
        if variable.causality == "input" or (variable.causality, variable.type) == _TEXT:
            return variable.name in linked
        if self._is_first_version and variable.causality in _NEW:
            if variable.name in linked:
                self._say(variable, f"a connector of the kind {variable.causality}")
            return False
        return True

    def _values(self, constants: frozenset[str]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Values by variable, and what concerns nlosim only."""
        values: dict[str, Any] = {}
        options: dict[str, Any] = {}
        parameters = self._use.type.parameters
        for name, value in self._use.values.items():
            if name in self._fmu.variables:
                values[name] = value
            elif name.startswith(START):
                if value is not None:
                    values[name.removeprefix(START)] = value
            else:
                assert name.startswith(OPTION)  # noqa: S101 - an FMU has no other parameters
                options[name] = written(parameters[name], value)
        for name in constants:
            start = np.asarray(self._connectors[name].start_value())
            values[name] = start.ravel().tolist() if start.shape else start.item()
        return values, options

    def _port(self, variable: FmuVariable) -> Tag:
        return tag(
            "ssd:Connector",
            self._type(variable),
            *(self._dimensions(variable)),
            name=variable.name,
            kind=variable.causality,
            description=variable.description or None,
        )

    def _type(self, variable: FmuVariable) -> Tag:
        """The type of a connector; FMI 3.0's types exist from SSP 2.0 on."""
        if variable.items:
            name = f"{self._use.name}.{variable.name}"
            items = (tag("ssc:Item", name=n, value=str(v)) for n, v in variable.items.items())
            self._enumerations.append(Tag("ssc:Enumeration", {"name": name}, tuple(items)))
            return tag("ssc:Enumeration", name=name)
        kind = self._kind(variable)
        if kind == "Binary":
            return Tag("ssc:Binary", {"mime-type": variable.mime_type})
        return tag(f"ssc:{kind}", unit=self._unit(variable) if kind in REALS else None)

    def _kind(self, variable: FmuVariable) -> str:
        """The type of a variable as this version calls it."""
        if not self._is_first_version or variable.type in {"Boolean", "String", "Binary"}:
            return variable.type
        if variable.type in {"Real", "Float64"}:
            return "Real"
        if variable.type in {"Integer", "Int32", "Int16", "UInt16", "Int8", "UInt8"}:
            return "Integer"
        self._say(variable, f"of the type {variable.type}")
        return "Real"

    def _say(self, variable: FmuVariable, what: str) -> None:
        self._unsaid.setdefault(variable.name, what)

    def _dimensions(self, variable: FmuVariable) -> Iterator[Tag]:
        if variable.axes and self._is_first_version:
            self._say(variable, "an array")
            return
        for axis in variable.axes:
            if axis.structural is None:
                yield tag("ssc:Dimension", size=str(axis.length))
            else:
                yield tag("ssc:Dimension")

    def _unit(self, variable: FmuVariable) -> str | None:
        """The unit of a variable, if SSP can define it."""
        found = unit_of(declared(variable))
        is_silent = variable.unit == "1" and variable.definition is None
        if found is None or is_silent or found.reference is not None:
            return None
        if any(found.exponents[_BASES:]) or len(BASE_UNITS) < _BASES:
            return None
        known = self._units.setdefault(variable.unit, found)
        return variable.unit if known == found else None

    def _parameter(self, variable: FmuVariable, value: Any) -> Tag:
        elements = list(value) if isinstance(value, tuple | list) else [value]
        children: tuple[Tag, ...] = ()
        if variable.axes:
            children = (tag("ssc:Dimension", size=str(len(elements))),)
        return tag("ssv:Parameter", self._value(variable, elements), *children, name=variable.name)

    def _value(self, variable: FmuVariable, elements: Sequence[Any]) -> Tag:
        if variable.items:
            names = {number: name for name, number in variable.items.items()}
            said = [str(names.get(each, each)) for each in elements]
            name = f"{self._use.name}.{variable.name}"
            if len(said) == 1:
                return tag("ssv:Enumeration", value=said[0])
            return tag("ssv:Enumeration", *(tag("ssv:Value", value=s) for s in said), name=name)
        kind = self._kind(variable)
        if kind == "String":
            return tag("ssv:String", value=str(elements[0]))
        if kind == "Boolean":
            text = " ".join("true" if each else "false" for each in elements)
        elif kind in REALS:
            text = " ".join(repr(float(each)) for each in elements)
        else:
            text = " ".join(str(int(each)) for each in elements)
        return tag(f"ssv:{kind}", value=text)


def _too_new(unsaid: Mapping[str, str]) -> str:
    """What SSP 1.0 cannot say: the first variables, and how many there are besides."""
    first = ", ".join(f"`{name}` ({what})" for name, what in list(unsaid.items())[:_QUOTED])
    rest = f" and {len(unsaid) - _QUOTED} more" if len(unsaid) > _QUOTED else ""
    return f"SSP 1.0 cannot say {first}{rest}; write `--version 2.0`"
