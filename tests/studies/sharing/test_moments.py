"""Moments of real traffic: who chooses whom, with the units that are installed."""

import pytest

from orchestrator.registry import component_type
from studies.sharing import moments
from studies.sharing.moments import APMM, PLAIN, choices
from studies.verification.perception.session import UnitsUnderTest


@pytest.mark.slow
def test_the_units_choose_in_the_traffic_of_the_red_light(monkeypatch: pytest.MonkeyPatch) -> None:
    """All matrices are heard; what anybody reveals is part of what is hidden."""
    monkeypatch.setattr(moments, "LOOKS", {"red_light": (6,)})
    units = UnitsUnderTest(component_type("lidar"), component_type("perception"))
    found = list(choices("red_light", 0.1, 1, units))
    assert [one.parameters for one in found] == [APMM.name, PLAIN.name]
    for one in found:
        look = one.moment
        assert look.time == 6.0
        assert look.heard == look.candidates >= 1
        assert moments.DEMAND <= look.most <= look.all <= look.hidden
        assert look.revealed <= look.most
        assert look.mean <= look.most
    first, second = (one.moment for one in found)
    assert (first.hidden, first.most, first.best) == (second.hidden, second.most, second.best)
