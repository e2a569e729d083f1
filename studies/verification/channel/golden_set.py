"""A directory of golden data: what is in it, and what each file is compared by."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from studies.verification.channel import (
    antenna,
    buildings,
    error_rate,
    fading,
    knife_edge_profiles,
    min_snir,
    path_loss,
    stack,
    vehicles,
)
from studies.verification.channel.check import Check
from studies.verification.channel.problems import GoldenError

_READERS: Final[Mapping[str, Callable[[Path], Check]]] = {
    path_loss.NAME: path_loss.read,
    buildings.NAME: buildings.read,
    vehicles.NAME: vehicles.read,
    knife_edge_profiles.NAME: knife_edge_profiles.read,
    antenna.NAME: antenna.read,
    error_rate.NAME: error_rate.read,
    min_snir.NAME: min_snir.read,
    fading.NAME: fading.read,
}
_STACK: Final = "stack"
_NOT_COMPARED: Final = {
    "FORMAT.md": "describes the files",
    "README.md": "describes the files",
    "cost.json": "wall times, no results",
}


@dataclass(frozen=True, slots=True)
class GoldenSet:
    """What a directory holds.

    Attributes:
        checks: by the name of the file, or `stack/<run>`.
        skipped: names of other files, and why they are not compared.
    """

    checks: Mapping[str, Check]
    skipped: Mapping[str, str]


def read_golden_set(directory: Path, seeds: int) -> GoldenSet:
    """Read everything in a directory.

    Args:
        directory: with golden data.
        seeds: how often each run of the whole stack is repeated.

    Raises:
        GoldenError: with the first problem of each file; or there is nothing to compare.
    """
    if not directory.is_dir():
        raise GoldenError([f"{directory}: there is no such directory"])
    found = {path.name: path for path in sorted(directory.iterdir())}
    runs = _runs(found.pop(_STACK, None))
    readers = {name: read for name, read in _READERS.items() if name in found}
    checks: dict[str, Check] = {}
    problems: list[str] = []
    for name, read in readers.items():
        try:
            checks[name] = read(found[name])
        except GoldenError as error:
            problems += error.problems
    for name, folder in runs.items():
        try:
            checks[name] = stack.read(folder, seeds)
        except GoldenError as error:
            problems += error.problems
    if not checks and not problems:
        known = ", ".join([*_READERS, f"{_STACK}/RUN/"])
        problems.append(f"{directory}: holds no golden data; known are: {known}")
    if problems:
        raise GoldenError(problems)
    others = {name: _why(name) for name in found if name not in readers}
    return GoldenSet(checks, others | _stray(directory / _STACK))


def _runs(folder: Path | None) -> dict[str, Path]:
    if folder is None or not folder.is_dir():
        return {}
    return {f"{_STACK}/{path.name}": path for path in sorted(folder.iterdir()) if path.is_dir()}


def _stray(folder: Path) -> dict[str, str]:
    """Files among the folders of the runs."""
    if not folder.is_dir():
        return {}
    return {f"{_STACK}/{p.name}": _why(p.name) for p in sorted(folder.iterdir()) if p.is_file()}


def _why(name: str) -> str:
    return _NOT_COMPARED.get(name, "unknown, not compared")
