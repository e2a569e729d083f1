"""Claims: what is compared, what would satisfy it, what the runs say, and the verdict."""

import enum
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from orchestrator.intervals import Estimate


class Part(enum.Enum):
    """What is known of one comparison that a claim consists of."""

    HOLDS = "holds"
    """The whole interval satisfies it."""

    FAILS = "fails"
    """The whole interval violates it."""

    OPEN = "open"
    """The interval reaches to both sides, or there is none."""


class Verdict(enum.Enum):
    """What has become of a claim."""

    REPRODUCED = "reproduced"
    PARTLY = "partly reproduced"
    REFUTED = "not reproduced"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True, kw_only=True)
class Range:
    """The values that satisfy a comparison.

    Attributes:
        low, high: the bounds.
        is_open: whether the bounds do not belong to it: "more than" rather than "at least".
    """

    low: float = -math.inf
    high: float = math.inf
    is_open: bool = False

    def has(self, value: float) -> bool:
        """Whether `value` satisfies the comparison."""
        if self.is_open:
            return self.low < value < self.high
        return self.low <= value <= self.high

    def judge(self, found: Estimate | None) -> Part:
        """Whether the interval lies within, outside, or across a bound."""
        if found is None or found.low is None or found.high is None:
            return Part.OPEN
        if self.has(found.low) and self.has(found.high):
            return Part.HOLDS
        below, above = found.high, found.low  # the ends next to the range
        is_outside = below < self.low or above > self.high
        if self.is_open:
            is_outside = below <= self.low or above >= self.high
        return Part.FAILS if is_outside else Part.OPEN

    def words(self) -> str:
        """The range as a reader says it: `less than 1`."""
        if self.high == math.inf:
            return f"{'more than' if self.is_open else 'at least'} {self.low:g}"
        if self.low == -math.inf:
            return f"{'less than' if self.is_open else 'at most'} {self.high:g}"
        return f"{self.low:.2f} to {self.high:.2f}"


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """A comparison and what has become of its claim: a row of the table of claims.

    Attributes:
        claim: the claim's name.
        text: the claim.
        origin: whose claim it is.
        quantity: what is compared, in words.
        unit: `points` (percentage points), `%` or empty.
        n: the number of seeds.
        value: the estimate of the quantity, if it was measured.
        wanted: the values that satisfy the claim, in words.
        paper: the paper's value, where it has one.
        mean_satisfies: whether the estimate without its interval satisfies the claim.
        part: the value of the `Part` of this comparison.
        verdict: the value of the `Verdict` of the whole claim.
    """

    claim: str
    text: str
    origin: str
    quantity: str
    unit: str
    n: int
    value: Estimate | None
    wanted: str
    paper: float | None
    mean_satisfies: bool | None
    part: str
    verdict: str


@dataclass(frozen=True, slots=True)
class Claim:
    """A sentence, and the comparisons that all have to hold for it.

    Attributes:
        name: what programs call it.
        text: the sentence.
        origin: whose claim it is.
        comparisons: what has to hold, at least one.
    """

    name: str
    text: str
    origin: str
    comparisons: Sequence[Comparison]

    def judge(self) -> Iterator[Judgement]:
        """Judge every comparison, and the whole claim by all of them."""
        parts = [one.wanted.judge(one.found) for one in self.comparisons]
        whole = verdict(parts)
        for one, part in zip(self.comparisons, parts, strict=True):
            yield Judgement(
                claim=self.name,
                text=self.text,
                origin=self.origin,
                quantity=one.quantity,
                unit=one.unit,
                n=one.n,
                value=one.found,
                wanted=one.wanted.words(),
                paper=one.paper,
                mean_satisfies=None if one.found is None else one.wanted.has(one.found.value),
                part=part.value,
                verdict=whole.value,
            )


def judge(claims: Iterable[Claim]) -> list[Judgement]:
    """Judge all comparisons of all claims."""
    return [judgement for claim in claims for judgement in claim.judge()]


def verdict(parts: Sequence[Part]) -> Verdict:
    """The verdict on a claim with at least one part.

    Reproduced if every part holds, partly if some do; not reproduced if none holds and one fails;
    else undecided.
    """
    holding = sum(part is Part.HOLDS for part in parts)
    if holding:
        return Verdict.REPRODUCED if holding == len(parts) else Verdict.PARTLY
    return Verdict.REFUTED if Part.FAILS in parts else Verdict.UNDECIDED
