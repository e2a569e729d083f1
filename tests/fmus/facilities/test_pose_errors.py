"""A message says what its sender believes of itself."""

from typing import Any

import numpy as np
import pytest

from fmus.facilities import CpmFacilities, Facilities
from fmus.messages.records import BSM, OBJECT, frame, unframe
from orchestrator.absence import Need
from orchestrator.signal import Signal
from tests.fmus.boxes import put

from .test_collective_perception import contents
from .world import EGO, RELAY, SHARER, H, Run, delivered

SHIFT, TURN = np.array([1.5, -0.5]), 0.3
PLACE, VELOCITY = np.array([20.0, 20.0]), np.array([1.0, 2.0])
"""Of the relay, in the world of these tests; it heads east."""


def wrong(vehicle: int = RELAY, factor: float = 1.0) -> dict[str, Signal]:
    """Two who may be wrong; of the first it is not told here."""
    return {
        "pose_error.vehicle": np.array([EGO, vehicle]),
        "pose_error.position": np.array([[0.0, 0.0], factor * SHIFT]),
        "pose_error.heading": np.array([0.0, factor * TURN]),
    }


def heard_of(**changes: Signal) -> Any:
    """What the ego knows of the relay by its BSM."""
    run = Run(Facilities(Facilities.Parameters()))
    packets = np.concatenate([run.step(**changes) for _ in range(11)])
    bsms = packets[(packets["kind"] == BSM) & (packets["source"] == RELAY)]
    run.step(receptions=delivered(bsms, EGO), **changes)
    assert run.output("received.bsm.id").tolist() == [RELAY]
    return {
        name: run.output(f"received.bsm.{name}")[0]
        for name in ("position", "heading", "velocity", "size", "antenna_height")
    }


def test_a_bsm_says_where_its_sender_believes_to_be() -> None:
    """And that it drives where it believes to head; its speed is its own."""
    true, found = heard_of(), heard_of(**wrong())
    assert (true["position"].tolist(), true["heading"]) == (PLACE.tolist(), 0.0)
    np.testing.assert_allclose(found["position"], PLACE + SHIFT, atol=1e-12)
    assert found["heading"] == pytest.approx(TURN)
    cos, sin = np.cos(TURN), np.sin(TURN)
    turned = VELOCITY @ np.array([[cos, sin], [-sin, cos]])
    np.testing.assert_allclose(found["velocity"], turned, atol=1e-12)
    for name in ("size", "antenna_height"):
        np.testing.assert_array_equal(found[name], true[name])


@pytest.mark.parametrize("errors", [wrong(SHARER), wrong(factor=0.0)], ids=["another", "zero"])
def test_who_is_not_wrong_says_the_truth(errors: dict[str, Signal]) -> None:
    for name, value in heard_of(**errors).items():
        np.testing.assert_array_equal(value, heard_of()[name])


def test_an_error_that_changes_while_vehicles_stay_is_told() -> None:
    """Traffic need not move for somebody to change his mind."""
    run = Run(Facilities(Facilities.Parameters()))
    for factor in (1.0, 2.0):
        packets = np.concatenate([run.step(**wrong(factor=factor)) for _ in range(11)])
        bsms = packets[(packets["kind"] == BSM) & (packets["source"] == RELAY)]
        run.step(receptions=delivered(bsms[-1:], EGO), **wrong(factor=factor))
        (place,) = run.output("received.bsm.position")
        np.testing.assert_allclose(place, PLACE + factor * SHIFT, atol=1e-12)


def test_in_a_cpm_the_sender_and_what_it_sees_are_off_alike() -> None:
    """Objects come where the sender's lidar put them: with its error once, not twice."""
    run = Run(CpmFacilities(CpmFacilities.Parameters(processing_time=0.0)))
    seen = np.zeros(1, OBJECT)
    seen["sensor"], seen["instance"], seen["points"] = SHARER, 7, 50
    put(seen, (69.0, 4.0), (73.5, 5.8))
    errors = wrong(SHARER)
    given: dict[str, Signal] = {"objects": frame("OBJS", seen), **errors}
    packets = np.concatenate([run.step(**given) for _ in range(round(0.2e9) // H)])
    told = packets[(packets["source"] == SHARER) & (packets["kind"] != BSM)]
    (message,) = contents(run, told)
    np.testing.assert_allclose(message.position, np.array([50.0, 0.0]) + SHIFT, atol=0.011)
    assert message.heading == pytest.approx(TURN, abs=np.radians(0.1) + 1e-9)
    run.step(receptions=delivered(told, EGO), **given)
    (found,) = unframe("OBJS", run.output("received.objects"), OBJECT)
    np.testing.assert_allclose(found["position"], seen["position"][0], atol=0.011)


@pytest.mark.parametrize("kind", [Facilities, CpmFacilities])
def test_errors_that_are_on_offer_must_be_taken(kind: Any) -> None:
    undriven = kind(kind.Parameters()).connectors["pose_error.position"].undriven
    assert undriven is not None
    assert undriven.need is Need.IF_OFFERED
