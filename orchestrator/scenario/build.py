"""From a scenario file to a `Scenario`: every problem of the file at once, each at its place."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar, cast

from pydantic import ValidationError

from orchestrator.algorithm.base import CosimulationAlgorithm, algorithm_type
from orchestrator.errors import ComponentTypeError, Problem, ScenarioError
from orchestrator.limits import Deadlines, Limits, can_limit_memory
from orchestrator.measure import Measure, measure_type
from orchestrator.parameters import Parameter, Parametrised, declared
from orchestrator.report import Report, report_type
from orchestrator.scenario import diagnosis, extension, routes, schema
from orchestrator.scenario.absent import AbsentType, are_absent_files
from orchestrator.scenario.component_types import module_of, type_of
from orchestrator.scenario.conversion import Conversion
from orchestrator.scenario.document import Address, Document
from orchestrator.scenario.expansion import Expansion, overridden
from orchestrator.scenario.isolation import Isolation
from orchestrator.scenario.model import (
    ComponentUse,
    ConnectionUse,
    PlugInUse,
    Scenario,
)
from orchestrator.scenario.other_files import refuse_experiment
from orchestrator.scenario.processes import APART_ONLY, crowding
from orchestrator.scenario.units import format_duration
from orchestrator.scenario.wiring import problems_of_sound_parts
from orchestrator.suggestion import nearest, suggestion
from orchestrator.system import Endpoint
from orchestrator.table_files import NO_PARQUET, Format, has_parquet
from orchestrator.timebase import CommunicationGrid, seconds


def load_scenario(path: Path, overrides: Sequence[str] = ()) -> Scenario:
    """Read and check a scenario file.

    Args:
        path: of the file; paths in it, and in files that it extends, are relative to the folder
            of the file that says them.
        overrides: `PATH=VALUE`, as `nlosim run --set` takes them.

    Raises:
        ScenarioError: all problems, each at its place. Whether the connections fit is known
            only once the components exist; see `wiring.assemble`.
    """
    document = extension.read(path)
    refuse_experiment(document)
    return built(document, path, overrides)


def built(document: Document, path: Path, overrides: Sequence[str] = ()) -> Scenario:
    """Do as `load_scenario` with a document that was read already."""
    found = overridden(document, overrides)
    return _Build(path, tuple(overrides), found.document, found).scenario()


_P = TypeVar("_P", bound=Parametrised)
_KINDS: Final = ("type", "fmu")
"""The keys that say what a component is."""

_DECIDING: Final = frozenset({*_KINDS, "process", "host", "parameters"})
"""The keys without which what else is said of a component, and what is not, cannot be judged."""

_SOME_STEP: Final = 1.0
"""Stands for a step [s] that is missing or wrong: such a scenario is never built."""


@dataclass(slots=True)
class _Build:
    """One reading of a document, collecting problems, and the components that have none."""

    path: Path
    overrides: tuple[str, ...]
    document: Document
    expansion: Expansion
    problems: list[Problem] = field(default_factory=list)
    sound: dict[str, ComponentUse] = field(default_factory=dict)
    remarks: list[Problem] = field(default_factory=list)

    def scenario(self) -> Scenario:
        if isinstance(self.document.data, dict) and extension.KEY in self.document.data:
            what = "cannot be set; write a file that extends the other one"
            self._add((extension.KEY,), what, at_key=True)
        file = self._file()
        components = self._components()
        self.problems += crowding(
            self.document,
            {
                name: use
                for name, use in self.sound.items()
                if use.process is Isolation.NEVER and use.host is None
            },
        )
        self._check_sources()
        if file is None:
            raise self._error(())
        self._check_times(file.time, components)
        self._check_steps(components)
        self._check_names(file)
        coupling = self._coupling(file.coupling, tuple(file.components))
        measures = self._measures(file)
        tables = self._tables(file)
        report = self._report(file)
        connections, constants = routes.read(file.connections)
        if self.problems or self.expansion.problems or coupling is None:
            raise self._error(connections)
        return Scenario(
            path=self.path,
            overrides=self.overrides,
            title=file.title,
            description=file.description,
            start=file.time.start,
            stop=file.time.stop,
            until=None if file.time.until is None else Endpoint.parse(file.time.until),
            seed=file.seed,
            coupling=coupling,
            components=MappingProxyType(components),
            connections=connections,
            constants=constants,
            include=tuple(file.recording.include),
            exclude=tuple(file.recording.exclude),
            measures=measures,
            tables=tables,
            report=report,
            remarks=(*self.expansion.remarks, *diagnosis.once(self.document, self.remarks)),
            document=self.document,
        )

    def _file(self) -> schema.ScenarioFile | None:
        """The file after expansion, if it has the right shape before and after it."""
        try:
            for document in (self.expansion.source, self.document):
                file = schema.ScenarioFile.model_validate(document.data)
        except ValidationError as error:
            self.problems += diagnosis.problems(document, schema.ScenarioFile, error)
            return None
        return file

    def _error(self, connections: Sequence[ConnectionUse]) -> ScenarioError:
        """All problems, in the order of the file; also those that only components can tell."""
        said = {problem.where for problem in self.expansion.problems}
        between = problems_of_sound_parts(self.document, self.sound, () if said else connections)
        others = [p for p in (*self.problems, *between) if p.where not in said]
        problems = diagnosis.once(self.document, others)
        problems += self.expansion.problems
        return ScenarioError(sorted(problems, key=lambda p: (p.where, p.what)))

    def _add(self, address: Address, what: str, *, at_key: bool = False) -> None:
        where = self.document.key(address) if at_key else self.document.value(address)
        named = diagnosis.spell(self.document.written(address))
        self.problems.append(Problem(where, f"{named}: {what}"))

    def _components(self) -> dict[str, ComponentUse]:
        """The components of a known type, also when others, or other parts, are not."""
        data = self.document.data
        entries = data.get("components") if isinstance(data, dict) else None
        found = {}
        for name, raw in entries.items() if isinstance(entries, dict) else ():
            entry = _readable(raw)
            if entry is None:
                continue
            before = len(self.problems)
            use = self._component(name, entry)
            if use is not None:
                found[name] = use
                if len(self.problems) == before and not isinstance(use.type, AbsentType):
                    self.sound[name] = use
        return found

    def _component(self, name: str, entry: schema.ComponentEntry) -> ComponentUse | None:
        address = ("components", name)
        if (entry.type is None) == (entry.fmu is None):
            both = "has both `type` and `fmu`; write one of them"
            neither = "`type` (an installed type) or `fmu` (a path) is missing"
            self._add(address, neither if entry.type is None else both, at_key=True)
            return None
        fmu = None
        if entry.fmu is not None:
            fmu = (self.document.folder((*address, "fmu")) / entry.fmu).absolute()
        try:
            found = type_of(entry.type, fmu, self.document.folder((*address, "type")))
        except ComponentTypeError as error:
            if entry.host is None:
                self._add((*address, "type" if fmu is None else "fmu"), str(error))
                return None
            found = AbsentType(str(error), entry.parameters)
        given = {} if isinstance(found, AbsentType) else entry.parameters
        before = len(self.problems)
        values = self._values((*address, "parameters"), found.parameters, given)
        wrong = self.problems[before:]
        if entry.host is not None and are_absent_files(wrong):
            del self.problems[before:]
            found, values = AbsentType(wrong[0].what, entry.parameters, wrong[0].where), {}
        return ComponentUse(
            name=name,
            type_name=entry.type,
            fmu=fmu,
            type=found,
            module=module_of(entry.type, self.document.folder((*address, "type"))),
            step=entry.step,
            process=entry.process,
            limits=self._limits(address, entry),
            host=entry.host,
            without=tuple(entry.without),
            values=values,
        )

    def _limits(self, address: Address, entry: schema.ComponentEntry) -> Limits:
        """What its process or host may take; a component without either has no limits."""
        said = entry.model_fields_set & {"deadline", "memory", "on_failure"}
        is_here = entry.process is Isolation.NEVER and entry.host is None
        for key in sorted(said) if is_here else ():
            self._add((*address, key), APART_ONLY, at_key=True)
        if entry.memory is not None and not can_limit_memory():
            self._add((*address, "memory"), "can be limited on Linux only", at_key=True)
        deadline = entry.deadline
        create = deadline.setup if deadline.create is None else deadline.create
        times = Deadlines(
            create=seconds(create),
            setup=seconds(deadline.setup),
            step=seconds(deadline.step),
        )
        return Limits(deadlines=times, memory=entry.memory, on_failure=entry.on_failure)

    def _coupling(
        self, entry: schema.Coupling, components: Sequence[str]
    ) -> PlugInUse[CosimulationAlgorithm] | None:
        """The co-simulation algorithm; `None` if it cannot be made.

        `null` for what an algorithm does not have says nothing, so that a file can take back what
        the file that it extends says for another algorithm.
        """
        said, address = entry.model_extra or {}, ("coupling",)
        found = self._plugin_type(algorithm_type, entry.algorithm, (*address, "algorithm"))
        if found is None:
            return None
        parameters = declared(found)
        given = {name: v for name, v in said.items() if name in parameters or v is not None}
        made = self._plugin(found, address, given, components)
        return (
            None
            if made is None
            else PlugInUse(type_name=entry.algorithm, made=made[0], values=made[1])
        )

    def _tables(self, file: schema.ScenarioFile) -> tuple[Format, ...] | None:
        if file.tables is None:
            return None
        for k, name in enumerate(file.tables):
            if name == "parquet" and not has_parquet():
                self._add(("tables", k), NO_PARQUET)
        return tuple(file.tables)

    def _report(self, file: schema.ScenarioFile) -> PlugInUse[Report] | None:
        """The report with its parameters; `None` if there is none, or if they are wrong."""
        if file.report is None:
            return None
        is_name = isinstance(self.document.data["report"], str)
        where = ("report",) if is_name else ("report", "type")
        found = self._plugin_type(report_type, file.report.type, where)
        if found is None:
            return None
        address, given = ("report", "parameters"), file.report.parameters
        names = tuple(file.components)
        made = self._plugin(found, address, given, names)
        if made is None:
            return None
        values = {name: use.all_values() for name, use in self.sound.items()}
        for each in made[0].problems_with(values):
            self._add((*address, *each.address), each.what, at_key=each.at_key)
        return PlugInUse(type_name=file.report.type, made=made[0], values=made[1])

    def _measures(self, file: schema.ScenarioFile) -> Mapping[str, PlugInUse[Measure]] | None:
        if file.measures is None:
            return None
        found = {}
        for name, entry in file.measures.items():
            given = dict(entry or {})
            address = ("measures", name)
            is_named = isinstance(given.get("type"), str)
            kind = given.pop("type") if is_named else name
            where = (*address, "type") if is_named else address
            measure = self._plugin_type(measure_type, kind, where, at_key=not is_named)
            made = None
            if measure is not None:
                made = self._plugin(measure, address, given, tuple(file.components))
            if made is not None:
                found[name] = PlugInUse(type_name=kind, made=made[0], values=made[1])
        return MappingProxyType(found)

    def _plugin_type(
        self, load: Callable[[str], type[_P]], name: str, address: Address, *, at_key: bool = False
    ) -> type[_P] | None:
        try:
            return load(name)
        except ComponentTypeError as error:
            self._add(address, str(error), at_key=at_key)
            return None

    def _plugin(
        self, found: type[_P], address: Address, given: Mapping[str, Any], components: Sequence[str]
    ) -> tuple[_P, Mapping[str, Any]] | None:
        """An algorithm, a measure or a report with its parameters; `None` if they are wrong."""
        before = len(self.problems)
        values = self._values(address, declared(found), given)
        if len(self.problems) > before:
            return None
        try:
            made: _P = cast("Callable[..., _P]", found)(**values)
        except ValueError as error:
            self._add(address, str(error), at_key=True)
            return None
        for each in made.problems(components):
            self._add((*address, *each.address), each.what, at_key=each.at_key)
        return made, values

    def _values(
        self, address: Address, declared: Mapping[str, Parameter], given: Mapping[str, Any]
    ) -> Mapping[str, Any]:
        """The parameters given, converted; problems with them, and with those not given."""
        for name in given:
            if name not in declared:
                self._unknown((*address, name), name, declared)
        known = {name: value for name, value in given.items() if name in declared}
        conversion = Conversion(lambda inner: self.document.folder((*address, *inner)))
        converted = conversion.parameters(declared, known)
        for problem in conversion.problems:
            self._add((*address, *problem.address), problem.what, at_key=problem.at_key)
        return MappingProxyType(converted)

    def _unknown(self, address: Address, name: str, declared: Collection[str]) -> None:
        """A parameter that the type of a component, the algorithm or a measure does not have.

        If an override has just replaced the type, a file's parameters of the old one are no
        mistake.
        """
        document, place = self.document, self.document.key(address)
        is_coupling = address[0] == "coupling"
        entry, keys = (address[:1], ("algorithm",)) if is_coupling else (address[:2], _KINDS)
        types = [document.places.get((*entry, key)) for key in keys]
        is_swapped = any(p is not None and not document.is_in_a_file(p.value) for p in types)
        if is_swapped and document.is_in_a_file(place):
            noun = "algorithm" if is_coupling else "type"
            what = f"{diagnosis.spell(address)}: ignored, the {noun} that was set has no `{name}`"
            self.remarks.append(Problem(place, what))
        else:
            what = f"there is no parameter `{name}`; {suggestion(name, declared)}"
            self._add(address, what, at_key=True)

    def _check_times(self, time: schema.TimeSpan, components: Mapping[str, ComponentUse]) -> None:
        if time.stop <= time.start:
            start, stop = format_duration(time.start), format_duration(time.stop)
            self._add(("time", "stop"), f"{stop} is not after the start at {start}")
            return
        for name, use in components.items():
            try:
                CommunicationGrid.over(time.start, time.stop, use.step)
            except ValueError:
                span = format_duration(time.stop - time.start)
                rest = format_duration((time.stop - time.start) % use.step)
                what = (
                    f"{format_duration(use.step)} does not divide the simulated {span} "
                    f"({rest} are left over); change the step or `time.stop`"
                )
                self._add(("components", name, "step"), what)

    def _check_steps(self, components: Mapping[str, ComponentUse]) -> None:
        for name, use in components.items():
            what = use.type.step_problem(use.step, use.values)
            if what is not None:
                self._add(("components", name, "step"), f"{format_duration(use.step)} {what}")

    def _check_names(self, file: schema.ScenarioFile) -> None:
        """The names of components in the times, connections and recording."""
        names = tuple(file.components)
        if file.time.until is not None:
            self._check_name(("time", "until"), file.time.until.partition(".")[0], names)
        for index, connection in enumerate(file.connections):
            for inner, end in routes.ends(connection):
                self._check_name(("connections", index, *inner), end.partition(".")[0], names)
        for key, patterns in (
            ("include", file.recording.include),
            ("exclude", file.recording.exclude),
        ):
            for index, pattern in enumerate(patterns):
                first = pattern.partition(".")[0]
                if not set(first) & set("*?["):
                    self._check_name(("recording", key, index), first, names)

    def _check_sources(self) -> None:
        """That every connection says one source; asked also where other parts are wrong."""
        data = self.document.data
        entries = data.get("connections") if isinstance(data, dict) else None
        for index, entry in enumerate(entries if isinstance(entries, list) else ()):
            for key, what in routes.problems(entry) if isinstance(entry, dict) else ():
                self._add(("connections", index, *key), what, at_key=True)

    def _check_name(self, address: Address, name: str, names: Sequence[str]) -> None:
        if name not in names:
            self._add(address, f"there is no component `{name}`; {suggestion(name, names)}")


def _readable(raw: object) -> schema.ComponentEntry | None:
    """What a component's entry says, without the keys that the validation of the file reports.

    `None` where those decide what the component is or what may be said of it, misspelt or not.
    """
    try:
        return schema.ComponentEntry.model_validate(raw)
    except ValidationError as error:
        wrong = {str(key) for each in error.errors() for key in each["loc"][:1]}
    keys = schema.ComponentEntry.model_fields
    meant = {key if key in keys else nearest(key, keys) for key in wrong}
    if not isinstance(raw, dict) or meant & _DECIDING or not raw.keys() & _KINDS:
        return None
    rest = {key: value for key, value in raw.items() if key not in wrong}
    return schema.ComponentEntry.model_validate({"step": _SOME_STEP, **rest})
