"""Names of components of a scenario for elements of nested systems."""

import re
from collections.abc import Iterable
from typing import Final

from adapters.ssp.flows import Path

_OTHER: Final = re.compile(r"[^A-Za-z0-9_-]+")


def named(paths: Iterable[Path]) -> dict[Path, str]:
    """A name for each path: its parts with hyphens between, and a number where that is taken."""
    found: dict[Path, str] = {}
    taken: set[str] = set()
    for path in paths:
        plain = "-".join(_OTHER.sub("_", part) for part in path).lstrip("-") or "component"
        name, number = plain, 2
        while name in taken:
            name, number = f"{plain}-{number}", number + 1
        taken.add(name)
        found[path] = name
    return found
