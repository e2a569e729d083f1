"""The claims about collisions, the paper's and ours, each with what the runs say."""

from typing import Any, Final

import numpy as np

from orchestrator.intervals import Estimate
from studies.collision import linearity
from studies.collision.campaign import Campaign
from studies.collision.condition import COOPERATIVE, USUAL_AGE
from studies.collision.curve import Curve, Resampling, interval
from studies.collision.curves import CurveName, curves
from studies.collision.names import relay_name
from studies.collision.published import COMPRESSION_32_RATE, MOHED_RATE
from studies.collision.rates import collision_rate, difference
from studies.collision.runs import Point
from studies.method.claim import Claim, Comparison, percent
from studies.method.verdict import Range

SPEEDS: Final = (30.0, 25.0)
"""Of the ego, those of the paper [km/h]."""

COMPRESSIONS: Final = (16, 32)

RIVALS: Final = ("signal-strength", "random", "direct")

BELOW: Final = Range(high=100 * MOHED_RATE, is_open=True)
ABOVE: Final = Range(low=100 * MOHED_RATE)

APPROXIMATELY: Final = 5.0
"""How far a rate may lie from one that the paper gives approximately [points]. Ours."""

SAME: Final = 5.0
"""How far critical points that are the same may lie apart, in packet error rate [points]. Ours."""

CRITICAL: Final = 0.1
"""The collision rate whose crossing is compared between speeds. Ours: the paper names none."""

BENT: Final = 5.0
"""How far a curve that matters as nonlinear is from its chord somewhere [points]. Ours."""


def rows(campaign: Campaign) -> list[dict[str, Any]]:
    """One row per comparison; `verdict` is that of the whole claim."""
    return [row for claim in claims(campaign) for row in claim.rows()]


def claims(campaign: Campaign) -> list[Claim]:
    """All of them."""
    return [*_of_the_paper(campaign), *_ours(campaign)]


def _of_the_paper(campaign: Campaign) -> list[Claim]:
    first, _ = SPEEDS
    bends = linearity.rows(campaign.points)
    return [
        Claim(
            "mohed-below-1",
            "With MoHeD less than 1 % collide (compression 16).",
            "paper",
            [_relayed(campaign, "mohed", speed, BELOW) for speed in SPEEDS],
        ),
        Claim(
            "only-mohed",
            "MoHeD is the only method with a basic function: with the others it is 1 % or more "
            "(compression 16).",
            "paper",
            [
                _relayed(campaign, "mohed", first, BELOW),
                *(_relayed(campaign, rival, first, ABOVE) for rival in RIVALS),
            ],
        ),
        Claim(
            "compression-32",
            f"At compression 32 approximately {100 * COMPRESSION_32_RATE:g} % collide, even under "
            f"perfect communication (within {APPROXIMATELY:g} points).",
            "paper",
            [_compressed(campaign)],
        ),
        Claim(
            "same-critical-point",
            f"The critical point is the same at both speeds (where {100 * CRITICAL:g} % collide, "
            f"within {SAME:g} points of PER).",
            "paper",
            [_moved(campaign, compression) for compression in COMPRESSIONS],
        ),
        Claim(
            "nonlinear",
            "The collision rate is not linear in the PER (more than "
            f"{BENT:g} points from a straight line).",
            "paper",
            [_bent(bends, compression) for compression in COMPRESSIONS],
        ),
    ]


def _ours(campaign: Campaign) -> list[Claim]:
    return [
        Claim(
            "perfect-below-1",
            "Under perfect communication less than 1 % of the cooperative policy collide, "
            "of the blind one more than 50 % (compression 16).",
            "nlosim (target)",
            [
                _rate("cooperative, PER 0", campaign.perfect(COOPERATIVE, 16), BELOW, None),
                _rate("blind", campaign.perfect("blind"), Range(low=50.0, is_open=True), None),
            ],
        ),
        Claim(
            "compression-costs",
            "Under perfect communication compression 32 collides more often than 16.",
            "nlosim",
            [_cost_of_compression(campaign)],
        ),
    ]


def _rate(name: str, point: Point | None, wanted: Range, paper: float | None) -> Comparison:
    return Comparison(
        quantity=f"collision rate, {name}",
        unit="%",
        found=None if point is None else percent(collision_rate(point)),
        n=0 if point is None else len(point.runs),
        wanted=wanted,
        paper=paper,
    )


def _relayed(campaign: Campaign, relay: str, speed: float, wanted: Range) -> Comparison:
    return _rate(
        f"{relay_name(relay)}, {speed:g} km/h", campaign.relayed(relay, 16, speed), wanted, None
    )


def _compressed(campaign: Campaign) -> Comparison:
    paper = 100 * COMPRESSION_32_RATE
    wanted = Range(low=paper - APPROXIMATELY, high=paper + APPROXIMATELY)
    return _rate("compression 32, PER 0", campaign.perfect(COOPERATIVE, 32), wanted, paper)


def _cost_of_compression(campaign: Campaign) -> Comparison:
    points = [campaign.perfect(COOPERATIVE, compression) for compression in (32, 16)]
    rates = [collision_rate(point) for point in points if point is not None]
    found = [rate for rate in rates if rate is not None]
    is_known = len(found) == len(points)
    return Comparison(
        quantity="collision rate of compression 32 minus 16, PER 0",
        unit="points",
        found=percent(difference(*found)) if is_known else None,
        n=min(len(point.runs) for point in points if point is not None) if is_known else 0,
        wanted=Range(low=0.0, is_open=True),
        paper=None,
    )


def _moved(campaign: Campaign, compression: int) -> Comparison:
    """By the constant channel if it was run at both speeds, else over the relay methods."""
    known = curves(campaign.points)
    pairs = [
        [
            known.get(CurveName(channel=channel, compression=compression, speed_kmh=speed)) or []
            for speed in SPEEDS
        ]
        for channel in ("constant", "simulated")
    ]
    chosen = next((pair for pair in pairs if all(pair)), None)
    resampling = None if chosen is None else Resampling.of([each for one in chosen for each in one])
    return Comparison(
        quantity=f"critical PER at {SPEEDS[1]:g} minus {SPEEDS[0]:g} km/h, "
        f"compression {compression}",
        unit="points",
        found=None if chosen is None or resampling is None else _shift(chosen, resampling),
        n=0 if resampling is None else len(resampling.seeds),
        wanted=Range(low=-SAME, high=SAME),
        paper=None,
    )


def _shift(pair: list[list[Point]], resampling: Resampling) -> Estimate | None:
    """Of the second curve against the first [points]; `None` where one does not get there."""
    first, second = (Curve.of(points, resampling).crossing(CRITICAL) for points in pair)
    if not np.isfinite([first[0], second[0]]).all():
        return None
    with np.errstate(invalid="ignore"):
        shift = second - first
    found = interval(shift)
    if found is None or found.low is None or found.high is None:
        return found
    is_bounded = np.isfinite([found.low, found.high]).all() and not np.isnan(shift).any()
    return percent(found if is_bounded else Estimate(found.value, None, None))


def _bent(bends: list[dict[str, Any]], compression: int) -> Comparison:
    found = [
        row
        for row in bends
        if row["compression"] == compression
        and row["speed_kmh"] == SPEEDS[0]
        and row["maximum_age"] == USUAL_AGE
    ]
    return Comparison(
        quantity=f"largest distance from the chord, compression {compression}",
        unit="points",
        found=percent(linearity.size(found[0])) if found else None,
        n=found[0]["seeds"] if found else 0,
        wanted=Range(low=BENT, is_open=True),
        paper=None,
    )
