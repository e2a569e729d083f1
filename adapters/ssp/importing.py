"""From a package to a scenario file, with the FMUs beside it."""

import json
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from adapters.fmi.experiment import default_experiment
from adapters.ssp.common import COMPONENT, TOP
from adapters.ssp.description import Fmus, read_description
from adapters.ssp.draft import ComponentDraft, Draft, Page, page
from adapters.ssp.flows import Network, network
from adapters.ssp.implementation import OPTION, NoSuchInterfaceError, chosen
from adapters.ssp.interfaces import Interface, completed
from adapters.ssp.model import SOURCES, Component, Description
from adapters.ssp.naming import named
from adapters.ssp.node import Findings
from adapters.ssp.package import Package, opened_package
from adapters.ssp.routing import inner, routed
from adapters.ssp.settings import Setting, Settings
from adapters.ssp.times import Times, Wanted, times
from orchestrator.errors import ComponentTypeError, CosimError, Location, Problem, ScenarioError
from orchestrator.scenario.build import load_scenario
from orchestrator.scenario.units import span
from orchestrator.scenario.wiring import assemble
from orchestrator.timebase import StepSize
from orchestrator.units import UnitError


@dataclass(frozen=True, slots=True, kw_only=True)
class Imported:
    """A scenario from a package.

    Attributes:
        path: of the scenario file.
        components, connections: how many there are.
        remarks: what is not wrong, but may not be meant; what is left out is among them.
        obstacles: why it cannot run as it is, each where the package says it.
    """

    path: Path
    components: int
    connections: int
    remarks: tuple[Problem, ...]
    obstacles: tuple[Problem, ...]


def import_package(
    path: Path,
    folder: Path,
    *,
    variant: str | None = None,
    wanted: Wanted | None = None,
    trusts_numbers: bool = False,
) -> Imported:
    """Write the scenario of a package into a new folder. Nothing of its FMUs is run.

    Args:
        path: of the package.
        folder: which is made; it may exist if it is empty.
        variant: a file or the name of a description; `None` for the main one.
        wanted: times that count instead of those of the package.
        trusts_numbers: whether numbers whose unit nothing defines are taken as they are.

    Raises:
        ScenarioError: something in the package cannot be used; every problem with its place in
            it. There is no folder then.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        what = f"there is `{folder}` already; choose another folder with `-o`"
        raise ScenarioError([Problem(Location(str(path), 1, 1), what)])
    folder.parent.mkdir(parents=True, exist_ok=True)
    findings = Findings(trusts_numbers=trusts_numbers)
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as place:
        staged = Path(place) / "scenario"
        staged.mkdir()
        found, made = _read(path, staged, variant, wanted or Wanted(), findings)
        file = staged / f"{path.stem}.yaml"
        if file.exists():
            where = Location(str(path), 1, 1)
            raise ScenarioError([Problem(where, f"an FMU in it is called `{file.name}`")])
        file.write_text(made.text, encoding="utf-8")
        obstacles = tuple(_obstacles(file.resolve(), made))
        folder.mkdir(exist_ok=True)
        for each in staged.iterdir():
            shutil.move(each, folder / each.name)
    left_out = (Problem(where, f"left out: {what}") for what, where in findings.unused.items())
    return Imported(
        path=folder / f"{path.stem}.yaml",
        components=len(found.components),
        connections=len(found.connections),
        remarks=tuple(sorted((*findings.remarks, *left_out), key=lambda p: (p.where, p.what))),
        obstacles=obstacles,
    )


def _read(
    path: Path, staged: Path, variant: str | None, wanted: Wanted, findings: Findings
) -> tuple[Draft, Page]:
    """The scenario of a package, its FMUs unpacked."""
    with opened_package(path) as package:
        description, fmus = read_description(package, variant, findings)
        findings.check()
        interfaces = _interfaces(fmus, staged, package, findings)
    system = completed(description.system, interfaces, findings)
    net = network(system, findings)
    settings = Settings(net, interfaces, findings)
    settings.apply((), system)
    experiments = [default_experiment(staged / source) for source in interfaces]
    when = times(description, experiments, wanted, findings)
    names = named({path: each.said.get("name") for path, each in net.components.items()})
    connections = routed(net, interfaces, names, findings)
    for element, component in net.components.items():
        offered = interfaces[component.source]
        try:
            kind = chosen(component.implementation, offered.kinds, offered.options)
        except NoSuchInterfaceError as error:
            findings.add(component.where, f"component `{component.name}`: {error}")
        else:
            if kind is not None:
                settings.found[element][OPTION] = Setting(kind, component.where)
    for element, variables in inner(net, interfaces).items():
        where = net.components[element].where
        settings.found[element]["fmi.locals"] = Setting(list(variables), where)
    _mention_ends(net, findings)
    if not net.components:
        findings.add(description.system.where, "there is no component in the system")
    draft = Draft(
        package=path.name,
        head=_head(path, description),
        title=description.said.get("title") or description.name or path.stem,
        description=description.said.get("description", description.description),
        start=when.start,
        stop=when.stop,
        times_from=when.from_,
        until=description.said.get("until"),
        top=_noted(description.said, TOP, description.where, findings),
        components=tuple(
            _component(names[path], component, when, settings.found[path], findings)
            for path, component in net.components.items()
        ),
        connections=connections,
    )
    findings.check()
    return draft, page(draft)


def _interfaces(
    fmus: Fmus, staged: Path, package: Package, findings: Findings
) -> dict[str, Interface]:
    """What the FMUs of a package offer; they are unpacked from it."""
    found = {}
    for source, (holder, name) in fmus.items():
        target = staged / source
        target.parent.mkdir(parents=True, exist_ok=True)
        with holder.archive.open(name) as packed, target.open("wb") as unpacked:
            shutil.copyfileobj(packed, unpacked)
        try:
            found[source] = Interface.of(target)
        except ComponentTypeError as error:
            what = str(error).removeprefix(f"{target}: ")
            findings.add(Location(f"{package.name}/{source}", 1, 1), what)
    findings.check()
    return found


def _component(
    name: str,
    component: Component,
    when: Times,
    settings: Mapping[str, Setting],
    findings: Findings,
) -> ComponentDraft:
    where = component.where
    step: StepSize = when.step
    step_from = when.step_from
    if "step" in component.said:
        step_from = "as nlosim has noted down"
        try:
            step = span(component.said["step"])
        except UnitError as error:
            findings.add(where, f"`step` of a note of nlosim: {error}")
    extra = _noted(component.said, COMPONENT, where, findings)
    options = extra.pop("parameters", {})
    if not isinstance(options, dict):
        findings.add(where, "`parameters` of a note of nlosim: expected a mapping")
        options = {}
    return ComponentDraft(
        name=name,
        description=component.description,
        fmu=component.source,
        step=step,
        step_from=step_from,
        extra=extra,
        settings={**settings, **{n: _both(settings.get(n), v, where) for n, v in options.items()}},
        where=where,
    )


def _both(setting: Setting | None, value: Any, where: Location) -> Setting:
    """What nlosim has noted down, and what the package asks for besides."""
    if setting is None or not isinstance(value, list):
        return Setting(value, where)
    return Setting(list(dict.fromkeys((*value, *setting.value))), setting.where)


def _noted(
    said: Mapping[str, str], keys: Sequence[str], where: Location, findings: Findings
) -> dict[str, Any]:
    """What nlosim has noted down as JSON under these keys."""
    found = {}
    for key in keys:
        if key in said:
            try:
                found[key] = json.loads(said[key])
            except ValueError as error:
                findings.add(where, f"`{key}` of a note of nlosim: {error}")
    return found


def _mention_ends(net: Network, findings: Findings) -> None:
    """Say what becomes of the outputs of the system, and which of its inputs nobody drives."""
    for spot, port in net.ports.items():
        if not spot.path and port.kind in SOURCES:
            findings.leave_out(
                port.where, "outputs of the system; recorded are those of components"
            )
    for spot in dict.fromkeys(flow.source for flow in net.flows if not flow.is_driven):
        port = net.ports[spot]
        what = f"nothing drives `{'.'.join((*spot.path, spot.connector))}`: a start value stays"
        if port.kind == "input":
            findings.remark(port.where, what)


def _head(path: Path, description: Description) -> tuple[str, ...]:
    """Comments at the top of the file."""
    said = f"{description.file.partition('/')[2]}, SSP {description.version}"
    return (
        f"From {path.name}: {said}, system `{description.system.name}`.",
        "A comment says where the line is from.",
        *(f"{name}: {text}" for name, text in description.credits.items()),
    )


def _obstacles(path: Path, made: Page) -> Iterator[Problem]:
    """What `nlosim check` finds, where the package says it."""
    place = f"{path.parent.resolve()}/"
    try:
        assemble(load_scenario(path)).close()
    except ScenarioError as error:
        for problem in error.problems:
            yield Problem(_origin(made, problem.where), problem.what.replace(place, ""))
    except CosimError as error:
        yield Problem(Location(path.name, 1, 1), str(error).replace(place, ""))


def _origin(made: Page, where: Location) -> Location:
    """What says a line of the scenario, or the next line above it that something says."""
    line = next((n for n in range(where.line, 0, -1) if n in made.origins), None)
    return where if line is None else made.origins[line]
