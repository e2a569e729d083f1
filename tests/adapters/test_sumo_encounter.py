import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.sumo.encounter import Passage, SpeedControl, yielding_speed

CONTROL = SpeedControl(
    hold_distance=25.0, min_speed=20 / 3.6, max_speed=60 / 3.6, max_acceleration=3.0
)
H = 0.05


def approach(
    distance: float, speed: float, ego_distance: float, ego_speed: float
) -> tuple[float, float]:
    """Distance of the ego and speed of the collider when the collider is at the point."""
    while distance > 0.0:
        speed = CONTROL.speed(
            speed=speed,
            distance=distance,
            ego_speed=ego_speed,
            ego_distance=ego_distance,
            h=H,
        )
        distance -= speed * H
        ego_distance -= ego_speed * H
    return ego_distance, speed


@given(st.floats(90.0, 200.0), st.floats(6.0, 12.0), st.floats(5.0, 12.0))
def test_the_collider_meets_an_ego_that_keeps_its_speed(
    distance: float, speed: float, ego_speed: float
) -> None:
    """Whatever speed it starts with, as long as the speed that fits is within its bounds."""
    fitting = 9.0  # m/s
    ego_distance, _ = approach(distance, speed, distance * ego_speed / fitting, ego_speed)
    assert abs(ego_distance) < 1.0


def test_within_the_hold_distance_the_speed_is_kept_whatever_the_ego_does() -> None:
    for ego_speed in (0.0, 5.0, 30.0):
        speed = CONTROL.speed(speed=9.0, distance=25.0, ego_speed=ego_speed, ego_distance=20.0, h=H)
        assert speed == 9.0


def test_for_a_standing_ego_it_slows_down_to_its_smallest_speed_no_further() -> None:
    ego_distance, speed = approach(150.0, 12.0, 100.0, 0.0)
    assert ego_distance == 100.0
    assert speed == pytest.approx(20 / 3.6)


def test_the_acceleration_is_bounded() -> None:
    faster = CONTROL.speed(speed=8.0, distance=100.0, ego_speed=20.0, ego_distance=50.0, h=H)
    assert faster == pytest.approx(8.0 + 3.0 * H)


def passage(way: float, reach: float, speed: float) -> Passage:
    return Passage(way=np.array([way]), reach=np.array([reach]), speed=np.array([speed]))


@given(st.floats(60.0, 90.0), st.floats(8.0, 14.0), st.floats(45.0, 100.0), st.floats(6.0, 14.0))
def test_bodies_are_never_both_at_the_crossing(
    way: float, speed: float, collider_way: float, collider_speed: float
) -> None:
    desired = speed
    while way > -20.0 and collider_way > -20.0:
        wanted = float(
            yielding_speed(passage(way, 4.0, speed), passage(collider_way, 3.5, collider_speed), H)[
                0
            ]
        )
        speed = min(desired, speed + 2.0 * H) if np.isnan(wanted) else wanted
        way -= speed * H
        collider_way -= collider_speed * H
        assert abs(way) > 4.0 or abs(collider_way) > 3.5


@pytest.mark.parametrize(
    ("way", "collider_way"),
    [
        pytest.param(200.0, 30.0, id="comes long after"),
        pytest.param(10.0, 60.0, id="is through long before"),
        pytest.param(2.0, 20.0, id="is on the crossing"),
        pytest.param(30.0, -10.0, id="the collider is through"),
        pytest.param(110.0, 110.0, id="the collider is far away"),
    ],
)
def test_nobody_gives_way_without_need(way: float, collider_way: float) -> None:
    free = yielding_speed(passage(way, 4.0, 13.0), passage(collider_way, 3.5, 9.0), H)
    assert np.isnan(free).all()
