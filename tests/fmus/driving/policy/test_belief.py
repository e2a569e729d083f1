"""An ego that is wrong about its pose: its own error cancels, but for what others tell it."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st
from typing_extensions import override

from fmus.driving.policy import EGO, Command, DrivingPolicy, Inputs
from fmus.driving.policy.connectors import INPUTS, POSE_ERROR, VEHICLES
from fmus.localisation import Offsets, stamped
from fmus.messages.records import OBJECT, frame
from fmus.physics.plane import Frame
from orchestrator.absence import Need
from orchestrator.registry import component_type
from orchestrator.signal import Array, Signal
from orchestrator.timebase import Time
from tests.fmus.boxes import put
from tests.fmus.driving.network.world import turn

STEP = 50_000_000
ALL = EGO | VEHICLES | POSE_ERROR | {"objects", "received.objects"}
PLACE, HEADING = np.array([30.0, -8.0]), 0.5 * math.pi
NOTHING: dict[str, Signal] = {name: one.start_value() for name, one in INPUTS.items()}


def box(
    sensor: int, center: tuple[float, float], velocity: tuple[float, float] = (0.0, 0.0)
) -> Array:
    """An object of 2 m x 2 m; the same box, but for rounding, however the world is turned."""
    found = np.zeros(1, OBJECT)
    found["sensor"], found["instance"] = sensor, 7
    put(found, np.array(center) - 1.0, np.array(center) + 1.0)
    found["velocity"] = velocity
    return found


def world(*seen: Array, told: tuple[Array, ...] = ()) -> dict[str, Signal]:
    """An ego that drives north at 8 m/s."""
    return NOTHING | {
        "ego.id": np.array(3),
        "ego.position": PLACE,
        "ego.heading": np.array(HEADING),
        "ego.speed": np.array(8.0),
        "ego.size": np.array([4.5, 1.8, 1.5]),
        "ego.route": PLACE + np.array([[0.0, 0.0], [0.0, 40.0], [30.0, 60.0]]),
        "objects": frame("OBJS", np.concatenate(seen)) if seen else b"",
        "received.objects": frame("OBJS", np.concatenate(told)) if told else b"",
    }


def wrong(x: float, y: float, heading: float, vehicle: int = 3) -> dict[str, Signal]:
    """By how much two vehicles are wrong; the ego is one of them."""
    return {
        "pose_error.vehicle": np.array([1, vehicle]),
        "pose_error.position": np.array([[50.0, 50.0], [x, y]]),
        "pose_error.heading": np.array([1.0, heading]),
    }


def driven(name: str, values: dict[str, Signal], steps: int = 3, **parameters: object) -> Any:
    policy = component_type(name).create("policy", parameters)
    policy.setup(0, np.random.default_rng(0))
    for k in range(steps):
        policy.step(values, k * STEP, STEP)
    return {name: np.asarray(value).tolist() for name, value in policy.outputs().items()}


def test_everything_is_where_the_ego_believes_it_to_be() -> None:
    """Moved by (2, -1), and turned by a quarter about the ego."""
    car = {
        "vehicle.id": np.array([3, 8]),
        "vehicle.position": np.array([[30.0, -8.0, 0.0], [34.0, 2.0, 0.0]]),
        "vehicle.heading": np.array([HEADING, 0.0]),
        "vehicle.velocity": np.array([[0.0, 8.0], [5.0, 0.0]]),
        "vehicle.size": np.tile([4.5, 1.8, 1.5], (2, 1)),
    }
    seen = box(3, (40.0, 2.0))
    known = Inputs.read(world(seen) | car | wrong(2.0, -1.0, 0.5 * math.pi), ALL)
    there = np.array([32.0, -9.0])
    np.testing.assert_allclose(known.ego.position, there, atol=1e-12)
    assert known.ego.heading == pytest.approx(math.pi)
    route = there + np.array([[0.0, 0.0], [-40.0, 0.0], [-60.0, 30.0]])
    np.testing.assert_allclose(known.ego.route, route, atol=1e-9)
    np.testing.assert_allclose(known.vehicles.center, [[32.0, -9.0], [22.0, -5.0]], atol=1e-9)
    np.testing.assert_allclose(known.vehicles.heading, [math.pi, 0.5 * math.pi])
    np.testing.assert_allclose(known.vehicles.velocity, [[-8.0, 0.0], [0.0, 5.0]], atol=1e-12)
    np.testing.assert_array_equal(known.vehicles.size, [[4.5, 1.8]] * 2)
    np.testing.assert_array_equal(known.seen, seen)  # is there already
    assert (known.ego.speed, known.ego.length, known.ego.width) == (8.0, 4.5, 1.8)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-0.2, 0.2))
def test_distances_and_angles_stay(x: float, y: float, heading: float) -> None:
    known = Inputs.read(world() | wrong(x, y, heading), ALL)
    true = Inputs.read(world(), ALL)
    places = [np.vstack([each.ego.position, each.ego.route]) for each in (true, known)]
    apart = [np.linalg.norm(p[:, None] - p, axis=2) for p in places]
    np.testing.assert_allclose(apart[1], apart[0], atol=1e-9)
    ahead = [
        Frame.at(each.ego.position, each.ego.heading).to(
            Frame.at(each.ego.route[1], 0.0), np.array([9.0]), np.array([0.0])
        )
        for each in (true, known)
    ]
    assert math.hypot(*(float(v[0]) for v in ahead[1])) == pytest.approx(
        math.hypot(*(float(v[0]) for v in ahead[0])), abs=1e-9
    )


@pytest.mark.parametrize(
    "error",
    [wrong(0.0, 0.0, 0.0), wrong(5.0, 5.0, 1.0, vehicle=4), {}],
    ids=["zero", "of another", "none"],
)
def test_who_is_not_wrong_has_the_very_numbers(error: dict[str, Signal]) -> None:
    known = Inputs.read(world() | error, ALL)
    assert known.ego.position.tobytes() == PLACE.tobytes()
    assert known.ego.heading == HEADING
    np.testing.assert_array_equal(known.ego.route, world()["ego.route"])


@pytest.mark.parametrize("name", ["policy-rule-based", "policy-blind"])
@pytest.mark.parametrize("beside", [0.0, 3.1])
def test_what_the_ego_sees_is_where_it_is_whatever_the_ego_believes(
    name: str, beside: float
) -> None:
    """It brakes as hard for what stands in its way, and not at all for what stands beside it."""
    there = (PLACE[0] - beside, PLACE[1] + 14.0)
    true = driven(name, world(box(3, there)))
    error = (1.5, -0.9)
    moved = (there[0] + error[0], there[1] + error[1])
    believed = driven(name, world(box(3, moved)) | wrong(*error, 0.0))
    assert (true["command"][1] > 0.3) is (beside == 0.0)
    np.testing.assert_allclose(believed["command"], true["command"], atol=1e-9)
    assert believed["hazard.instance"] == true["hazard.instance"]
    if beside:  # it is one that compares with where it is that brakes
        astray = driven(name, world(box(3, moved)))
        assert astray["command"][1] > 0.3


def test_what_others_tell_is_off_by_the_error_of_the_ego() -> None:
    """A body that stands 14 m ahead is believed to be 1.2 m nearer: braking is v^2 / 2 d."""
    there = (PLACE[0], PLACE[1] + 14.0)
    brake = []
    for error in (0.0, 1.2):
        outputs = driven("policy-rule-based", world(told=(box(9, there),)) | wrong(0.0, error, 0.0))
        assert outputs["hazard.sensor"] == 9
        brake.append(outputs["command"][1])
    # from its front to the body's rear, less stop_margin; full brake is 8 m/s^2
    room = 14.0 - 1.0 - 2.25 - 2.0
    assert brake[0] == pytest.approx(8.0**2 / (2 * room) / 8.0, rel=1e-9)
    assert brake[1] == pytest.approx(8.0**2 / (2 * (room - 1.2)) / 8.0, rel=1e-9)


@pytest.mark.parametrize("heading", [0.0, 0.3])
def test_a_network_drives_as_if_it_knew(heading: float) -> None:
    """Its own scan comes with the pose that it believes to have, in which it takes it."""
    error = (12.0, -9.0)
    points = turn(1, {3: tuple(PLACE.tolist()), 6: (38.0, 4.0)})
    true = driven("policy-network", world() | {"points": points})
    offsets = Offsets(
        vehicle=np.array([3, 6]),
        position=np.array([error, (0.0, 0.0)]),
        heading=np.array([heading, 0.0]),
    )
    moved = stamped(points, offsets)
    believed = driven("policy-network", world() | {"points": moved} | wrong(*error, heading))
    assert moved != points
    np.testing.assert_allclose(believed["command"], true["command"], atol=1e-3)
    astray = driven("policy-network", world() | {"points": moved})
    assert np.abs(np.subtract(astray["command"], true["command"])).max() > 0.01


def test_the_expert_knows_where_it_is() -> None:
    """It reads the truth alone."""
    expert = component_type("policy-expert").create("policy", {})
    assert not POSE_ERROR & expert.connectors["command"].feedthrough
    undriven = expert.connectors["pose_error.position"].undriven
    assert undriven is not None
    assert undriven.need is Need.NEVER


class _Own(DrivingPolicy):
    """One of a user's own, that says no word of errors."""

    def __init__(self) -> None:
        self.known: list[Inputs] = []

    @property
    @override
    def reads(self) -> frozenset[str]:
        return EGO | {"received.objects"}

    @override
    def drive(self, inputs: Inputs, now: Time) -> Command:
        self.known.append(inputs)
        return Command()


def test_a_policy_of_ones_own_need_not_know_of_it() -> None:
    policy = _Own()
    policy.setup(0, np.random.default_rng(0))
    policy.step(world() | wrong(2.0, 0.5, 0.0), 0, STEP)
    np.testing.assert_allclose(policy.known[0].ego.position, [32.0, -7.5])
    assert policy.connectors["command"].feedthrough >= POSE_ERROR
    undriven = policy.connectors["pose_error.position"].undriven
    assert undriven is not None
    assert undriven.need is Need.IF_OFFERED
