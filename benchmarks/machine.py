"""The machine and the versions on which a benchmark ran."""

import os
import platform
from collections.abc import Mapping
from typing import Any

from orchestrator.machine import commit, cpu, load_average, memory_gib
from orchestrator.provenance import DISTRIBUTION, provenance


def environment() -> Mapping[str, Any]:
    """Machine, versions and commit, for the output of a benchmark."""
    origin = provenance()
    versions = {name: origin["versions"][name] for name in (DISTRIBUTION, "python", "numpy")}
    return {
        "created": origin["created"],
        "commit": commit(),
        "machine": {
            "cpu": cpu(),
            "cpus": os.cpu_count(),
            "memory_gib": memory_gib(),
            "load_average": load_average(),
            "platform": platform.platform(),
        },
        "versions": versions,
    }
