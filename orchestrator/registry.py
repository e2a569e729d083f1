"""Component types by name, found through the entry points of installed packages.

Our own components use the same door as everybody else's:

* `orchestrator.components`: a `Component` subclass, or a `ComponentType`, or a class of one;
* `orchestrator.fmus`: a package that holds `<name>.fmu`;
* `orchestrator.importers`, entry `fmu`: what opens an FMU, a callable `(Path) -> ComponentType`.

Nothing is imported before it is asked for, so that a missing library matters only to those who
use it.
"""

import importlib.resources
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, cast

from orchestrator.component import Component
from orchestrator.errors import ComponentTypeError, defects, in_words
from orchestrator.installed import entry_points, loaded
from orchestrator.parameters import ComponentType, PythonComponentType
from orchestrator.suggestion import suggestion

COMPONENTS: Final = "orchestrator.components"
FMUS: Final = "orchestrator.fmus"
IMPORTERS: Final = "orchestrator.importers"


@dataclass(frozen=True, slots=True)
class Offer:
    """A component type on offer, not loaded yet.

    Attributes:
        entry_points: who offers it under this name; one, unless packages are in conflict.
    """

    entry_points: tuple[EntryPoint, ...]

    @property
    def name(self) -> str:
        """The name of the component type."""
        return self.entry_points[0].name

    @property
    def origin(self) -> str:
        """Where it comes from, e.g. `adapters.sumo:SumoTraffic`."""
        return ", ".join(entry.value for entry in self.entry_points)

    def load(self) -> ComponentType:
        """Import the component type.

        Raises:
            ComponentTypeError: its package cannot be imported or offers something else, or
                several packages offer this name.
        """
        if len(self.entry_points) > 1:
            raise ComponentTypeError(
                f"component type `{self.name}` is offered several times: {self.origin}; "
                "uninstall all but one of these packages"
            )
        entry = self.entry_points[0]
        return _fmu(entry) if entry.group == FMUS else _python(entry)


def installed() -> Mapping[str, Offer]:
    """Every component type on offer, sorted by name."""
    found: dict[str, set[EntryPoint]] = defaultdict(set)
    for group in (COMPONENTS, FMUS):
        for entry in entry_points(group=group):
            found[entry.name].add(entry)
    return MappingProxyType(
        {name: Offer(tuple(sorted(found[name], key=lambda e: e.value))) for name in sorted(found)}
    )


def component_type(name: str) -> ComponentType:
    """The component type called `name`.

    Raises:
        ComponentTypeError: nothing of that name is installed, or it cannot be loaded.
    """
    offers = installed()
    if name not in offers:
        nothing = f"no installed package offers any in the entry points `{COMPONENTS}`"
        hint = suggestion(name, offers) if offers else nothing
        if name.lower().endswith(".fmu"):
            hint = f"in a scenario write `fmu: {name}` in place of `type`"
        elif not hint.startswith("did"):
            hint += "; for an FMU write its file, `model.fmu`, for a class of yours `module:Class`"
        raise ComponentTypeError(f"no component type `{name}` is installed; {hint}")
    return offers[name].load()


def fmu_type(path: Path) -> ComponentType:
    """The component type in the FMU at `path`.

    Raises:
        ComponentTypeError: there is no such file, no importer for FMUs is installed, or the
            importer refuses the file.
    """
    if not path.is_file():
        raise ComponentTypeError(f"there is no file `{path}`")
    importers = [entry for entry in entry_points(group=IMPORTERS) if entry.name == "fmu"]
    if not importers:
        raise ComponentTypeError(
            f"cannot open `{path}`: no package offers `fmu` in the entry points `{IMPORTERS}`"
        )
    open_fmu = cast("Callable[[Path], ComponentType]", _load(importers[0]))
    try:
        return open_fmu(path)
    except ComponentTypeError:
        raise
    except defects() as error:
        raise ComponentTypeError(f"cannot open `{path}`: {in_words(error)}") from error


def _python(entry: EntryPoint) -> ComponentType:
    found = _load(entry)
    if isinstance(found, ComponentType):
        return found
    if isinstance(found, type) and issubclass(found, Component):
        return PythonComponentType(found)
    if isinstance(found, type) and issubclass(found, ComponentType):
        return found()
    raise ComponentTypeError(
        f"component type `{entry.name}`: `{entry.value}` is neither a subclass of `Component` nor "
        "a `ComponentType`"
    )


def _fmu(entry: EntryPoint) -> ComponentType:
    try:
        path = Path(str(importlib.resources.files(entry.value) / f"{entry.name}.fmu"))
    except defects() as error:
        raise ComponentTypeError(f"{_cannot_load(entry)}: {in_words(error)}") from error
    if not path.is_file():
        raise ComponentTypeError(
            f"component type `{entry.name}`: `{entry.value}` is installed without "
            f"`{path.name}`; build it with `nlosim fmu build`"
        )
    return fmu_type(path)


def _load(entry: EntryPoint) -> Any:
    return loaded(entry, _cannot_load(entry))


def _cannot_load(entry: EntryPoint) -> str:
    return f"cannot load `{entry.name}` from `{entry.value}`"


def _sentence(error: BaseException) -> str:
    return in_words(error)
