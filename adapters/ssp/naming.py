"""Names of components of a scenario for elements of nested systems, and the other way."""

import re
from collections.abc import Iterable, Mapping
from typing import Final, TypeVar

from adapters.ssp.flows import Path

Key = TypeVar("Key")

_OTHER: Final = re.compile(r"[^A-Za-z0-9_-]+")

_NO_IDENTIFIER: Final = re.compile(r"[^A-Za-z0-9_]")


def named(paths: Mapping[Path, str | None]) -> dict[Path, str]:
    """A name for each path: its parts with hyphens between, and a number where that is taken.

    Args:
        paths: with the names that nlosim has noted down for them, which are not changed.
    """
    plain = {
        path: noted or "-".join(_OTHER.sub("_", part) for part in path).lstrip("-") or "component"
        for path, noted in paths.items()
    }
    return _distinct(plain, "-")


def identifiers(names: Iterable[str]) -> dict[str, str]:
    """An identifier for each name: letters, digits and underscores, the first one a letter.

    Names that are identifiers stay. SSP allows any text; OMSimulator opens no package that has
    other names.
    """
    plain = {name: _NO_IDENTIFIER.sub("_", name) for name in names}
    made = {name: each if each[:1].isalpha() else f"c_{each}" for name, each in plain.items()}
    return _distinct(dict(sorted(made.items(), key=lambda each: each[0] != each[1])), "_")


def _distinct(plain: Mapping[Key, str], between: str) -> dict[Key, str]:
    """Names of which those that are taken get a number."""
    found: dict[Key, str] = {}
    taken: set[str] = set()
    for key, first in plain.items():
        name, number = first, 2
        while name in taken:
            name, number = f"{first}{between}{number}", number + 1
        taken.add(name)
        found[key] = name
    return found
