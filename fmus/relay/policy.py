"""What a relay policy decides, and from what."""

import abc
from collections.abc import Mapping
from dataclasses import dataclass

from fmus.messages.records import NO_VEHICLE
from fmus.relay.nodes import Node
from orchestrator.signal import Signals
from orchestrator.timebase import Time


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """One decision: who is to be connected, and who could relay.

    Attributes:
        ego: the receiver.
        sharer: the sender, where it was last known.
        candidates: neighbours that the ego heard within `lost_after` and whose two hops are
            within the range, by ascending id; without the sharer and the ego.
        current: the choice until now, `NO_VEHICLE` for the direct link; None at the first
            choice for this sharer.
    """

    ego: Node
    sharer: Node
    candidates: Mapping[int, Node]
    current: int | None

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
    """A relay, or `NO_VEHICLE` for the direct link, and the NLOS risks where assessed."""

    relay: int = NO_VEHICLE
    risk_direct: float = 0.0
    risk_chosen: float = 0.0


class Policy(abc.ABC):
    """The rule by which one candidate is preferred to another."""

    def remember(self, inputs: Signals, now: Time) -> None:
        """Take in what the ego knows at `now`, at every communication point.

        Args:
            inputs: of the relay component.
            now: [ns].
        """

    @abc.abstractmethod
    def choose(self, situation: Situation, inputs: Signals) -> Choice:
        """The choice for the next window.

        Args:
            situation: who is to be connected; `candidates` may be empty.
            inputs: of the relay component.
        """
