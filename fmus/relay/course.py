"""The choice in force, and how often it changed."""

import numpy as np

from fmus.messages.records import NO_VEHICLE
from fmus.relay.connectors import OUTPUTS
from fmus.relay.situation import Choice
from orchestrator.signal import Signals


class Course:
    """The choice in force, whom it is for, and how often it changed while fusion was triggered.

    Attributes:
        relay: `NO_VEHICLE` for the direct link.
        sharer: `NO_VEHICLE` while fusion is not triggered.
        outputs: of a relay component.
    """

    def __init__(self) -> None:
        self.relay = NO_VEHICLE
        self.sharer = NO_VEHICLE
        self.outputs: Signals = {name: output.start_value() for name, output in OUTPUTS.items()}
        self._switches = 0

    def is_new(self, sharer: int) -> bool:
        """Whether a choice for `sharer` is the first after a trigger."""
        return sharer != self.sharer

    def pause(self) -> None:
        """Fusion is not triggered; the choice stays, but counts no more as one to keep."""
        self.sharer = NO_VEHICLE

    def take(self, choice: Choice, sharer: int) -> None:
        """Make `choice`; one that differs from the last for the same sharer is a switch."""
        if sharer == self.sharer != NO_VEHICLE and choice.relay != self.relay:
            self._switches += 1
        self.relay, self.sharer = choice.relay, sharer
        self.outputs = {
            "relay": np.array(choice.relay, np.int64),
            "switches": np.array(self._switches, np.int64),
            "risk.direct": np.array(choice.risk_direct),
            "risk.chosen": np.array(choice.risk_chosen),
        }
