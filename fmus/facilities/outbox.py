"""Messages on the air: packets with their contents, and reassembly at the receiver.

The channel carries packets without contents; the facilities layer keeps the contents of what
was sent until it can no longer arrive, and hands them over when the channel reports that the
packets were received. Nothing that the channel lost is ever handed over.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Broadcasts:
    """Messages of one kind to everybody, in arrays of shape (message,).

    Attributes:
        kind: `BSM`, `APM`, `SENSOR_DATA` or `REQUEST` of `fmus.records`.
        time: handed to the radio [ns].
        source: int64.
        size: of each message [byte].
        content: what message `k` says, made when it is asked for.
    """

    kind: int
    time: Array
    source: Array
    size: Array
    content: Callable[[int], object]
    access_category: int = 3

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, k: int) -> Message:
        return Message(
            kind=self.kind,
            time=int(self.time[k]),
            source=int(self.source[k]),
            size=int(self.size[k]),
            content=self.content(k),
            access_category=self.access_category,
        )

    def headers(self) -> Array:
        """A `PACKET` record for each message, as if it were sent in one piece; without an id."""
        headers = np.zeros(len(self), PACKET)
        headers["time"], headers["source"], headers["size"] = self.time, self.source, self.size
        headers["destination"], headers["route"] = NO_VEHICLE, NO_VEHICLE
        headers["access_category"], headers["kind"] = self.access_category, self.kind
        return headers


@dataclass(slots=True)
class _Sent:
    """Message `k` of `messages` in `count` packets, and which of them reached each receiver."""

    messages: Sequence[Message] | Broadcasts
    k: int
    time: Time
    count: int
    arrived: dict[int, set[int]] = field(default_factory=dict)

    @property
    def message(self) -> Message:
        """Made when it is asked for: most reach nobody who wants them."""
        return self.messages[self.k]


class Outbox:
    """Numbers packets, remembers contents, and reports messages that arrived whole."""

    def __init__(self, fragment_size: int, lifetime: Duration) -> None:
        self._fragment_size = fragment_size
        self._lifetime = lifetime
        self._oldest = 0
        self._next = 0
        self._by_packet: dict[int, _Sent] = {}

    def send(self, messages: Sequence[Message], broadcasts: Sequence[Broadcasts] = ()) -> bytes:
        """The packets of all messages as a "PKTS" signal, ordered by (time, id).

        A message longer than the fragment size is cut into equal fragments; it arrives
        when all of them have arrived. Of those handed over at the same time, broadcasts come first.
        """
        headers = [each.headers() for each in broadcasts]
        if messages or not headers:
            headers.append(_headers(messages))
        whole = np.concatenate(headers) if len(headers) > 1 else headers[0]
        order = whole["time"].argsort(kind="stable")
        whole = whole.take(order)
        size = np.maximum(whole["size"].astype(np.int64), 1)
        count = -(-size // self._fragment_size)
        sources: list[Sequence[Message] | Broadcasts] = [*broadcasts, messages]
        given = [(each, k) for each in sources for k in range(len(each))]
        given = [given[place] for place in order.tolist()]
        times, counts = whole["time"].tolist(), count.tolist()
        sent = [
            _Sent(source, k, time, pieces)
            for (source, k), time, pieces in zip(given, times, counts, strict=True)
        ]
        if len(sent) < count.sum():
            whole, sent = _cut(whole, count), [each for each in sent for _ in range(each.count)]
        whole["id"] = numbers = np.arange(self._next, self._next + len(sent))
        self._by_packet.update(zip(numbers.tolist(), sent, strict=True))
        self._next += len(sent)
        return frame("PKTS", whole)

    def arrivals(self, receptions: Array) -> list[tuple[Message, int]]:
        """Messages whose last fragment is among `receptions`, with their receivers.

        Args:
            receptions: `RECEPTION` records of fragments received by an addressee of the
                last hop, in order of time.
        """
        complete = []
        packets, receivers = receptions["packet"].tolist(), receptions["receiver"].tolist()
        for packet, receiver in zip(packets, receivers, strict=True):
            sent = self._by_packet.get(packet)
            if sent is None:
                continue
            have = sent.arrived.setdefault(receiver, set())
            have.add(packet)
            if len(have) == sent.count:
                complete.append((sent.message, receiver))
        return complete

    def forget(self, now: Time) -> None:
        """Drop contents older than the lifetime: they can no longer arrive.

        Numbers ascend with time up to one step: what follows one that is young is younger.
        """
        while (sent := self._by_packet.get(self._oldest)) and now - sent.time > self._lifetime:
            del self._by_packet[self._oldest]
            self._oldest += 1


def _cut(messages: Array, count: Array) -> Array:
    """The packets of messages that are cut into so many fragments each."""
    packets = messages.repeat(count)
    pieces = count.repeat(count)
    fragment = np.arange(len(packets)) - (np.cumsum(count) - count).repeat(count)
    packets["size"] = packets["size"] // pieces + (fragment < packets["size"] % pieces)
    return packets


def _headers(messages: Sequence[Message]) -> Array:
    """As `Broadcasts.headers`."""
    rows = [
        (
            0,  # no id yet
            message.time,
            message.source,
            message.destination,
            (*message.route, NO_VEHICLE, NO_VEHICLE)[:2],
            0,  # duration: by size and bit rate
            0.0,  # power offset
            message.size,
            message.access_category,
            message.kind,
            0,
        )
        for message in messages
    ]
    return np.array(rows, PACKET)
