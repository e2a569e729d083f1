"""What installed packages offer in their entry points, and modules that may not be installed.

Reading them takes longer than all else when a scenario is loaded; they are the same as long as
Python looks for packages in the same places.
"""

import importlib
import importlib.metadata
import sys
from collections.abc import Collection, Mapping
from functools import lru_cache
from importlib.metadata import EntryPoint, EntryPoints
from types import ModuleType
from typing import Any, TypeVar

from orchestrator.errors import ComponentTypeError, defects, in_words
from orchestrator.suggestion import suggestion

_Base = TypeVar("_Base")


def entry_points(group: str) -> EntryPoints:
    """The entry points of all installed packages in `group`."""
    return _of(group, tuple(sys.path))


def offers(group: str) -> Mapping[str, str]:
    """What packages offer in `group`: where each comes from, by name, sorted."""
    return {entry.name: entry.value for entry in sorted(entry_points(group=group))}


@lru_cache
def _of(group: str, path: tuple[str, ...]) -> EntryPoints:
    """The entry points in `group` of the packages on `path`."""
    return _found(path).select(group=group)


@lru_cache
def _found(path: tuple[str, ...]) -> EntryPoints:
    """The entry points of the packages on `path`, which is `sys.path`, read once for all groups."""
    del path
    everything = importlib.metadata.entry_points()  # before Python 3.12 a mapping of groups
    return EntryPoints(each for name in everything.groups for each in everything.select(group=name))


def loaded(entry: EntryPoint, what: str) -> Any:
    """What an entry point names, imported.

    Args:
        entry: of an installed package.
        what: how the message begins if it cannot be imported.

    Raises:
        ComponentTypeError: whatever went wrong is its cause.
    """
    try:
        return entry.load()
    except defects() as error:  # whatever a plug-in does when it is imported
        raise ComponentTypeError(f"{what}: {in_words(error)}") from error


def module_of_extra(module: str, what: str, *, extra: str, otherwise: str) -> ModuleType:
    """A module that is installed with an extra of this package.

    Args:
        module: to import.
        what: needs it, in the plural.
        extra: with which it comes.
        otherwise: what to do without it.

    Raises:
        ComponentTypeError: it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        how = f"pip install 'nlosim[{extra}]'; {otherwise}"
        raise ComponentTypeError(f"{what} need the extra `{extra}`: {how}") from None


def installed_class(
    group: str, name: str, base: type[_Base], noun: str, built_in: Collection[str] = ()
) -> type[_Base]:
    """Load the class that an installed package offers as `name`.

    Args:
        group: of entry points.
        name: of the entry point.
        base: what the class must be derived from.
        noun: what messages call it.
        built_in: names that could have been meant as well, though no package offers them.

    Raises:
        ComponentTypeError: it is not installed, or cannot be loaded.
    """
    offers = {entry.name: entry for entry in entry_points(group=group)}
    if name not in offers:
        hint = suggestion(name, {*offers, *built_in})
        raise ComponentTypeError(f"no {noun} `{name}` is installed; {hint}")
    found = loaded(offers[name], f"the {noun} `{name}` cannot be loaded")
    if not (isinstance(found, type) and issubclass(found, base)):
        what = f"the {noun} `{name}` is not a class derived from `{base.__name__}`"
        raise ComponentTypeError(what)
    return found
