"""What all policies read about the ego vehicle, and what they put out."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.policy.conflict import Ego
from fmus.driving.policy.connectors import EGO, connectors
from orchestrator.signal import Causality, Signals

NOTHING: Final[Signals] = {
    name: connector.start_value()
    for name, connector in connectors(EGO).items()
    if connector.causality is Causality.OUTPUT
}
"""The outputs before the first step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Hazard:
    """What the brake is used for.

    Attributes:
        instance: track number of the object; of a policy that knows the truth, of the vehicle.
        sensor: the vehicle whose sensor saw it, -1 where none was needed.
        age: of the scan in which it was seen [s].
    """

    instance: int
    sensor: int
    age: float


def ego_of(inputs: Signals) -> Ego:
    """The ego vehicle."""
    size = np.asarray(inputs["ego.size"])
    return Ego(
        speed=float(np.asarray(inputs["ego.speed"])),
        length=float(size[0]),
        width=float(size[1]),
        route=np.asarray(inputs["ego.route"]),
    )


def outputs(*, accelerate: float, brake: float, steer: float, hazard: Hazard | None) -> Signals:
    """The outputs of a policy: the pedals 0..1, the wheel -1..1, and why the brake is used."""
    return {
        "command": np.array([accelerate, brake, steer]),
        "hazard.instance": np.array(hazard.instance if hazard else -1, np.int64),
        "hazard.sensor": np.array(hazard.sensor if hazard else -1, np.int64),
        "hazard.age": np.array(hazard.age if hazard else 0.0),
    }
