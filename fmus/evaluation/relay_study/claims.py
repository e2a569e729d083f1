"""The claims about relay policies, the paper's and ours, each with what the runs say."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from fmus.evaluation.relay_study.paper import CLAIMED_ADVANTAGE, DIRECT_PER, RIVALS, TABLE_2
from fmus.evaluation.relay_study.sample import Study, columns, differences, estimate
from fmus.evaluation.relay_study.table2 import ORACLE
from fmus.evaluation.relay_study.verdict import Range, verdict
from orchestrator.intervals import Estimate

IMPROVED: Final = "expected-prr"
"""Our improved policy."""

CALIBRATION: Final = 2.0
"""How far the direct link's PER may lie from the paper's [points]."""

REGRET: Final = 3.0
"""The target of the improved policy: its PRR lies at most so far below the oracle's [points]."""


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


def rows(study: Study) -> list[dict[str, Any]]:
    """One row per comparison, all at the base condition; `verdict` is that of the whole claim."""
    return [row for claim in claims(study) for row in _rows(claim)]


def claims(study: Study) -> list[Claim]:
    """All of them."""
    return [
        Claim(
            "mohed-better",
            "MoHeD delivers more than both rivals.",
            "paper",
            [_prr(study, "mohed", rival, Range(low=0.0, is_open=True)) for rival in RIVALS],
        ),
        Claim(
            "mohed-25-points",
            f"MoHeD is at least {100 * CLAIMED_ADVANTAGE:g} points above both rivals.",
            "paper",
            [_prr(study, "mohed", r, Range(low=100 * CLAIMED_ADVANTAGE)) for r in RIVALS],
        ),
        Claim(
            "signal-strength-not-better",
            "Signal strength is not better than random choice.",
            "paper",
            [_prr(study, "signal-strength", "random", Range(high=0.0))],
        ),
        Claim(
            "mohed-fewer-switches",
            "MoHeD switches relays less often than both rivals.",
            "paper",
            [_switches(study, "mohed", rival) for rival in RIVALS],
        ),
        Claim(
            "direct-link",
            f"The direct link loses {100 * DIRECT_PER:.2f} % of the packets, "
            f"within {CALIBRATION:g} points (the scene is fitted to that).",
            "calibration",
            [_direct(study)],
        ),
        Claim(
            "improved-near-oracle",
            f"`{IMPROVED}` comes within {REGRET:g} points of the oracle.",
            "nlosim",
            [_prr(study, ORACLE, IMPROVED, Range(high=REGRET))],
        ),
    ]


def _prr(study: Study, a: str, b: str, wanted: Range) -> Comparison:
    found = differences(study.sample("prr", a, study.base), study.sample("prr", b, study.base))
    both = a in TABLE_2 and b in TABLE_2
    return Comparison(
        quantity=f"PRR of {a} minus {b}",
        unit="points",
        found=_scaled(estimate(found)),
        n=len(found),
        wanted=wanted,
        paper=100 * (TABLE_2[a].prr - TABLE_2[b].prr) if both else None,
    )


def _switches(study: Study, a: str, b: str) -> Comparison:
    samples = [study.sample("relay_switches", method, study.base) for method in (a, b)]
    found = differences(*samples)
    return Comparison(
        quantity=f"relay switches of {a} minus {b}",
        unit="",
        found=estimate(found),
        n=len(found),
        wanted=Range(high=0.0, is_open=True),
        paper=TABLE_2[a].relay_switches - TABLE_2[b].relay_switches,
    )


def _direct(study: Study) -> Comparison:
    sample = study.sample("direct_prr", "direct", study.base)
    middle = 100 * DIRECT_PER
    return Comparison(
        quantity="PER of the direct link",
        unit="%",
        found=_scaled(estimate([1.0 - prr for prr in sample.values()])),
        n=len(sample),
        wanted=Range(low=middle - CALIBRATION, high=middle + CALIBRATION),
        paper=middle,
    )


def _scaled(found: Estimate | None) -> Estimate | None:
    """In percent."""
    if found is None or found.low is None or found.high is None:
        return None if found is None else Estimate(100 * found.value, None, None)
    return Estimate(100 * found.value, 100 * found.low, 100 * found.high)


def _rows(claim: Claim) -> Iterator[dict[str, Any]]:
    parts = [one.wanted.judge(one.found) for one in claim.comparisons]
    whole = verdict(parts)
    for one, part in zip(claim.comparisons, parts, strict=True):
        yield {
            "claim": claim.name,
            "text": claim.text,
            "origin": claim.origin,
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


def _wanted(wanted: Range) -> str:
    """The range in words."""
    if wanted.high == float("inf"):
        return f"{'more than' if wanted.is_open else 'at least'} {wanted.low:g}"
    if wanted.low == float("-inf"):
        return f"{'less than' if wanted.is_open else 'at most'} {wanted.high:g}"
    return f"{wanted.low:.2f} to {wanted.high:.2f}"
