"""Messages on the air: packets with their contents, and reassembly at the receiver.

The channel carries packets without contents; the facilities layer keeps the contents of what
was sent until it can no longer arrive, and hands them over when the channel reports that the
packets were received. Nothing that the channel lost is ever handed over.
"""

import math
from dataclasses import dataclass

import numpy as np

from fmus.records import NO_VEHICLE, PACKET, frame
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """What a source sends to a destination.

    Attributes:
        kind: `BSM`, `APM`, `SENSOR_DATA` or `REQUEST` of `fmus.records`.
        time: handed to the radio [ns].
        size: of the message [byte].
        route: relays in order, at most two.
        content: given to whoever receives the whole message.
    """

    kind: int
    time: Time
    source: int
    size: int
    content: object
    destination: int = NO_VEHICLE
    route: tuple[int, ...] = ()
    access_category: int = 3


@dataclass(slots=True)
class _Sent:
    message: Message
    fragments: frozenset[int]
    arrived: dict[int, set[int]]


class Outbox:
    """Numbers packets, remembers contents, and reports messages that arrived whole."""

    def __init__(self, fragment_size: int, lifetime: Duration) -> None:
        self._fragment_size = fragment_size
        self._lifetime = lifetime
        self._next = 0
        self._by_packet: dict[int, _Sent] = {}

    def send(self, messages: list[Message]) -> bytes:
        """The packets of `messages` as a "PKTS" signal, ordered by (time, id).

        A message longer than the fragment size is cut into equal fragments; it arrives
        when all of them have arrived.
        """
        rows: list[tuple[object, ...]] = []
        for message in sorted(messages, key=lambda m: m.time):
            count = max(1, math.ceil(message.size / self._fragment_size))
            numbers = range(self._next, self._next + count)
            self._next += count
            sent = _Sent(message, frozenset(numbers), {})
            hops = (*message.route, NO_VEHICLE, NO_VEHICLE)[:2]
            for index, number in enumerate(numbers):
                size = message.size // count + (index < message.size % count)
                self._by_packet[number] = sent
                rows.append(
                    (
                        number,
                        message.time,
                        message.source,
                        message.destination,
                        hops,
                        0,  # duration: by size and bit rate
                        0.0,  # power offset
                        size,
                        message.access_category,
                        message.kind,
                        0,
                    )
                )
        return frame("PKTS", np.array(rows, PACKET))

    def arrivals(self, receptions: Array) -> list[tuple[Message, int]]:
        """Messages whose last fragment is among `receptions`, with their receivers.

        Args:
            receptions: `RECEPTION` records of fragments received by an addressee of the
                last hop, in order of time.
        """
        complete = []
        for row in receptions:
            sent = self._by_packet.get(int(row["packet"]))
            if sent is None:
                continue
            receiver = int(row["receiver"])
            have = sent.arrived.setdefault(receiver, set())
            have.add(int(row["packet"]))
            if have == sent.fragments:
                complete.append((sent.message, receiver))
        return complete

    def forget(self, now: Time) -> None:
        """Drop contents older than the lifetime: they can no longer arrive."""
        expired = []
        for number, sent in self._by_packet.items():
            if now - sent.message.time <= self._lifetime:
                break  # numbers ascend with time up to one step: the rest is younger
            expired.append(number)
        for number in expired:
            del self._by_packet[number]
