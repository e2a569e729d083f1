"""Dead times: commands act later, by exactly that much, and otherwise as before."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import given, strategies as st

from adapters.sumo import SumoTraffic
from adapters.sumo.actuation import Actuation, TransportDelay
from adapters.sumo.ego import (
    RELEASED,
    Command,
    EgoDynamics,
    EgoState,
    advance,
    stopping_distance,
)
from adapters.sumo.parameters import TrafficParameters
from orchestrator.errors import CosimError
from orchestrator.randomness import stream
from tests.adapters.red_light import ALONE, STEP, ego_speed, entity, red_light

SPARSE = {"spacing": 60.0}
PARAMETERS = red_light(background=SPARSE, entities=ALONE)
DYNAMICS = entity(PARAMETERS, "ego").dynamics.single_track
MILLISECOND = 1_000_000
PARTS = 5
BRAKE = Command(accelerate=0.0, brake=1.0, steer=0.0)

delays = st.integers(0, 700 * MILLISECOND)
commands = st.builds(
    Command,
    accelerate=st.floats(0.0, 1.0),
    brake=st.sampled_from([0.0, 0.0, 0.4, 1.0]),
    steer=st.floats(-1.0, 1.0),
)


def at_speed(speed: float) -> EgoState:
    return EgoState(x=0.0, y=0.0, heading=math.pi / 2, speed=speed)


def driven(
    actuation: Actuation,
    asked: Sequence[Command],
    state: EgoState,
    dynamics: EgoDynamics = DYNAMICS,
) -> list[EgoState]:
    """The states every 10 ms while `asked` is commanded, one of them per 50 ms."""
    states = []
    for k, command in enumerate(asked):
        actuation.give(k * STEP, command)
        for pieces in actuation.pieces(k * STEP, STEP, PARTS):
            for piece in pieces:
                state = advance(state, piece.command, dynamics, piece.duration)
            states.append(state)
    return states


@given(delays, st.floats(1.0, 20.0))
def test_braking_takes_the_way_of_the_dead_time_longer(delay: int, speed: float) -> None:
    """Also for dead times that no grid divides: s = v d + the way without a dead time."""
    *_, end = driven(Actuation(delay, 0), [BRAKE] * 90, at_speed(speed))
    assert end.speed == 0.0
    expected = speed * delay / 1e9 + stopping_distance(speed, DYNAMICS)
    assert end.y == pytest.approx(expected, abs=1e-8)


@given(st.lists(commands, min_size=1, max_size=8), st.floats(0.0, 20.0))
def test_without_a_dead_time_every_state_is_the_same_bits_as_without_a_delay_line(
    asked: list[Command], speed: float
) -> None:
    state, expected = at_speed(speed), []
    for command in asked:
        for _ in range(PARTS):
            state = advance(state, command, DYNAMICS, 0.05 / PARTS)
            expected.append(state)
    assert driven(Actuation(0, 0), asked, at_speed(speed)) == expected


@given(st.lists(commands, min_size=1, max_size=8), st.integers(0, 30))
def test_one_dead_time_for_all_shifts_the_whole_motion(asked: list[Command], shift: int) -> None:
    """By `shift` times 10 ms: until then nothing is commanded."""
    delay = shift * 10 * MILLISECOND
    prompt = driven(Actuation(0, 0), asked, at_speed(0.0))
    late = driven(Actuation(delay, delay), [*asked, *[RELEASED] * 6], at_speed(0.0))
    rest = [at_speed(0.0)] * shift
    for one, other in zip([*rest, *prompt], late, strict=False):
        assert other.y == pytest.approx(one.y, abs=1e-9)
        assert other.x == pytest.approx(one.x, abs=1e-9)
        assert other.steering == pytest.approx(one.steering, abs=1e-9)


@given(st.lists(st.tuples(st.integers(0, 60), st.integers(0, 9)), max_size=20), delays)
def test_what_acts_is_the_newest_of_what_is_old_enough(
    given_: list[tuple[int, int]], delay: int
) -> None:
    line, times = TransportDelay(delay, -1), sorted(t * MILLISECOND for t, _ in given_)
    values = [value for _, value in given_]
    for t, value in zip(times, values, strict=True):
        line.give(t, value)
    for now in range(0, 900 * MILLISECOND, 7 * MILLISECOND):
        old = [value for t, value in zip(times, values, strict=True) if t + delay <= now]
        assert line.at(now) == (old[-1] if old else -1)


@given(delays, delays, st.lists(commands, min_size=2, max_size=12))
def test_the_pieces_cover_every_part_and_only_take_effect_when_due(
    pedals: int, steering: int, asked: list[Command]
) -> None:
    actuation = Actuation(pedals, steering)

    def newest(t: float, delay: int, of: Callable[[Command], object], at_first: object) -> object:
        acting = [of(c) for k, c in enumerate(asked) if k * STEP + delay <= t + 1.0]
        return acting[-1] if acting else at_first

    for k, command in enumerate(asked):
        actuation.give(k * STEP, command)
        t = float(k * STEP)
        for part in actuation.pieces(k * STEP, STEP, PARTS):
            assert sum(piece.duration for piece in part) == pytest.approx(0.01, abs=1e-15)
            for piece in part:
                assert piece.command.steer == newest(t, steering, lambda c: c.steer, 0.0)
                assert (piece.command.accelerate, piece.command.brake) == newest(
                    t, pedals, lambda c: (c.accelerate, c.brake), (0.0, 0.0)
                )
                t += piece.duration * 1e9


def with_pedals(delay: float) -> TrafficParameters:
    """The ego vehicle alone; its pedals have a dead time of `delay` [s]."""
    slow = {"ego": {"dynamics": {"pedal_delay": delay}}, **ALONE}
    return red_light(background=SPARSE, entities=slow)


def stopped_at(pedal_delay: float) -> float:
    """Where the ego of the component stands that is asked to brake from the first step on."""
    traffic = SumoTraffic(with_pedals(pedal_delay))
    traffic.setup(0, stream(1, "traffic"))
    try:
        for k in range(60):
            traffic.step({"ego.command": np.array([0.0, 1.0, 0.0])}, k * STEP, STEP)
        outputs = traffic.outputs()
    finally:
        traffic.close()
    assert outputs["ego.speed"] == 0.0
    return float(np.asarray(outputs["ego.position"])[1])


def test_the_component_brakes_later_by_its_dead_time() -> None:
    prompt = stopped_at(0.0)
    for delay in (0.25, 0.1234567):
        way = ego_speed(PARAMETERS) * delay
        assert stopped_at(delay) - prompt == pytest.approx(way, abs=1e-8)


def test_steering_and_pedals_have_dead_times_of_their_own() -> None:
    both = Command(accelerate=1.0, brake=0.0, steer=1.0)
    states = driven(Actuation(120 * MILLISECOND, 40 * MILLISECOND), [both] * 4, at_speed(5.0))
    assert [state.steering > 0.0 for state in states] == [k >= 4 for k in range(20)]
    assert [state.speed > 5.0 for state in states] == [k >= 12 for k in range(20)]


def test_the_component_refuses_what_is_no_command_whenever_it_would_act() -> None:
    traffic = SumoTraffic(with_pedals(1.0))
    traffic.setup(0, stream(1, "traffic"))
    try:
        with pytest.raises((ValueError, CosimError), match="must be finite"):
            traffic.step({"ego.command": np.array([0.0, math.nan, 0.0])}, 0, STEP)
    finally:
        traffic.close()
