"""Powers of links as radios measured them and the ego was told."""

from dataclasses import dataclass

import numpy as np

from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True)
class MeasuredLinks:
    """The connectors `received.link.*`, looked up by pairs of vehicles.

    Attributes:
        pair: both numbers of each link, ascending by transmitter and then receiver.
        measured: [dBm].
    """

    pair: Array
    measured: Array

    @classmethod
    def of(cls, inputs: Signals) -> "MeasuredLinks":
        """The links that the ego knows."""
        transmitter = np.asarray(inputs["received.link.transmitter"])
        receiver = np.asarray(inputs["received.link.receiver"])
        pair = transmitter.astype(np.int64) << 32 | receiver
        order = np.argsort(pair, kind="stable")
        return cls(pair[order], np.asarray(inputs["received.link.power"])[order])

    def power(self, transmitter: Array, receiver: Array) -> Array:
        """Power of each link [dBm], NaN where it is not known; all arrays (link,)."""
        wanted = transmitter << 32 | receiver
        if len(self.pair) == 0:
            return np.full(wanted.shape, np.nan)
        row = np.minimum(np.searchsorted(self.pair, wanted), len(self.pair) - 1)
        return np.where(self.pair[row] == wanted, self.measured[row], np.nan)

    def is_reported(self, transmitter: Array) -> Array:
        """Whether anybody reports a power of each transmitter, bool (link,)."""
        return np.isin(transmitter, self.pair >> 32)
