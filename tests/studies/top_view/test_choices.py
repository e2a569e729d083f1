"""What has a place on the page: whose receptions, which points."""

import numpy as np
import pytest

from fmus.messages.records import GROUND, POINT, SENSOR, frame
from studies.top_view.listeners import Listeners
from studies.top_view.sensing import _thin


@pytest.mark.parametrize(
    ("receiver", "transmitter", "is_rare", "expected"),
    [
        (0, 9, False, True),  # all that the ego hears
        (5, 9, False, False),  # a BSM of somebody at another entity
        (5, 0, False, True),  # of the ego
        (5, 9, True, True),  # no BSM
        (9, 0, True, False),  # at somebody who is neither
    ],
)
def test_receptions_are_those_of_whom_the_run_is_about(
    *,
    receiver: int,
    transmitter: int,
    is_rare: bool,
    expected: bool,
) -> None:
    listeners = Listeners(full=np.array([0]), partly=np.array([5]))
    found = listeners.wants(np.array([receiver]), np.array([transmitter]), np.array([is_rare]))
    assert found.tolist() == [expected]


def test_points_are_turned_into_the_world_and_those_on_the_ground_left_out() -> None:
    """A sensor at (100, 50) that looks north: forward is north, left is west."""
    sensor = np.zeros(1, SENSOR)
    sensor["vehicle"], sensor["heading"], sensor["count"] = 7, np.pi / 2, 4
    sensor["position"] = (100.0, 50.0, 2.0)
    points = np.zeros(4, POINT)
    points["position"] = [(10, 0, 0), (0, 3, 0), (5, 5, -2), (10.01, 0.01, 0)]
    points["instance"] = [3, -2, GROUND, 3]
    found = _thin(frame("LPTS", sensor, points.tobytes()))
    expected = [(100.0, 60.0, 0.0, 7.0), (97.0, 50.0, 1.0, 7.0)]
    ahead = found[found[:, 2] == 0]
    assert 1 <= len(ahead) <= 2
    np.testing.assert_allclose(ahead[0], expected[0], atol=0.02)
    np.testing.assert_allclose(found[found[:, 2] == 1], expected[1:], atol=1e-5)
