"""Compares the channel with everything in a directory of golden data."""

import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from tqdm import tqdm

from orchestrator.errors import ComponentError
from studies.verification.channel.check import Check
from studies.verification.channel.comparison import Comparison
from studies.verification.channel.fading import FADING_STATISTICS, read_fading
from studies.verification.channel.golden_files import GoldenError
from studies.verification.channel.link_budget import (
    ANTENNA,
    PATH_LOSS,
    read_antenna,
    read_path_loss,
)
from studies.verification.channel.reception import (
    ERROR_RATE,
    MIN_SNIR,
    read_error_rate,
    read_min_snir,
)
from studies.verification.channel.session import ChannelUnderTest
from studies.verification.channel.shadowing import (
    BUILDINGS,
    KNIFE_EDGES,
    VEHICLES,
    read_buildings,
    read_knife_edges,
    read_vehicles,
)
from studies.verification.channel.stack import read_stack

_READERS: Final[Mapping[str, Callable[[Path], Check]]] = {
    PATH_LOSS: read_path_loss,
    BUILDINGS: read_buildings,
    VEHICLES: read_vehicles,
    KNIFE_EDGES: read_knife_edges,
    ANTENNA: read_antenna,
    ERROR_RATE: read_error_rate,
    MIN_SNIR: read_min_snir,
    FADING_STATISTICS: read_fading,
}
_STACK: Final = "stack"
_NOT_COMPARED: Final = {
    "FORMAT.md": "describes the files",
    "README.md": "describes the files",
    "cost.json": "wall times, no results",
}
_HEAD: Final[tuple[str, ...]] = (
    "file",
    "cases",
    "largest error",
    "tolerance",
    "excepted",
    "mismatches",
    "misses",
    "",
)


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
            checks[name] = read_stack(folder, seeds)
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


@dataclass(frozen=True, slots=True)
class Verification:
    """What comparing a directory of golden data found.

    Attributes:
        files: by the name of the golden file, or `stack/<run>`.
        skipped: files that were not compared, and why.
    """

    files: Mapping[str, Comparison]
    skipped: Mapping[str, str]

    @property
    def passes(self) -> bool:
        """Whether every file passes."""
        return all(comparison.passes for comparison in self.files.values())

    def as_data(self) -> Mapping[str, Any]:
        """What `--json` prints."""
        return {
            "pass": self.passes,
            "files": {name: comparison.as_data() for name, comparison in self.files.items()},
            "skipped": dict(self.skipped),
        }


def verify(channel: ChannelUnderTest, golden: GoldenSet) -> Verification:
    """Run every check, with a progress bar on standard error.

    A file on which the channel fails does not pass; the others are compared.
    """
    files: dict[str, Comparison] = {}
    work = sum(check.work for check in golden.checks.values())
    with tqdm(total=work, file=sys.stderr, leave=False, disable=None) as bar:  # on a terminal only
        for name, check in golden.checks.items():
            bar.set_description(name)
            try:
                files[name] = check.run(channel, bar.update)
            except ComponentError as error:
                files[name] = Comparison.failure(check.tolerance, f"{name}: {error}")
    return Verification(files, golden.skipped)


def as_text(verification: Verification) -> str:
    """Write a table, what did not pass, and what was left out."""
    rows = [_HEAD, *(_row(name, comparison) for name, comparison in verification.files.items())]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = []
    for name, *cells, verdict in rows:
        padded = (f"{cell:>{width}}" for cell, width in zip(cells, widths[1:-1], strict=True))
        lines.append(f"{name:<{widths[0]}}  {'  '.join(padded)}  {verdict}".rstrip())
    for comparison in verification.files.values():
        lines += [f"  {note}" for note in comparison.notes]
    lines += [f"skipped: {name} ({why})" for name, why in verification.skipped.items()]
    good = sum(comparison.passes for comparison in verification.files.values())
    lines.append(f"{good} of {len(verification.files)} files pass")
    return "\n".join(lines)


def _row(name: str, comparison: Comparison) -> tuple[str, ...]:
    return (
        name,
        str(comparison.cases),
        amount(comparison.largest, comparison.unit),
        amount(comparison.tolerance, comparison.unit),
        str(comparison.excepted),
        str(comparison.mismatches),
        str(comparison.misses),
        "pass" if comparison.passes else "FAIL",
    )


def amount(value: float, unit: str) -> str:
    """Write a value with two digits and its unit."""
    return f"{value:.2g}" if unit == "1" else f"{value:.2g} {unit}"
