"""The radios in the scene: who they are and where their antennas stand."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from orchestrator.signal import Signals

Int = npt.NDArray[np.int64]
Float = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Radios:
    """The equipped vehicles.

    Attributes:
        id: numbers of the vehicles, ascending, shape (radio,).
        antenna: positions [m], shape (radio, 3).
        silent: numbers of the vehicles that have no radio.
        highest: number of any vehicle, -1 if there is none.
    """

    id: Int
    antenna: Float
    silent: frozenset[int]
    highest: int

    @classmethod
    def of(cls, inputs: Signals) -> "Radios":
        """The radios in the inputs `vehicle.*`."""
        ids = np.asarray(inputs["vehicle.id"])
        equipped = np.asarray(inputs["vehicle.equipped"])
        antenna = np.array(inputs["vehicle.position"])
        antenna[:, 2] += np.asarray(inputs["vehicle.antenna_height"])
        return cls(
            id=ids[equipped],
            antenna=antenna[equipped],
            silent=frozenset(ids[~equipped].tolist()),
            highest=int(ids.max(initial=-1)),
        )

    def row(self, vehicle: int) -> int | None:
        """The row of a vehicle, `None` if it has no radio or is not there."""
        row = int(np.searchsorted(self.id, vehicle))
        return row if row < len(self.id) and self.id[row] == vehicle else None
