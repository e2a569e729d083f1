"""What was found, as text: tables, and whether the targets are met."""

import math
from collections.abc import Sequence
from typing import Final

from studies.verification.perception.bytes_on_air import FEATURES
from studies.verification.perception.generator import MANY
from studies.verification.perception.parameter_set import LADDER, RECOMMENDED
from studies.verification.perception.summary import (
    ALWAYS,
    DEMAND,
    WHOLE,
    SharerScore,
    byte_share,
    chosen_by,
    has_demand,
    score_sharers,
    traffic,
    zone_areas,
)
from studies.verification.perception.verification import (
    DATA_SIZES,
    TARGET_BYTES,
    TARGET_RIGHT,
    Verification,
)

SHARER_HEAD: Final = (
    "chosen by", "best", "right", "95 % interval", "revealed", "missed", "false", "precision",
    "recall", "IoU",
)  # fmt: skip


def as_text(verification: Verification) -> str:
    """Write tables, and whether the targets are met."""
    results = verification.results
    if not results:
        return "no scene was played"
    wanted = sum(map(has_demand, results))
    best = verification.recommended
    found = (
        f"{len(results)} scenes, seed {verification.seed}; in {wanted} of them a candidate reveals "
        f"{DEMAND:g} m^2 or more"
    )
    right = (
        f"right sharer: {percent(best.right)} of the scenes, target {TARGET_RIGHT:.0%}: "
        f"{_verdict(is_met=best.right >= TARGET_RIGHT)}"
    )
    cheap = (
        "bytes of always-on sharing: "
        f"{verification.byte_share:.1%} (with whole answers {verification.whole_share:.1%}), "
        f"target {TARGET_BYTES:.0%}: "
        f"{_verdict(is_met=verification.byte_share <= TARGET_BYTES)}"
    )
    sharers = aligned((SHARER_HEAD, *sharer_rows(verification)))
    sizes = aligned((BYTES_HEAD, *byte_rows(verification)))
    lines = [found, "", *sharers, "", *sizes, "", *_crowd(verification), right, cheap]
    return "\n".join(lines)


def _crowd(verification: Verification) -> list[str]:
    """Say what many candidates change."""
    results = verification.crowded
    if not results:
        return []
    score = score_sharers(results, chosen_by(RECOMMENDED.name))
    share = byte_share(results, RECOMMENDED.name, FEATURES)
    whole = byte_share(results, RECOMMENDED.name, FEATURES, WHOLE)
    line = (
        f"with {MANY.fewest} to {MANY.most} candidates ({len(results)} scenes): right sharer "
        f"{percent(score.right)}, revealed {percent(score.revealed)}, bytes of always-on sharing "
        f"{percent(share)}, with whole answers {percent(whole)}"
    )
    return [line]


def _verdict(*, is_met: bool) -> str:
    return "met" if is_met else "NOT met"


def sharer_rows(verification: Verification) -> list[tuple[str, ...]]:
    """Write scores of baselines and of the main parameter sets as cells of a table."""
    rows = [
        (name, *_score_cells(score), "", "", "") for name, score in verification.baselines().items()
    ]
    for one in LADDER:
        areas = zone_areas(verification.results, one.name)
        shares = (areas.precision, areas.recall, areas.iou)
        rows.append(
            (one.name, *_score_cells(verification.score(one)), *(f"{x:.2f}" for x in shares))
        )
    return rows


def _score_cells(score: SharerScore) -> tuple[str, ...]:
    return (
        percent(score.strict),
        percent(score.right),
        f"{score.right_low:.0%} to {score.right_high:.0%}",
        percent(score.revealed),
        percent(score.missed),
        percent(score.false),
    )


BYTES_HEAD: Final = (
    "sensor data", "sharing", "bytes/scan", "of always-on", "m^2/scene", "m^2/kB",
    "hidden vehicles",
)  # fmt: skip


def byte_rows(verification: Verification) -> list[tuple[str, ...]]:
    """Write bytes and what they give as cells of a table."""
    results = verification.results
    count, vehicles = len(results), sum(one.hidden_vehicles for one in results)
    rows: list[tuple[str, ...]] = []
    for size, data in DATA_SIZES.items():
        ways = traffic(results, RECOMMENDED.name, data)
        for way, one in ways.items():
            rows.append(
                (
                    size,
                    way,
                    f"{one.bytes / count:.0f}",
                    f"{one.bytes / max(ways[ALWAYS].bytes, 1):.1%}",
                    "" if one.area is None else f"{one.area / count:.0f}",
                    "" if one.area is None else f"{1e3 * one.area / one.bytes:.2f}",
                    f"{one.vehicles / max(vehicles, 1):.0%}",
                )
            )
    return rows


def percent(share: float) -> str:
    """Write a share in per cent with one digit; a dash for a share of nothing."""
    return "-" if math.isnan(share) else f"{share:.1%}"


def aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Align the lines of a table: the first column to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            [f"{row[0]:<{widths[0]}}"]
            + [f"{cell:>{width}}" for cell, width in zip(row[1:], widths[1:], strict=True)]
        ).rstrip()
        for row in rows
    ]
