"""What a relay policy decides, and from what."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fmus.messages.records import NO_VEHICLE
from fmus.relay.inputs import Inputs
from fmus.relay.nodes import Node


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """One decision: who is to be connected, who could relay, and all else that the ego knows.

    Attributes:
        ego: the receiver.
        sharer: the sender, where it was last known.
        candidates: neighbours that the ego heard within `lost_after` and whose two hops are
            within the range, by ascending number; without the sharer and the ego.
        current: the choice until now, `NO_VEHICLE` for the direct link; None at the first
            choice for this sharer.
        known: what the ego knows now.
    """

    ego: Node
    sharer: Node
    candidates: Mapping[int, Node]
    current: int | None
    known: Inputs

    def power(self, transmitter: int, receiver: int) -> float:
        """The power at which one vehicle received another lately [dBm], NaN if it is not known.

        The ego knows what it measured itself and what its neighbours announce in their BSMs.
        """
        return float(self.known.links.power(np.array(transmitter), np.array(receiver)))

    def best(self, merits: Mapping[int, float]) -> int:
        """The relay of largest merit; among equally good ones the first by `tie_break`.

        Args:
            merits: by candidate, or `NO_VEHICLE` for the direct link; those that are NaN are
                passed over.

        Returns:
            Its number; `NO_VEHICLE`, the direct link, if there is none.
        """
        judged = [relay for relay, merit in merits.items() if not math.isnan(merit)]
        if not judged:
            return NO_VEHICLE
        return min(judged, key=lambda relay: (-merits[relay], *self.tie_break(relay)))

    def longest_hop(self, relay: int) -> float:
        """The longer of the two hops over a candidate, or the direct link [m]."""
        if relay == NO_VEHICLE:
            return self.sharer.distance(self.ego)
        node = self.candidates[relay]
        return max(self.sharer.distance(node), node.distance(self.ego))

    def tie_break(self, relay: int) -> tuple[bool, bool, float, int]:
        """The sort key among equally good choices, which the paper leaves open.

        One keeps the current choice, then prefers the direct link, then the relay whose
        longer hop is shorter.
        """
        is_relay = relay != NO_VEHICLE
        return (relay != self.current, is_relay, self.longest_hop(relay), relay)


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What a relay policy chooses, and the risks where it assessed them.

    Attributes:
        relay: number of the vehicle that relays, `NO_VEHICLE` for the direct link.
        risk_direct: NLOS risk of the direct link [dB s/m].
        risk_chosen: NLOS risk of what was chosen, over both hops [dB s/m].
    """

    relay: int = NO_VEHICLE
    risk_direct: float = 0.0
    risk_chosen: float = 0.0
