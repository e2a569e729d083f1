"""The readings of how a relay is discovered and chosen: who is a candidate, and by which powers."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest

from fmus.messages.records import NO_VEHICLE
from fmus.relay import ExpectedPrr, Mohed, Random, RelaySelection, SignalStrength
from fmus.relay.offers import Offers
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
    started,
    switches,
    truck,
    with_powers,
)

THIRD = 5
THREE = {**NEIGHBOURS, THIRD: (0.0, 30.0, 1.5)}
"""Three candidates between ego and sharer; the third is the one in the middle."""
WINDOW = 20 * STEP

POLICIES: dict[str, Callable[..., RelaySelection]] = {
    "mohed": lambda **given: Mohed(Mohed.Parameters(direct_link=False, **given)),
    "random": lambda **given: Random(Random.Parameters(**given)),
    "signal-strength": lambda **given: SignalStrength(SignalStrength.Parameters(**given)),
    "expected-prr": lambda **given: ExpectedPrr(ExpectedPrr.Parameters(**given)),
}
EVERY = pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES)


def powers(hops: Mapping[int, tuple[float, float]], direct: float = np.nan) -> Inputs:
    """Three candidates with these powers from the sharer and to the ego, and the direct link's.

    Two trucks stand in the direct link.
    """
    trucks = np.concatenate([truck(0, 20), truck(0, 40)])
    values = with_powers(inputs(THREE, trucks), hops)
    if np.isnan(direct):
        return values
    links = ("transmitter", SHARER), ("receiver", EGO), ("power", direct)
    for name, value in links:
        key = f"received.link.{name}"
        values[key] = np.append(np.asarray(values[key]), value)
    return values


def strength(**given: Any) -> RelaySelection:
    found = SignalStrength(SignalStrength.Parameters(**given))
    started(found)
    return found


ONE_EACH = {LEFT: (-50.0, -80.0), RIGHT: (-85.0, -55.0), THIRD: (-66.0, -66.0)}
"""The strongest by the sum, -130 dBm, by the hop to the ego, and by the weaker hop."""


@pytest.mark.parametrize(("rule", "best"), [("sum", LEFT), ("own", RIGHT), ("min", THIRD)])
def test_three_rules_choose_three_relays(rule: str, best: int) -> None:
    """-130 beats -140 and -132 dBm; -55 beats -66 and -80; -66 beats -80 and -85."""
    assert chosen(strength(rule=rule), powers(ONE_EACH)) == best


def test_the_own_hop_alone_decides_but_the_other_one_must_be_known() -> None:
    """The ego decides by what it measures; who has not heard the sharer cannot relay."""
    assert chosen(strength(rule="own"), powers(ONE_EACH | {RIGHT: (-93.9, -55.0)})) == RIGHT
    assert chosen(strength(rule="own"), powers(ONE_EACH | {RIGHT: (np.nan, -55.0)})) == THIRD


def test_without_the_other_hop_who_does_not_hear_the_sharer_is_taken_too() -> None:
    deaf = ONE_EACH | {RIGHT: (np.nan, -55.0)}
    assert chosen(strength(rule="own", needs_sharer=False), powers(deaf)) == RIGHT
    assert chosen(strength(rule="sum", needs_sharer=False), powers(deaf)) == LEFT
    held = strength(rule="own", needs_sharer=False, threshold=-54.9)
    assert chosen(held, powers(deaf)) == NO_VEHICLE


@pytest.mark.parametrize(
    ("threshold", "hysteresis", "best"),
    [
        (-85.0, 0.0, RIGHT),  # its hop from the sharer is exactly there
        (-84.9, 0.0, THIRD),
        (-85.0, 0.1, THIRD),
        (-66.0, 0.0, THIRD),
        (-65.9, 0.0, NO_VEHICLE),
        (-69.0, 3.0, THIRD),
        (-69.0, 3.1, NO_VEHICLE),
    ],
)
def test_both_hops_are_held_to_the_threshold_and_a_new_relay_to_the_hysteresis(
    threshold: float, hysteresis: float, best: int
) -> None:
    policy = strength(rule="own", threshold=threshold, hysteresis=hysteresis)
    assert chosen(policy, powers(ONE_EACH)) == best


def test_each_window_takes_the_strongest_or_keeps_the_one_above_the_threshold() -> None:
    """The relay falls from -55 to -69.9 dBm at the ego, where another has -66; then below -70."""
    falls = ONE_EACH | {RIGHT: (-60.0, -69.9)}
    gone = ONE_EACH | {RIGHT: (-60.0, -70.1)}
    anew = strength(rule="own", threshold=-70.0)
    kept = strength(rule="own", threshold=-70.0, reselection="threshold")
    courses = [
        [
            chosen(each, powers(values), t=k * WINDOW)
            for k, values in enumerate((first, falls, gone))
        ]
        for each in (anew, kept)
        for first in [ONE_EACH | {RIGHT: (-60.0, -55.0)}]
    ]
    assert courses == [[RIGHT, THIRD, THIRD], [RIGHT, RIGHT, THIRD]]
    assert (switches(anew), switches(kept)) == (1, 1)


def test_a_kept_relay_may_hear_the_sharer_no_more() -> None:
    """The ego re-selects by what it measures itself; the other hop counts for new relays only."""
    policy = strength(rule="own", threshold=-70.0, reselection="threshold")
    assert chosen(policy, powers(ONE_EACH | {RIGHT: (-60.0, -55.0)})) == RIGHT
    assert chosen(policy, powers(ONE_EACH | {RIGHT: (np.nan, -55.0)}), t=WINDOW) == RIGHT


def test_the_hysteresis_is_not_asked_of_the_current_relay() -> None:
    policy = strength(rule="own", threshold=-70.0, hysteresis=5.0)
    assert chosen(policy, powers({RIGHT: (-60.0, -60.0)})) == RIGHT
    weak = {RIGHT: (-68.0, -68.0), THIRD: (-66.0, -66.0)}
    assert chosen(policy, powers(weak), t=WINDOW) == RIGHT
    assert chosen(policy, powers(weak | {THIRD: (-65.0, -65.0)}), t=2 * WINDOW) == THIRD


@EVERY
def test_on_demand_a_relay_is_looked_for_when_the_direct_link_becomes_weak(
    policy: Callable[..., RelaySelection],
) -> None:
    """At -80 dBm the direct link suffices; at -80.1 a relay is chosen at once, within a window."""
    component = policy(direct_threshold=-80.0)
    started(component)
    assert chosen(component, powers(ONE_EACH, direct=-80.0)) == NO_VEHICLE
    assert chosen(component, powers(ONE_EACH, direct=-80.0), t=4 * STEP) == NO_VEHICLE
    assert chosen(component, powers(ONE_EACH, direct=-80.1), t=5 * STEP) != NO_VEHICLE
    within = chosen(component, powers(ONE_EACH, direct=-60.0), t=5 * STEP + WINDOW - STEP)
    assert within != NO_VEHICLE
    assert chosen(component, powers(ONE_EACH, direct=-60.0), t=5 * STEP + WINDOW) == NO_VEHICLE
    assert switches(component) == 2


@EVERY
def test_a_sharer_that_is_not_heard_needs_a_relay(policy: Callable[..., RelaySelection]) -> None:
    component = policy(direct_threshold=-80.0)
    started(component)
    assert chosen(component, powers(ONE_EACH)) != NO_VEHICLE


@EVERY
def test_candidates_beyond_the_range_of_the_ego_are_left_out(
    policy: Callable[..., RelaySelection],
) -> None:
    """The three are 36.1, 39.1 and 30 m from the ego."""
    found = {}
    for reach in (35.0, 29.9):
        component = policy(ego_range=reach)
        started(component)
        found[reach] = chosen(component, powers(ONE_EACH))
    assert found == {35.0: THIRD, 29.9: NO_VEHICLE}


@EVERY
def test_who_does_not_offer_to_relay_is_no_candidate(
    policy: Callable[..., RelaySelection],
) -> None:
    component = policy(offering=0.0)
    started(component)
    assert chosen(component, powers(ONE_EACH)) == NO_VEHICLE


def test_the_same_vehicles_offer_whatever_the_policy_draws() -> None:
    """A draw of the policy's own before or after changes nothing, nor does the draw itself."""
    one, other = np.random.default_rng(7), np.random.default_rng(7)
    offers = Offers(0.25, one)
    willing = [vehicle for vehicle in range(2000) if vehicle in offers]
    assert one.random() == other.random()
    again = Offers(0.25, np.random.default_rng(7))
    assert [vehicle for vehicle in reversed(range(2000)) if vehicle in again] == willing[::-1]


def test_a_share_of_the_vehicles_offers_and_a_larger_share_adds_to_them() -> None:
    """Of 4000 a quarter, within 3.3 standard deviations of a binomial count (27.4)."""
    few, more, every = (Offers(share, np.random.default_rng(3)) for share in (0.25, 0.5, 1.0))
    assert abs(sum(vehicle in few for vehicle in range(4000)) - 1000) < 90
    assert all(vehicle in more for vehicle in range(4000) if vehicle in few)
    assert all(vehicle in every for vehicle in range(4000))
    other = Offers(0.25, np.random.default_rng(4))
    assert any((vehicle in other) != (vehicle in few) for vehicle in range(100))


def test_the_draws_of_random_relays_stay_what_they_were_with_everybody_offering() -> None:
    def course(**given: Any) -> list[int]:
        component = Random(Random.Parameters(**given))
        started(component, seed=5)
        return [chosen(component, inputs(THREE), t=k * WINDOW) for k in range(40)]

    assert course() == course(offering=1.0, ego_range=40.0)
    assert course() == course(offering=0.9999999)
