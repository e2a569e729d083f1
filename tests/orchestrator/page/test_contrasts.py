"""Which combinations an experiment's page compares, and what it says of their difference."""

import math

import pytest

from orchestrator.experiment.page.contrasts import contrasts, difference
from tests.orchestrator.page.results import planned

PLAN = planned({"road": ["dry", "wet", "icy"], "lamp": ["on", "off"]}, [1], {"m": "m"})
"""Combinations: dry on, dry off, wet on, wet off, icy on, icy off."""


def test_every_pair_that_differs_in_one_factor_is_compared_once() -> None:
    found = contrasts(PLAN, PLAN.combinations)
    roads = {(a + k, b + k) for a, b in ((0, 2), (0, 4), (2, 4)) for k in (0, 1)}
    lamps = {(0, 1), (2, 3), (4, 5)}
    assert {(c.first, c.second) for c in found if c.factor == 0} == roads
    assert {(c.first, c.second) for c in found if c.factor == 1} == lamps
    assert len(found) == len(roads) + len(lamps)


def test_differences_to_the_first_level_come_first() -> None:
    """Those of wet and icy come last: they are the first to be left out."""
    found = contrasts(PLAN, PLAN.combinations)
    last = [(c.first, c.second) for c in found if not c.by_reference]
    assert last == [(2, 4), (3, 5)]
    assert [c.by_reference for c in found] == [True] * 7 + [False] * 2


def test_the_order_is_that_of_the_levels_whatever_is_kept() -> None:
    """Combinations that are there in another order, one of them left out."""
    kept = [PLAN.combinations[k] for k in (4, 2, 0)]  # icy on, wet on, dry on
    found = contrasts(PLAN, kept)
    pairs = [(c.first, c.second, c.by_reference) for c in found]
    assert pairs == [(2, 1, True), (2, 0, True), (1, 0, False)]


def test_a_difference_is_of_the_seeds_that_both_have() -> None:
    """3 - 1 and 5 - 6, mean 1/2; t(0.975, 1) = 12.7062 times the error, 3/2."""
    found = difference({1: 3, 2: 5, 3: 9}, {1: 1, 2: 6, 4: 0}, counted=False)
    assert (found.n, found.more, found.less) == (2, 1, 1)
    assert found.estimate is not None
    assert found.estimate.value == 0.5
    assert found.estimate.high is not None
    assert found.estimate.high - 0.5 == pytest.approx(12.7062 * 1.5, abs=1e-3)


def test_a_difference_of_shares_is_counted() -> None:
    """Of four seeds three hit in the first and one in the second: a half."""
    first = {1: True, 2: True, 3: True, 4: False}
    second = {1: True, 2: False, 3: False, 4: False}
    found = difference(first, second, counted=True)
    assert (found.n, found.more, found.less) == (4, 2, 0)
    assert found.estimate is not None
    assert math.isclose(found.estimate.value, 0.5)


def test_without_a_common_seed_there_is_no_difference() -> None:
    found = difference({1: 3}, {2: 5}, counted=False)
    assert (found.estimate, found.n, found.more, found.less) == (None, 0, 0, 0)
