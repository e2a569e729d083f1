"""Background vehicles let one pass that ignores right of way: never both at the crossing."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.sumo.giving_way import Passage, yielding_speed

H = 0.05


def passage(way: float, reach: float, speed: float) -> Passage:
    return Passage(way=np.array([way]), reach=np.array([reach]), speed=np.array([speed]))


@given(st.floats(60.0, 90.0), st.floats(8.0, 14.0), st.floats(45.0, 100.0), st.floats(6.0, 14.0))
def test_bodies_are_never_both_at_the_crossing(
    way: float, speed: float, other_way: float, other_speed: float
) -> None:
    desired = speed
    while way > -20.0 and other_way > -20.0:
        wanted = float(
            yielding_speed(passage(way, 4.0, speed), passage(other_way, 3.5, other_speed), H)[0]
        )
        speed = min(desired, speed + 2.0 * H) if np.isnan(wanted) else wanted
        way -= speed * H
        other_way -= other_speed * H
        assert abs(way) > 4.0 or abs(other_way) > 3.5


@pytest.mark.parametrize(
    ("way", "other_way"),
    [
        pytest.param(200.0, 30.0, id="comes long after"),
        pytest.param(10.0, 60.0, id="is through long before"),
        pytest.param(2.0, 20.0, id="is on the crossing"),
        pytest.param(30.0, -10.0, id="the other is through"),
        pytest.param(110.0, 110.0, id="the other is far away"),
    ],
)
def test_nobody_gives_way_without_need(way: float, other_way: float) -> None:
    free = yielding_speed(passage(way, 4.0, 13.0), passage(other_way, 3.5, 9.0), H)
    assert np.isnan(free).all()
