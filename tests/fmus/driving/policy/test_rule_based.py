"""Rule-based driving against closed-form kinematics."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.driving.policy import Blind, Expert, RuleBased
from fmus.driving.policy.conflict import Bodies, Conflicts, Prediction, project
from fmus.driving.policy.ego import Ego
from fmus.messages.records import OBJECT, frame, unframe
from fmus.physics.boxes import corners
from orchestrator.absence import Need
from orchestrator.component import Component
from orchestrator.signal import Causality, Signal
from orchestrator.testing import check_component
from tests.fmus.boxes import put

STEP = 50_000_000
PREDICTION = Prediction(
    horizon=4.0,
    step=0.05,
    lateral_margin=0.0,
    longitudinal_margin=0.0,
    acceleration=2.0,
    cruise=10.0,
)
EGO = Ego(
    vehicle=1,
    position=np.zeros(2),
    heading=0.5 * np.pi,
    speed=10.0,
    length=4.0,
    width=2.0,
    route=np.array([[0.0, 0.0], [0.0, 100.0]]),
)


def crossing(x: float, y: float, speed: float) -> Bodies:
    """A car of 4 m x 2 m whose centre is at (x, y), going east."""
    return body((x - 2.0, y - 1.0), (x + 2.0, y + 1.0), velocity=(speed, 0.0))


def body(
    low: tuple[float, float], high: tuple[float, float], *, velocity: tuple[float, float]
) -> Bodies:
    """One whose box lies along the axes."""
    (x, y), (beyond_x, beyond_y) = low, high
    walk = [(x, y), (beyond_x, y), (beyond_x, beyond_y), (x, beyond_y)]
    return Bodies(corners=np.array([walk]), velocity=np.array([velocity]))


def conflict(ego: Ego, bodies: Bodies) -> tuple[float, float]:
    found = PREDICTION.first_conflicts(ego, bodies)
    return float(found.time[0]), float(found.distance[0])


def test_two_that_arrive_together_are_in_conflict_when_the_first_touch_is_possible() -> None:
    """Both reach (0, 20) after 2 s; bodies first touch when both are in the common square."""
    time, distance = conflict(EGO, crossing(-20.0, 20.0, 10.0))
    assert time == pytest.approx(1.7, abs=0.051)
    assert distance == pytest.approx(17.0)


def test_one_that_passes_before_or_after_is_not() -> None:
    assert np.isinf(conflict(EGO, crossing(-10.0, 30.0, 10.0))[0])
    assert np.isinf(conflict(EGO, crossing(-60.0, 20.0, 10.0))[0])


def test_a_stopped_ego_looks_at_the_motion_it_could_start() -> None:
    stopped = replace(EGO, speed=0.0)
    assert conflict(stopped, crossing(-15.0, 6.0, 10.0))[0] < 4.0


def test_traffic_in_the_next_lane_is_no_conflict() -> None:
    parallel = body((2.5, 5.0), (4.5, 9.0), velocity=(0.0, 5.0))
    assert np.isinf(conflict(EGO, parallel)[0])


def test_a_follower_is_no_conflict_for_the_one_it_follows() -> None:
    follower = body((-1.0, -9.0), (1.0, -5.0), velocity=(0.0, 15.0))
    assert np.isinf(conflict(EGO, follower)[0])


@pytest.mark.parametrize(("ahead", "is_judged"), [(-2.1, False), (-1.9, True), (1.9, True)])
def test_who_cuts_in_from_beside_is_a_conflict_unless_wholly_behind(
    ahead: float, *, is_judged: bool
) -> None:
    """A car of 4 m whose front is `ahead` of the ego's middle closes a gap of 2 m at 4 m/s."""
    beside = body((3.0, ahead - 4.0), (5.0, ahead), velocity=(-4.0, EGO.speed))
    time, distance = conflict(EGO, beside)
    assert time == (pytest.approx(0.5, abs=0.051) if is_judged else np.inf)
    if is_judged:  # its rear bumper, seen from the ego's front, when they touch
        assert distance == pytest.approx(max(ahead - 4.0 + EGO.speed * time - 2.0, 0.0))


def test_each_body_is_judged_as_if_it_were_alone() -> None:
    alone = [crossing(-20.0, 20.0, 10.0), crossing(-10.0, 30.0, 10.0), crossing(20.0, 15.0, -9.0)]
    together = Bodies(
        corners=np.concatenate([each.corners for each in alone]),
        velocity=np.concatenate([each.velocity for each in alone]),
    )
    found: Conflicts = PREDICTION.first_conflicts(EGO, together)
    assert list(zip(found.time, found.distance, strict=True)) == [conflict(EGO, b) for b in alone]


BODIES = st.lists(
    st.tuples(
        *(st.floats(-10.0, 45.0), st.floats(-15.0, 45.0), st.floats(0.0, np.pi / 2)),
        *(st.floats(0.3, 18.0), st.floats(0.3, 2.6)),
        *(st.sampled_from([0.0, -9.0, 6.0]), st.sampled_from([0.0, 7.0, -5.0])),
    ),
    min_size=1,
    max_size=6,
)


@given(BODIES)
def test_nobody_is_overlooked_beside_others(
    rows: list[tuple[float, float, float, float, float, float, float]],
) -> None:
    """Bodies of any size and angle, along a route with a bend; far away, one of 1 km.

    Who is near enough to be looked at depends on the largest: with that one, everybody is.
    """
    table = np.array([*rows, (9e4, 9e4, 0.0, 1e3, 1.0, 0.0, 0.0)])
    boxes = corners(table[:, :2], table[:, 2], table[:, 3:5])
    ego = replace(EGO, route=np.array([[0.0, 0.0], [0.0, 18.0], [6.0, 24.0], [60.0, 24.0]]))
    together = PREDICTION.first_conflicts(ego, Bodies(corners=boxes, velocity=table[:, 5:]))
    for k in range(len(rows)):
        one = Bodies(corners=boxes[k : k + 1], velocity=table[k : k + 1, 5:])
        alone = PREDICTION.first_conflicts(ego, one)
        assert (together.time[k], together.distance[k]) == (alone.time[0], alone.distance[0])


@given(st.floats(-50, 150), st.floats(-20, 20))
def test_projection_on_a_straight_route_is_the_identity(along: float, left: float) -> None:
    found = project(EGO.route, np.array([-left, along]))
    assert found[0] == pytest.approx(along, abs=1e-9)
    assert found[1] == pytest.approx(left, abs=1e-9)


def inputs(policy: Component, **changes: Any) -> dict[str, Signal]:
    values: dict[str, Signal] = {
        name: connector.start_value()
        for name, connector in policy.connectors.items()
        if connector.causality is Causality.INPUT
    }
    values |= {
        "ego.id": np.array(1),
        "ego.heading": np.array(np.pi / 2),
        "ego.speed": np.array(30 / 3.6),
        "ego.size": np.array([4.5, 1.8, 1.5]),
        "ego.route": np.array([[0.0, 0.0], [0.0, 100.0]]),
    }
    return values | {name.replace("_", "."): value for name, value in changes.items()}


def seen(sensor: int, x: float, y: float, speed: float, time: int = 0) -> bytes:
    row = np.zeros(1, OBJECT)
    row["sensor"], row["instance"], row["time"], row["points"] = sensor, 7, time, 50
    put(row, (x - 2, y - 1), (x + 2, y + 1))
    row["velocity"], row["height"] = (speed, 0.0), 1.5
    return frame("OBJS", row)


def command(policy: RuleBased | Blind, **changes: Any) -> Any:
    policy.setup(0, np.random.default_rng(0))
    values = inputs(policy, **changes)
    policy.step(values, -2 * STEP, STEP)
    policy.step(values, -STEP, STEP)
    return policy.outputs()


def test_it_brakes_for_what_arrived_and_says_whose_it_was() -> None:
    policy = RuleBased(RuleBased.Parameters())
    outputs = command(policy, received_objects=seen(5, -16.0, 14.0, 10.0))
    assert np.asarray(outputs["command"])[1] > 0.3
    assert int(np.asarray(outputs["hazard.sensor"])) == 5
    assert int(np.asarray(outputs["hazard.instance"])) == 7


@pytest.mark.parametrize(("gap", "deceleration"), [(12.0, 5.0), (17.0, 10.0 / 3), (7.0, 10.0)])
def test_it_brakes_as_much_as_it_takes_to_stop_before_what_stands(
    gap: float, deceleration: float
) -> None:
    """From 10 m/s to a stop 2 m before it, `gap` ahead of the front: v^2 / (2 (gap - 2 m)); the
    pedal is a share of 8 m/s^2, and has a stop."""
    row = unframe("OBJS", seen(1, 0.0, 0.0, 0.0), OBJECT).copy()
    length = 4.5
    put(row, (-1.0, length / 2 + gap), (1.0, length / 2 + gap + 2.0))
    given = {"objects": frame("OBJS", row), "ego_speed": np.array(10.0)}
    for policy in (RuleBased(RuleBased.Parameters()), Blind(Blind.Parameters())):
        pedals = np.asarray(command(policy, **given)["command"])
        assert pedals[:2] == pytest.approx([0.0, min(deceleration / 8.0, 1.0)], abs=0.002)


def test_it_does_not_brake_for_itself_as_others_see_it() -> None:
    """Whatever its track number: the object is where the ego is, moved on by its age."""
    policy = RuleBased(RuleBased.Parameters())
    row = np.zeros(1, OBJECT)
    row["sensor"], row["time"], row["points"], row["height"] = 5, -STEP, 50, 1.5
    row["velocity"] = (0.0, 30 / 3.6)
    behind = 30 / 3.6 * STEP / 1e9
    put(row, (-0.9, -2.25 - behind), (0.9, 2.25 - behind))
    for track in (1, 7):
        row["instance"] = track
        policy.setup(0, np.random.default_rng(0))
        values = inputs(policy, received_objects=frame("OBJS", row))
        for time in (-2 * STEP, -STEP):
            policy.step(values, time, STEP)
        assert int(np.asarray(policy.outputs()["hazard.instance"])) == -1


def test_a_shared_object_with_the_number_of_the_ego_is_no_less_of_a_hazard() -> None:
    row = unframe("OBJS", seen(5, -16.0, 14.0, 10.0), OBJECT).copy()
    row["instance"] = 1
    outputs = command(RuleBased(RuleBased.Parameters()), received_objects=frame("OBJS", row))
    assert np.asarray(outputs["command"])[1] > 0.3


def test_the_blind_policy_ignores_what_arrived() -> None:
    outputs = command(Blind(Blind.Parameters()), received_objects=seen(5, -16.0, 14.0, 10.0))
    assert np.asarray(outputs["command"])[1] == 0.0


def test_both_brake_for_what_the_ego_sees() -> None:
    for policy in (RuleBased(RuleBased.Parameters()), Blind(Blind.Parameters())):
        outputs = command(policy, objects=seen(1, -16.0, 14.0, 10.0))
        assert np.asarray(outputs["command"])[1] > 0.3


def test_objects_of_other_sensors_do_not_reach_it_without_the_radio() -> None:
    outputs = command(RuleBased(RuleBased.Parameters()), objects=seen(5, -16.0, 14.0, 10.0))
    assert np.asarray(outputs["command"])[1] == 0.0


def test_shared_objects_are_predicted_from_the_time_of_their_scan() -> None:
    """A scan of 0.5 s ago saw the car 5 m further back: the same command results."""
    policy = RuleBased(RuleBased.Parameters())
    fresh = command(policy, received_objects=seen(5, -16.0, 14.0, 10.0))
    aged = command(policy, received_objects=seen(5, -21.0, 14.0, 10.0, time=-500_000_000))
    np.testing.assert_allclose(fresh["command"], aged["command"], rtol=1e-9)


def test_it_keeps_the_cruising_speed() -> None:
    policy = RuleBased(RuleBased.Parameters())
    np.testing.assert_array_equal(command(policy)["command"], np.zeros(3))
    assert np.asarray(command(policy, ego_speed=np.array(5.0))["command"])[0] > 0
    assert np.asarray(command(policy, ego_speed=np.array(12.0))["command"])[1] > 0


def test_it_steers_back_to_its_route() -> None:
    for policy in (RuleBased(RuleBased.Parameters()), Blind(Blind.Parameters())):
        right = command(policy, ego_position=np.array([1.0, 0.0]))
        assert np.asarray(right["command"])[2] > 0.05
        left = command(policy, ego_heading=np.array(0.5 * np.pi + 0.1))
        assert np.asarray(left["command"])[2] < -0.05


@pytest.mark.parametrize(
    "policy",
    [RuleBased(RuleBased.Parameters()), Blind(Blind.Parameters()), Expert(Expert.Parameters())],
    ids=["rule-based", "blind", "expert"],
)
def test_a_policy_reads_what_its_outputs_depend_on_and_nothing_else(policy: Component) -> None:
    """Without the other inputs it drives as before; without one of its own it cannot."""
    policy.setup(0, np.random.default_rng(0))
    reads = policy.connectors["command"].feedthrough
    everything = inputs(policy) | {
        "vehicle.id": np.array([1]),
        "vehicle.position": np.zeros((1, 3)),
        "vehicle.heading": np.zeros(1),
        "vehicle.velocity": np.zeros((1, 2)),
        "vehicle.size": np.ones((1, 3)),
    }
    policy.step({name: everything[name] for name in reads}, 0, STEP)
    for name in reads:
        with pytest.raises(KeyError, match=name):
            policy.step({n: everything[n] for n in reads - {name}}, 0, STEP)


def test_contract() -> None:
    check_component(RuleBased(RuleBased.Parameters()), steps=5, h=STEP, seed=1)
    check_component(Blind(Blind.Parameters()), steps=5, h=STEP, seed=1)


@pytest.mark.parametrize("policy", [Blind, Expert, RuleBased])
def test_an_input_that_a_policy_does_not_read_is_nobodys_loss(policy: Any) -> None:
    component: Component = policy(policy.Parameters())
    inputs = {
        name: connector
        for name, connector in component.connectors.items()
        if connector.causality is Causality.INPUT
    }
    said = {name: connector.undriven for name, connector in inputs.items()}
    assert all(each is not None for each in said.values())
    never = {name for name, each in said.items() if each is not None and each.need is Need.NEVER}
    assert never
    for name in never:
        each = said[name]
        assert each is not None
        assert each.meaning == "no matter: this policy does not read it"


def test_what_was_told_some_time_ago_has_gone_on_since() -> None:
    """As if it had been told now from where it has come to be: 20 m on in 2 s at 10 m/s."""
    policy = RuleBased.Parameters(confirmations=1)
    told = {
        "ago": seen(5, -36.0, 14.0, 10.0, -2_000_000_000),
        "now": seen(5, -16.0, 14.0, 10.0),
        "there": seen(5, -36.0, 14.0, 10.0),
    }
    ago, now, there = (
        np.asarray(command(RuleBased(policy), received_objects=each)["command"])
        for each in told.values()
    )
    np.testing.assert_allclose(ago, now, atol=1e-9)
    assert now[1] > 0.1
    assert there[1] == 0.0
