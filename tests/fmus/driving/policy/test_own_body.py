"""Nobody brakes for himself: what others see of the ego is told from what is beside it."""

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, strategies as st
from typing_extensions import override

from fmus.driving.policy import EGO, Command, DrivingPolicy, Inputs, RuleBased
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.own_body import ACCURACY, MARGIN, OwnBody
from fmus.messages.records import OBJECT, frame
from fmus.physics.boxes import corners
from orchestrator.signal import Array, Causality, Signal
from orchestrator.timebase import Time
from tests.fmus.boxes import put

STEP = 50_000_000
LENGTH, WIDTH, SPEED = 4.5, 1.8, 30 / 3.6
SHARER = 5


def ego(x: float, y: float, heading: float, speed: float = SPEED, vehicle: int = 1) -> Ego:
    return Ego(
        vehicle=vehicle,
        position=np.array([x, y]),
        heading=heading,
        speed=speed,
        length=LENGTH,
        width=WIDTH,
        route=np.array([[x, y], [x + np.cos(heading), y + np.sin(heading)]]),
    )


def boxes(*ends: tuple[npt.ArrayLike, npt.ArrayLike], time: Time = 0) -> Array:
    """Objects with these lower and upper corners."""
    rows = np.zeros(len(ends), OBJECT)
    rows["sensor"], rows["instance"], rows["time"] = SHARER, np.arange(len(ends)), time
    for k, (low, high) in enumerate(ends):
        put(rows[k : k + 1], low, high)
    return rows


def body_at(*poses: tuple[Time, Ego]) -> OwnBody:
    body = OwnBody()
    for time, pose in poses:
        body.update(pose, time)
    return body


class Listens(DrivingPolicy):
    """A policy of somebody else's, which keeps what it is given."""

    def __init__(self, reads: frozenset[str]) -> None:
        self._reads = reads
        self.known: list[Inputs] = []

    @property
    @override
    def reads(self) -> frozenset[str]:
        return self._reads

    @override
    def drive(self, inputs: Inputs, now: Time) -> Command:
        self.known.append(inputs)
        return Command()


def drive(policy: DrivingPolicy, shared: Array, steps: int = 12, **changes: Signal) -> Any:
    """The outputs after driving north in a straight line, at (0, 0) in the end, at time 0."""
    policy.setup(-steps * STEP, np.random.default_rng(0))
    values: dict[str, Signal] = {
        name: connector.start_value()
        for name, connector in policy.connectors.items()
        if connector.causality is Causality.INPUT
    }
    for k in range(steps):
        now = (k + 1 - steps) * STEP
        known = shared[shared["time"] <= now]
        where = np.array([0.0, SPEED * now / 1e9])
        values |= {
            "ego.id": np.array(1),
            "ego.position": where,
            "ego.heading": np.array(np.pi / 2),
            "ego.speed": np.array(SPEED),
            "ego.size": np.array([LENGTH, WIDTH, 1.5]),
            "ego.route": np.array([where, where + np.array([0.0, 100.0])]),
            "received.objects": frame("OBJS", known),
        }
        policy.step(values | changes, now - STEP, STEP)
    return policy.outputs()


def piece_of_the_front(time: Time, off: float) -> Array:
    """1.2 m of the ego's front as a sharer sees it at `time`, `off` metres too far ahead."""
    front = SPEED * time / 1e9 + LENGTH / 2 + off
    return boxes(((-WIDTH / 2, front - 1.2), (WIDTH / 2, front)), time=time)


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (0.0, SPEED), (0.0, 2.5 * SPEED), (3.0, -4.0)])
@pytest.mark.parametrize("age", [0, 50_000_000, 120_000_000, 400_000_000])
@pytest.mark.parametrize("off", [-0.4, 0.0, 0.45])
def test_a_view_of_its_front_leaves_the_command_as_it_is(
    velocity: tuple[float, float], age: int, off: float
) -> None:
    """Whatever velocity the sharer's track of that piece has, and however old it is."""
    view = piece_of_the_front(-age, off)
    view["velocity"] = velocity
    policy = RuleBased(RuleBased.Parameters())
    alone = drive(policy, np.empty(0, OBJECT))
    found = drive(policy, view)
    for name, value in alone.items():
        np.testing.assert_array_equal(np.asarray(found[name]), np.asarray(value))


def test_that_view_would_be_a_hazard_if_it_were_of_somebody_else() -> None:
    """The same box, as far ahead of the ego as the ego stops before."""
    view = piece_of_the_front(-STEP, 6.0)
    found = drive(RuleBased(RuleBased.Parameters()), view)
    assert np.asarray(found["command"])[1] > 0.0
    assert int(np.asarray(found["hazard.sensor"])) == SHARER


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_obstacle_one_metre_beside_the_footprint_still_counts(side: float) -> None:
    """It comes in from there: as large as the piece of the ego, and with it in one message."""
    inner, outer = sorted((side * (WIDTH / 2 + 1.0), side * (WIDTH / 2 + 2.2)))
    walker = boxes(((inner, 1.0), (outer, 2.0)))
    walker["velocity"], walker["instance"] = (-2.0 * side, SPEED), 77
    shared = np.concatenate([piece_of_the_front(0, 0.2), walker])
    found = drive(RuleBased(RuleBased.Parameters(confirmations=1)), shared)
    assert int(np.asarray(found["hazard.instance"])) == 77
    assert np.asarray(found["command"])[1] > 0.0


def test_every_policy_that_knows_the_ego_is_given_the_others_alone() -> None:
    shared = np.concatenate([piece_of_the_front(0, 0.0), boxes(((-1.0, 9.0), (1.0, 12.0)))])
    policy = Listens(EGO | {"received.objects"})
    drive(policy, shared)
    assert policy.known[-1].received["position"].tolist() == [[0.0, 10.5]]
    stranger = Listens(frozenset({"received.objects"}))
    drive(stranger, shared)
    assert len(stranger.known[-1].received) == 2


def test_braking_and_turning_are_remembered() -> None:
    """A scan of 0.5 s ago, at 8 m/s^2: going on as now would put the ego 1 m elsewhere."""
    times = np.arange(-20, 1) * STEP
    poses = []
    for time in times.tolist():
        t = time / 1e9  # s: speed 3 m/s now, turning left at 0.8 rad/s
        along, heading = 3.0 * t - 4.0 * t * t, 0.8 * t
        poses.append((time, ego(along, 0.1 * t, heading, speed=3.0 - 8.0 * t)))
    body = body_at(*poses)
    for time, pose in poses[-12:]:
        around = corners(pose.position, np.array(pose.heading), np.array([LENGTH, WIDTH]))
        view = boxes((around.min(axis=0), around.max(axis=0)), time=time)
        nose = around[[0, 3]]  # the surface of the front alone
        front = boxes((nose.min(axis=0), nose.max(axis=0)), time=time)
        assert body.is_in(np.concatenate([view, front])).all()
    old = poses[10][1]  # where it was 0.5 s ago there may be somebody now
    behind = old.position - [LENGTH / 2, 0.0]
    rear = (behind - 0.3, behind + 0.3)
    assert body.is_in(boxes(rear, time=poses[10][0])).all()
    assert not body.is_in(boxes(rear, time=0)).any()


def test_before_the_first_pose_it_is_taken_to_have_come_with_its_velocity() -> None:
    body = body_at((0, ego(0.0, 0.0, np.pi / 2)))
    assert body.is_in(piece_of_the_front(-300_000_000, 0.0)).all()


@given(
    heading=st.floats(-7.0, 7.0),
    place=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0)),
    off=st.floats(-1.0, 1.0).map(lambda share: share * (MARGIN - 0.01)),
)
def test_every_part_of_it_is_itself(
    heading: float, place: tuple[float, float, float], off: float
) -> None:
    """Points on its border, from anywhere along it to anywhere, with an error of the pose."""
    around = corners(np.zeros(2), np.array(heading), np.array([LENGTH, WIDTH]))
    ring = np.vstack([around, around[:1]])
    ends = 4.0 * np.sort(place[:2])
    asked = np.array([ends[0], *range(int(np.ceil(ends[0])), int(ends[1]) + 1), ends[1]])
    seen = np.stack([np.interp(asked, np.arange(5), ring[:, k]) for k in range(2)], axis=-1)
    turn = 2 * np.pi * place[2]
    seen += off * np.array([np.cos(turn), np.sin(turn)])
    view = boxes((seen.min(axis=0), seen.max(axis=0)))
    assert body_at((0, ego(0.0, 0.0, heading))).is_in(view).all()


@given(
    heading=st.floats(-7.0, 7.0),
    bearing=st.floats(-np.pi, np.pi),
    size=st.tuples(st.floats(0.01, 6.0), st.floats(0.01, 6.0)),
)
def test_what_keeps_a_metre_from_it_is_somebody_else(
    heading: float, bearing: float, size: tuple[float, float]
) -> None:
    """A box beyond a line that is 1 m from the footprint, in any direction."""
    around = corners(np.zeros(2), np.array(heading), np.array([LENGTH, WIDTH]))
    normal = np.array([np.cos(bearing), np.sin(bearing)])
    reach = float((around @ normal).max()) + 1.0
    half = np.array(size) / 2
    center = (reach + float(np.abs(half * normal).sum())) * normal
    somebody = boxes((center - half, center + half))
    assert not body_at((0, ego(0.0, 0.0, heading))).is_in(somebody).any()


@given(x=st.floats(-30, 30), y=st.floats(-30, 30))
def test_what_shares_its_place_is_itself_however_large_it_is(x: float, y: float) -> None:
    """A box of 6 m x 8 m is no view of a car, but a merged one of the ego and its neighbour."""
    body = body_at((0, ego(0.0, 0.0, np.pi / 2)))
    found = bool(body.is_in(boxes(((x - 3.0, y - 4.0), (x + 3.0, y + 4.0))))[0])
    half = np.array([WIDTH, LENGTH]) / 2 - ACCURACY
    near_the_border = min(abs(abs(x) - 3.0 - half[0]), abs(abs(y) - 4.0 - half[1])) < 1e-6
    assert near_the_border or found == (abs(x) < 3.0 + half[0] and abs(y) < 4.0 + half[1])


@pytest.mark.parametrize("heading", [0.0, np.pi / 2, np.pi, -np.pi / 2])
@pytest.mark.parametrize("side", range(4))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_view_beside_it_is_of_it_as_far_as_the_margin(
    heading: float, side: int, sign: float
) -> None:
    """A strip along one side, that touches the footprint at most, and ends at the margin or not."""
    around = corners(np.zeros(2), np.array(heading), np.array([LENGTH, WIDTH]))
    low, high = around.min(axis=0), around.max(axis=0)
    axis, is_upper = divmod(side, 2)

    def strip(end: float) -> Array:
        bottom, top = low.copy(), high.copy()
        if is_upper:
            bottom[axis], top[axis] = high[axis] + 0.1, high[axis] + end
        else:
            bottom[axis], top[axis] = low[axis] - end, low[axis] - 0.1
        return boxes((bottom, top))

    is_within = sign < 0.0
    found = body_at((0, ego(0.0, 0.0, heading))).is_in(strip(MARGIN + sign * 1e-6))
    assert found.tolist() == [is_within]


@pytest.mark.parametrize("turn", [0.25, 0.75, 1.25, 1.75])
@pytest.mark.parametrize(("overlap", "is_it"), [(ACCURACY + 0.05, True), (ACCURACY - 0.05, False)])
def test_a_large_box_is_of_it_if_only_one_corner_is_in_its_place(
    turn: float, *, overlap: float, is_it: bool
) -> None:
    """Beside the middle of each side of a footprint that stands across: the corner's alone."""
    heading = np.pi / 4
    bearing = turn * np.pi
    is_ahead = abs(np.cos(bearing - heading)) > 0.5
    outward = np.array([np.cos(bearing), np.sin(bearing)])
    nearest = ((LENGTH if is_ahead else WIDTH) / 2 - overlap) * outward
    other = nearest + 6.0 * np.sign(outward)
    box = boxes((np.minimum(nearest, other), np.maximum(nearest, other)))
    assert body_at((0, ego(0.0, 0.0, heading))).is_in(box).tolist() == [is_it]


@given(
    turn=st.floats(-np.pi, np.pi),
    place=st.tuples(st.floats(-6.0, 6.0), st.floats(-4.0, 4.0)),
    angle=st.floats(0.0, np.pi / 2),
    size=st.tuples(st.floats(0.1, 5.0), st.floats(0.1, 3.0)),
)
def test_what_is_of_it_does_not_depend_on_the_axes(
    turn: float, place: tuple[float, float], angle: float, size: tuple[float, float]
) -> None:
    """The same box beside the same ego, both turned."""
    view = np.zeros(1, OBJECT)
    view["position"], view["angle"], view["size"] = place, angle, size
    cos, sin = np.cos(turn), np.sin(turn)
    turned = view.copy()
    turned["position"] = view["position"] @ np.array([[cos, sin], [-sin, cos]])
    turned["angle"] += turn
    wide = view.copy()
    wide["size"] += 1e-6  # what lies on a border may fall on either side of it
    before, near = (body_at((0, ego(0.0, 0.0, 0.0))).is_in(each) for each in (view, wide))
    after = body_at((0, ego(0.0, 0.0, turn))).is_in(turned)
    assert bool(after[0]) in {bool(before[0]), bool(near[0])}


@pytest.mark.parametrize("heading", [0.0, 0.3, np.pi / 4, 1.5])
def test_a_nose_beside_it_is_of_somebody_else_on_any_road(heading: float) -> None:
    """Of a car that comes from the side: 2 m of it, 0.3 m from the flank."""
    view = np.zeros(1, OBJECT)
    out = np.array([-np.sin(heading), np.cos(heading)])
    view["position"] = (WIDTH / 2 + 0.3 + 1.0) * out
    view["angle"], view["size"] = heading, (1.8, 2.0)
    assert body_at((0, ego(0.0, 0.0, heading))).is_in(view).tolist() == [False]


def test_of_two_poses_at_one_time_the_last_one_holds() -> None:
    body = body_at((0, ego(0.0, 0.0, 0.0)), (0, ego(50.0, 0.0, 0.0)))
    views = boxes(((-0.5, -0.5), (0.5, 0.5)), ((49.5, -0.5), (50.5, 0.5)))
    assert body.is_in(views).tolist() == [False, True]


@pytest.mark.parametrize(("age", "is_it"), [(2_000_000_000, True), (2_000_000_001, False)])
def test_poses_are_remembered_for_two_seconds(age: int, *, is_it: bool) -> None:
    """From 50 m aside it came in the first step, which a velocity cannot tell."""
    body = body_at((-age, ego(0.0, 50.0, 0.0)), (STEP - age, ego(0.0, 0.0, 0.0, speed=0.0)))
    body.update(ego(0.0, 0.0, 0.0, speed=0.0), 0)
    view = boxes(((-0.5, 49.5), (0.5, 50.5)), time=-age)
    assert body.is_in(view).tolist() == [is_it]


def test_while_it_is_not_there_nothing_is_of_it() -> None:
    view = piece_of_the_front(0, 0.0)
    body = body_at((-STEP, ego(0.0, 0.0, np.pi / 2)), (0, ego(0.0, 0.0, 0.0, vehicle=-1)))
    assert not body.is_in(view).any()
    body.update(ego(0.0, 0.0, np.pi / 2, vehicle=3), STEP)  # another vehicle plays the ego
    assert body.is_in(view).all()
    assert body.is_in(np.empty(0, OBJECT)).shape == (0,)


class Careless(DrivingPolicy):
    """A policy of somebody else's, which returns what it is not asked for."""

    @property
    @override
    def reads(self) -> frozenset[str]:
        return EGO

    @override
    def drive(self, inputs: Inputs, now: Time) -> Command:
        return [0.0, 0.0, 0.0]  # type: ignore[return-value]


def test_a_policy_that_gives_no_command_is_told_so() -> None:
    with pytest.raises(TypeError, match=r"`Careless.drive` returned `list`, not a `Command`"):
        drive(Careless(), np.zeros(0, OBJECT))
