"""A relay policy whose ego is wrong about its pose."""

import numpy as np
import pytest
from hypothesis import given, strategies as st

from fmus.messages.records import NO_VEHICLE, OBJECT, unframe
from fmus.relay.inputs import Inputs as Known
from orchestrator.absence import Need
from orchestrator.component import Component
from orchestrator.registry import component_type
from orchestrator.signal import Signal

from .world import EGO, LEFT, NEIGHBOURS, RIGHT, Inputs, chosen, inputs, started, truck, with_powers

POWERS = {LEFT: (-70.0, -72.0), RIGHT: (-71.0, -70.0)}


def wrong(x: float, y: float, heading: float = 0.0, vehicle: int = EGO) -> Inputs:
    return {
        "pose_error.vehicle": np.array([vehicle, 77]),
        "pose_error.position": np.array([[x, y], [9.0, 9.0]]),
        "pose_error.heading": np.array([heading, 1.0]),
    }


def scene() -> Inputs:
    values = inputs(NEIGHBOURS, np.concatenate([truck(0, 30), truck(-10, 15)]))
    route = np.array([[0.0, 0.0], [0.0, 50.0]])
    return with_powers(values, POWERS) | {"ego.route": route}


def everybody_wrong(values: Inputs, x: float, y: float) -> Inputs:
    """All err alike: the ego, its neighbours, and so what its lidar sees."""
    objects = unframe("OBJS", bytes(values["objects"]), OBJECT).copy()
    objects["position"] += (x, y)
    told = np.asarray(values["received.bsm.position"]) + np.array([x, y])
    moved: dict[str, Signal] = {
        "objects": bytes(values["objects"])[:16] + objects.tobytes(),
        "received.bsm.position": told,
    }
    return values | moved | wrong(x, y)


def test_the_ego_and_its_route_are_where_it_believes_to_be() -> None:
    known = Known.read(scene() | wrong(2.0, -1.0, np.pi / 2))
    np.testing.assert_allclose(known.ego.position, [2.0, -1.0], atol=1e-12)
    np.testing.assert_allclose(known.ego.velocity, [-8.0, 0.0], atol=1e-12)
    assert known.ego.heading == pytest.approx(np.pi)
    np.testing.assert_allclose(known.route, [[2.0, -1.0], [-48.0, -1.0]], atol=1e-9)
    assert known.ego.vehicle == EGO


@pytest.mark.parametrize("error", [wrong(0.0, 0.0), wrong(3.0, 3.0, 1.0, vehicle=8)])
def test_who_is_not_wrong_has_the_very_numbers(error: Inputs) -> None:
    true, known = Known.read(scene()), Known.read(scene() | error)
    assert known.ego.position.tobytes() == true.ego.position.tobytes()
    assert known.route.tobytes() == true.route.tobytes()
    assert known.ego.heading == true.ego.heading


def policy(name: str) -> Component:
    return started(component_type(f"relay-{name}").create("relay", {}))


@pytest.mark.parametrize("name", ["mohed", "expected-prr", "signal-strength"])
@given(x=st.floats(-3, 3), y=st.floats(-3, 3))
def test_an_error_that_all_have_changes_nothing(name: str, x: float, y: float) -> None:
    """Where there are no buildings on the map, only places relative to each other count."""
    true = chosen(policy(name), scene())
    assert chosen(policy(name), everybody_wrong(scene(), x, y)) == true


def test_an_error_of_the_ego_alone_may_decide() -> None:
    """6 m aside: the truck half-way to the sharer is taken to stand beside the direct link."""
    values = inputs(NEIGHBOURS, truck(0, 30))
    assert chosen(policy("mohed"), values) != NO_VEHICLE
    assert chosen(policy("mohed"), moved_view(values, 6.0, 0.0)) == NO_VEHICLE


def moved_view(values: Inputs, x: float, y: float) -> Inputs:
    """The ego is wrong, and what it sees with it; its neighbours are not."""
    told = values["received.bsm.position"]
    return everybody_wrong(values, x, y) | {"received.bsm.position": told}


def test_errors_that_are_on_offer_must_be_taken() -> None:
    undriven = policy("mohed").connectors["pose_error.position"].undriven
    assert undriven is not None
    assert undriven.need is Need.IF_OFFERED
