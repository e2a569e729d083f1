"""The rivals of MoHeD: uniform draws, and signal strength on made-up tables."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.records import NO_VEHICLE
from fmus.relay import Random, SignalStrength
from tests.fmus.relay.world import (
    LEFT,
    NEIGHBOURS,
    RIGHT,
    STEP,
    Inputs,
    chosen,
    inputs,
    started,
    with_powers,
)

FAR = 5
TABLE = {**NEIGHBOURS, FAR: (0.0, 100.0, 1.5)}
WINDOW = 20 * STEP
POWER = st.integers(-110, -30).map(float)


def draws(count: int, seed: int, **parameters: Any) -> list[int]:
    """The choices at `count` windows."""
    component = started(Random(Random.Parameters(**parameters)), seed)
    return [chosen(component, inputs(TABLE), t=k * WINDOW) for k in range(count)]


def by_strength(hops: Mapping[int, tuple[float, float]], rule: str = "sum") -> int:
    component = SignalStrength(SignalStrength.Parameters(rule=rule))  # type: ignore[arg-type]
    return chosen(started(component), with_powers(inputs(TABLE), hops))


@pytest.mark.parametrize(
    ("direct_link", "expected", "critical"),
    [(False, {LEFT, RIGHT, FAR}, 13.816), (True, {LEFT, RIGHT, FAR, NO_VEHICLE}, 16.266)],
)
def test_every_candidate_is_drawn_equally_often(
    direct_link: bool,  # noqa: FBT001
    expected: set[int],
    critical: float,
) -> None:
    """Pearson's chi-square of 3000 draws; `critical` is exceeded once in 1000 fair samples.

    The 0.999 quantiles for 2 and 3 degrees of freedom.
    """
    relays, counts = np.unique(draws(3000, seed=7, direct_link=direct_link), return_counts=True)
    assert set(relays.tolist()) == expected
    fair = 3000 / len(expected)
    assert float(np.sum((counts - fair) ** 2 / fair)) < critical


def test_draws_follow_from_the_seed() -> None:
    assert draws(50, seed=1) == draws(50, seed=1)
    assert draws(50, seed=1) != draws(50, seed=2)


def test_sum_and_min_of_the_hops_can_disagree() -> None:
    """-50 - 90 = -140 beats -72 - 72 = -144; but its weaker hop is the weaker one."""
    hops = {LEFT: (-50.0, -90.0), RIGHT: (-72.0, -72.0)}
    assert by_strength(hops, "sum") == LEFT
    assert by_strength(hops, "min") == RIGHT


@given(st.fixed_dictionaries({v: st.tuples(POWER, POWER) for v in (LEFT, RIGHT, FAR)}))
def test_nobody_is_stronger_than_the_chosen_one(hops: dict[int, tuple[float, float]]) -> None:
    assert sum(hops[by_strength(hops, "sum")]) == max(map(sum, hops.values()))
    assert min(hops[by_strength(hops, "min")]) == max(map(min, hops.values()))


@pytest.mark.parametrize("rule", ["sum", "min"])
def test_a_tie_goes_to_the_shorter_longest_hop_and_then_to_the_current_choice(rule: str) -> None:
    component = started(SignalStrength(SignalStrength.Parameters(rule=rule)))  # type: ignore[arg-type]
    equal = {LEFT: (-60.0, -70.0), RIGHT: (-60.0, -70.0)}
    assert chosen(component, with_powers(inputs(TABLE), equal)) == LEFT
    better = equal | {RIGHT: (-59.0, -69.0)}
    assert chosen(component, with_powers(inputs(TABLE), better), t=WINDOW) == RIGHT
    assert chosen(component, with_powers(inputs(TABLE), equal), t=2 * WINDOW) == RIGHT


@pytest.mark.parametrize("unknown", [(np.nan, -40.0), (-40.0, np.nan), (np.nan, np.nan)])
def test_a_candidate_of_which_a_hop_is_not_known_is_not_taken(
    unknown: tuple[float, float],
) -> None:
    assert by_strength({LEFT: unknown, RIGHT: (-90.0, -90.0)}) == RIGHT
    assert by_strength({LEFT: unknown}) == NO_VEHICLE


def test_who_announces_but_is_not_heard_itself_is_no_candidate() -> None:
    values = with_powers(inputs(NEIGHBOURS), {FAR: (-40.0, -40.0), RIGHT: (-90.0, -90.0)})
    assert chosen(started(SignalStrength(SignalStrength.Parameters())), values) == RIGHT


def test_links_from_other_sharers_do_not_count() -> None:
    values: Inputs = with_powers(inputs(TABLE), {LEFT: (-40.0, -40.0), RIGHT: (-90.0, -90.0)})
    told = np.asarray(values["received.link.receiver"]) == LEFT
    transmitters = np.asarray(values["received.link.transmitter"])
    values["received.link.transmitter"] = np.where(told, 99, transmitters)
    assert chosen(started(SignalStrength(SignalStrength.Parameters())), values) == RIGHT


def test_replayed_recordings_know_no_powers_and_leave_the_direct_link() -> None:
    assert by_strength({}) == NO_VEHICLE
