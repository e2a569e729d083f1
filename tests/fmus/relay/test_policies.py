"""What holds for every relay policy: same plugs, same moments of choice, no peeking."""

from collections.abc import Callable

import numpy as np
import pytest
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE, frame
from fmus.relay import (
    Choice,
    Direct,
    ExpectedPrr,
    Mohed,
    Random,
    RelaySelection,
    SignalStrength,
    Situation,
)
from fmus.relay.connectors import CONNECTORS
from fmus.relay.selection import SelectionParameters
from orchestrator.component import Component, DecidingComponent
from orchestrator.registry import component_type
from orchestrator.signal import Causality
from orchestrator.testing import check_component
from tests.fmus.boxes import put
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
    switches,
    truck,
    with_powers,
)

RSU = 1_000
NAMES = (
    "relay-mohed",
    "relay-direct",
    "relay-random",
    "relay-signal-strength",
    "relay-expected-prr",
)
RELAYING: dict[str, Callable[[], Component]] = {
    "mohed": lambda: Mohed(Mohed.Parameters()),
    "random": lambda: Random(Random.Parameters()),
    "sum": lambda: SignalStrength(SignalStrength.Parameters()),
    "expected-prr": lambda: ExpectedPrr(ExpectedPrr.Parameters()),
    "min": lambda: SignalStrength(SignalStrength.Parameters(rule="min")),
}
ALL = {**RELAYING, "direct": Direct}


def only(relay: int) -> Inputs:
    """A scene in which `relay` is the one vehicle that any policy would take."""
    table = {vehicle: NEIGHBOURS[vehicle] for vehicle in (SHARER, relay)}
    return with_powers(inputs(table, truck(0, 30)), {relay: (-60.0, -60.0)})


def nobody() -> Inputs:
    return inputs({}, truck(0, 30))


@pytest.mark.parametrize("name", NAMES)
def test_all_have_the_same_connectors(name: str) -> None:
    assert component_type(name).create(name, {}).connectors == CONNECTORS


@pytest.mark.parametrize("name", sorted(set(NAMES) - {"relay-direct"}))
def test_all_that_relay_have_the_parameters_of_the_selection(name: str) -> None:
    assert set(SelectionParameters.__dataclass_fields__) <= set(component_type(name).parameters)


@pytest.mark.parametrize("kind", ALL)
def test_contract(kind: str) -> None:
    check_component(ALL[kind](), steps=5, h=STEP, seed=1)


@pytest.mark.parametrize("kind", ALL)
def test_starved_of_messages_it_uses_the_direct_link(kind: str) -> None:
    component = started(ALL[kind]())
    for k in range(50):
        assert chosen(component, nobody(), t=k * STEP) == NO_VEHICLE


@pytest.mark.parametrize("kind", RELAYING)
def test_a_sharer_that_was_never_heard_has_no_relay(kind: str) -> None:
    values = with_powers(inputs({LEFT: NEIGHBOURS[LEFT]}, truck(0, 30)), {LEFT: (-60.0, -60.0)})
    assert chosen(started(RELAYING[kind]()), values) == NO_VEHICLE


@pytest.mark.parametrize("kind", RELAYING)
def test_when_messages_stop_the_relay_is_given_up_at_once(kind: str) -> None:
    component = started(RELAYING[kind]())
    assert chosen(component, only(LEFT)) == LEFT
    assert chosen(component, nobody(), t=STEP) == NO_VEHICLE
    assert switches(component) == 1


@pytest.mark.parametrize("kind", RELAYING)
def test_a_relay_that_was_just_heard_is_kept_until_the_window_ends(kind: str) -> None:
    component = started(RELAYING[kind]())
    assert chosen(component, only(LEFT)) == LEFT
    both = only(RIGHT)
    both["received.bsm.id"] = np.array([LEFT, RIGHT], np.int64)  # the sharer is shadowed by now
    for k in range(1, 20):
        assert chosen(component, both, t=k * STEP) == LEFT
    assert chosen(component, only(RIGHT), t=20 * STEP) == RIGHT


@pytest.mark.parametrize("kind", RELAYING)
def test_without_a_trigger_nothing_is_chosen(kind: str) -> None:
    component = started(RELAYING[kind]())
    idle = only(LEFT) | {"match.trigger": np.array(False)}
    assert chosen(component, idle) == NO_VEHICLE
    assert chosen(component, only(LEFT), t=STEP) == LEFT


@pytest.mark.parametrize("kind", RELAYING)
def test_the_first_choice_after_a_pause_is_no_switch(kind: str) -> None:
    component = started(RELAYING[kind]())
    assert chosen(component, only(LEFT)) == LEFT
    chosen(component, only(LEFT) | {"match.trigger": np.array(False)}, t=STEP)
    assert chosen(component, only(RIGHT), t=2 * STEP) == RIGHT
    assert switches(component) == 0


@pytest.mark.parametrize("kind", RELAYING)
def test_candidates_with_a_hop_out_of_range_are_not_considered(kind: str) -> None:
    table = {SHARER: NEIGHBOURS[SHARER], LEFT: (-310.0, 30.0, 1.5)}
    values = with_powers(inputs(table, truck(0, 30)), {LEFT: (-60.0, -60.0)})
    assert chosen(started(RELAYING[kind]()), values) == NO_VEHICLE


@pytest.mark.parametrize("kind", RELAYING)
def test_an_empty_list_of_sharers_is_no_trigger(kind: str) -> None:
    values = only(LEFT) | {"match.sharer": np.empty(0, np.int64)}
    assert chosen(started(RELAYING[kind]()), values) == NO_VEHICLE


@pytest.mark.parametrize("kind", RELAYING)
@pytest.mark.parametrize(("age", "is_candidate"), [(0.49, True), (0.51, False)])
def test_who_would_count_as_lost_is_no_candidate(
    kind: str,
    age: float,
    is_candidate: bool,  # noqa: FBT001
) -> None:
    """A choice that `lost_after` (0.5 s) takes back after the next 100 ms is none."""
    values = only(LEFT)
    ids = np.asarray(values["received.bsm.id"])
    values["received.bsm.age"] = np.where(ids == LEFT, age, 0.0)
    assert chosen(started(RELAYING[kind]()), values) == (LEFT if is_candidate else NO_VEHICLE)


@pytest.mark.parametrize("kind", RELAYING)
def test_a_roadside_unit_relays_as_any_neighbour_does(kind: str) -> None:
    """A body of 0.3 m at rest with its antenna 6 m high; the ego's lidar sees its pole."""
    values = with_powers(inputs({SHARER: NEIGHBOURS[SHARER], RSU: (-20.0, 30.0, 6.0)}), {})
    at = np.asarray(values["received.bsm.id"]) == RSU
    size = np.asarray(values["received.bsm.size"]).copy()
    size[at] = (0.3, 0.3, 6.0)
    pole = truck(-20.0, 30.0, height=5.9)
    put(pole, (-20.1, 29.9), (-19.9, 30.1))
    blocked = np.concatenate([truck(0, 30), pole])
    values |= with_powers(values, {RSU: (-60.0, -60.0)})
    values |= {"received.bsm.size": size, "objects": frame("OBJS", blocked)}
    component = started(RELAYING[kind]())
    assert chosen(component, values) == RSU
    assert float(np.asarray(component.outputs()["risk.chosen"])) == 0.0


@pytest.mark.parametrize("name", [*NAMES, "relay-forced", "relay-oracle"])
def test_while_the_ego_is_not_there_nothing_is_chosen_and_nothing_remembered(name: str) -> None:
    """Without anything, and with what it knew when it left; afterwards it chooses as if new."""
    kind = component_type(name)
    late, new = (started(kind.create(name, {})) for _ in range(2))
    nothing = {
        signal: connector.start_value()
        for signal, connector in CONNECTORS.items()
        if connector.causality is Causality.INPUT
    }
    gone = only(LEFT) | {"ego.id": np.array(NO_VEHICLE)}
    for k, values in enumerate((nothing, nothing | {"match.trigger": np.array(True)}, gone, gone)):
        assert chosen(late, values, k * STEP) == NO_VEHICLE
        if isinstance(late, DecidingComponent):
            assert late.decision is None
    assert chosen(late, only(LEFT), 4 * STEP) == chosen(new, only(LEFT), 4 * STEP)
    if isinstance(late, DecidingComponent) and isinstance(new, DecidingComponent):
        assert late.decision == new.decision is not None
    assert switches(late) == 0


class Careless(RelaySelection):
    """A policy of somebody else's, which returns what it is not asked for."""

    @override
    def choose(self, situation: Situation) -> Choice:
        return 5  # type: ignore[return-value]


def test_a_policy_that_makes_no_choice_is_told_so() -> None:
    policy = Careless(Careless.Parameters())
    with pytest.raises(TypeError, match=r"`Careless.choose` returned `int`, not a `Choice`"):
        chosen(started(policy), only(next(iter(NEIGHBOURS.keys() - {SHARER}))))
