"""The areas of the product from which breaks are drawn."""

from collections.abc import Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import Final

AREAS: Final[Mapping[str, tuple[str, ...]]] = {
    "kernel": (
        "orchestrator/algorithm/*.py",
        "orchestrator/plan/*",
        "orchestrator/branching.py",
        "orchestrator/contest.py",
        "orchestrator/feedthrough.py",
        "orchestrator/randomness.py",
        "orchestrator/simulation.py",
        "orchestrator/system.py",
        "orchestrator/timebase.py",
    ),
    "transports": ("orchestrator/remote/*.py", "adapters/zenoh/*.py"),
    "importer": ("adapters/fmi/**/*.py",),
    "experiments": ("orchestrator/experiment/**/*.py", "orchestrator/campaign/*.py"),
    "adapters": (
        "adapters/sumo/**/*.py",
        "adapters/replay/*.py",
        "adapters/ssp/**/*.py",
        "adapters/tables/*.py",
        "adapters/traffic/*.py",
    ),
    "units": (
        "fmus/channel/**/*",
        "fmus/facilities/*.py",
        "fmus/lidar/**/*",
        "fmus/messages/**/*.py",
        "fmus/native/*",
        "fmus/perception/*",
        "fmus/physics/*.py",
        "fmus/relay/*.py",
    ),
    "policies": ("fmus/driving/**/*.py", "studies/training/collector.py"),
}
"""Patterns of the files of each area."""

SUFFIXES: Final = (".py", ".c", ".h")


def files_of(area: str, root: Path) -> list[str]:
    """Paths from `root` of the sources of an area, in order."""
    found: Iterable[Path] = (path for each in AREAS[area] for path in root.glob(each))
    return sorted({_posix(path, root) for path in found if path.suffix in SUFFIXES})


def unit_of(file: str) -> str | None:
    """The native unit that has to be built again after a change of a C file; none for the engine.

    What units share is tried in the smallest of them.
    """
    folder = PurePosixPath(file).parts[1]
    return {"native": "lidar", "plan": None}.get(folder, folder)


def _posix(path: Path, root: Path) -> str:
    return path.relative_to(root).as_posix()
