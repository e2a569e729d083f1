"""Where a result comes from: versions of everything that computed it, and the host."""

import os
import platform
import socket
from collections.abc import Mapping
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, distribution, version
from types import MappingProxyType
from typing import Any, Final

DISTRIBUTION: Final = "nlosim"


def nlosim_version() -> str:
    """The version of this distribution."""
    return _version(DISTRIBUTION) or "not installed"


def provenance() -> Mapping[str, Any]:
    """What the manifest of a run says of its origin; none of it may influence the results."""
    return {
        "created": datetime.now(tz=UTC).isoformat(timespec="seconds"),
        "versions": {
            DISTRIBUTION: nlosim_version(),
            "python": platform.python_version(),
            **_dependencies(),
        },
        "host": {
            "name": socket.gethostname(),
            "platform": platform.platform(),
            "machine": platform.machine(),
            "cpus": os.cpu_count(),
        },
    }


@cache
def _dependencies() -> Mapping[str, str]:
    """The installed versions of what this distribution requires, extras included."""
    try:
        requirements = distribution(DISTRIBUTION).requires or []
    except PackageNotFoundError:
        requirements = ["numpy"]
    names = sorted({_name(text) for text in requirements} - {DISTRIBUTION})
    return MappingProxyType({name: found for name in names if (found := _version(name))})


def _name(requirement: str) -> str:
    """The name in front of a requirement such as `libsumo==1.28.0; extra == 'x'`."""
    end = next((i for i, c in enumerate(requirement) if not (c.isalnum() or c in "-_.")), None)
    return requirement[:end]


def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None
