"""From a scenario whose components are FMUs to a package."""

import json
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path
from typing import Final

from adapters.fmi.component_type import FmuComponentType
from adapters.ssp.common import TOP
from adapters.ssp.components import Outline, outline
from adapters.ssp.implementation import used
from adapters.ssp.naming import identifiers
from adapters.ssp.node import Findings
from adapters.ssp.writing import (
    Tag,
    annotations,
    document,
    note,
    noted,
    some,
    steps_of_omsimulator,
    tag,
    unit,
)
from orchestrator.connection import Connection, Endpoint
from orchestrator.elements import WHOLE
from orchestrator.errors import Location, Problem
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.model import ComponentUse, Scenario
from orchestrator.scenario.wiring import assemble
from orchestrator.system import System, expand
from orchestrator.timebase import NANOSECONDS_PER_SECOND, StepSize, Time, format_duration
from orchestrator.transformation import Transformation

VERSIONS: Final = ("1.0", "2.0")
_DATE: Final = (1980, 1, 1, 0, 0, 0)
"""The date of all files in a package, so that the same scenario gives the same bytes."""


@dataclass(frozen=True, slots=True)
class Exported:
    """A package that was written.

    Attributes:
        components, connections: how many there are in it.
        remarks: what only nlosim reads from it, each with its place in the scenario.
    """

    components: int
    connections: int
    remarks: tuple[Problem, ...]


@dataclass(slots=True)
class _Names:
    """Names in the package for FMUs; each FMU is packed once."""

    found: dict[Path, str] = field(default_factory=dict)

    def of(self, path: Path) -> str:
        if path not in self.found:
            name, number = f"resources/{path.name}", 2
            while name in self.found.values():
                name, number = f"resources/{path.stem}-{number}{path.suffix}", number + 1
            self.found[path] = name
        return self.found[path]


def export_scenario(path: Path, target: Path, version: str = "1.0") -> Exported:
    """Write a scenario as a package. Nothing of its FMUs is run.

    Args:
        path: of the scenario file.
        target: the `.ssp` file.
        version: 1.0 or 2.0.

    Raises:
        ScenarioError: the scenario is wrong, or has what SSP cannot say; every problem with its
            place in the file.
        ComponentError: a component cannot be created.
    """
    scenario = load_scenario(path)
    assembly = assemble(scenario)
    try:
        return _Export(scenario, assembly.system, version).written(target)
    finally:
        assembly.close()


class _Export:
    """One scenario on its way."""

    def __init__(self, scenario: Scenario, system: System, version: str) -> None:
        self._scenario = scenario
        self._system = system
        self._version = version
        self._findings = Findings()
        self._names = _Names()
        self._called = identifiers(scenario.components)
        self._resolved = scenario.resolved()

    def written(self, target: Path) -> Exported:
        outlines = {
            name: self._outline(name, use) for name, use in self._scenario.components.items()
        }
        links = tuple(self._links())
        self._findings.check()
        outlined = {name: each for name, each in outlines.items() if each is not None}
        content = document(self._description(outlined, links))
        self._mention()
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.writestr(_entry("SystemStructure.ssd"), content)
            for fmu, name in self._names.found.items():
                archive.writestr(_entry(name), fmu.read_bytes())
        remarks = tuple(sorted(self._findings.remarks, key=lambda each: each.where))
        return Exported(len(outlined), len(links), remarks)

    def _outline(self, name: str, use: ComponentUse) -> Outline | None:
        """What SSP says of a component; `None` if it cannot."""
        where = self._scenario.document.key(("components", name))
        if not isinstance(use.type, FmuComponentType):
            what = f"`{name}` is {use.origin()}, no FMU; a component of SSP is an FMU"
            self._findings.add(where, what)
            return None
        connectors = self._system.connectors[name]
        constants = frozenset(
            c.target.connector for c in self._system.constants if c.target.component == name
        )
        return outline(
            use,
            connectors,
            constants,
            frozenset(end.connector for end in self._ends() if end.component == name),
            is_first_version=self._version == "1.0",
            said=self._resolved["components"][name],
            refuse=lambda what: self._findings.add(where, what),
        )

    def _ends(self) -> Iterator[Endpoint]:
        """The ends of all connections."""
        for link in self._system.connections:
            yield from (link.source, link.target)

    def _links(self) -> Iterator[Tag]:
        """The connections; what SSP cannot say of them is noted at their places in the file."""
        for use in self._scenario.connections:
            where = self._scenario.document.value(use.address)
            for link in expand(self._system.components, use.source, use.target, use.way):
                yield _link(link, self._called, self._notes_of(link.way, where))

    def _notes_of(self, way: Transformation, where: Location) -> Tag | None:
        """What only nlosim reads about a connection."""
        if way.adds:
            self._findings.add(where, "a sum: an input of SSP has one source")
        if way.picked != WHOLE or way.placed != WHOLE:
            what = "elements of arrays: SSP does not say whether indices count from 0 or from 1"
            self._findings.add(where, what)
        notes = {
            name: format_duration(time)
            for name, time in (("delay", way.delay), ("sample", way.sample))
            if time
        }
        for name in notes:
            self._findings.remark(where, f"`{name}` is written as a note that nlosim reads")
        return annotations("ssd", [noted(note("Connection", notes))]) if notes else None

    def _description(self, outlines: Mapping[str, Outline], links: tuple[Tag, ...]) -> Tag:
        scenario = self._scenario
        components = (
            tag(
                "ssd:Component",
                some("ssd:Connectors", outlines[name].connectors),
                outlines[name].binding(self._version),
                id=self._called[name],
                name=self._called[name],
                type="application/x-fmu-sharedlibrary",
                source=self._names.of(outlines[name].fmu),
                implementation=used(outlines[name].fmu, scenario.components[name].values),
            )
            for name in scenario.components
        )
        steps = {use.step for use in scenario.components.values()}
        (system_name,) = identifiers([scenario.name]).values()
        shared = _step(steps.pop()) if len(steps) == 1 else None
        notes = [noted(self._notes(outlines))]
        if shared is not None:
            notes.insert(0, steps_of_omsimulator(shared))  # which reads the first one only
        system = tag(
            "ssd:System",
            some("ssd:Elements", components),
            some("ssd:Connections", links),
            annotations("ssd", notes),  # here: OMSimulator takes none below or above
            name=system_name,
        )
        units = {u.symbol: u for each in outlines.values() for u in each.units}
        enumerations = [e for each in outlines.values() for e in each.enumerations]
        return tag(
            "ssd:SystemStructureDescription",
            system,
            some("ssd:Enumerations", enumerations),
            some("ssd:Units", (unit(u, name) for name, u in sorted(units.items()))),
            tag(
                "ssd:DefaultExperiment",
                startTime=_seconds(scenario.start),
                stopTime=_seconds(scenario.stop),
            ),
            version=self._version,
            name=system_name,
            description=scenario.description or None,
            generationTool="nlosim",
        )

    def _notes(self, outlines: Mapping[str, Outline]) -> Tag:
        """What SSP has no words for."""
        until = self._scenario.until
        said = {"title": self._scenario.title}
        if until is not None:
            said["until"] = str(until)
        said |= {key: json.dumps(self._resolved[key]) for key in TOP if key in self._resolved}
        return note("Scenario", said, self._notes_of_components(outlines))

    def _notes_of_components(self, outlines: Mapping[str, Outline]) -> Iterator[Tag]:
        for name, called in self._called.items():
            said: dict[str, str] = {"of": called, **outlines[name].notes}
            if name != called:
                said["name"] = name
            yield note("Component", said)

    def _mention(self) -> None:
        """Say what of the scenario only nlosim reads."""
        document_ = self._scenario.document
        for key in ("coupling", "seed", "recording", "measures", "tables", "report"):
            if key in document_.data:
                what = f"`{key}` is written as a note that nlosim reads; SSP has no word for it"
                self._findings.remark(document_.key((key,)), what)
        if len({use.step for use in self._scenario.components.values()}) > 1:
            what = "step sizes differ: they are written as notes that nlosim reads"
            self._findings.remark(document_.key(("components",)), what)


def _link(link: Connection, called: Mapping[str, str], notes: Tag | None) -> Tag:
    """A connection of SSP between components that are `called` so."""
    way = link.way
    is_changed = way.gain != 1.0 or way.offset != 0.0
    change = tag(
        "ssc:LinearTransformation", factor=repr(way.gain), offset=repr(way.offset)
    )  # both always: OMSimulator reads both
    return tag(
        "ssd:Connection",
        change if is_changed else None,
        notes,
        startElement=called[link.source.component],
        startConnector=link.source.connector,
        endElement=called[link.target.component],
        endConnector=link.target.connector,
        suppressUnitConversion=None if way.converts else "true",
    )


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name, _DATE)
    entry.compress_type = zipfile.ZIP_DEFLATED
    entry.external_attr = 0o644 << 16
    return entry


def _step(size: StepSize) -> str:
    """A step size in seconds; of a fraction the nearest number."""
    if isinstance(size, int):
        return _seconds(size)
    return repr(float(size / NANOSECONDS_PER_SECOND))


def _seconds(time: Time) -> str:
    """A time in seconds, exactly."""
    whole, rest = divmod(Fraction(time), NANOSECONDS_PER_SECOND)
    digits = f"{int(rest):09d}".rstrip("0")
    return f"{whole}.{digits}" if digits else str(whole)
