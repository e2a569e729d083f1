"""Powers of links as radios measured them and the ego was told."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from orchestrator.signal import Array, Signals


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredLinks:
    """The signals `received.link.*`, looked up by pairs of vehicles.

    Attributes:
        pair: both numbers of each link, ascending by transmitter and then receiver, int64, shape
            (link,).
        measured: received powers [dBm], shape (link,).
    """

    pair: Array
    measured: Array

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The links in the inputs of a relay policy."""
        transmitter = np.asarray(signals["received.link.transmitter"], np.int64)
        receiver = np.asarray(signals["received.link.receiver"], np.int64)
        pair = transmitter << 32 | receiver
        order = np.argsort(pair, kind="stable")
        return cls(pair[order], np.asarray(signals["received.link.power"], np.float64)[order])

    def power(self, transmitter: Array, receiver: Array) -> Array:
        """The power at which each link was received lately.

        Args:
            transmitter: numbers of the vehicles that sent, int64, shape (link,).
            receiver: numbers of those that measured, int64, of a shape that broadcasts.

        Returns:
            Power [dBm], shape (link,); NaN where it is not known.
        """
        wanted = transmitter << 32 | receiver
        if len(self.pair) == 0:
            return np.full(wanted.shape, np.nan)
        row = np.minimum(np.searchsorted(self.pair, wanted), len(self.pair) - 1)
        return np.where(self.pair[row] == wanted, self.measured[row], np.nan)

    def is_reported(self, transmitter: Array) -> Array:
        """Whether anybody reports a power of each transmitter.

        Args:
            transmitter: numbers of vehicles, int64, shape (link,).

        Returns:
            Truth values, shape (link,).
        """
        return np.isin(transmitter, self.pair >> 32)
