"""What comparing golden data with the channel found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final, Self

import numpy as np

from fmus.messages.records import OUTCOMES
from orchestrator.signal import Array
from studies.verification.channel.tolerances import TOTALS, Tolerance

SHOWN: Final = 5
"""Misses of one kind that are described one by one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Series:
    """What a figure shows of a comparison: values over values, in the unit of the comparison.

    Attributes:
        label: for the legend.
        golden, ours: what is compared, shape (n,) each.
        x: what both depend on, shape (n,); empty if nothing single.
    """

    label: str
    golden: Array
    ours: Array
    x: Array = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Exceptions:
    """Cases of a file for which only a finite answer is asked.

    Attributes:
        cases: how many there are.
        asserted: of them, those in which Veins stops on an assertion.
        equal: of them, those in which golden and ours agree all the same.
    """

    cases: int
    asserted: int
    equal: int

    def as_data(self) -> Mapping[str, Any]:
        """What `--json` says of them."""
        return {"veins_asserts": self.asserted, "excepted_but_equal": self.equal}


@dataclass(frozen=True, slots=True, kw_only=True)
class ReceptionRatio:
    """Frames received over the distance, of links of one class.

    Attributes:
        link: one of `LINKS`.
        distance: middle of the bins [m], shape (bin,).
        events: arrivals in each bin, shape (bin,).
        golden, ours: how many of them were received, shape (bin,) each.
    """

    link: str
    distance: Array
    events: Array
    golden: Array
    ours: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Received:
    """Frames received in a run of those that were decoded.

    Attributes:
        golden, ours: how many.
        predicted: sum of the probabilities that the channel states for the golden SNIR.
        sigma: standard deviation of a count with these probabilities.
    """

    golden: int
    ours: int
    predicted: float
    sigma: float

    def as_data(self) -> Mapping[str, float]:
        """What `--json` says of them."""
        return {
            "golden": self.golden,
            "ours": self.ours,
            "predicted": round(self.predicted, 3),
            "sigma": round(self.sigma, 3),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """How often one outcome occurs in a run with a medium access of our own.

    Attributes:
        golden: in Veins.
        ours: of each seed, shape (seed,).
        least: the half width of the interval is never smaller.
    """

    golden: int
    ours: Array
    least: float

    @property
    def half_width(self) -> float:
        """Half the interval around the mean of ours in which one more sample is to be expected."""
        n = len(self.ours)
        spread = float(self.ours.std(ddof=1)) if n > 1 else 0.0
        return max(TOTALS.limit * spread * float(np.sqrt(1 + 1 / n)), self.least)

    @property
    def passes(self) -> bool:
        """Whether the golden total lies in that interval."""
        return abs(self.golden - float(self.ours.mean())) <= self.half_width

    def as_data(self) -> Mapping[str, Any]:
        """What `--json` says of them."""
        return {
            "golden": self.golden,
            "mean": round(float(self.ours.mean()), 3),
            "minimum": int(self.ours.min()),
            "maximum": int(self.ours.max()),
            "half_width": round(self.half_width, 3),
            "pass": self.passes,
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class StackFindings:
    """What a run of the whole stack shows beside its received powers.

    Attributes:
        snir_error: the largest error of the lowest SNIR [dB].
        snir_excepted: decoded frames whose SNIR is not compared.
        received: frames received, with given transmit times.
        outcomes: how often each of `OUTCOMES` occurs in golden and our events with given transmit
            times, shape (2, outcome).
        models: of propagation, as `run.json` lists them.
        versions: of Veins and what it ran on, by name.
        seeds: repetitions with a medium access of our own.
        totals: what those gave, by the letter of the outcome.
        ratios: packet reception ratios of the classes of links that occur.
    """

    snir_error: float
    snir_excepted: int
    received: Received
    outcomes: Array
    models: tuple[str, ...]
    versions: Mapping[str, str]
    seeds: int
    totals: Mapping[str, Totals]
    ratios: tuple[ReceptionRatio, ...]

    def as_data(self) -> Mapping[str, Any]:
        """What `--json` says of it."""
        counts = (dict(zip(OUTCOMES, row, strict=True)) for row in self.outcomes.tolist())
        totals = {letter: total.as_data() for letter, total in self.totals.items()}
        return {
            "max_snir_error": self.snir_error,
            "snir_excepted": self.snir_excepted,
            "received": self.received.as_data(),
            "outcomes": dict(zip(("golden", "ours"), counts, strict=True)),
            "models": list(self.models),
            "versions": dict(self.versions),
            "own_medium_access": {"seeds": self.seeds, "totals": totals},
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The result for one file, or for one run of the whole stack.

    Attributes:
        cases: values or events compared.
        largest: the largest error, in `unit`; NaN if the channel failed.
        unit: `dB`, `1` or `sigma`.
        tolerance: the largest error that passes.
        mismatches: events whose class differs, or answers that are not finite.
        misses: values outside their tolerance.
        excepted: cases without a golden result, for which only a finite answer is asked.
        notes: the first misses and mismatches, one sentence each.
        series: for figures.
        exceptions: what is excepted; `None` of files that have no such cases.
        stack: what else a run of the whole stack shows; `None` of other files.
    """

    cases: int
    largest: float
    unit: str
    tolerance: float
    mismatches: int = 0
    misses: int = 0
    excepted: int = 0
    notes: tuple[str, ...] = ()
    series: tuple[Series, ...] = ()
    exceptions: Exceptions | None = None
    stack: StackFindings | None = None

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
        mismatches: Sequence[str] = (),
        exceptions: Exceptions | None = None,
    ) -> Self:
        """Compare the values of `series`, one after the other.

        Args:
            tolerance: of all of them.
            places: where each value stands in the golden file.
            series: in the order of `places`.
            mismatches: a sentence for each thing other than these values that is wrong.
            exceptions: see the attribute.
        """
        golden = np.concatenate([np.empty(0), *(one.golden for one in series)])
        ours = np.concatenate([np.empty(0), *(one.ours for one in series)])
        error = np.abs(ours - golden)
        bad = np.flatnonzero(~(error <= tolerance.limit))  # NaN is bad
        unit = "" if tolerance.unit == "1" else f" {tolerance.unit}"
        found = [
            f"{places[k]}: golden {golden[k]:.12g}{unit}, ours {ours[k]:.12g}{unit}"
            for k in bad[np.argsort(-np.nan_to_num(error[bad], nan=np.inf))][:SHOWN]
        ]
        return cls(
            cases=len(error),
            largest=float(error.max(initial=0.0)),
            unit=tolerance.unit,
            tolerance=tolerance.limit,
            mismatches=len(mismatches),
            misses=len(bad),
            excepted=exceptions.cases if exceptions else 0,
            notes=(*found, *mismatches),
            series=tuple(series),
            exceptions=exceptions,
        )

    @classmethod
    def failure(cls, tolerance: Tolerance, message: str) -> Self:
        """The result of a file on which the channel failed."""
        return cls(
            cases=0,
            largest=float("nan"),
            unit=tolerance.unit,
            tolerance=tolerance.limit,
            misses=1,
            notes=(message,),
        )

    def as_data(self) -> Mapping[str, Any]:
        """What `--json` says of the file."""
        data: dict[str, Any] = {
            "pass": self.passes,
            "cases": self.cases,
            "max_error": self.largest if np.isfinite(self.largest) else None,
            "unit": self.unit,
            "tolerance": self.tolerance,
            "mismatches": self.mismatches,
            "misses": self.misses,
            "excepted": self.excepted,
            "notes": list(self.notes),
        }
        for details in (self.exceptions, self.stack):
            data |= details.as_data() if details else {}
        return data
