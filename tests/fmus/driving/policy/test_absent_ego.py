"""An ego that enters late, or leaves, stops no policy."""

from typing import Any

import numpy as np
import pytest

from fmus.driving.policy.connectors import INPUTS
from fmus.messages.records import NO_VEHICLE, OBJECT, frame
from orchestrator.component import Component
from orchestrator.registry import component_type
from orchestrator.signal import Signal
from tests.fmus.boxes import put

STEP = 50_000_000
POLICIES = ("policy-rule-based", "policy-blind", "policy-expert", "policy-network")
NOTHING: dict[str, Signal] = {name: one.start_value() for name, one in INPUTS.items()}


def there(vehicle: int = 3) -> dict[str, Signal]:
    """An ego that drives north towards a car that stands in its way."""
    seen = np.zeros(1, OBJECT)
    seen["sensor"], seen["instance"] = vehicle, 7
    put(seen, (-1.0, 12.0), (1.0, 16.0))
    return NOTHING | {
        "ego.id": np.array(vehicle),
        "ego.position": np.zeros(2),
        "ego.heading": np.array(np.pi / 2),
        "ego.speed": np.array(8.0),
        "ego.size": np.array([4.5, 1.8, 1.5]),
        "ego.route": np.array([[0.0, 0.0], [0.0, 100.0]]),
        "objects": frame("OBJS", seen),
        "vehicle.id": np.array([1, vehicle]),
        "vehicle.position": np.array([[0.0, 14.0, 0.0], [0.0, 0.0, 0.0]]),
        "vehicle.heading": np.full(2, np.pi / 2),
        "vehicle.velocity": np.array([[0.0, 0.0], [0.0, 8.0]]),
        "vehicle.size": np.tile([4.5, 1.8, 1.5], (2, 1)),
    }


def driven(policy: Component, *steps: dict[str, Signal], start: int = 0) -> Any:
    for k, values in enumerate(steps):
        policy.step(values, (start + k) * STEP, STEP)
    return {name: np.asarray(value).tolist() for name, value in policy.outputs().items()}


@pytest.mark.parametrize("name", POLICIES)
def test_before_it_enters_and_after_it_left_there_is_no_hazard(name: str) -> None:
    policy = component_type(name).create(name, {})
    policy.setup(0, np.random.default_rng(0))
    gone = there() | {"ego.id": np.array(NO_VEHICLE), "ego.route": np.empty((0, 2))}
    for values in (NOTHING, there(), there(), gone, NOTHING):
        outputs = driven(policy, values)
        assert np.isfinite(outputs["command"]).all()
        if int(np.asarray(values["ego.id"])) == NO_VEHICLE:
            assert outputs["hazard.instance"] == NO_VEHICLE
            assert outputs["command"][1:] == [0.0, 0.0]


@pytest.mark.parametrize("name", POLICIES)
def test_one_that_entered_late_is_driven_as_one_that_was_there_from_the_start(name: str) -> None:
    late, prompt = (component_type(name).create(name, {}) for _ in range(2))
    for policy in (late, prompt):
        policy.setup(0, np.random.default_rng(0))
    driven(late, NOTHING, NOTHING, NOTHING)
    steps = [there() for _ in range(4)]
    assert driven(late, *steps, start=3) == driven(prompt, *steps, start=3)
