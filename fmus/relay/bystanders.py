"""Neighbours that take no part: their BSMs overlap with packets of senders they do not hear."""

import numpy as np

from fmus.relay.crossings import Hops, antennas, vehicles
from fmus.relay.radio import Radio
from fmus.relay.situation import Situation
from orchestrator.signal import Array

_NOTHING = -300.0
"""Stands for the power of who is not heard [dBm]."""
_FIRST = 0.5
"""Probability that of two overlapping frames of equal length the other's comes first."""


class Bystanders:
    """How many packets the BSMs of others spoil, as expected numbers of harmful neighbours.

    Who hears the sharer, reports its power; who reports none does not hear it. How strongly
    each arrives at the ego is measured. What is left, the links between neighbours and
    candidates, is geometry.

    Args:
        radio: of all nodes.
        situation: the candidates, the other neighbours and the measured powers.
    """

    def __init__(self, radio: Radio, situation: Situation) -> None:
        self._radio = radio
        links = situation.known.links
        sharer, ego = situation.sharer.vehicle, situation.ego.vehicle
        known = situation.known.bsms.heard_within(np.inf)
        others = [node for vehicle, node in known.items() if vehicle not in {sharer, ego}]
        relays = list(situation.candidates.values())
        self._others, self._other_antennas = vehicles(others), antennas(others)
        self._relays, self._relay_antennas = vehicles(relays), antennas(relays)
        ids = self._others
        to_sharer = links.power(np.full(len(ids), sharer), ids)
        to_ego = links.power(ids, np.full(len(ids), ego))
        silent = 1.0 if links.is_reported(np.array([sharer]))[0] else 0.0
        self._deaf = np.where(np.isnan(to_sharer), silent, radio.unheard(to_sharer))
        self._at_ego = np.where(np.isnan(to_ego), _NOTHING, to_ego)

    def of_direct(self, power: float) -> float:
        """Harmful neighbours on the direct link, of mean `power` [dBm]."""
        return float(np.sum(self._deaf * self._spoiled(np.array(power), self._at_ego)))

    def hops(self, some: Array) -> Hops:
        """The links from every neighbour to each of some candidates.

        Args:
            some: indices of the candidates, shape (some,).

        Returns:
            Hops from neighbours to candidates, shape (neighbour * some,): all candidates of the
            first neighbour, then those of the next.
        """
        other, relay = np.indices((len(self._others), len(some)))
        other, relay = other.ravel(), some[relay.ravel()]
        return Hops(
            vehicle=np.stack([self._others[other], self._relays[relay]], axis=1),
            start=self._other_antennas[other],
            end=self._relay_antennas[relay],
        )

    def of_relays(self, some: Array, first: Array, second: Array, between: Array) -> Array:
        """Expected number of harmful neighbours on both hops over each of some candidates.

        Args:
            some: indices of the candidates, shape (some,).
            first: mean powers of the hops from the sharer [dBm], shape (some,).
            second: mean powers of the hops to the ego [dBm], shape (some,).
            between: powers of the links of `hops` [dBm], shape (neighbour * some,).

        Returns:
            Shape (some,).
        """
        between = between.reshape(len(self._others), len(some))
        unheard = self._radio.unheard(between)
        at_relay = self._deaf[:, None] * self._spoiled(first, between)
        at_ego = unheard * self._spoiled(second, self._at_ego[:, None])
        itself = self._others[:, None] == self._relays[some]
        return np.asarray(np.where(itself, 0.0, at_relay + at_ego).sum(axis=0))

    def _spoiled(self, signal: Array, other: Array) -> Array:
        return self._radio.overlapped(signal, other, _FIRST)
