"""The expert against closed-form kinematics, and in traffic."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from adapters.sumo import SumoTraffic
from adapters.sumo.ego import Command, EgoState, advance
from adapters.traffic.geometry import Boxes, box_distance
from fmus.driving.policy import Expert, ExpertDriver, Inputs
from fmus.driving.policy.expert import EXPERT_READS, ExpertParameters
from orchestrator.distribution import Constant
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Causality, Signal
from orchestrator.testing import check_component
from tests.adapters.red_light import red_light
from tests.fmus.dynamics import DYNAMICS

STEP: Final = 50_000_000
CRUISE: Final = 30 / 3.6
SIZE: Final = np.array([4.93, 1.86])
START: Final = EgoState(x=0.0, y=0.0, heading=0.5 * math.pi, speed=CRUISE)


@dataclass(frozen=True, slots=True, kw_only=True)
class Other:
    """Another vehicle that keeps its velocity."""

    center: tuple[float, float]
    heading: float
    speed: float = 0.0
    size: tuple[float, float] = (4.63, 1.78)

    def after(self, time: float) -> "Other":
        x, y = self.center
        ahead = (math.cos(self.heading), math.sin(self.heading))
        way = time * self.speed
        return replace(self, center=(x + way * ahead[0], y + way * ahead[1]))


def signals(ego: EgoState, *vehicles: Other) -> dict[str, Signal]:
    """The ego drives to the north and is number 4; the others are 5, 6, ..."""
    center = np.array([(ego.x, ego.y), *(v.center for v in vehicles)])
    heading = np.array([ego.heading, *(v.heading for v in vehicles)])
    speed = np.array([ego.speed, *(v.speed for v in vehicles)])
    size = np.array([SIZE, *(v.size for v in vehicles)])
    return {
        "ego.id": np.array(4),
        "ego.position": center[0],
        "ego.heading": heading[0],
        "ego.speed": speed[0],
        "ego.size": np.append(SIZE, 1.5),
        "ego.route": np.array([[0.0, ego.y], [0.0, ego.y + 200.0]]),
        "vehicle.id": 4 + np.arange(len(center)),
        "vehicle.position": np.column_stack([center, np.zeros(len(center))]),
        "vehicle.heading": heading,
        "vehicle.velocity": speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)]),
        "vehicle.size": np.column_stack([size, np.full(len(center), 1.5)]),
    }


def inputs(ego: EgoState, *vehicles: Other) -> Inputs:
    return Inputs.read(signals(ego, *vehicles), EXPERT_READS)


def decide(ego: EgoState, *vehicles: Other, **parameters: Any) -> tuple[float, int]:
    """The acceleration that the command stands for [m/s^2], and the number braked for."""
    found = ExpertDriver(ExpertParameters(**parameters)).drive(inputs(ego, *vehicles))
    number = found.hazard.instance if found.hazard else -1
    return 3.0 * found.accelerate - 8.0 * found.brake, number


def drive(seconds: float, *vehicles: Other, start: EgoState = START) -> Iterator[Any]:
    """State, gap to the nearest body and acceleration, every 50 ms."""
    driver, state = ExpertDriver(ExpertParameters()), start
    for k in range(round(seconds / 0.05)):
        now = [vehicle.after(0.05 * k) for vehicle in vehicles]
        body = Boxes(
            center=np.array([state.x, state.y]), heading=np.array(state.heading), size=SIZE
        )
        theirs = Boxes(
            center=np.array([v.center for v in now]),
            heading=np.array([v.heading for v in now]),
            size=np.array([v.size for v in now]),
        )
        command = np.asarray(driver.drive(inputs(state, *now)).signals()["command"])
        yield state, float(box_distance(body, theirs).min()), 3.0 * command[0] - 8.0 * command[1]
        for _ in range(5):
            state = advance(state, Command.of(command), DYNAMICS, 0.01)


def crossing(distance: float, time: float, speed: float) -> Other:
    """Goes east and reaches the ego's route, `distance` ahead, after `time`."""
    return Other(center=(-speed * time, distance), heading=0.0, speed=speed)


def test_with_a_free_road_it_keeps_its_speed() -> None:
    assert decide(START) == (0.0, -1)
    assert decide(replace(START, speed=CRUISE - 1.0))[0] == pytest.approx(1.0)
    assert decide(replace(START, speed=0.0))[0] == pytest.approx(2.0)
    assert decide(replace(START, speed=CRUISE + 1.0))[0] == pytest.approx(-1.0)


def test_it_does_not_brake_for_a_meeting_far_away() -> None:
    """At 40 m, 0.9 m/s^2 would be enough; the forecast may still change."""
    assert decide(START, crossing(40.0, 40.0 / CRUISE, 8.0)) == (0.0, -1)


def test_it_brakes_as_hard_as_it_must() -> None:
    """With `room` to the stop, v^2 / (2 room), once that is more than comfortable."""
    parameters = ExpertParameters()
    half_widths = 0.5 * (SIZE[0] + 1.78)  # of the ego's length and the car's width
    for demand in (3.0, 4.0, 6.0):
        room = CRUISE**2 / (2.0 * demand)
        distance = room + parameters.stop_margin + half_widths
        found, number = decide(START, crossing(distance, distance / CRUISE, 8.0))
        assert found == pytest.approx(-demand, rel=1e-6)
        assert number == 5


def test_bodies_beside_the_lane_are_no_threats() -> None:
    """A queue of trucks, and a turned bus whose bounding box would lie across the lane."""
    queue = [Other(center=(-3.5, 9.5 * k), heading=0.5 * math.pi, size=(8, 2.5)) for k in range(6)]
    bus = Other(center=(6.8, 14.0), heading=math.radians(50.0), size=(12.0, 2.55))
    assert decide(START, *queue, bus) == (0.0, -1)
    axis_aligned = 0.5 * (12.0 * math.cos(bus.heading) + 2.55 * math.sin(bus.heading))
    assert bus.center[0] - axis_aligned < 0.5 * SIZE[1] + 1.2  # what a box along the axes says
    assert decide(START, replace(bus, center=(3.0, 14.0)))[1] == 5


def test_followers_and_oncoming_traffic_are_no_threats() -> None:
    follower = Other(center=(0.0, -8.0), heading=0.5 * math.pi, speed=14.0)
    oncoming = Other(center=(-3.5, 30.0), heading=-0.5 * math.pi, speed=14.0)
    assert decide(START, follower, oncoming) == (0.0, -1)


@given(st.floats(0.0, CRUISE), st.floats(3.0, 40.0))
def test_the_command_is_continuous_before_an_obstacle(speed: float, distance: float) -> None:
    """A millimetre, or a millimetre per second, changes it by little: a network can learn it."""

    def acceleration(speed: float, distance: float) -> float:
        wall = Other(center=(0.0, distance), heading=0.0)
        return decide(replace(START, speed=speed), wall, horizon=30.0)[0]

    here = acceleration(speed, distance)
    assert abs(acceleration(speed, distance + 0.001) - here) < 0.1
    assert abs(acceleration(speed + 0.001, distance) - here) < 0.1


def test_it_stops_before_what_stands_in_the_way() -> None:
    *_, (state, gap, _) = drive(20.0, wall := Other(center=(0.0, 60.0), heading=0.0))
    assert state.speed < 0.05
    assert 2.5 < gap < 3.5  # `stop_margin` is 3 m
    assert gap == pytest.approx(60.0 - 0.5 * wall.size[1] - state.y - 0.5 * SIZE[0])
    hardest = min(acceleration for _, _, acceleration in drive(20.0, wall))
    assert -3.3 < hardest < -2.0  # `comfortable` is 3 m/s^2


def test_it_follows_a_slower_vehicle_at_its_headway() -> None:
    leader = Other(center=(0.0, 40.0), heading=0.5 * math.pi, speed=5.0)
    *_, (state, gap, acceleration) = drive(40.0, leader)
    assert state.speed == pytest.approx(5.0, abs=0.05)
    assert gap == pytest.approx(3.0 + 1.0 * 5.0, abs=0.5)  # `stop_margin` + `headway` x speed
    assert acceleration == pytest.approx(0.0, abs=0.05)


def test_who_comes_behind_it_may_be_faster_than_predicted_by_the_haste() -> None:
    """The ego has left the crossing after some 2.4 s; the car is there after 2.9 s, or sooner."""
    car = crossing(15.0, 3.4, 8.0)
    assert decide(START, car, haste=0.0) == (0.0, -1)
    assert decide(START, car, haste=0.1) == (0.0, -1)
    assert decide(START, car, haste=0.5)[1] == 5


@pytest.mark.slow
@settings(max_examples=20)
@given(st.floats(3.0, 17.0), st.floats(-4.0, 6.0), st.floats(35.0, 70.0))
def test_it_lets_pass_who_crosses_and_goes_on(speed: float, late: float, distance: float) -> None:
    """Whoever comes whenever at whatever speed: no touch, no emergency, and no long wait."""
    other = crossing(distance, distance / CRUISE + late, speed)
    on_the_way = takewhile(lambda now: now[0].y < distance + 15.0, drive(25.0, other))
    run = list(on_the_way)
    assert min(gap for _, gap, _ in run) > 0.5
    assert min(acceleration for _, _, acceleration in run) > -4.5
    undisturbed = (distance + 15.0) / CRUISE
    through = max(undisturbed, distance / CRUISE + late + 10.0 / speed)
    assert 0.05 * len(run) < through + 6.0


def test_where_it_cannot_stop_any_more_it_goes_on_if_that_is_free() -> None:
    """1 m before the path of a car that comes in 2.5 s: within the margins, but free."""
    distance = 1.0 + 0.5 * (SIZE[0] + 1.78)
    assert decide(START, crossing(distance, 2.3, 12.0))[0] == 0.0
    assert decide(START, crossing(distance, 0.6, 12.0))[0] == -8.0  # neither: it brakes


def test_the_command_depends_on_the_present_only() -> None:
    """A driver with a past and a new one decide alike."""
    driver = ExpertDriver(ExpertParameters())
    other = crossing(30.0, 30.0 / CRUISE, 9.0)
    for k in range(60):
        now = inputs(replace(START, y=0.3 * k, speed=7.0), other.after(0.05 * k))
        assert driver.drive(now) == ExpertDriver(ExpertParameters()).drive(now)


def test_without_the_truth_it_refuses_to_drive() -> None:
    values = signals(START) | {"vehicle.id": np.array([9])}
    with pytest.raises(ValueError, match="connect the truth about all vehicles"):
        ExpertDriver(ExpertParameters()).drive(Inputs.read(values, EXPERT_READS))


def test_parameters_that_do_not_fit_together() -> None:
    with pytest.raises(ComponentTypeError, match=r"`onset` .* must be below `comfortable`"):
        Expert(Expert.Parameters(onset=3.0))
    with pytest.raises(ComponentTypeError, match="not above `max_braking`"):
        Expert(Expert.Parameters(max_braking=2.5))


def test_contract() -> None:
    check_component(Expert(Expert.Parameters()), steps=5, h=STEP, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "speed", "trucks"), [(1, 20, 3), (2, 30, 4), (3, 33, 6)])
def test_in_traffic_it_yields_to_the_collision_vehicle_and_completes(
    seed: int, speed: float, trucks: int
) -> None:
    cruise = speed / 3.6
    ego = {"speed": Constant(cruise), "position": {"to_end": 90.0}}
    traffic = SumoTraffic(red_light(entities={"ego": ego, "blocking": {"count": trucks}}))
    expert = Expert(Expert.Parameters(cruise_speed=cruise))
    named = [n for n, c in expert.connectors.items() if c.causality is Causality.INPUT]
    try:
        traffic.setup(0, np.random.default_rng(seed))
        expert.setup(0, np.random.default_rng(seed))
        hardest = 0.0
        for t in range(0, 30_000_000_000, STEP):
            signals = traffic.outputs()
            if signals["encounter.over"]:
                break
            expert.step({n: signals[n] for n in named if n in signals}, t, STEP)
            command = np.asarray(expert.outputs()["command"])
            hardest = max(hardest, 8.0 * float(command[1]))
            traffic.step({"ego.command": command}, t, STEP)
        outcome = traffic.outputs()
        assert not outcome["ego.collision"]
        assert 0.0 < float(np.asarray(outcome["ego.completion_time"])) < (90 + 23) / cruise + 4.0
        assert 2.0 < hardest < 4.0
    finally:
        traffic.close()
