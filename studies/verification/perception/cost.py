"""The part of the page about bytes: by the number of candidates, and what they consist of."""

import math

import numpy as np

from studies.verification.perception.bytes_on_air import FEATURES, SMALL_FEATURES
from studies.verification.perception.parameter_set import RECOMMENDED
from studies.verification.perception.prose import section, table, whole_percent
from studies.verification.perception.scoring import SceneResult
from studies.verification.perception.summary import (
    ALWAYS,
    CPM,
    DEMANDED,
    WHOLE,
    Parts,
    byte_share,
    chosen_by,
    parts,
    score_sharers,
    traffic,
)
from studies.verification.perception.tables import percent
from studies.verification.perception.verification import TARGET_BYTES, Verification

_HEAD = (
    "candidates", "scenes", "right", "revealed", "demanded, features", "half features",
    "raw points", "whole, features", "1/equipped",
)  # fmt: skip


def cost_text(verification: Verification) -> str:
    """What was demanded and whole scans, in bytes of always-on sharing."""
    results = verification.results
    found = parts(results, RECOMMENDED.name, FEATURES)
    ways = traffic(results, RECOMMENDED.name, FEATURES)
    matrix = found.matrices / sum(one.equipped for one in results)
    by_points = (found.sum - found.answers + found.answers_by_points) / ways[ALWAYS].bytes
    return section(
        "## What it costs",
        "Bytes of APMM over those of always-on sharing, by the number of candidates:",
        table(_HEAD, [_row(*item) for item in verification.by_candidates().items()]),
        "Scenes with many candidates are further ones, drawn until so many vehicles are near.",
        f"**What it consists of.** With features, {_composition(found, len(results))} "
        f"{_demanded(verification)}",
        f"**What limits it.** A matrix takes {matrix:.0f} bytes on average, "
        f"{percent(matrix / FEATURES)} of the features: that share of always-on sharing remains "
        "however many vehicles there are. A request and an answer for each ego vehicle come on "
        f"top; they weigh most where few vehicles are equipped. {_enough(verification, matrix)} "
        f"{_worst(verification)}",
        "**What is left out.** The answer has "
        f"{percent((ways[DEMANDED].area or 0.0) / max(ways[WHOLE].area or 0.0, 1e-9))} of the "
        "hidden road that the whole scan shows, because not all of it is in blind zones. Its size "
        "follows, as in `facilities`, from the seen area in the zones; they hold "
        f"{percent(_point_share(verification))} of the sharer's points. Sent by the number of "
        f"points, features would take {percent(by_points)} of always-on sharing. Raw points are "
        "counted.",
        f"**Beside CPMs.** {_cpms(verification)}",
    )


def _row(name: str, group: list[SceneResult]) -> tuple[str, ...]:
    score = score_sharers(group, chosen_by(RECOMMENDED.name))
    shares = [byte_share(group, RECOMMENDED.name, n) for n in (FEATURES, SMALL_FEATURES, 0)]
    whole = byte_share(group, RECOMMENDED.name, FEATURES, WHOLE)
    fraction = float(np.mean([1 / one.equipped for one in group]))
    cells = map(percent, (score.right, score.revealed, *shares, whole, fraction))
    return (name, str(len(group)), *cells)


def _cpms(verification: Verification) -> str:
    results = verification.results
    ways = traffic(results, RECOMMENDED.name, FEATURES)
    hidden = max(sum(one.hidden_vehicles for one in results), 1)
    cpm, one = ways[CPM], ways[DEMANDED]
    return (
        f"Collective perception messages of all take {percent(cpm.bytes / ways[ALWAYS].bytes)} of "
        f"always-on sharing with features, and tell of {whole_percent(cpm.vehicles / hidden)} of "
        f"the hidden vehicles; what was demanded of one sharer tells of "
        f"{whole_percent(one.vehicles / hidden)}. They say nothing about which road is free, and "
        "carry no sensor data."
    )


def _composition(found: Parts, scenes: int) -> str:
    total = max(found.sum, 1)
    return (
        f"a scene takes {found.sum / scenes:.0f} bytes per scan: the matrices "
        f"{whole_percent(found.matrices / total)}, requests "
        f"{whole_percent(found.requests / total)}, answers "
        f"{whole_percent(found.answers / total)}."
    )


def _demanded(verification: Verification) -> str:
    chosen = (one.choices[RECOMMENDED.name].demanded for one in verification.results)
    asked = [one for one in chosen if one is not None]
    if not asked:
        return "Nobody was asked."
    zones = float(np.mean([one.zones for one in asked]))
    share = float(np.mean([float(one.share) for one in asked]))
    return (
        f"A request has {zones:.0f} zones, and the sharer has {percent(share)} of what it sees in "
        "them, on average."
    )


def _point_share(verification: Verification) -> float:
    chosen = (one.choices[RECOMMENDED.name].demanded for one in verification.results)
    asked = [one for one in chosen if one is not None]
    return sum(one.points for one in asked) / max(sum(one.all_points for one in asked), 1)


def _worst(verification: Verification) -> str:
    shares = [byte_share([one], RECOMMENDED.name, FEATURES) for one in verification.results]
    above = sum(share > TARGET_BYTES for share in shares)
    return (
        f"Taken alone, {above} of the {len(shares)} scenes take more; the costliest one takes "
        f"{percent(max(shares))}."
    )


def _enough(verification: Verification, matrix: float) -> str:
    """How many equipped vehicles make APMM cheap enough."""
    target = whole_percent(TARGET_BYTES)
    left = TARGET_BYTES - matrix / FEATURES
    if left <= 0:
        return f"The matrices alone are more than {target} of always-on sharing."
    found = parts(verification.results, RECOMMENDED.name, FEATURES)
    pair = (found.requests + found.answers) / len(verification.results) / FEATURES
    return (
        f"So APMM takes less than {target} from {math.ceil(pair / left)} equipped vehicles on; "
        f"with a whole scan as answer, from {math.ceil(1 / left)} on."
    )
