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
_NEVER: Final = np.iinfo(np.int64).min
"""When a link was heard that never was."""
_NOBODY: Final = np.iinfo(np.int64).max
"""The number of each place to spare, behind all radios: a search for any vehicle ends within."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Powers:
    """Powers at which one radio received others.

    Attributes:
        transmitter: ascending, int64 (link,).
        power: filtered [dBm], NaN where nothing was heard, (link,); of several radios
            (receiver, link).
    """

    transmitter: Array = field(default_factory=lambda: np.empty(0, np.int64))
    power: Array = field(default_factory=lambda: np.empty(0))

    def announced(self) -> "Powers":
        """These powers as a message says them: steps of 1 dB from `WEAKEST` to `STRONGEST`."""
        power = np.minimum(np.maximum(np.rint(self.power), WEAKEST), STRONGEST)
        return Powers(transmitter=self.transmitter, power=power)

    def of(self, vehicles: Array) -> Array:
        """The powers at which these vehicles were received.

        Args:
            vehicles: their numbers, int64, shape (vehicle,).

        Returns:
            Powers [dBm], NaN where they are not known, shape (vehicle,).
        """
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
        """The connectors `received.link.*`: what the ego measured itself comes first.

        Args:
            ego: number of the ego vehicle.
            own: what it measures.

        Returns:
            By name, arrays with the shape and unit that the connector declares.
        """
        measured = np.full(len(own.power), ego, np.int64)
        return {
            "received.link.transmitter": np.concatenate([own.transmitter, self.transmitter]),
            "received.link.receiver": np.concatenate([measured, self.receiver]),
            "received.link.power": np.concatenate([own.power, self.power]),
        }


_NO_LINKS: Final = Links(
    transmitter=np.empty(0, np.int64), receiver=np.empty(0, np.int64), power=np.empty(0)
)


class Measurements:
    r"""The filtered power of every link that was heard lately.

    $$ F_n = (1 - a) F_{n-1} + a M_n, \quad a = 2^{-k/4} $$

    (3GPP TS 38.331, clause 5.5.3.2), in dBm, one sample per received message; the first is
    taken as it is. The radios that were heard of lately make up a table of all pairs.

    Args:
        filter_coefficient: k.
        lifetime: a link that was not heard for longer starts anew [ns].
    """

    def __init__(self, filter_coefficient: int, lifetime: Duration) -> None:
        # correctly rounded roots: the same bits on every platform, which a power need not be
        self._weight = math.sqrt(math.sqrt(math.ldexp(1.0, -filter_coefficient)))
        self._lifetime = lifetime
        self._oldest: Time = _NEVER + 1
        self._count = 0  # of the radios in the table; places to spare are nobody's
        self._radios: Array = np.array([_NOBODY])
        self._time: Array = np.full((1, 1), _NEVER)  # (receiver, transmitter)
        self._power: Array = np.full((1, 1), np.nan)
        self._first: Array = np.empty(1, np.intp)  # scratch, a place for each link

    def meet(self, radios: Array) -> None:
        """Expect to hear of these radios, int64, shape (radio,); spares making room one by one."""
        if (self._radios[self._radios.searchsorted(radios)] != radios).any():
            self._meet(radios)

    def measure(self, received: Array) -> None:
        """Take in messages that were received; those without a power measure nothing.

        Args:
            received: `RECEPTION` records by time, shape (reception,).
        """
        known = ~np.isnan(received["power_dbm"])
        if not known.all():
            received = received.compress(known)
        link = self._links(np.array([received["receiver"], received["transmitter"]]))
        time, power = received["time"], received["power_dbm"]
        while not (first := self._first_of_each(link)).all():  # a radio sent two messages
            self._update(link[first], time[first], power[first])
            link, time, power = link[~first], time[~first], power[~first]
        self._update(link, time, power)

    def forget(self, now: Time) -> None:
        """Drop links that were not heard lately."""
        self._oldest = now - self._lifetime

    def by(self, receiver: int) -> Powers:
        """What one radio measures of all that it hears."""
        row = self._radios.searchsorted(receiver)
        if self._radios[row] != receiver:
            return Powers()
        heard = self._time[row] >= self._oldest
        return Powers(transmitter=self._radios[heard], power=self._power[row][heard])

    def table(self, receivers: Array) -> Powers:
        """What several radios measure: `power` is of shape (receiver, link).

        Args:
            receivers: numbers of their vehicles, int64, shape (receiver,).
        """
        row = self._radios.searchsorted(receivers)
        power = self._power[row, : self._count]
        power[self._time[row, : self._count] < self._oldest] = np.nan
        power[self._radios[row] != receivers] = np.nan
        return Powers(transmitter=self._radios[: self._count], power=power)

    def _links(self, ends: Array) -> Array:
        """The places in the table, row by row, of links (receiver and transmitter, link)."""
        row, column = place = self._radios.searchsorted(ends)
        if (self._radios[place] != ends).any():
            self._meet(ends)
            row, column = self._radios.searchsorted(ends)
        return np.asarray(row * len(self._radios) + column)

    def _meet(self, others: Array) -> None:
        """Make room for the radios `others`."""
        fresh = np.setdiff1d(others, self._radios)
        end = self._count + len(fresh)
        if end < len(self._radios) and fresh[0] > self._radios[self._count - 1]:
            self._radios[self._count : end] = fresh  # newer vehicles have higher numbers
            self._count = end
        else:
            self._make_room(others)

    def _make_room(self, others: Array) -> None:
        """A table for the radios `others` and those heard of lately, with places to spare."""
        heard = self._time >= self._oldest
        (kept,) = np.nonzero(heard.any(axis=0) | heard.any(axis=1))
        known = self._radios[kept]
        radios = np.union1d(known, others)
        side = len(radios) + len(radios) // 4 + 1
        to, of = np.ix_(*[radios.searchsorted(known)] * 2), np.ix_(kept, kept)
        time, power = np.full((side, side), _NEVER), np.full((side, side), np.nan)
        time[to], power[to] = self._time[of], self._power[of]
        self._count = len(radios)
        self._radios = np.concatenate([radios, np.full(side - len(radios), _NOBODY)])
        self._time, self._power = time, power
        self._first = np.empty(time.size, np.intp)

    def _first_of_each(self, link: Array) -> Array:
        """Whether each sample is the first of its link, bool (sample,)."""
        number = np.arange(len(link))
        self._first[link[::-1]] = number[::-1]  # where places repeat, the last one written stays
        return np.asarray(self._first[link] == number)

    def _update(self, link: Array, time: Array, power: Array) -> None:
        """One sample per link."""
        times, powers = self._time.reshape(-1), self._power.reshape(-1)  # views
        old = powers[link]
        filtered = old + self._weight * (power - old)
        powers[link] = np.where(times[link] >= self._oldest, filtered, power)
        times[link] = time


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
        """What is known of links by announcements, in the order of their transmitters.

        Args:
            now: the communication point [ns].
            transmitters: numbers of their vehicles, int64, shape (transmitter,).
        """
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
        if len(self._transmitters) == 0:
            return _NO_LINKS
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
