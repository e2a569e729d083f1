"""The claims about collisions, the paper's and ours, each with what the runs say.

At the top is what others publish about the red-light scene.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from orchestrator.intervals import Estimate
from studies.collision.conditions import CONSTANT, COOPERATIVE, SIMULATED, USUAL_AGE
from studies.collision.curves import (
    CurveName,
    Linearity,
    curve_of,
    curves,
    linearities,
    resampling_of,
)
from studies.collision.runs import Campaign, Point
from studies.collision.statistics import collision_rate, difference
from studies.method.claims import Claim, Comparison, Range
from studies.method.curve import Resampling, interval
from studies.method.estimates import percent
from studies.method.style import method_name


@dataclass(frozen=True, slots=True)
class Published:
    """A row of COOPERNAUT's table, each with its ± (three trained networks).

    Attributes:
        name: what the table calls the policy.
        success, success_sd: success rate and its ± [%].
        sct, sct_sd: success weighted by completion time and its ± [%].
        collisions, collisions_sd: collision rate and its ± [%].
    """

    name: str
    success: float
    success_sd: float
    sct: float
    sct_sd: float
    collisions: float
    collisions_sd: float


COOPERNAUT: Final = {
    "blind": Published("no V2V", 47.3, 18.7, 46.1, 18.4, 51.4, 17.4),
    "early-fusion": Published("early fusion", 78.6, 11.8, 75.8, 9.1, 17.7, 15.2),
    "cooperative-16": Published("COOPERNAUT", 80.7, 7.6, 77.8, 7.1, 17.7, 7.8),
}
"""The rows of red-light violation, by our policy of the same kind: Cui, Qiu, Chen, Stone, Zhu,
"COOPERNAUT: End-to-End Driving with Cooperative Perception for Networked Vehicles", CVPR 2022,
table 2. In CARLA, 30 background vehicles, lidars read without loss; an ego that stands for long
fails, too."""

MOHED_RATE: Final = 0.01
"""Collision rate with MoHeD is below it ("NLOS Dies Twice", section "Results & Analysis")."""

MOHED_PER: Final = 0.1202
"""The packet error rate at which `MOHED_RATE` is meant (ibidem)."""

COMPRESSION_32_RATE: Final = 0.40
"""Collision rate at compression 32 "even under perfect wireless connection", approximately."""

SPEEDS: Final = (30.0, 25.0)
"""The speeds of the ego in the paper [km/h]."""

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


def claims(campaign: Campaign) -> list[Claim]:
    """All claims, the paper's first."""
    return [*_of_the_paper(campaign), *_ours(campaign)]


def _of_the_paper(campaign: Campaign) -> list[Claim]:
    first, _ = SPEEDS
    bends = linearities(campaign.points)
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
                rate("cooperative, PER 0", campaign.perfect(COOPERATIVE, 16), BELOW),
                rate("blind", campaign.perfect("blind"), Range(low=50.0, is_open=True)),
            ],
        ),
        Claim(
            "compression-costs",
            "Under perfect communication compression 32 collides more often than 16.",
            "nlosim",
            [_cost_of_compression(campaign)],
        ),
    ]


def rate(name: str, point: Point | None, wanted: Range, paper: float | None = None) -> Comparison:
    """How the collision rate of a point lies to what is wanted of it [%].

    Args:
        name: of the point, in words.
        point: `None` if it was not run.
        wanted: the rates that satisfy the claim [%].
        paper: its rate [%], where it has one.
    """
    return Comparison(
        quantity=f"collision rate, {name}",
        unit="%",
        found=None if point is None else percent(collision_rate(point)),
        n=0 if point is None else len(point.runs),
        wanted=wanted,
        paper=paper,
    )


def _relayed(campaign: Campaign, relay: str, speed: float, wanted: Range) -> Comparison:
    return rate(
        f"{method_name(relay)}, {speed:g} km/h", campaign.relayed(relay, 16, speed), wanted, None
    )


def _compressed(campaign: Campaign) -> Comparison:
    paper = 100 * COMPRESSION_32_RATE
    wanted = Range(low=paper - APPROXIMATELY, high=paper + APPROXIMATELY)
    return rate("compression 32, PER 0", campaign.perfect(COOPERATIVE, 32), wanted, paper)


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
    """How far the critical point moves with the speed.

    Over constant rates if they were run at both speeds, else over the relay methods.
    """
    known = curves(campaign.points)
    pairs = [
        [
            known.get(CurveName(channel=channel, compression=compression, speed_kmh=speed)) or []
            for speed in SPEEDS
        ]
        for channel in (CONSTANT, SIMULATED)
    ]
    chosen = next((pair for pair in pairs if all(pair)), None)
    resampling = None if chosen is None else resampling_of([each for one in chosen for each in one])
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
    """How far the critical point of the second curve lies beyond that of the first [points].

    `None` where one of them does not get there.
    """
    first, second = (curve_of(points, resampling).crossing(CRITICAL) for points in pair)
    if not np.isfinite([first[0], second[0]]).all():
        return None
    with np.errstate(invalid="ignore"):
        shift = second - first
    found = interval(shift)
    if found is None or found.low is None or found.high is None:
        return found
    is_bounded = np.isfinite([found.low, found.high]).all() and not np.isnan(shift).any()
    return percent(found if is_bounded else Estimate(found.value, None, None))


def _bent(bends: Sequence[Linearity], compression: int) -> Comparison:
    found = [
        bend
        for bend in bends
        if bend.curve.compression == compression
        and bend.curve.speed_kmh == SPEEDS[0]
        and bend.curve.maximum_age == USUAL_AGE
    ]
    return Comparison(
        quantity=f"largest distance from the chord, compression {compression}",
        unit="points",
        found=percent(found[0].size) if found else None,
        n=found[0].seeds if found else 0,
        wanted=Range(low=BENT, is_open=True),
        paper=None,
    )
