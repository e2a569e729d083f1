"""The claims about relay policies, the paper's and ours, each with what the runs say."""

from typing import Final

from studies.method.claims import Claim, Comparison, Range
from studies.method.estimates import differences, mean_of, percent
from studies.relay.conditions import ORACLE
from studies.relay.published import CLAIMED_ADVANTAGE, DIRECT_PER, RIVALS, TABLE_2
from studies.relay.runs import Study

IMPROVED: Final = "expected-prr"
"""Our improved policy."""

CALIBRATION: Final = 2.0
"""How far the direct link's PER may lie from the paper's [points]."""

REGRET: Final = 3.0
"""The target of the improved policy: its PRR lies at most so far below the oracle's [points]."""


def claims(study: Study) -> list[Claim]:
    """All claims, at the base condition."""
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
        found=percent(mean_of(found)),
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
        found=mean_of(found),
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
        found=percent(mean_of([1.0 - prr for prr in sample.values()])),
        n=len(sample),
        wanted=Range(low=middle - CALIBRATION, high=middle + CALIBRATION),
        paper=middle,
    )
