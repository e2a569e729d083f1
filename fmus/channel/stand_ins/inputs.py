"""What the stand-ins for the channel read."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt

from fmus.messages.records import PACKET, unframe
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Inputs:
    """The inputs of one step that matter here: no stand-in asks for bodies and buildings.

    Attributes:
        id: numbers of the vehicles, ascending, int64, shape (vehicle,).
        position: centres of the footprints, world frame [m], float64, shape (vehicle, 3).
        antenna_height: above the ground [m], float64, shape (vehicle,).
        equipped: whether the vehicle has a radio, bool, shape (vehicle,).
        packets: those to be sent, `PACKET` records of shape (packet,).
    """

    id: npt.NDArray[np.int64]
    position: npt.NDArray[np.float64]
    antenna_height: npt.NDArray[np.float64]
    equipped: npt.NDArray[np.bool_]
    packets: Array

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The inputs of a step; what is the same object as before stays it, but for packets.

        Raises:
            ValueError: `packets` is no "PKTS" signal.
        """
        return cls(
            id=np.asarray(signals["vehicle.id"]),
            position=np.asarray(signals["vehicle.position"]),
            antenna_height=np.asarray(signals["vehicle.antenna_height"]),
            equipped=np.asarray(signals["vehicle.equipped"]),
            packets=unframe("PKTS", bytes(signals["packets"]), PACKET),
        )
