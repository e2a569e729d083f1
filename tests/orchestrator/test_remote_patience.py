"""Time that is waited: what this process slept through does not count."""

from time import monotonic

import pytest

from orchestrator.remote.patience import LONGEST_SLICE, SLICE, Patience


def test_a_pause_of_this_process_takes_one_slice() -> None:
    patience = Patience(0.15)
    patience.spend(monotonic() - 3600.0)
    assert not patience.is_over
    assert patience.slice() == pytest.approx(0.15 - LONGEST_SLICE)
    patience.spend(monotonic() - 3600.0)
    assert patience.is_over
    assert patience.slice() == 0.0


def test_what_is_waited_counts_as_long_as_it_was() -> None:
    patience = Patience(1.0)
    patience.spend(monotonic() - 0.08)
    assert patience.slice(10.0) == pytest.approx(0.92, abs=0.01)
    assert patience.slice() == SLICE
