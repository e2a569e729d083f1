"""What the manifest of a run says before it begins: all that repeats it, and shows that it did.

Nothing here needs the machine to be the same. Paths of inputs are said from where they can be found
again: the folder of the scenario, or one of installed packages.
"""

import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from orchestrator.algorithm.base import GROUP as ALGORITHMS
from orchestrator.input_files import digest
from orchestrator.installed import entry_points
from orchestrator.measure import GROUP as MEASURES
from orchestrator.placement import GROUP as TRANSPORTS, Placement
from orchestrator.provenance import provenance
from orchestrator.registry import COMPONENTS, FMUS, IMPORTERS
from orchestrator.report import GROUP as REPORTS
from orchestrator.resuming.continuation import OPTIONS, Settings
from orchestrator.scenario import installed
from orchestrator.scenario.cautions import cautions
from orchestrator.scenario.inputs import digests, scenario_digests, shown
from orchestrator.scenario.model import Scenario
from orchestrator.scenario.path_values import PathValue, path_values
from orchestrator.statement import Statement
from orchestrator.wording import Privately, Wording

PATHS: Final = "paths"
"""The key of what `found_again` says."""

FOLDER, PACKAGES, ANYWHERE = "scenario", "packages", "anywhere"
"""Where the path of an input starts."""


def manifest_of(
    scenario: Scenario,
    turns: Sequence[str],
    placed: Placement,
    *,
    found: Mapping[str, Statement],
    asked: Settings,
    wording: Wording,
) -> dict[str, Any]:
    """The manifest of a run that is about to begin, in terms of JSON.

    Args:
        scenario: of the run.
        turns: the order in which its components step.
        placed: where they are.
        found: what hosts say of those that they have, by name.
        asked: how the run was asked for.
        wording: how it is written down.
    """
    away = {
        name: {"host": use.host, "nlosim": found[name].nlosim, "files": found[name].files}
        for name, use in placed.away.items()
    }
    origin = dict(provenance(distributions(scenario, placed.transport)))
    if wording.is_private:
        origin.pop("host")
        away = {name: {**each, "host": None} for name, each in away.items()}
    package, folder = _package(scenario.path), scenario.path.absolute().parent
    said = {
        **origin,
        **({"private": True} if wording.is_private else {}),
        "scenario_file": str(scenario.path.absolute()),
        **({} if package is None else {"installed": package}),
        "scenario_files": scenario_digests(scenario),
        "overrides": list(scenario.overrides),
        "seed": scenario.seed,
        "transport": placed.transport,
        OPTIONS: {
            "transport": asked.transport,
            "figure": asked.figure,
            "page": asked.page,
            "default_measures": asked.default_measures,
        },
        **({"hosts": away} if away else {}),
        "turns": list(turns),
        "files": digests(scenario, without=away),
        PATHS: [
            found_again(each, folder) for each in path_values(scenario) if each.reader not in away
        ],
        **({"cautions": list(warned)} if (warned := cautions(scenario)) else {}),
        "scenario": scenario.resolved(),
    }
    made: dict[str, Any] = wording.plain(said)
    return made


def private_wording(scenario: Scenario, *folders: Path) -> Privately:
    """Leaves out the folders of a scenario, of what it names, and `folders`."""
    near = [scenario.path.parent, *scenario.document.folders.values()]
    near += [each.path.parent for each in path_values(scenario)]
    return Privately(*(each.absolute() for each in near), *folders)


def found_again(value: PathValue, folder: Path) -> dict[str, Any]:
    """Where an input is found again, and what is in it.

    Args:
        value: whose path it is.
        folder: of the scenario.
    """
    path = value.path.absolute()
    entries = (Path(each) for each in sys.path if each)
    if path.is_relative_to(folder):
        start, name = FOLDER, shown(path, folder)
    else:
        near = [entry for entry in entries if path.is_relative_to(entry) and entry != Path("/")]
        start = PACKAGES if near else ANYWHERE
        name = shown(path, max(near, key=lambda entry: len(entry.parts)) if near else folder)
    return {
        "reader": value.reader,
        "at": list(value.at),
        "from": start,
        "path": name,
        **({"rest": value.rest} if value.rest else {}),
        "sha256": digest(path) if path.is_file() else None,
    }


def distributions(scenario: Scenario, transport: str) -> frozenset[str]:
    """The names of the distributions whose plug-ins take part in a run."""
    return frozenset(
        entry.dist.name
        for group, name in _plug_ins(scenario, transport)
        for entry in entry_points(group=group)
        if entry.name == name and entry.dist is not None
    )


def _plug_ins(scenario: Scenario, transport: str) -> Iterator[tuple[str, str]]:
    """Group and name of every plug-in."""
    for use in scenario.components.values():
        if use.fmu is not None:
            yield IMPORTERS, "fmu"
        elif use.type_name is not None:
            yield COMPONENTS, use.type_name
            yield FMUS, use.type_name
    yield ALGORITHMS, scenario.coupling.type_name
    yield TRANSPORTS, transport
    for each in (scenario.measures or {}).values():
        yield MEASURES, each.type_name
    if scenario.report is not None:
        yield REPORTS, scenario.report.type_name


def _package(path: Path) -> str | None:
    """The name of the installed scenario whose file this is; `None` if it is none."""
    offers = installed.installed().get(path.stem, ())
    return path.stem if any(each.path.absolute() == path.absolute() for each in offers) else None
