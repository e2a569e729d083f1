"""The steps of Figure 8: the distribution of the packet reception rate over runs."""

import math
from typing import Any

from studies.relay.sample import METHOD, Study


def band(n: int) -> float:
    r"""Half the height of a band that covers the whole distribution function with 95 %.

    $$ \epsilon = \sqrt{\ln(2 / 0.05) / (2 n)} $$

    Dvoretzky, Kiefer and Wolfowitz with Massart's constant (Annals of Probability 18(3), 1990), for
    n independent runs.
    """
    return math.sqrt(math.log(2.0 / 0.05) / (2.0 * n))


def rows(study: Study) -> list[dict[str, Any]]:
    """The steps of the empirical distribution function of every method, at the base condition.

    `share` of the runs have a packet reception rate of at most `prr`.
    """
    found = []
    for method in study.methods(study.base):
        values = sorted(study.sample("prr", method, study.base).values())
        n = len(values)
        for value in sorted(set(values)):
            share = sum(each <= value for each in values) / n
            low, high = max(0.0, share - band(n)), min(1.0, share + band(n))
            row = {METHOD: method, "n": n, "prr": value, "share": share}
            found.append({**row, "share_low": low, "share_high": high})
    return found
