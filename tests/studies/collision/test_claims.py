"""The claims, on campaigns whose outcome we chose."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest

from studies.collision.claims import claims
from studies.collision.curves import critical_points
from studies.collision.runs import Campaign, Point
from studies.method.claims import Judgement, judge
from tests.studies.bounds import known
from tests.studies.collision.synthetic import first, point

N = 400
PERS = {"mohed": 0.12, "signal-strength": 0.4, "random": 0.5, "direct": 0.6}

Rate = Callable[[float, int], float]
"""Of packet error rate and compression: collisions."""


def of_the_paper(per: float, compression: int) -> float:
    """Nothing below 30 %, then steeply up; at compression 32 it is 40 % at least."""
    rising = min(1.0, max(0.0, (per - 0.3) * 3.0))
    return max(0.4, rising) if compression == 32 else rising


def points(
    rate: Rate, *, blind: float = 0.6, compressions: Sequence[int] = (16, 32)
) -> list[Point]:
    """Constant rates at 30 km/h, and relay methods at both speeds."""
    found = [point(first(round(blind * N), N), policy="blind", compression=None)]
    for compression in (16, 32):
        found += [
            point(
                first(round(rate(k / 10, compression) * N), N), per=k / 10, compression=compression
            )
            for k in range(11)
        ]
        found += [
            relayed(relay, per, compression, speed, rate)
            for relay, per in PERS.items()
            for speed in (30.0, 25.0)
        ]
    return found


def relayed(relay: str, per: float, compression: int, speed: float, rate: Rate) -> Point:
    made = point(
        first(round(rate(per, compression) * N), N),
        channel="simulated",
        per=None,
        relay=relay,
        compression=compression,
        speed_kmh=speed,
    )
    runs = {seed: replace(run, per=per) for seed, run in made.runs.items()}
    return replace(made, runs=runs)


def verdicts(found: Sequence[Point]) -> dict[str, str]:
    return {one.claim: one.verdict for one in judged(found)}


def judged(found: Sequence[Point]) -> list[Judgement]:
    return judge(claims(Campaign(found, [])))


def test_what_the_paper_says_reproduces_its_claims() -> None:
    found = verdicts(points(of_the_paper))
    assert found.pop("same-critical-point") == "partly reproduced"  # 32 is beyond it at once
    assert set(found.values()) == {"reproduced"}


def test_the_opposite_refutes_them() -> None:
    """A straight line from 2 % on, at both compressions; compression 32 is better."""
    found = verdicts(points(lambda per, c: 0.02 + 0.5 * per + 0.3 * (c == 16), blind=0.3))
    assert found.pop("same-critical-point") == "undecided"  # below every point
    assert found.pop("only-mohed") == "partly reproduced"  # the others do collide
    assert set(found.values()) == {"not reproduced"}


def test_nothing_at_all_decides_nothing() -> None:
    assert set(verdicts([]).values()) == {"undecided"}


def test_a_policy_that_forgets_has_a_curve_of_its_own() -> None:
    usual = [point(first(k * 10, 100), per=k / 10) for k in range(11)]
    short = [point(first(100 - k, 100), per=k / 10, maximum_age=0.15) for k in range(11)]
    assert judged([*usual, *short]) == judged(usual)
    found = critical_points([*usual, *short])
    assert {point.curve.maximum_age for point in found} == {1.0, 0.15}
    of_usual = [point for point in found if point.curve.maximum_age == 1.0]
    assert of_usual == critical_points(usual)


def test_three_hundred_runs_without_a_collision_do_not_show_less_than_one_percent() -> None:
    short = point(first(0, 300), compression=16)
    long = point(first(0, 400), compression=16)
    blind = point(first(240, 400), policy="blind", compression=None)
    assert verdicts([short, blind])["perfect-below-1"] == "partly reproduced"
    assert verdicts([long, blind])["perfect-below-1"] == "reproduced"


def test_the_critical_point_is_compared_where_both_speeds_have_one() -> None:
    """At 25 km/h the same happens 20 points later."""
    fast = [point(first(k * 40, N), per=k / 10, compression=16) for k in range(11)]
    slow = [
        point(first(max(0, k - 2) * 40, N), per=k / 10, compression=16, speed_kmh=25.0)
        for k in range(11)
    ]
    rows = judged([*fast, *slow])
    (row,) = (r for r in rows if r.quantity.endswith("25 minus 30 km/h, compression 16"))
    assert known(row.value).value == pytest.approx(20.0)
    assert row.part == "fails"


def test_perfect_communication_is_taken_from_most_runs_and_no_other_load() -> None:
    here = Campaign(
        [
            point(first(0, 300), compression=16),
            point(first(0, 400), compression=16),
            point(first(9, 500), compression=16, load="full"),
            point(first(9, 500), compression=16, maximum_age=0.15),
        ],
        [],
    )
    found = here.perfect("cooperative", 16)
    assert found is not None
    assert len(found.runs) == 400
