"""The random streams of the facilities layer."""

from collections.abc import Sequence

import numpy as np

from fmus.messages.records import NO_VEHICLE
from orchestrator.randomness import substream


class Streams:
    """Whose random stream phases and processing times are drawn from.

    The first ego and all other vehicles have the component's stream. Every further ego has one
    of its own, which depends on its name: what its vehicle sends, asks for and so causes others
    to send takes nothing from the draws of the others. So the first ego's messages have the same
    times whether there are further egos or not. A vehicle that was an ego stays with its stream,
    for answers to it may still be under way.

    Args:
        stream: the component's.
        egos: names of the egos, the first one first.
    """

    def __init__(self, stream: np.random.Generator, egos: Sequence[str]) -> None:
        self._egos = egos
        self._by_vehicle: dict[int, int] = {}
        self.renew(stream)

    def renew(self, stream: np.random.Generator) -> None:
        """Draw from this stream of the component from now on, and from its substreams."""
        self._common = stream
        self._further = [substream(stream, ego) for ego in self._egos[1:]]

    def assign(self, vehicles: Sequence[int]) -> None:
        """Say which vehicles the egos are now.

        Args:
            vehicles: their numbers in the order of the names; `NO_VEHICLE` while one is not there.
        """
        for further, vehicle in zip(range(len(self._further)), vehicles[1:], strict=True):
            if vehicle != NO_VEHICLE:
                self._by_vehicle[vehicle] = further

    def of(self, vehicle: int) -> np.random.Generator:
        """The stream for what a vehicle causes."""
        further = self._by_vehicle.get(vehicle)
        return self._common if further is None else self._further[further]
