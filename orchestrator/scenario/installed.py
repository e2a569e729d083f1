"""Scenarios that come with installed packages, by name.

A package ships scenarios by an entry point of the group `orchestrator.scenarios`; its value is a
package whose YAML files are the scenarios, each called as its file is without the suffix. What they
need (nets, tables, FMUs) lies beside them, in the same package.
"""

import importlib.resources
import logging
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from orchestrator.errors import CosimError, defects, in_words
from orchestrator.installed import entry_points
from orchestrator.regular_files import why_no_file
from orchestrator.suggestion import suggestion

logger = logging.getLogger(__name__)

SCENARIOS: Final = "orchestrator.scenarios"
SUFFIXES: Final = (".yaml", ".yml")


class NoSuchScenarioError(CosimError):
    """Neither a file nor one installed scenario is called so. Exit code 2."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InstalledScenario:
    """A scenario of an installed package, not read yet.

    Attributes:
        name: what `nlosim run` takes.
        package: that holds it, e.g. `scenarios`.
        path: of its file.
    """

    name: str
    package: str
    path: Path


def installed() -> Mapping[str, tuple[InstalledScenario, ...]]:
    """Every installed scenario, sorted by name; several of one name if packages are in conflict."""
    found: dict[str, list[InstalledScenario]] = defaultdict(list)
    for package in sorted({entry.value for entry in entry_points(group=SCENARIOS)}):
        for scenario in _scenarios(package):
            found[scenario.name].append(scenario)
    return MappingProxyType({name: tuple(found[name]) for name in sorted(found)})


def installed_scenario(name: str) -> InstalledScenario:
    """The installed scenario called `name`.

    Raises:
        NoSuchScenarioError: there is none, or several packages have one.
    """
    offers = installed()
    found = offers.get(name, ())
    if not found:
        what = f"no scenario called `{name}` is installed; {suggestion(name, offers)}"
        raise NoSuchScenarioError(what)
    if len(found) > 1:
        places = ", ".join(f"`{scenario.path}`" for scenario in found)
        raise NoSuchScenarioError(f"several scenarios are called `{name}`; give a path: {places}")
    return found[0]


def scenario_path(given: str) -> Path:
    """The file that `given` means: a path, or the name of an installed scenario.

    An existing file wins over an installed scenario, and that one over a folder or a pipe. What has
    a folder or a suffix of YAML is a path, whether there is such a file or not.

    Raises:
        NoSuchScenarioError: it is no file, and the name of no installed scenario or of several.
    """
    path = Path(given)
    if not _may_be_a_name(given) or path.is_file():
        return path
    if path.exists() and given not in installed():  # whoever reads it says what it is
        return path
    return _by_name(given, f"there is no file `{given}`")


def scenario_beside(folder: Path, given: str) -> Path:
    """The file that `given` means where it stands in a file in `folder`.

    As `scenario_path`, but that a path is relative to `folder`.

    Raises:
        NoSuchScenarioError: there is no such file, and no or several installed scenarios of that
            name.
    """
    path = folder / given
    what = why_no_file(path)
    if not what:
        return path
    if not _may_be_a_name(given):
        raise NoSuchScenarioError(what)
    return _by_name(given, what)


def _may_be_a_name(given: str) -> bool:
    path = Path(given)
    return path.name == given and path.suffix not in SUFFIXES


def _by_name(given: str, what: str) -> Path:
    """The file of an installed scenario; `what` says why it is not that of a path."""
    offers = installed()
    if given not in offers:
        what = f"{what}, and no scenario of that name is installed"
        raise NoSuchScenarioError(f"{what}; {suggestion(given, offers)}")
    return installed_scenario(given).path


def _scenarios(package: str) -> Iterator[InstalledScenario]:
    """Those in `package`; none, and a warning, if it cannot be imported."""
    try:
        folder = Path(str(importlib.resources.files(package)))
    except defects() as error:  # a broken package must not take the others' scenarios away
        why = in_words(error)
        logger.warning("the scenarios of `%s` cannot be listed: %s", package, why)
        return
    for path in sorted(folder.glob("*")):
        if path.suffix in SUFFIXES:
            yield InstalledScenario(name=path.stem, package=package, path=path)
