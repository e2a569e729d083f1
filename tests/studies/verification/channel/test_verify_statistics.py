"""Intervals of the comparison."""

import numpy as np
import pytest

from orchestrator.intervals import wilson
from studies.verification.channel.comparison import Comparison, Series, Totals
from studies.verification.channel.tolerances import LOSS


def test_wilson_intervals() -> None:
    """Of 0, 8 and 10 of 10; the values of Newcombe, Statistics in Medicine 17, 1998, method 3."""
    low, high = wilson(np.array([0, 8, 10]), np.array([10, 10, 10]))
    assert low == pytest.approx([0.0, 0.4902, 0.7225], abs=1e-4)
    assert high == pytest.approx([0.2775, 0.9433, 1.0], abs=1e-4)


def totals(golden: int, *ours: int, least: float = 1.0) -> Totals:
    return Totals(golden=golden, ours=np.array(ours), least=least)


def test_a_total_may_lie_where_one_more_sample_is_expected() -> None:
    """s = 2 of n = 3 samples: 5 * 2 * sqrt(4 / 3) = 11.547."""
    assert totals(100, 98, 100, 102).half_width == pytest.approx(11.547, abs=1e-3)
    assert totals(111, 98, 100, 102).passes
    assert not totals(112, 98, 100, 102).passes


def test_a_class_without_spread_may_differ_by_one_frame() -> None:
    assert totals(143, 100, 100, least=43).passes
    assert not totals(144, 100, 100, least=43).passes


def test_a_value_that_is_no_number_is_a_miss() -> None:
    series = Series(label="", golden=np.array([1.0, 2.0]), ours=np.array([1.0, np.nan]))
    found = Comparison.of_values(LOSS, ["first", "second"], [series])
    assert found.misses == 1
    assert found.notes == ("second: golden 2 dB, ours nan dB",)
    assert not found.passes
