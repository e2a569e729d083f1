"""Compares the channel with everything in a directory of golden data."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from orchestrator.errors import ComponentError
from studies.verification.channel.comparison import Comparison
from studies.verification.channel.golden_set import GoldenSet
from studies.verification.channel.progress import progress
from studies.verification.channel.session import ChannelUnderTest

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
class Verification:
    """All comparisons.

    Attributes:
        files: by the name of the golden file, or `stack/<run>`.
        skipped: files that were not compared, and why.
    """

    files: Mapping[str, Comparison]
    skipped: Mapping[str, str]

    @property
    def passes(self) -> bool:
        """Whether every file does."""
        return all(comparison.passes for comparison in self.files.values())

    def as_data(self) -> Mapping[str, Any]:
        """For `--json`."""
        return {
            "pass": self.passes,
            "files": {name: file_data(comparison) for name, comparison in self.files.items()},
            "skipped": dict(self.skipped),
        }


def verify(channel: ChannelUnderTest, golden: GoldenSet) -> Verification:
    """Run every check. A file on which the channel fails does not pass; the others are compared."""
    files: dict[str, Comparison] = {}
    with progress(sum(check.work for check in golden.checks.values())) as bar:
        for name, check in golden.checks.items():
            bar.begin(name)
            try:
                files[name] = check.run(channel, bar)
            except ComponentError as error:
                files[name] = Comparison.failure(check.tolerance, f"{name}: {error}")
    return Verification(files, golden.skipped)


def file_data(comparison: Comparison) -> dict[str, Any]:
    """The result for one file, for `--json`."""
    largest = comparison.largest
    return {
        "pass": comparison.passes,
        "cases": comparison.cases,
        "max_error": largest if math.isfinite(largest) else None,
        "unit": comparison.unit,
        "tolerance": comparison.tolerance,
        "mismatches": comparison.mismatches,
        "misses": comparison.misses,
        "excepted": comparison.excepted,
        "notes": list(comparison.notes),
        **comparison.details,
    }


def as_text(verification: Verification) -> str:
    """A table, what did not pass, and what was left out."""
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
    """Two digits and the unit."""
    return f"{value:.2g}" if unit == "1" else f"{value:.2g} {unit}"
