"""Measures of sharers and bytes, on scenes made by hand."""

import math
from fractions import Fraction

import numpy as np
import pytest

from studies.verification.perception.bytes_on_air import FEATURES, RAW_POINT, Demanded
from studies.verification.perception.scoring import Choice, SceneResult, ZoneAreas
from studies.verification.perception.summary import (
    DEMANDED,
    WHOLE,
    byte_share,
    chosen_by,
    examine,
    nearest,
    parts,
    score_random,
    score_sharers,
    traffic,
)

NOTHING = ZoneAreas(zones=0.0, hidden=0.0, both=0.0)


def scene(areas: tuple[float, ...], *sharers: int, hidden: float = 500.0) -> SceneResult:
    """Candidates 0, 1, ... reveal `areas`; the first is the nearest. 1000 bytes per matrix.

    A tenth of what the sharer sees is in 20 blind zones, with 2000 of its points.
    """
    demanded = Demanded(
        zones=20, share=Fraction(1, 10), points=2000, all_points=50_000, area=40.0, vehicles=1
    )
    count = len(areas)
    return SceneResult(
        number=0,
        candidates=count,
        areas=dict(enumerate(areas)),
        nearest=0,
        by_cells={5.0: 0, 2.5: 1, 1.25: 1},
        all_area=sum(areas),
        hidden_area=hidden,
        interest_area=1000.0,
        hidden_vehicles=2,
        found=dict.fromkeys(range(count), 1),
        all_found=2,
        points=(count + 1) * 50_000,
        cpm_bytes=(count + 1) * 300,
        choices={
            "x": Choice(
                zones=NOTHING,
                sharers=sharers,
                apm_bytes=(count + 1) * 1000,
                demanded=demanded if sharers else None,
            ),
        },
    )


def test_right_is_almost_as_good_as_the_best() -> None:
    results = [
        scene((100.0, 50.0), 0),  # best
        scene((96.0, 100.0), 0),  # right
        scene((94.0, 100.0), 0, 1),  # wrong
        scene((10.0, 100.0)),  # missed
    ]
    score = score_sharers(results, chosen_by("x"))
    assert (score.scenes, score.idle_scenes) == (4, 0)
    assert (score.strict, score.right, score.missed) == (0.25, 0.5, 0.25)
    assert score.revealed == pytest.approx((1 + 0.96 + 0.94 + 0) / 4)
    assert score.right_low < 0.5 < score.right_high


def test_false_triggers_are_those_when_nobody_reveals_anything() -> None:
    results = [
        scene((4.9, 1.0), 1),  # false
        scene((0.0, 0.0)),
        scene((24.9, 0.0), 0),  # neither demand nor nothing
        scene((25.0, 0.0), 0),
    ]
    score = score_sharers(results, chosen_by("x"))
    assert (score.scenes, score.idle_scenes, score.false, score.right) == (1, 2, 0.5, 1.0)


def test_a_random_candidate_is_right_as_often_as_there_are_right_ones() -> None:
    score = score_random([scene((100.0, 95.0, 0.0, 40.0)), scene((0.0, 50.0))])
    assert score.strict == pytest.approx((1 / 4 + 1 / 2) / 2)
    assert score.right == pytest.approx((2 / 4 + 1 / 2) / 2)
    assert score.revealed == pytest.approx((2.35 / 4 + 1 / 2) / 2)


def test_the_nearest_candidate() -> None:
    assert score_sharers([scene((0.0, 50.0)), scene((50.0, 0.0))], nearest).right == 0.5


def test_bytes_of_the_ways_to_share() -> None:
    results = [scene((100.0, 50.0, 0.0), 1), scene((30.0,))]
    found = traffic(results, "x", FEATURES)
    asked = (100 + 12 * 20) + (16 + FEATURES // 10 + 1)  # a tenth of 67072 is not whole
    assert found[DEMANDED].bytes == (4 + 2) * 1000 + asked
    assert found[WHOLE].bytes == (4 + 2) * 1000 + 100 + FEATURES
    assert found["always-on"].bytes == (4 + 2) * FEATURES
    assert found["CPM"].bytes == (4 + 2) * 300
    areas = [found[way].area for way in (DEMANDED, WHOLE, "always-on", "CPM")]
    assert areas == [40.0, 50.0, 180.0, None]
    assert [one.vehicles for one in found.values()] == [1, 1, 4, 4]
    assert byte_share(results, "x", FEATURES) == pytest.approx((6000 + asked) / (6 * FEATURES))
    whole = byte_share(results, "x", FEATURES, WHOLE)
    assert whole == pytest.approx((6100 + FEATURES) / (6 * FEATURES))


def test_raw_points_have_the_size_of_the_scans() -> None:
    found = traffic([scene((100.0, 50.0), 0)], "x", 0)
    assert found["always-on"].bytes == 3 * 50_000 * RAW_POINT
    assert found[WHOLE].bytes == 3 * 1000 + 100 + 50_000 * RAW_POINT
    assert found[DEMANDED].bytes == 3 * 1000 + 340 + 16 + 2000 * RAW_POINT


def test_the_parts_of_what_was_demanded() -> None:
    results = [scene((100.0, 50.0, 0.0), 1), scene((30.0,))]
    found = parts(results, "x", FEATURES)
    assert (found.matrices, found.requests) == (6000, 340)
    assert found.sum == traffic(results, "x", FEATURES)[DEMANDED].bytes
    assert found.answers_by_points == 16 + math.ceil(FEATURES * 2000 / 50_000)


def test_misses_are_examined() -> None:
    results = [
        scene((100.0, 50.0), 0, hidden=200.0),
        scene((50.0, 100.0), 0, 1, hidden=700.0),
        scene((90.0, 100.0, 0.0), 2, 0, 1, hidden=900.0),
        scene((10.0, 100.0)),
    ]
    found = examine(results, "x")
    assert (found.scenes, found.count, found.missed) == (4, 3, 1)
    assert (found.second, found.third) == (0.5, 1.0)
    assert found.median == pytest.approx(0.25)
    assert (found.coarse, found.fine) == (1.0, 0.0)
    assert (found.hidden, found.hidden_right) == (800.0, 200.0)


def test_without_scenes_there_is_no_score() -> None:
    assert np.isnan(score_sharers([], nearest).right)
    assert np.isnan(score_random([]).right)
