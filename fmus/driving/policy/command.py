"""What driving policies put out."""

from dataclasses import dataclass

import numpy as np

from orchestrator.signal import Signals


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """Pedals and wheel, and why the brake is used.

    Attributes:
        accelerate: accelerator pedal, 0 to 1.
        brake: brake pedal, 0 to 1; it overrides the accelerator.
        steer: wheel, -1 (right) to 1 (left).
        hazard: what the brake is used for, None without one.
    """

    accelerate: float = 0.0
    brake: float = 0.0
    steer: float = 0.0
    hazard: Hazard | None = None

    def signals(self) -> Signals:
        """The outputs of a driving policy."""
        hazard = self.hazard
        return {
            "command": np.array([self.accelerate, self.brake, self.steer]),
            "hazard.instance": np.array(hazard.instance if hazard else -1, np.int64),
            "hazard.sensor": np.array(hazard.sensor if hazard else -1, np.int64),
            "hazard.age": np.array(hazard.age if hazard else 0.0),
        }
