"""Where a result comes from: versions of everything that computed it, and the host."""

import os
import platform
import re
import socket
from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, version
from types import MappingProxyType
from typing import Any, Final

DISTRIBUTION: Final = "nlosim"

_TOOLS: Final = frozenset({"audit", "dev", "docs", "mutation", "release"})
"""Extras for work on this package; nothing of them takes part in a run."""


def nlosim_version() -> str:
    """The version of this distribution."""
    return _version(DISTRIBUTION) or "not installed"


def provenance(others: Iterable[str] = ()) -> Mapping[str, Any]:
    """What the manifest of a run says of its origin; none of it may influence the results.

    Args:
        others: further distributions that take part.
    """
    return {
        "created": datetime.now(tz=UTC).isoformat(timespec="seconds"),
        "versions": versions(others),
        "host": {
            "name": socket.gethostname(),
            "platform": platform.platform(),
            "machine": platform.machine(),
            "cpus": os.cpu_count(),
        },
    }


def versions(others: Iterable[str] = ()) -> dict[str, str]:
    """Versions of Python, this distribution, `others`, and all installed ones they require.

    Extras of this distribution count, but for those for work on it.
    """
    named = frozenset(others) - {DISTRIBUTION}
    return {
        DISTRIBUTION: nlosim_version(),
        "python": platform.python_version(),
        **_required(named),
    }


@cache
def _required(others: frozenset[str]) -> Mapping[str, str]:
    """The installed versions of `others` and of all that they and this distribution require."""
    found: dict[str, str] = {}
    waiting = [*others, *_requirements(DISTRIBUTION, with_extras=True)]
    while waiting:
        name = waiting.pop()
        if name in found or name == DISTRIBUTION or (there := _version(name)) is None:
            continue
        found[name] = there
        waiting += _requirements(name, with_extras=False)
    return MappingProxyType(dict(sorted(found.items())))


def _requirements(name: str, *, with_extras: bool) -> Iterator[str]:
    """The names of the distributions that one requires."""
    try:
        said = distribution(name).requires or []
    except PackageNotFoundError:
        said = []
    for text in said:
        extras = set(re.findall(r"extra\s*==\s*['\"]([\w-]+)['\"]", text))
        if not extras or (with_extras and not extras <= _TOOLS):
            yield _name(text)


def _name(requirement: str) -> str:
    """The name in front of a requirement such as `libsumo==1.28.0; extra == 'x'`, in one form."""
    end = next((i for i, c in enumerate(requirement) if not (c.isalnum() or c in "-_.")), None)
    return re.sub(r"[-_.]+", "-", requirement[:end]).lower()


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
