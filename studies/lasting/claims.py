"""The paper's claims once more, where the obstruction lasts through the decision."""

from collections.abc import Mapping
from typing import Final

from orchestrator.intervals import Estimate
from studies.collision.claims import (
    ABOVE,
    APPROXIMATELY,
    BELOW,
    COMPRESSION_32_RATE,
    COMPRESSIONS,
    RIVALS,
    rate,
)
from studies.collision.conditions import COOPERATIVE, EXPERT, HELD
from studies.collision.runs import Campaign
from studies.collision.statistics import collision_rate, difference
from studies.lasting.scenes import BESIDE, OPPOSING, SCENES, TURNING, Scene
from studies.method.claims import Claim, Comparison, Range
from studies.method.estimates import percent
from studies.method.style import method_name

_SPEED: Final = 30.0
"""The speed of the ego in all experiments [km/h]."""

_HELD_AT: Final = 32
"""The compression of the network that keeps to its brake."""

_MOST: Final = Range(low=50.0, is_open=True)
"""More than half [%]."""

_MORE: Final = Range(low=0.0, is_open=True)
"""More than nothing [points]."""

Campaigns = Mapping[str, Campaign]
"""What was run, by the name of the scene."""


def claims(campaigns: Campaigns) -> list[Claim]:
    """All claims, the paper's first."""
    turning = campaigns[TURNING.name]
    paper = 100 * COMPRESSION_32_RATE
    near = Range(low=paper - APPROXIMATELY, high=paper + APPROXIMATELY)
    perfect = {c: turning.perfect(COOPERATIVE, c) for c in COMPRESSIONS}
    return [
        Claim(
            "mohed-below-1",
            "With MoHeD less than 1 % collide.",
            "paper",
            [
                *(_relayed(campaigns, TURNING, "mohed", c, BELOW) for c in COMPRESSIONS),
                *(_relayed(campaigns, BESIDE, "mohed", c, BELOW) for c in COMPRESSIONS),
                _relayed(campaigns, OPPOSING, "mohed", None, BELOW),
            ],
        ),
        Claim(
            "only-mohed",
            "MoHeD is the only method with a basic function: with the others it is 1 % or more "
            "(compression 16).",
            "paper",
            [
                _relayed(campaigns, TURNING, "mohed", 16, BELOW),
                *(_relayed(campaigns, TURNING, rival, 16, ABOVE) for rival in RIVALS),
            ],
        ),
        Claim(
            "compression-32",
            f"At compression 32 approximately {paper:g} % collide, even under perfect "
            f"communication (within {APPROXIMATELY:g} points).",
            "paper",
            [rate("compression 32, PER 0", perfect[32], near, paper)],
        ),
        Claim(
            "mohed-below-1-held",
            "With MoHeD less than 1 % collide if the network keeps to its brake (compression "
            f"{_HELD_AT}).",
            "nlosim",
            [_held(campaigns, "mohed", BELOW)],
        ),
        Claim(
            "only-mohed-held",
            "MoHeD is the only relay method for which that holds: with the others it is 1 % or "
            "more.",
            "nlosim",
            [_held(campaigns, rival, ABOVE) for rival in ("signal-strength", "random")],
        ),
        Claim(
            "direct-fails",
            "Over the direct link more than half collide.",
            "nlosim",
            [
                *(_relayed(campaigns, TURNING, "direct", c, _MOST) for c in COMPRESSIONS),
                _relayed(campaigns, BESIDE, "direct", 16, _MOST),
                _relayed(campaigns, OPPOSING, "direct", None, _MOST),
            ],
        ),
        Claim(
            "relay-saves",
            "With MoHeD fewer collide than over the direct link.",
            "nlosim",
            [
                *(_saved(campaigns, TURNING, c) for c in COMPRESSIONS),
                _saved(campaigns, BESIDE, 16),
                _saved(campaigns, OPPOSING, None),
            ],
        ),
        Claim(
            "scene",
            "Without a lost packet the expert does not collide (less than 1 %), the blind network "
            "does (more than half).",
            "nlosim",
            [
                comparison
                for scene in SCENES
                for comparison in (
                    _perfect(campaigns, scene, EXPERT, BELOW),
                    _perfect(campaigns, scene, "blind", _MOST),
                )
            ],
        ),
    ]


def _named(scene: Scene, relay: str, compression: int | None) -> str:
    size = "" if compression is None else f", compression {compression}"
    return f"{method_name(relay)}{size}, {scene.title}"


def _relayed(
    campaigns: Campaigns, scene: Scene, relay: str, compression: int | None, wanted: Range
) -> Comparison:
    point = campaigns[scene.name].relayed(relay, compression, _SPEED, scene.policy)
    return rate(_named(scene, relay, compression), point, wanted)


def _held(campaigns: Campaigns, relay: str, wanted: Range) -> Comparison:
    """The network that keeps to its brake, in the scene with the turning truck."""
    point = campaigns[TURNING.name].relayed(relay, _HELD_AT, _SPEED, HELD)
    return rate(f"{_named(TURNING, relay, _HELD_AT)}, brake held", point, wanted)


def _perfect(campaigns: Campaigns, scene: Scene, policy: str, wanted: Range) -> Comparison:
    return rate(f"{policy}, {scene.title}", campaigns[scene.name].perfect(policy), wanted)


def _saved(campaigns: Campaigns, scene: Scene, compression: int | None) -> Comparison:
    campaign = campaigns[scene.name]
    both = [
        campaign.relayed(relay, compression, _SPEED, scene.policy) for relay in ("direct", "mohed")
    ]
    rates = [None if point is None else collision_rate(point) for point in both]
    known: list[Estimate] = [one for one in rates if one is not None]
    is_known = len(known) == len(both)
    return Comparison(
        quantity=f"direct link minus {_named(scene, 'mohed', compression)}",
        unit="points",
        found=percent(difference(*known)) if is_known else None,
        n=min((len(point.runs) for point in both if point is not None), default=0),
        wanted=_MORE,
        paper=None,
    )
