"""Differences between methods, run by run with the same seed.

All methods meet the same traffic and the same fading (common random numbers), so differences vary
less than the rates themselves, and are known better than two intervals side by side suggest.
"""

import itertools
from typing import Any

from studies.method.estimates import columns, differences, estimate
from studies.relay.sample import Condition, Study


def rows(study: Study) -> list[dict[str, Any]]:
    """One row per condition and pair of methods.

    `difference` is the packet reception rate of method `a` minus that of `b` in percentage points;
    `a_better` and `b_better` are shares of the `n` seeds, which need not add up to 1.
    """
    return [
        _row(study, condition, a, b)
        for condition in study.conditions
        for a, b in itertools.combinations(study.methods(condition), 2)
    ]


def _row(study: Study, condition: Condition, a: str, b: str) -> dict[str, Any]:
    found = differences(study.sample("prr", a, condition), study.sample("prr", b, condition))
    n = len(found)
    return {
        **condition,
        "a": a,
        "b": b,
        "n": n,
        **columns("difference", estimate(found), scale=100.0),
        "a_better": sum(value > 0.0 for value in found) / n if n else None,
        "b_better": sum(value < 0.0 for value in found) / n if n else None,
    }
