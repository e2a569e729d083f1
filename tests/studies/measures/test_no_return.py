"""The point of no return: the formula, and the driven vehicle braking at ever later moments."""

import math

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.sumo.ego import Command, EgoDynamics, EgoState, advance
from studies.measures.no_return import Body, Conflict, conflict

CAR = (4.0, 2.0)
DYNAMICS = EgoDynamics(
    wheelbase=2.85,
    max_acceleration=3.0,
    max_braking=8.0,
    actuator_lag=0.1,
    max_steering=0.6,
    max_steering_rate=0.8,
)


def body(x: float, y: float, speed: float, degrees: float, size: tuple[float, float] = CAR) -> Body:
    heading = math.radians(degrees)
    velocity = speed * np.array([math.cos(heading), math.sin(heading)])
    return Body(center=np.array([x, y]), heading=heading, velocity=velocity, size=np.array(size))


def crossing(speed: float, delay: float, other_speed: float = 8.0) -> tuple[Body, Body]:
    """One drives north from 40 m before the origin, one east; it is there `delay` [s] later."""
    arrival = 40.0 / speed + delay
    return body(0.0, -40.0, speed, 90.0), body(-other_speed * arrival, 0.0, other_speed, 0.0)


def test_ways_at_a_right_angle() -> None:
    """Front to the near side of the other's strip; its front and rear to the sides of one's own."""
    found = conflict(*crossing(10.0, delay=0.0))
    assert found is not None
    assert found.distance == pytest.approx(40.0 - 2.0 - 1.0)
    assert found.begin == pytest.approx((32.0 - 2.0 - 1.0) / 8.0)
    assert found.end == pytest.approx((32.0 + 2.0 + 1.0) / 8.0)
    assert found.meeting(10.0) == pytest.approx(3.7)
    assert found.meeting(20.0) == pytest.approx(found.begin)


@pytest.mark.parametrize("turned", [0.0, 37.0, 181.0])
def test_the_direction_of_the_axes_does_not_matter(turned: float) -> None:
    first, other = crossing(10.0, delay=0.2)
    angle = math.radians(turned)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    moved = [
        Body(
            center=turn @ each.center + [5.0, -3.0],
            heading=each.heading + angle,
            velocity=turn @ each.velocity,
            size=each.size,
        )
        for each in (first, other)
    ]
    found, wanted = conflict(*moved), conflict(first, other)
    assert found is not None
    assert wanted is not None
    for name in ("distance", "begin", "end"):
        assert getattr(found, name) == pytest.approx(getattr(wanted, name))


def test_ways_at_half_a_right_angle_are_longer_in_each_other() -> None:
    """A strip of half width h is 2 h / sin 45 long across; the body at 45 degrees is 3 / sqrt 2."""
    other = body(-30.0 / math.sqrt(2), -30.0 / math.sqrt(2), 10.0, 45.0)
    found = conflict(body(0.0, -30.0, 10.0, 90.0), other)
    assert found is not None
    reach = (1.0 + (2.0 + 1.0) / math.sqrt(2)) * math.sqrt(2)
    assert found.distance == pytest.approx(30.0 - reach)
    assert (found.begin, found.end) == pytest.approx(((30 - reach) / 10, (30 + reach) / 10))


def test_who_is_there_already_has_no_way_to_it() -> None:
    """One is 0.5 m beyond the middle of the other's way, which it leaves in half a second."""
    found = conflict(body(0.0, 0.5, 5.0, 90.0), body(-6.0, 0.0, 8.0, 0.0))
    assert found == Conflict(distance=0.0, begin=3.0 / 8.0, end=9.0 / 8.0)
    found = conflict(body(0.0, 0.5, 5.0, 90.0), body(-3.0, 0.0, 8.0, 0.0))
    assert found is not None
    assert (found.begin, found.end) == pytest.approx((0.0, 6.0 / 8.0))
    found = conflict(body(0.0, 0.5, 5.0, 90.0), body(-2.0, 0.0, 8.0, 0.0))
    assert found is not None
    assert found.begin == 0.0


@pytest.mark.parametrize(
    ("first", "other"),
    [
        (body(0, -40, 0.0, 90), body(-32, 0, 8.0, 0)),  # one stands
        (body(0, -40, 10.0, 90), body(-32, 0, 0.0, 0)),
        (body(0, -40, 10.0, 90), body(1, 40, 10.0, -85)),  # nearly the same way
        (body(0, 40, 10.0, 90), body(-32, 0, 8.0, 0)),  # the crossing is behind one
        (body(0, -40, 10.0, 90), body(32, 0, 8.0, 0)),
        crossing(10.0, delay=-1.0),  # the other has passed
        crossing(10.0, delay=1.0),  # one has passed
    ],
)
def test_who_does_not_meet_has_no_conflict(first: Body, other: Body) -> None:
    assert conflict(first, other) is None


def test_who_would_have_to_stop_has_the_time_of_the_way_to_stop() -> None:
    """20 m to the way, 10 m/s, 5 m/s^2: braking takes 10 m, so it begins 1 s from now."""
    found = Conflict(distance=20.0, begin=1.9, end=10.0)
    assert found.last_moment(10.0, 5.0, reaction=0.0) == pytest.approx(1.0)
    assert found.last_moment(10.0, 5.0, reaction=0.4) == pytest.approx(0.6)
    assert found.last_moment(10.0, 2.0, reaction=0.0) == pytest.approx(-0.5)


def test_who_may_pass_behind_brakes_away_what_it_would_be_too_far() -> None:
    """At the end, 2.5 s, it would be 5 m in the way: 5 m/s^2 take sqrt 2 s for that."""
    found = Conflict(distance=20.0, begin=1.9, end=2.5)
    wanted = 2.5 - 0.3 - math.sqrt(2.0)
    assert found.last_moment(10.0, 5.0, reaction=0.3) == pytest.approx(wanted)


def test_between_the_two_cases_there_is_no_step() -> None:
    """10 m/s and 5 m/s^2: with 10 m in the way it comes to a stop just when the other leaves."""
    ends = [3.0 - 1e-9, 3.0, 3.0 + 1e-9]
    last = [Conflict(distance=20.0, begin=2.0, end=e).last_moment(10.0, 5.0, 0.2) for e in ends]
    assert last == pytest.approx([0.8, 0.8, 0.8], abs=1e-6)


def meets(first: Body, other: Body, brakes_at: float, reaction: float, share: float) -> bool:
    """Whether the driven vehicle, which decides at `brakes_at` [s], is ever in the other's way."""
    state = EgoState(x=first.center[0], y=first.center[1], heading=first.heading, speed=first.speed)
    step = 0.005
    found = conflict(first, other)
    assert found is not None
    start = state.y
    for k in range(round(found.end / step)):
        is_braking = k * step >= brakes_at + reaction
        pedal = Command(accelerate=0.0, brake=share if is_braking else 0.0, steer=0.0)
        state = advance(state, pedal, DYNAMICS, step)
    return state.y - start > found.distance


@pytest.mark.parametrize("deceleration", [3.0, 8.0])
@pytest.mark.parametrize("delay", [0.0, 0.3])
@pytest.mark.parametrize("speed", [6.0, 30.0 / 3.6, 14.0])
def test_it_is_when_the_driven_vehicle_can_just_not_avoid_it_any_more(
    speed: float, delay: float, deceleration: float
) -> None:
    """Bisection of the moment of the decision; the brakes' lag of 0.1 s is part of the reaction."""
    first, other = crossing(speed, delay)
    found = conflict(first, other)
    assert found is not None
    early, late = found.meeting(speed) - 4.0, found.meeting(speed)
    share = deceleration / DYNAMICS.max_braking
    assert not meets(first, other, early, 0.2, share)
    assert meets(first, other, late, 0.2, share)
    while late - early > 0.005:
        middle = 0.5 * (early + late)
        early, late = (early, middle) if meets(first, other, middle, 0.2, share) else (middle, late)
    formula = found.last_moment(speed, deceleration, reaction=0.2 + DYNAMICS.actuator_lag)
    assert formula == pytest.approx(early, abs=0.03)


@given(
    st.floats(3.0, 30.0),
    st.floats(0.5, 9.0),
    st.floats(0.0, 1.0),
    st.floats(1.0, 80.0),
    st.floats(0.1, 5.0),
)
def test_who_brakes_then_is_at_the_way_when_the_other_leaves_or_stands_before_it(
    speed: float, deceleration: float, reaction: float, distance: float, into: float
) -> None:
    """Way in the time until the end, by the motion itself."""
    found = Conflict(distance=distance, begin=distance / speed, end=distance / speed + into / speed)
    decision = found.last_moment(speed, deceleration, reaction)
    braking = found.end - decision - reaction
    assert braking >= -1e-9
    rolls = min(braking, speed / deceleration)
    way = speed * (decision + reaction) + speed * rolls - 0.5 * deceleration * rolls**2
    assert way == pytest.approx(distance, abs=1e-6)
