"""What comparing one golden file with the channel found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Self

import numpy as np

from orchestrator.signal import Array
from studies.verification.channel.tolerances import Tolerance

_SHOWN: Final = 5
"""Misses that are described one by one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """What a figure shows of a comparison: values over values, as shape (n,) each.

    Attributes:
        label: for the legend.
        golden, ours: what is compared.
        x: what both depend on; empty if nothing single.
    """

    label: str
    golden: Array
    ours: Array
    x: Array = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, slots=True, kw_only=True)
class ReceptionRatio:
    """Frames received over the distance, of links of one class; shape (bin,) each.

    Attributes:
        link: one of `LINKS`.
        distance: middle of the bins [m].
        events: in the bin.
        golden, ours: received.
    """

    link: str
    distance: Array
    events: Array
    golden: Array
    ours: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The result for one file, or for one run of the whole stack.

    Attributes:
        cases: values or events compared.
        largest: the largest error, in `unit`; NaN if the channel failed.
        unit: `dB`, `1` or `sigma`.
        tolerance: of the error.
        mismatches: events whose class differs.
        misses: values outside their tolerance.
        excepted: cases without a golden result, for which only a finite answer is asked.
        notes: the first misses and mismatches, one sentence each.
        details: further numbers for `--json`.
        series: for figures.
        ratios: of a run of the whole stack, for a figure.
    """

    cases: int
    largest: float
    unit: str
    tolerance: float
    mismatches: int = 0
    misses: int = 0
    excepted: int = 0
    notes: tuple[str, ...] = ()
    details: Mapping[str, Any] = field(default_factory=dict)
    series: tuple[Series, ...] = ()
    ratios: tuple[ReceptionRatio, ...] = ()

    @property
    def passes(self) -> bool:
        """Whether everything lies within its tolerance."""
        return not self.misses and not self.mismatches

    @classmethod
    def of_values(
        cls,
        tolerance: Tolerance,
        places: Sequence[str],
        series: Sequence[Series],
        *,
        excepted: int = 0,
        mismatches: int = 0,
        notes: Sequence[str] = (),
        details: Mapping[str, Any] | None = None,
    ) -> Self:
        """Compare the values of `series`, one after the other.

        Args:
            tolerance: of all of them.
            places: where each value stands in the golden file.
            series: in the order of `places`.
            excepted: see the attribute.
            mismatches: see the attribute.
            notes: about other things than these values.
            details: see the attribute.
        """
        golden = np.concatenate([np.empty(0), *(one.golden for one in series)])
        ours = np.concatenate([np.empty(0), *(one.ours for one in series)])
        error = np.abs(ours - golden)
        bad = np.flatnonzero(~(error <= tolerance.limit))  # NaN is bad
        unit = "" if tolerance.unit == "1" else f" {tolerance.unit}"
        found = [
            f"{places[k]}: golden {golden[k]:.12g}{unit}, ours {ours[k]:.12g}{unit}"
            for k in bad[np.argsort(-np.nan_to_num(error[bad], nan=np.inf))][:_SHOWN]
        ]
        return cls(
            cases=len(error),
            largest=float(error.max(initial=0.0)),
            unit=tolerance.unit,
            tolerance=tolerance.limit,
            mismatches=mismatches,
            misses=len(bad),
            excepted=excepted,
            notes=(*found, *notes),
            details=details or {},
            series=tuple(series),
        )

    @classmethod
    def failure(cls, tolerance: Tolerance, message: str) -> Self:
        """The channel failed on this file."""
        return cls(
            cases=0,
            largest=float("nan"),
            unit=tolerance.unit,
            tolerance=tolerance.limit,
            misses=1,
            notes=(message,),
        )
