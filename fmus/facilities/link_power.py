"""Received powers: what every radio measures of its neighbours' BSMs, and announces in its own.

A measurement is filtered as in layer 3 of 3GPP TS 38.331, clause 5.5.3.2. An announcement has
one entry for each neighbour heard lately, in the resolution of RSRP reports.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

STRONGEST: Final = -31.0
"""Largest power that an announcement can say [dBm]: the reporting range of SS-RSRP, TS 38.133."""
WEAKEST: Final = -156.0
"""Smallest power that an announcement can say [dBm]: the same range."""
_ID_BITS: Final = 32
"""Vehicle numbers are below 2^31, so that a pair of them is one int64."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Powers:
    """Powers at which one radio received others.

    Attributes:
        transmitter: ascending, int64 (link,).
        power: filtered [dBm], (link,).
    """

    transmitter: Array = field(default_factory=lambda: np.empty(0, np.int64))
    power: Array = field(default_factory=lambda: np.empty(0))

    def announced(self) -> "Powers":
        """These powers as a message says them: steps of 1 dB from `WEAKEST` to `STRONGEST`."""
        power = np.minimum(np.maximum(np.rint(self.power), WEAKEST), STRONGEST)
        return Powers(transmitter=self.transmitter, power=power)

    def of(self, vehicles: Array) -> Array:
        """The power of each of `vehicles` [dBm], NaN where it is not known."""
        if len(self.transmitter) == 0:
            return np.full(len(vehicles), np.nan)
        row = np.minimum(self.transmitter.searchsorted(vehicles), len(self.transmitter) - 1)
        return np.where(self.transmitter[row] == vehicles, self.power[row], np.nan)


@dataclass(frozen=True, slots=True, kw_only=True)
class Links:
    """Links of which the ego knows the power; all arrays of shape (measured_link,).

    Attributes:
        transmitter: int64.
        receiver: who measured, int64.
        power: filtered [dBm].
    """

    transmitter: Array
    receiver: Array
    power: Array

    def outputs(self, ego: int, own: Powers) -> Mapping[str, Array]:
        """The connectors `received.link.*`: what the ego measured itself comes first."""
        measured = np.full(len(own.power), ego, np.int64)
        return {
            "received.link.transmitter": np.concatenate([own.transmitter, self.transmitter]),
            "received.link.receiver": np.concatenate([measured, self.receiver]),
            "received.link.power": np.concatenate([own.power, self.power]),
        }


class Measurements:
    r"""The filtered power of every link that was heard lately.

    $$ F_n = (1 - a) F_{n-1} + a M_n, \quad a = 2^{-k/4} $$

    (3GPP TS 38.331, clause 5.5.3.2), in dBm, one sample per received message; the first is
    taken as it is.

    Args:
        filter_coefficient: k.
        lifetime: a link that was not heard for longer starts anew [ns].
    """

    def __init__(self, filter_coefficient: int, lifetime: Duration) -> None:
        # correctly rounded roots: the same bits on every platform, which a power need not be
        self._weight = math.sqrt(math.sqrt(math.ldexp(1.0, -filter_coefficient)))
        self._lifetime = lifetime
        self._link: Array = np.empty(0, np.int64)
        self._time: Array = np.empty(0, np.int64)
        self._power: Array = np.empty(0)

    def measure(self, received: Array) -> None:
        """Take in `RECEPTION` records, by time; those without a power measure nothing."""
        known = ~np.isnan(received["power_dbm"])
        link = _link(received["receiver"], received["transmitter"])[known]
        order = link.argsort(kind="stable")
        link, time = link[order], received["time"][known][order]
        power = received["power_dbm"][known][order]
        while len(link):  # once, unless a radio sent two messages
            first = np.append([True], link[1:] != link[:-1])
            self._update(link[first], time[first], power[first])
            link, time, power = link[~first], time[~first], power[~first]

    def forget(self, now: Time) -> None:
        """Drop links that were not heard lately."""
        fresh = self._time >= now - self._lifetime
        if not fresh.all():
            self._link, self._time = self._link[fresh], self._time[fresh]
            self._power = self._power[fresh]

    def by(self, receiver: int) -> Powers:
        """What one radio measures of all that it hears."""
        begin = self._link.searchsorted(receiver << _ID_BITS)
        end = self._link.searchsorted((receiver + 1) << _ID_BITS)
        transmitter = self._link[begin:end] & ((1 << _ID_BITS) - 1)
        return Powers(transmitter=transmitter, power=self._power[begin:end].copy())

    def _update(self, link: Array, time: Array, power: Array) -> None:
        """One sample per link; `link` ascending."""
        row = self._link.searchsorted(link)
        known = np.append(self._link, -1)[row] == link
        old = row[known]
        self._time[old] = time[known]
        self._power[old] += self._weight * (power[known] - self._power[old])
        if not known.all():
            new = row[~known]
            self._link = np.insert(self._link, new, link[~known])
            self._time = np.insert(self._time, new, time[~known])
            self._power = np.insert(self._power, new, power[~known])


class Announcements:
    """The last announcement that the ego received of each neighbour, while it is fresh.

    Args:
        lifetime: age at which an announcement is forgotten [ns].
    """

    def __init__(self, lifetime: Duration) -> None:
        self._lifetime = lifetime
        self._last: dict[int, tuple[Time, Powers]] = {}
        self._transmitters: Array = np.empty(0, np.int64)
        self._rows: dict[int, Array] = {}
        self._links: Links | None = None

    def receive(self, source: int, time: Time, powers: Powers) -> None:
        """`powers` were sent at `time` [ns]; older ones than known change nothing."""
        if source not in self._last or self._last[source][0] < time:
            self._last[source] = (time, powers)
            self._rows.pop(source, None)
            self._links = None

    def links(self, now: Time, transmitters: Array) -> Links:
        """What is known at `now` of the links from `transmitters`, in this order."""
        oldest = now - self._lifetime
        for vehicle in [v for v, (time, _) in self._last.items() if time < oldest]:
            del self._last[vehicle]
            self._rows.pop(vehicle, None)
            self._links = None
        if not np.array_equal(transmitters, self._transmitters):
            self._transmitters, self._rows = transmitters, {}
            self._links = None
        if self._links is None:
            self._links = self._told()
        return self._links

    def _told(self) -> Links:
        for vehicle, (_, powers) in self._last.items():
            if vehicle not in self._rows:
                self._rows[vehicle] = powers.of(self._transmitters)
        receivers = sorted(self._last)
        table = np.array([self._rows[vehicle] for vehicle in receivers], np.float64)
        table = table.reshape(len(receivers), len(self._transmitters)).T
        link, receiver = np.nonzero(~np.isnan(table))
        return Links(
            transmitter=self._transmitters[link],
            receiver=np.array(receivers, np.int64)[receiver],
            power=table[link, receiver],
        )


def _link(receiver: Array, transmitter: Array) -> Array:
    """A number for each pair, by receiver and then transmitter."""
    return (receiver.astype(np.int64) << _ID_BITS) | transmitter
