"""A scenario with everything resolved: types found, values in their units, times in nanoseconds.

Nothing in here knows YAML; `document` serves only to say where an error found later belongs.
"""

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.byte_size import written_size
from orchestrator.errors import Problem
from orchestrator.limits import USUAL, Limits, OnFailure
from orchestrator.measure import Measure, defaults
from orchestrator.parameters import DRAWN, REQUIRED, ComponentType, declared
from orchestrator.questions import Questions
from orchestrator.report import Report
from orchestrator.scenario.absent import AbsentType
from orchestrator.scenario.document import Address, Document
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.units import format_duration
from orchestrator.scenario.values import written
from orchestrator.system import Endpoint
from orchestrator.table_files import Format
from orchestrator.timebase import StepSize, Time
from orchestrator.transformation import PLAIN, Transformation

PlugIn = TypeVar("PlugIn")


@dataclass(frozen=True, slots=True, kw_only=True)
class ComponentUse:
    """One component of a scenario.

    Attributes:
        type_name: the installed type, or a class in a file, `module:Class`; or `None` for an FMU
            given by its path.
        module: the absolute path of the file with the class, or `None`.
        fmu: the FMU's absolute path, or `None`.
        type: what creates it.
        step: communication step size [ns].
        process: whether it runs in a process of its own.
        limits: of that process, or of the host.
        host: on which it is, where a hosts file says how to get there.
        without: inputs, or groups of them, that nothing shall drive.
        values: the parameters that the scenario sets, in their declared type and unit.
    """

    name: str
    type_name: str | None
    fmu: Path | None
    type: ComponentType
    step: StepSize
    process: Isolation
    values: Mapping[str, Any]
    module: Path | None = None
    limits: Limits = USUAL
    host: str | None = None
    without: tuple[str, ...] = ()

    def reference(self) -> str | None:
        """The type's name, which for a class in a file has the whole path of it."""
        if self.module is None or self.type_name is None:
            return self.type_name
        return f"{self.module}:{self.type_name.rpartition(':')[2]}"

    def all_values(self) -> Mapping[str, Any]:
        """The parameters that the scenario sets, and the defaults of all others.

        Seeds that the component draws itself have no value here, nor have optional parameters
        that the scenario does not set.
        """
        defaults = {
            name: parameter.default
            for name, parameter in self.type.parameters.items()
            if parameter.default not in (REQUIRED, DRAWN) and not parameter.is_optional
        }
        return {**defaults, **self.values}

    def origin(self) -> str:
        """The type's name, or the FMU's path; and how it works, where that is worth a word."""
        name = self.type_name if self.type_name is not None else str(self.fmu)
        manner = self.type.manner(self.values)
        return f"{name} ({manner})" if manner else name


@dataclass(frozen=True, slots=True, kw_only=True)
class PlugInUse(Generic[PlugIn]):
    """The co-simulation algorithm of a scenario, its report, or one of its measures.

    Attributes:
        type_name: under which it is installed.
        made: the algorithm, report or measure, with its parameters.
        values: the parameters that the scenario sets, in their declared type and unit.
    """

    type_name: str
    made: PlugIn
    values: Mapping[str, Any]

    def resolved(self, key: str) -> dict[str, Any]:
        """The entry of a scenario file that means the same; `key` is that of the name."""
        return {key: self.type_name, **self.said()}

    def said(self) -> dict[str, Any]:
        """The parameters as a scenario file writes them."""
        parameters = declared(type(self.made))
        return {n: written(parameters[n], v) for n, v in self.values.items() if v is not None}


@dataclass(frozen=True, slots=True)
class ConnectionUse:
    """One connection, or group of connections, as written.

    Attributes:
        way: without the elements that the ends name.
        address: of what says it in the document.
    """

    source: str
    target: str
    way: Transformation = PLAIN
    address: Address = ()


@dataclass(frozen=True, slots=True)
class ConstantUse:
    """A constant in place of a source, as written.

    Attributes:
        address: of what says it in the document.
    """

    value: Any
    target: str
    address: Address = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """What a scenario file means, overrides included.

    Attributes:
        path: of the file.
        overrides: as written on the command line.
        start, stop: the first and the last communication point [ns].
        until: the output that ends the run before `stop` once it is true, or `None`.
        include, exclude: patterns of the outputs that are recorded.
        measures: by name; `None` if it does not speak of them.
        tables: the formats of the tables of measures, or `None`.
        report: with its parameters, or `None`.
        remarks: what is not wrong, but may not be meant.
        document: where everything was written.
    """

    path: Path
    overrides: tuple[str, ...]
    title: str
    description: str
    start: Time
    stop: Time
    until: Endpoint | None
    seed: int
    coupling: PlugInUse[CosimulationAlgorithm]
    components: Mapping[str, ComponentUse]
    connections: tuple[ConnectionUse, ...]
    constants: tuple[ConstantUse, ...]
    include: tuple[str, ...]
    exclude: tuple[str, ...]
    measures: Mapping[str, PlugInUse[Measure]] | None
    tables: tuple[Format, ...] | None
    report: PlugInUse[Report] | None
    remarks: tuple[Problem, ...]
    document: Document = field(repr=False, compare=False)

    @property
    def name(self) -> str:
        """The name of the file without its suffix."""
        return self.path.stem

    def asked(self, *, every_run: bool) -> Questions:
        """What is asked of its runs.

        Args:
            every_run: whether a scenario that does not speak of measures asks the default ones.
        """
        said = self.measures or {}
        has_report = self.report is not None
        return Questions(
            report=None if self.report is None else self.report.made,
            report_name="" if self.report is None else self.report.type_name,
            measures={name: use.made for name, use in said.items()},
            optional=defaults(has_report=has_report) if every_run and self.measures is None else {},
            tables=self.tables,
        )

    def resolved(self) -> dict[str, Any]:
        """The scenario as a scenario file: overrides applied, defaults written out.

        Reading it again gives the same run, wherever relative paths start.
        """
        said = self.measures
        measures = (
            None if said is None else {name: use.resolved("type") for name, use in said.items()}
        )
        return {
            "schema": 1,
            "title": self.title,
            "description": self.description,
            "time": {
                "start": format_duration(self.start),
                "stop": format_duration(self.stop),
                **({} if self.until is None else {"until": str(self.until)}),
            },
            "seed": self.seed,
            "coupling": self.coupling.resolved("algorithm"),
            "components": {name: _resolved(use) for name, use in self.components.items()},
            "connections": [
                *_written(self.connections),
                *({"value": c.value, "to": c.target} for c in self.constants),
            ],
            "recording": {"include": list(self.include), "exclude": list(self.exclude)},
            **({} if measures is None else {"measures": measures}),
            **({} if self.tables is None else {"tables": list(self.tables)}),
            **({} if self.report is None else {"report": _report(self.report)}),
        }


def _written(connections: Sequence[ConnectionUse]) -> Iterator[dict[str, Any]]:
    """Connections as a scenario file writes them; those that are added to others as a sum."""
    for k, use in enumerate(connections):
        following = itertools.takewhile(lambda each: each.way.adds, connections[k + 1 :])
        added = [_source(each) for each in following]
        if added and not use.way.adds:
            yield {"sum": [_source(use), *added], "to": use.target}
        elif not use.way.adds:
            yield {**_source(use), "to": use.target}


def _source(use: ConnectionUse) -> dict[str, Any]:
    way = use.way
    return {
        "from": use.source,
        **({} if way.gain == 1.0 else {"gain": way.gain}),
        **({} if way.offset == 0.0 else {"offset": way.offset}),
        **({} if way.converts else {"convert": False}),
        **({"delay": format_duration(way.delay)} if way.delay else {}),
        **({"sample": format_duration(way.sample)} if way.sample else {}),
    }


def _resolved(use: ComponentUse) -> dict[str, Any]:
    declared = use.type.parameters
    said = {n: written(declared[n], v) for n, v in use.all_values().items()}
    if isinstance(use.type, AbsentType):
        said = dict(use.type.said)
    return {
        **({"type": use.reference()} if use.fmu is None else {"fmu": str(use.fmu)}),
        "step": format_duration(use.step),
        "process": use.process.value,
        **({} if use.host is None else {"host": use.host}),
        **_limits(use.limits),
        **({"without": list(use.without)} if use.without else {}),
        "parameters": said,
    }


def _limits(limits: Limits) -> dict[str, Any]:
    """What differs from the defaults."""
    own, usual = limits.deadlines, USUAL.deadlines
    times = {
        "create": (own.create, own.setup),
        "setup": (own.setup, usual.setup),
        "step": (own.step, usual.step),
    }
    changed = {key: f"{value:g} s" for key, (value, default) in times.items() if value != default}
    return {
        **({"deadline": changed} if changed else {}),
        **({} if limits.on_failure is OnFailure.ABORT else {"on_failure": limits.on_failure.value}),
        **({} if limits.memory is None else {"memory": written_size(limits.memory)}),
    }


def _report(use: PlugInUse[Report]) -> str | dict[str, Any]:
    """The entry of a scenario file for a report."""
    said = use.said()
    return {"type": use.type_name, "parameters": said} if said else use.type_name
