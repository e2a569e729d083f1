"""Claims as tables: what is compared, what would satisfy it, and what the runs say."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from orchestrator.intervals import Estimate
from studies.method.estimates import columns
from studies.method.verdict import Range, verdict


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A quantity, and the values of it that satisfy a claim.

    Attributes:
        quantity: what it is, in words.
        unit: `points` (percentage points), `%` or empty.
        found: its estimate, if it was measured.
        n: the number of seeds.
        wanted: the values that satisfy the claim.
        paper: the paper's value, where it has one.
    """

    quantity: str
    unit: str
    found: Estimate | None
    n: int
    wanted: Range
    paper: float | None


@dataclass(frozen=True, slots=True)
class Claim:
    """A sentence, and the comparisons that all have to hold for it.

    Attributes:
        name: for programs.
        text: the sentence.
        origin: whose claim it is.
        comparisons: at least one.
    """

    name: str
    text: str
    origin: str
    comparisons: Sequence[Comparison]

    def rows(self) -> Iterator[dict[str, Any]]:
        """One row per comparison; `verdict` is that of the whole claim."""
        parts = [one.wanted.judge(one.found) for one in self.comparisons]
        whole = verdict(parts)
        for one, part in zip(self.comparisons, parts, strict=True):
            yield {
                "claim": self.name,
                "text": self.text,
                "origin": self.origin,
                "quantity": one.quantity,
                "unit": one.unit,
                "n": one.n,
                **columns("value", one.found),
                "wanted": _wanted(one.wanted),
                "paper": one.paper,
                "mean_satisfies": None if one.found is None else one.wanted.has(one.found.value),
                "part": part.value,
                "verdict": whole.value,
            }


def percent(found: Estimate | None) -> Estimate | None:
    """A share, or a difference of shares, in percent or points."""
    if found is None or found.low is None or found.high is None:
        return None if found is None else Estimate(100 * found.value, None, None)
    return Estimate(100 * found.value, 100 * found.low, 100 * found.high)


def _wanted(wanted: Range) -> str:
    """The range in words."""
    if wanted.high == float("inf"):
        return f"{'more than' if wanted.is_open else 'at least'} {wanted.low:g}"
    if wanted.low == float("-inf"):
        return f"{'less than' if wanted.is_open else 'at most'} {wanted.high:g}"
    return f"{wanted.low:.2f} to {wanted.high:.2f}"
