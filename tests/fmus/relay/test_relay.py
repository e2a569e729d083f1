"""MoHeD against hand-computed geometry; it must know only what the ego can know."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.apm import encode, join
from fmus.messages.records import APM_LAYER_CELL, NO_VEHICLE, OBJECT, frame, unframe
from fmus.relay import Direct, Mohed
from fmus.relay.crossings import Walls
from fmus.relay.nodes import Node
from fmus.relay.obstacles import Obstacles
from fmus.relay.risk import RiskModel
from orchestrator.testing import check_component
from tests.fmus.boxes import put
from tests.fmus.messages.apm.apms import apm_of
from tests.fmus.relay.world import (
    LEFT,
    NEIGHBOURS,
    RIGHT,
    SHARER,
    STEP,
    Inputs,
    chosen,
    inputs,
    started,
    truck,
)

NO_WALLS = Walls(np.empty((0, 2)), np.empty(0, np.int32))


def neighbours(**changes: tuple[float, float, float]) -> dict[int, tuple[float, float, float]]:
    """The neighbours of the world, some of them changed: `v2=(x, y, height)`."""
    return {**NEIGHBOURS, **{int(k[1:]): v for k, v in changes.items()}}


def test_a_free_direct_link_is_kept() -> None:
    assert chosen(started(Mohed(Mohed.Parameters())), inputs(neighbours())) == NO_VEHICLE


def test_a_truck_on_the_direct_link_calls_for_the_relay_with_the_shorter_hops() -> None:
    assert chosen(started(Mohed(Mohed.Parameters())), inputs(neighbours(), truck(0, 30))) == LEFT


def test_a_truck_on_one_hop_of_a_relay_calls_for_the_other() -> None:
    trucks = np.concatenate([truck(0, 30), truck(-10, 15)])
    assert chosen(started(Mohed(Mohed.Parameters())), inputs(neighbours(), trucks)) == RIGHT


def test_an_obstacle_below_the_line_of_sight_costs_nothing() -> None:
    values = inputs(neighbours(), truck(0, 30, height=1.0))
    assert chosen(started(Mohed(Mohed.Parameters())), values) == NO_VEHICLE


def test_objects_of_other_sensors_are_not_known_to_the_ego() -> None:
    foreign = truck(0, 30)
    foreign["sensor"] = SHARER
    assert chosen(started(Mohed(Mohed.Parameters())), inputs(neighbours(), foreign)) == NO_VEHICLE


def test_without_messages_it_degrades_to_the_direct_link() -> None:
    """Starved of BSMs there is no relay to choose, whatever stands in the way."""
    values = inputs({}, truck(0, 30))
    assert chosen(started(Mohed(Mohed.Parameters())), values) == NO_VEHICLE


def test_a_building_on_a_hop_is_a_risk() -> None:
    values = inputs(neighbours(), truck(0, 30))
    corners = np.array([[-14.0, 10.0], [-6.0, 10.0], [-6.0, 20.0], [-14.0, 20.0]])
    values |= {"building.vertex": corners, "building.index": np.zeros(4, np.int32)}
    assert chosen(started(Mohed(Mohed.Parameters())), values) == RIGHT


def test_walls_are_those_of_the_map_of_now() -> None:
    """A map that changes is read again; the choice follows at the next window."""
    policy = started(Mohed(Mohed.Parameters()))
    at_left = np.array([[-14.0, 10.0], [-6.0, 10.0], [-6.0, 20.0], [-14.0, 20.0]])
    window = 100 * STEP  # longer than a choice is held
    choices = []
    for k, corners in enumerate([at_left[:0], at_left, at_left * (-1.0, 1.0), at_left[:0]]):
        values = inputs(neighbours(v4=(20.0, 30.0, 1.5)), truck(0, 30))
        index = np.zeros(len(corners), np.int32)
        values |= {"building.vertex": corners, "building.index": index}
        choices.append(chosen(policy, values, t=k * window))
    assert choices[1:3] == [RIGHT, LEFT]
    assert choices[0] == choices[3] or choices[3] == LEFT


def test_a_received_layer_reveals_an_obstacle_that_the_ego_does_not_see() -> None:
    layer = np.zeros((20, 20), APM_LAYER_CELL)
    apm = apm_of(vehicle=SHARER, position=(0.0, 60.0), center=(0.0, 30.0), layer=layer)
    row, column = apm.locate(np.array([0.1, 30.1]))
    layer["height"][row, column] = 80  # 4 m
    values = inputs(neighbours())
    blocked = neighbours(v2=(4.0, 60.0, 1.8))
    values = inputs(blocked)
    values["received.apms"] = join([encode(apm)])
    assert chosen(started(Mohed(Mohed.Parameters())), values) != NO_VEHICLE


def risky(first_hop: str) -> int:
    """The choice where the sharer stands beside LEFT's obstacle, and all other things move."""
    values = inputs(neighbours(), np.concatenate([truck(0, 30), truck(-10, 45), truck(12, 15)]))
    objects = unframe("OBJS", bytes(values["objects"]), OBJECT).copy()
    objects["velocity"][1:] = [(0.0, 7.5), (0.0, 4.0)]
    values["objects"] = frame("OBJS", objects)
    return chosen(started(Mohed(Mohed.Parameters(first_hop=first_hop))), values)  # type: ignore[arg-type]


def test_the_velocity_beside_the_candidates_on_the_first_hop_is_a_choice() -> None:
    """A truck that moves as the ego does weighs most in S if the ego stands in it.

    LEFT's hop from the sharer is crossed at 7.5 m/s (ego: 8, sharer: 0), RIGHT's to the ego
    at 4 m/s.
    """
    assert risky("ends") == LEFT
    assert risky("ego") == RIGHT


def test_the_direct_link_can_be_left_out() -> None:
    free = inputs(neighbours())
    only_relays = Mohed.Parameters(direct_link=False)
    assert chosen(started(Mohed(only_relays)), free) == LEFT
    assert chosen(started(Mohed(only_relays)), inputs({SHARER: (0.0, 60.0, 1.8)})) == NO_VEHICLE


@pytest.mark.parametrize(("keep", "then"), [(True, RIGHT), (False, LEFT)])
def test_the_current_choice_wins_a_tie_if_it_shall(
    keep: bool,  # noqa: FBT001
    then: int,
) -> None:
    mohed = started(Mohed(Mohed.Parameters(keep_ties=keep)))
    trucks = np.concatenate([truck(0, 30), truck(-10, 15)])
    assert chosen(mohed, inputs(neighbours(), trucks)) == RIGHT
    assert chosen(mohed, inputs(neighbours(), truck(0, 30)), t=20 * STEP) == then


def test_the_body_of_a_silent_sharer_does_not_obstruct_its_own_links() -> None:
    """The ego's lidar still sees it; its last BSM said what it is."""
    mohed = started(Mohed(Mohed.Parameters()))
    assert chosen(mohed, inputs(neighbours())) == NO_VEHICLE
    silent = {v: p for v, p in neighbours().items() if v != SHARER}
    itself = truck(0, 59.5, height=1.8)
    put(itself, (-0.9, 57.8), (0.9, 62.2))
    assert chosen(mohed, inputs(silent, itself), t=20 * STEP) == NO_VEHICLE
    risk = float(np.asarray(mohed.outputs()["risk.direct"]))
    assert risk == 0.0


def test_the_choice_holds_for_the_window_and_then_follows_the_scene() -> None:
    mohed = started(Mohed(Mohed.Parameters()))
    assert chosen(mohed, inputs(neighbours(), truck(0, 30))) == LEFT
    moved = inputs(neighbours(), np.concatenate([truck(0, 30), truck(-10, 15)]))
    assert chosen(mohed, moved, t=STEP) == LEFT
    assert chosen(mohed, moved, t=20 * STEP) == RIGHT
    assert int(np.asarray(mohed.outputs()["switches"])) == 1


def test_a_sharer_that_is_shadowed_is_placed_by_its_apms() -> None:
    mohed = started(Mohed(Mohed.Parameters()))
    assert chosen(mohed, inputs(neighbours(), truck(0, 30))) == LEFT
    silent = {v: p for v, p in neighbours().items() if v != SHARER}
    values = inputs(silent, np.concatenate([truck(0, 30), truck(-10, 15)]))
    apm = apm_of(vehicle=SHARER, time=2_000_000_000, position=(0.0, 60.0), center=(0.0, 60.0))
    values["received.apms"] = join([encode(apm)])
    assert chosen(mohed, values, t=20 * STEP) == RIGHT


def test_a_relay_that_leaves_is_replaced_at_once() -> None:
    mohed = started(Mohed(Mohed.Parameters()))
    assert chosen(mohed, inputs(neighbours(), truck(0, 30))) == LEFT
    without = {v: p for v, p in neighbours().items() if v != LEFT}
    assert chosen(mohed, inputs(without, truck(0, 30)), t=STEP) == RIGHT


def test_risk_of_a_single_obstacle_is_the_papers_equation() -> None:
    """L_v-shadow * S with a truck of 4 m midway on 60 m, antennas at 1.5 m, |dv| = 8 and 4."""
    wavelength = 0.05
    model = RiskModel(wavelength=wavelength, minimum_speed_difference=0.5, wall_loss=9.6, itu=False)
    node = Node(vehicle=2, position=np.zeros(2), velocity=np.array([0, 8.0]), antenna_height=1.5)
    other = Node(
        vehicle=1, position=np.array([60.0, 0]), velocity=np.array([0, 4.0]), antenna_height=1.5
    )
    obstacle = Obstacles(
        owner=np.array([NO_VEHICLE]),
        center=np.array([[30.0, 0.0]]),
        heading=np.zeros(1),
        half=np.array([[2.0, 1.0]]),
        height=np.array([4.0]),
        velocity=np.zeros((1, 2)),
    )
    nu = 2.5 * np.sqrt(1 / wavelength * (1 / 30 + 1 / 30))
    loss = 6.9 + 20 * np.log10(np.sqrt((nu - 0.1) ** 2 + 1) + nu - 0.1)
    (risk,) = model.of_hops([(node, other)], [other], obstacle, NO_WALLS)
    assert risk == pytest.approx(loss * (1 / 8 + 1 / 4), rel=1e-12)


def test_equal_velocities_are_bounded() -> None:
    model = RiskModel(wavelength=0.05, minimum_speed_difference=0.5, wall_loss=9.6, itu=True)
    still = Node(vehicle=1, position=np.zeros(2), velocity=np.zeros(2), antenna_height=1.5)
    far = Node(vehicle=2, position=np.array([9.0, 0]), velocity=np.zeros(2), antenna_height=1.5)
    walls = Walls(np.array([[4.0, -1.0], [4.0, 1.0], [-3.0, 5.0]]), np.zeros(3, np.int32))
    (risk,) = model.of_hops([(still, far)], [far], Obstacles(), walls)
    assert risk == pytest.approx(2 * 9.6 * 4.0)


@given(
    angle=st.floats(0, 2 * np.pi),
    shift=st.tuples(st.floats(-500, 500), st.floats(-500, 500)),
    height=st.floats(1.6, 4.0),
)
def test_risk_does_not_depend_on_the_frame(
    angle: float, shift: tuple[float, float], height: float
) -> None:
    model = RiskModel(wavelength=0.05, minimum_speed_difference=0.5, wall_loss=9.6, itu=True)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def risk(frame_turn: Any, offset: Any, heading: float) -> float:
        def node(vehicle: int, x: float, y: float) -> Node:
            place = frame_turn @ np.array([x, y]) + offset
            speed = frame_turn @ np.array([3.0, vehicle])
            return Node(vehicle=vehicle, position=place, velocity=speed, antenna_height=1.5)

        obstacle = Obstacles(
            owner=np.array([NO_VEHICLE]),
            center=(frame_turn @ np.array([20.0, 0.5]) + offset)[None],
            heading=np.array([heading]),
            half=np.array([[3.0, 1.2]]),
            height=np.array([height]),
            velocity=(frame_turn @ np.array([1.0, 0.0]))[None],
        )
        corners = np.array([[35.0, -2.0], [36.0, -2.0], [36.0, 2.0], [35.0, 2.0]])
        walls = Walls(corners @ frame_turn.T + offset, np.zeros(4, np.int32))
        first, second = node(2, 0.0, 0.0), node(1, 50.0, 1.0)
        return float(model.of_hops([(first, second)], [second], obstacle, walls)[0])

    plain = risk(np.eye(2), np.zeros(2), 0.0)
    assert risk(turn, np.array(shift), angle) == pytest.approx(plain, rel=1e-6)


def moving(truck_at: float, speed: float) -> Inputs:
    """A truck beside the direct link that drives across it, and one that stands on LEFT's hops."""
    values = inputs(neighbours(), np.concatenate([truck(truck_at, 30), truck(-10, 45)]))
    objects = unframe("OBJS", bytes(values["objects"]), OBJECT).copy()
    objects["velocity"][0] = (speed, 0.0)
    return values | {"objects": frame("OBJS", objects)}


def test_a_truck_that_will_drive_into_the_line_counts_if_trajectories_do() -> None:
    """It stands 12 m beside the direct link and crosses it after 1.2 to 1.45 s of the window."""
    values = moving(-12.0, 10.0)
    blind, ahead = Mohed(Mohed.Parameters()), Mohed(Mohed.Parameters(trajectories=True))
    assert chosen(started(blind), values) == NO_VEHICLE
    assert chosen(started(ahead), values) == RIGHT
    away = moving(-12.0, -10.0)
    assert chosen(started(Mohed(Mohed.Parameters(trajectories=True))), away) == NO_VEHICLE


def test_a_truck_that_leaves_the_line_counts_for_as_long_as_it_stands_there() -> None:
    """The ego stands; a truck of 2.5 m width leaves at 1.25 m/s: half of 2 s on the line."""
    values = moving(0.0, 1.25) | {"ego.speed": np.array(0.0)}
    found = []
    for trajectories in (False, True):
        mohed = started(Mohed(Mohed.Parameters(trajectories=trajectories, sample=0.05)))
        chosen(mohed, values)
        found.append(float(np.asarray(mohed.outputs()["risk.direct"])))
    assert found[0] > 0.0
    assert found[1] == pytest.approx(found[0] / 2.0, rel=1e-9)


def test_trajectories_of_who_stands_give_the_risk_of_now() -> None:
    values = inputs(neighbours(), np.concatenate([truck(0, 30), truck(-10, 15), truck(12, 15)]))
    values = values | {"ego.speed": np.array(0.0)}
    risks = []
    for trajectories in (False, True):
        mohed = started(Mohed(Mohed.Parameters(trajectories=trajectories)))
        chosen(mohed, values)
        told = mohed.outputs()
        risks.append([float(np.asarray(told[f"risk.{which}"])) for which in ("direct", "chosen")])
    assert risks[1] == pytest.approx(risks[0], rel=1e-12)
    assert risks[0][0] > 0.0


def test_the_ego_is_predicted_on_its_route() -> None:
    """It turns right after 4 m, away from the truck that stands 20 m ahead beside the line."""
    tall = truck(0, 30)
    straight = inputs(neighbours(), tall)
    corners = np.array([[0.0, 0.0], [0.0, 4.0], [60.0, 4.0]])
    risks = []
    for values in (straight, straight | {"ego.route": corners}):
        mohed = started(Mohed(Mohed.Parameters(trajectories=True)))
        chosen(mohed, values)
        risks.append(float(np.asarray(mohed.outputs()["risk.direct"])))
    assert 0.0 < risks[1] < 0.5 * risks[0]


def test_contract() -> None:
    check_component(Mohed(Mohed.Parameters()), steps=5, h=STEP, seed=1)
    check_component(Mohed(Mohed.Parameters(trajectories=True)), steps=5, h=STEP, seed=1)
    check_component(Direct(), steps=5, h=STEP, seed=1)
