"""Powers of links as radios measured them and the ego was told."""

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from fmus.messages.connectors import arrays_beneath
from orchestrator.signal import Array, Signals


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredLinks:
    """The signals `received.link.*`, looked up by pairs of vehicles.

    Attributes:
        transmitter: numbers of the vehicles that sent, int64, shape (link,).
        receiver: numbers of those that measured, int64, shape (link,).
        measured: received powers [dBm], shape (link,).
    """

    transmitter: Array
    receiver: Array
    measured: Array

    @classmethod
    def read(cls, signals: Signals) -> Self:
        """The links in the inputs of a relay policy."""
        found = arrays_beneath(signals, "received.link")
        return cls(measured=found.pop("power"), **found)

    @cached_property
    def _table(self) -> tuple[Array, Array]:
        """Both numbers of each link in one, ascending, and the powers in that order."""
        pair = self.transmitter << 32 | self.receiver
        order = np.argsort(pair, kind="stable")
        return pair[order], self.measured[order]

    def power(self, transmitter: Array, receiver: Array) -> Array:
        """The power at which each link was received lately.

        Args:
            transmitter: numbers of the vehicles that sent, int64, shape (link,).
            receiver: numbers of those that measured, int64, of a shape that broadcasts.

        Returns:
            Power [dBm], shape (link,); NaN where it is not known.
        """
        wanted = transmitter << 32 | receiver
        pair, measured = self._table
        if len(pair) == 0:
            return np.full(wanted.shape, np.nan)
        row = np.minimum(np.searchsorted(pair, wanted), len(pair) - 1)
        return np.where(pair[row] == wanted, measured[row], np.nan)

    def is_reported(self, transmitter: Array) -> Array:
        """Whether anybody reports a power of each transmitter.

        Args:
            transmitter: numbers of vehicles, int64, shape (link,).

        Returns:
            Truth values, shape (link,).
        """
        return np.isin(transmitter, self.transmitter)
