"""Expected PRR: laws of the expectation, and what the policy makes of it."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from fmus.messages.records import NO_VEHICLE, OBJECT, frame, unframe
from fmus.relay import ExpectedPrr, Situation
from fmus.relay.expectation import Expectation
from fmus.relay.inputs import Inputs as Known
from fmus.relay.nodes import Node
from fmus.relay.prediction import Horizon
from fmus.relay.surroundings import Surroundings
from tests.fmus.relay.world import (
    EGO,
    LEFT,
    NEIGHBOURS,
    RIGHT,
    SHARER,
    STEP,
    Inputs,
    chosen,
    inputs,
    radio,
    started,
    truck,
    with_powers,
)

WINDOW = 20 * STEP
NOTHING_ELSE = {"contention": 0.0, "bsm_overlap": 0.0, "apm_overlap": 0.0}
BARE = {**NOTHING_ELSE, "hidden": 0.0, "uncertainty": 1.0}
"""Parameters under which noise and known bodies are all that costs packets."""
Prr = dict[int, float]


def expected(values: Inputs, **parameters: Any) -> Prr:
    """Expected PRR of each choice, while the ego stands at the origin."""
    policy = ExpectedPrr(ExpectedPrr.Parameters(**parameters))
    started(policy)
    known = Known.read(values)
    policy.remember(known, 0)
    return policy.expected(of_sharer(known))


def of_sharer(known: Known) -> Situation:
    """The sharer is to be connected; all others that were heard are candidates."""
    heard = known.bsms.heard_within(1.0)
    candidates = {v: node for v, node in heard.items() if v not in {SHARER, EGO}}
    return Situation(
        ego=known.ego, sharer=heard[SHARER], candidates=candidates, current=None, known=known
    )


def at_rest(table: Any, objects: Any = None) -> Inputs:
    return inputs(table, objects) | {"ego.speed": np.array(0.0)}


def test_with_free_lines_every_packet_arrives() -> None:
    for prr in expected(at_rest(NEIGHBOURS), **NOTHING_ELSE).values():
        assert prr == pytest.approx(1.0, abs=1e-9)


def test_two_hops_are_a_product() -> None:
    """Far apart, in free space: the product of two links that are asked for one by one."""
    x = 2900.0
    table = {SHARER: (2 * x, 0.0, 1.5), LEFT: (x, 0.0, 1.5)}
    relayed = expected(at_rest(table), **BARE)[LEFT]
    one = expected(at_rest({SHARER: (x, 0.0, 1.5)}), **BARE)[NO_VEHICLE]
    assert 0.05 < one < 0.95
    assert relayed == pytest.approx(one * one, rel=1e-9)


@given(st.floats(1.5, 4.0), st.floats(0.01, 1.0))
def test_a_higher_obstacle_never_helps(height: float, more: float) -> None:
    lower, higher = (
        expected(at_rest({SHARER: (0.0, 1200.0, 1.5)}, truck(0, 30, h)), **BARE)[NO_VEHICLE]
        for h in (height, height + more)
    )
    assert higher <= lower + 1e-12


@given(st.floats(100.0, 4000.0), st.floats(1.0, 500.0))
def test_a_longer_link_never_helps(length: float, more: float) -> None:
    near, far = (
        expected(at_rest({SHARER: (0.0, d, 1.5)}), **BARE)[NO_VEHICLE]
        for d in (length, length + more)
    )
    assert far <= near + 1e-12


def test_a_body_that_will_drive_into_the_link_counts_from_then_on() -> None:
    """A wall of a truck, 10 m to the side, at 10 m/s: half of the window is left."""
    table = {SHARER: (0.0, 1500.0, 1.5)}
    values = at_rest(table, truck(-11.25, 8, height=4.0))
    objects = unframe("OBJS", bytes(values["objects"]), OBJECT).copy()
    objects["position"][0, 0], objects["size"][0, 0] = -25.0, 30.0
    free = expected(values | {"objects": frame("OBJS", objects)}, **BARE)[NO_VEHICLE]
    objects["velocity"] = (10.0, 0.0)
    crossed = expected(values | {"objects": frame("OBJS", objects)}, **BARE)[NO_VEHICLE]
    objects["position"][0, 0] = 0.0
    objects["velocity"] = 0.0
    blocked = expected(values | {"objects": frame("OBJS", objects)}, **BARE)[NO_VEHICLE]
    assert blocked < 0.05
    assert crossed == pytest.approx((free + blocked) / 2.0, abs=1e-6)


def test_the_ego_is_moved_on_along_its_route() -> None:
    """At 10 m/s it turns the corner after 5 m: at the end of 2 s it is 15 m to the east."""
    node = Node(vehicle=1, position=np.zeros(2), velocity=np.array([0.0, 10.0]), antenna_height=1.5)
    route = np.array([[0.0, 0.0], [0.0, 5.0], [12.0, 5.0]])
    places = Horizon(time=np.array([0.0, 0.25, 0.5, 1.0, 2.0])).along(node, route)
    expected_places = [(0, 0), (0, 2.5), (0, 5), (5, 5), (15, 5)]
    np.testing.assert_allclose(places, expected_places, atol=1e-12)
    straight = Horizon(time=np.array([2.0])).along(node, np.empty((0, 2)))
    np.testing.assert_allclose(straight, [(0, 20)])


SCENES = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def scene(rng: np.random.Generator) -> tuple[Any, Any]:
    """Vehicles and their velocities around the ego, among them the sharer."""
    table = {
        int(v): (*rng.uniform(-150, 150, 2), float(rng.uniform(1.4, 4.0))) for v in range(2, 22)
    }
    return table, rng.uniform(-15, 15, (20, 2))


def moved(table: Any, velocity: Any, turn: float, shift: Any) -> Inputs:
    """The scene in another frame of reference."""
    axes = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    values = inputs(table)
    corners = np.array([[40.0, 20.0], [70.0, 25.0], [60.0, 90.0], [35.0, 80.0]])
    values["received.bsm.position"] = np.asarray(values["received.bsm.position"]) @ axes.T + shift
    values["received.bsm.heading"] = np.asarray(values["received.bsm.heading"]) + turn
    values["received.bsm.velocity"] = velocity @ axes.T
    values["ego.position"] = np.asarray(shift)
    values["ego.heading"] = np.array(np.pi / 2 + turn)
    values["ego.route"] = np.array([[0.0, 0.0], [0.0, 6.0], [30.0, 6.0]]) @ axes.T + shift
    values["building.vertex"] = corners @ axes.T + shift
    values["building.index"] = np.zeros(4, np.int32)
    return values


@given(SCENES, st.floats(0.0, 6.28), st.tuples(st.floats(-900, 900), st.floats(-900, 900)))
@settings(max_examples=25, deadline=None)
def test_it_does_not_depend_on_the_frame(
    rng: np.random.Generator, turn: float, shift: tuple[float, float]
) -> None:
    table, velocity = scene(rng)
    plain = expected(moved(table, velocity, 0.0, (0.0, 0.0)))
    other = expected(moved(table, velocity, turn, shift))
    assert other == pytest.approx(plain, abs=1e-6)


@given(SCENES)
@settings(max_examples=25, deadline=None)
def test_a_link_is_the_same_in_both_directions(rng: np.random.Generator) -> None:
    """Power is reciprocal, so the direct link is worth as much from the other end."""
    table, _ = scene(rng)
    x, y, _ = table[SHARER]
    values = at_rest({**table, SHARER: (x, y, 1.5)})
    swapped = at_rest({**table, SHARER: (0.0, 0.0, 1.5)}) | {"ego.position": np.array([x, y])}
    there, back = (expected(v, **BARE)[NO_VEHICLE] for v in (values, swapped))
    assert back == pytest.approx(there, abs=1e-9)


def test_what_was_measured_says_of_bodies_that_nobody_saw() -> None:
    """The candidate reports the sharer 40 dB weaker than free space would have it."""
    free = with_powers(at_rest(NEIGHBOURS), {LEFT: (-54.0, -54.0), RIGHT: (-56.0, -56.0)})
    weak = with_powers(at_rest(NEIGHBOURS), {LEFT: (-94.0, -54.0), RIGHT: (-56.0, -56.0)})
    assert expected(free, **NOTHING_ELSE)[LEFT] > 0.99
    assert expected(weak, **NOTHING_ELSE)[LEFT] < 0.6
    assert expected(weak, **NOTHING_ELSE)[RIGHT] > 0.99


def test_who_does_not_report_the_sharer_has_not_heard_it() -> None:
    told = with_powers(at_rest(NEIGHBOURS), {RIGHT: (-56.0, -56.0)})
    assert expected(told, **NOTHING_ELSE)[LEFT] < 0.6
    assert expected(at_rest(NEIGHBOURS), **NOTHING_ELSE)[LEFT] > 0.99


def test_neighbours_that_do_not_hear_the_sharer_spoil_its_packets() -> None:
    """Twenty of them around a candidate, which hears the sharer weaker than most of them."""
    angle = np.linspace(2.0, 4.2, 20)
    places = zip(-20 + 14 * np.cos(angle), 30 + 14 * np.sin(angle), strict=True)
    crowd = {20 + k: (float(x), float(y), 1.5) for k, (x, y) in enumerate(places)}
    table = {**NEIGHBOURS, **crowd}
    hears = with_powers(inputs(table), {LEFT: (-54.0, -54.0), RIGHT: (-56.0, -56.0)})
    prr = expected(hears, apm_overlap=0.0, contention=0.0, bsm_overlap=0.02)
    assert prr[LEFT] < prr[RIGHT] < 1.0
    assert np.exp(-0.02 * 21) <= prr[LEFT] < np.exp(-0.02 * 15)  # 21: RIGHT is one more


def test_the_current_choice_is_kept_unless_the_gain_is_worth_it() -> None:
    trucks = truck(0, 30)
    both = with_powers(inputs(NEIGHBOURS, trucks), {LEFT: (-54.0, -54.0), RIGHT: (-56.0, -56.0)})
    component = started(ExpectedPrr(ExpectedPrr.Parameters(gain=0.03)))
    only_right = with_powers(
        inputs({v: p for v, p in NEIGHBOURS.items() if v != LEFT}, trucks), {RIGHT: (-56.0, -56.0)}
    )
    assert chosen(component, only_right) == RIGHT
    assert chosen(component, both, t=WINDOW) == RIGHT
    blocked = with_powers(both, {LEFT: (-54.0, -54.0), RIGHT: (-94.0, -56.0)})
    assert chosen(component, blocked, t=2 * WINDOW) == LEFT


def test_a_relay_near_the_sharer_captures_it_from_the_ego() -> None:
    """The ego's own APM drowns the sharer at relays to which both are as near."""
    table = {SHARER: (0.0, 60.0, 1.8), LEFT: (-8.0, 55.0, 1.5), RIGHT: (25.0, 30.0, 1.5)}
    queue = np.concatenate([truck(0, 20), truck(0, 31), truck(0, 42)])
    prr = expected(at_rest(table, queue), apm_overlap=0.4)
    assert prr[LEFT] > prr[RIGHT] + 0.1


@pytest.mark.parametrize("m", [0.75, 1.5])
def test_fading_costs_packets_at_the_edge(m: float) -> None:
    """At 15 dB over the noise, of which 9 dB are margin: P(gain < -9 dB), roughly."""
    table = {SHARER: (0.0, 1720.0, 1.5)}
    plain = expected(at_rest(table), **BARE)[NO_VEHICLE]
    fading = expected(at_rest(table), **BARE, fading_m=m)[NO_VEHICLE]
    draws = np.random.default_rng(0).gamma(m, 1.0 / m, 200_000)
    power = radio(0.0).free_space(np.array(1720.0)) - radio(0.0).noise_floor
    drawn = radio(0.0).success(power + 10 * np.log10(draws)).mean()
    assert plain > 0.999
    assert fading == pytest.approx(drawn, abs=0.01)


@given(st.floats(-110, -30), st.floats(-130, -30), st.floats(0.1, 30))
def test_a_stronger_frame_is_spoilt_less(signal: float, other: float, more: float) -> None:
    one = radio(4.0)
    weak, strong = (
        float(one.overlapped(np.array(p), np.array(other), 0.5)) for p in (signal, signal + more)
    )
    assert 0.0 <= weak <= 1.0
    if signal > -85:  # below, what noise spoils anyway does not count
        assert strong <= weak + 1e-9


@given(st.floats(-130, -30), st.floats(0.0, 30))
def test_a_radio_keeps_silent_for_strong_frames_and_sometimes_misses_weaker_ones(
    power: float, more: float
) -> None:
    one = radio(1.0)
    weak, strong = (float(one.unheard(np.array(p))) for p in (power, power + more))
    assert 0.0 <= strong <= weak + 1e-12
    assert weak <= 1.0
    assert float(one.unheard(np.array(-110.0))) == pytest.approx(1.0)
    assert float(one.unheard(np.array(-80.0))) == pytest.approx(0.3)
    assert float(one.unheard(np.array(-50.0))) == pytest.approx(0.0, abs=1e-12)


def test_routes_that_are_not_examined_rank_behind_the_best() -> None:
    """Bystanders are looked at only where they may decide: the best is that of a full search."""
    rng = np.random.default_rng(3)
    for _ in range(10):
        table, velocity = scene(rng)
        values = moved(table, velocity, 0.0, (0.0, 0.0))
        hops = {v: tuple(rng.uniform(-80, -50, 2)) for v in list(table)[1:12]}
        values = with_powers(values, hops)
        short, full = best(values, 8), best(values, 1000)
        assert short == pytest.approx(full, abs=1e-12)


def best(values: Inputs, at_once: int) -> float:
    expectation = Expectation(
        radio(4.0),
        ExpectedPrr.Parameters(bsm_overlap=0.02, apm_overlap=0.4).losses,
        Horizon.over(2.0, 0.25),
        5.0,
        at_once=at_once,
    )
    surroundings = Surroundings(1.0, 10**9)
    situation = of_sharer(Known.read(values))
    obstacles = surroundings.obstacles(situation)
    walls = surroundings.walls(situation.known)
    return float(expectation.of_routes(situation, obstacles, walls).max())


def test_who_is_not_heard_at_the_ego_spoils_nothing_there() -> None:
    """The sharer reports whom it hears, and that is not LEFT: LEFT may send whenever it does."""
    table = {SHARER: (0.0, 60.0, 1.5), RIGHT: (25.0, 30.0, 1.5)}
    overlapping = {**BARE, "bsm_overlap": 0.5}

    def direct(
        others: Mapping[int, tuple[float, float, float]],
        *links: tuple[int, int],
        last: float = -60.0,
    ) -> float:
        values = at_rest({**table, **others})
        values |= {
            "received.link.transmitter": np.array([a for a, _ in links], np.int64),
            "received.link.receiver": np.array([b for _, b in links], np.int64),
            "received.link.power": np.array([*[-60.0] * (len(links) - 1), last]),
        }
        return expected(values, **overlapping)[NO_VEHICLE]

    left = {LEFT: (-20.0, 30.0, 1.5)}
    reports = ((SHARER, RIGHT), (RIGHT, SHARER), (SHARER, EGO))
    without = direct({}, *reports)
    assert direct(left, *reports) == pytest.approx(without, abs=1e-12)
    for power in (-60.0, -20.0):  # each BSM that overlaps with a packet is its loss
        heard = direct(left, *reports, (LEFT, EGO), last=power)
        assert heard == pytest.approx(without * np.exp(-0.5), abs=1e-6)
