"""The radios in the scene: who they are and where their antennas stand."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from fmus.channel.stand_ins.inputs import Inputs

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
    def of(cls, inputs: Inputs) -> Self:
        """The radios in the scene of a step."""
        ids, equipped = inputs.id, inputs.equipped
        antenna = inputs.position.copy()
        antenna[:, 2] += inputs.antenna_height
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
