"""Traffic lights: where their signals are, and what they show."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from adapters.sumo.scene import frozen
from adapters.sumo.simulation import Sumo
from orchestrator.signal import Array

_CODES: Final[Mapping[str, int]] = MappingProxyType(
    {"O": 0, "o": 0, "r": 1, "u": 2, "y": 3, "Y": 3, "g": 4, "G": 5, "s": 6}
)
"""Values of `light.state` by SUMO's letters; `o` and `O`, blinking or off, are both off."""


class Lights:
    """All signals of all traffic lights, light by light in the order of their names.

    There is one for each index of a light and each lane that the index rules. Signals that no lane
    outside junctions leads to, those of pedestrian crossings, are left out.
    """

    def __init__(self, sumo: Sumo) -> None:
        self._sumo = sumo
        self._names = sumo.lights()
        controller, place, heading = [], [], []
        self._rows: list[tuple[str, list[int]]] = []
        for number, light in enumerate(self._names):
            used = []
            ruled = enumerate(sumo.controlled_lanes(light))
            for k, lane in ((k, lane) for k, lanes in ruled for lane in lanes):
                if lane.startswith(":"):
                    continue
                shape = sumo.net.lane_shape(lane)
                way = shape[-1] - shape[-2]  # SUMO refuses a lane of one point
                used.append(k)
                controller.append(number)
                place.append(shape[-1])
                heading.append(math.atan2(way[1], way[0]))
            self._rows.append((light, used))
        self._fixed: Mapping[str, Array] = {
            "light.controller": frozen(np.array(controller, dtype=np.int32)),
            "light.position": frozen(np.array(place, dtype=np.float64).reshape(-1, 2)),
            "light.heading": frozen(np.array(heading, dtype=np.float64)),
        }
        self._shown: list[str] = []
        self._state: Array = np.zeros(len(controller), dtype=np.int32)

    def signals(self) -> Mapping[str, Array]:
        """The outputs `light.*`, shape (signal, ...); what did not change is the same object."""
        shown = self._sumo.light_states(self._names)
        if shown != self._shown:
            self._shown = shown
            codes = [
                _CODES[letters[k]]
                for (_, used), letters in zip(self._rows, shown, strict=True)
                for k in used
            ]
            self._state = frozen(np.array(codes, dtype=np.int32))
        return {"light.state": self._state, **self._fixed}
