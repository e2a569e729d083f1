"""Messages on the air: packets with their contents, and reassembly at the receiver.

The channel carries packets without contents; the facilities layer keeps the contents of what
was sent until it can no longer arrive, and hands them over when the channel reports that the
packets were received. Nothing that the channel lost is ever handed over.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from fmus.facilities.granularity import ALL_PACKETS, Granularity
from fmus.messages.records import NO_VEHICLE, PACKET, frame
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """What a source sends to a destination.

    Attributes:
        kind: `BSM`, `APM`, `SENSOR_DATA` or `REQUEST` of `fmus.messages.records`.
        time: handed to the radio [ns].
        size: of the message [byte].
        route: relays in order, at most two.
        content: given to whoever receives the message, or some of it.
        granularity: what of it is of use when packets are lost; `size` is a multiple of its grain.
    """

    kind: int
    time: Time
    source: int
    size: int
    content: object
    destination: int = NO_VEHICLE
    route: tuple[int, ...] = ()
    access_category: int = 3
    granularity: Granularity = ALL_PACKETS


@dataclass(frozen=True, slots=True)
class Arrival:
    """What a receiver has of a message.

    Attributes:
        message: as it was sent.
        receiver: a vehicle.
        count: packets of the message.
        usable: which of its packets 0 to `count - 1` count as arrived; at least one.
    """

    message: Message
    receiver: int
    count: int
    usable: Collection[int]

    @property
    def is_whole(self) -> bool:
        """Whether nothing is missing."""
        return len(self.usable) == self.count

    def grains(self) -> Array:
        """Which grains of the message are there; bool, shape (grain,)."""
        total = self.message.size // self.message.granularity.grain
        usable = np.zeros(self.count, np.bool_)
        usable[list(self.usable)] = True
        return usable.repeat(_shares(np.arange(self.count), total, self.count))


@dataclass(frozen=True, slots=True, kw_only=True)
class Broadcasts:
    """Messages of one kind to everybody, in arrays of shape (message,).

    Attributes:
        kind: `BSM`, `APM`, `SENSOR_DATA` or `REQUEST` of `fmus.messages.records`.
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
        """The packets if each message were sent in one piece; without ids.

        Returns:
            `PACKET` records of shape (message,).
        """
        headers = np.zeros(len(self), PACKET)
        headers["time"], headers["source"], headers["size"] = self.time, self.source, self.size
        headers["destination"], headers["route"] = NO_VEHICLE, NO_VEHICLE
        headers["access_category"], headers["kind"] = self.access_category, self.kind
        return headers


@dataclass(slots=True)
class _Fragments:
    """The number of the first packet of several, and which of them reached each receiver."""

    first: int
    arrived: dict[int, set[int]] = field(default_factory=dict)


@dataclass(slots=True, eq=False)
class _Sent:
    """Message `k` of `messages` in `count` packets; `fragments` if there are several."""

    messages: Sequence[Message] | Broadcasts
    k: int
    time: Time
    count: int
    fragments: _Fragments | None = None

    @property
    def message(self) -> Message:
        """Made when it is asked for: most reach nobody who wants them."""
        return self.messages[self.k]


class Outbox:
    """Numbers packets, remembers contents, and reports what arrived."""

    def __init__(self, fragment_size: int, lifetime: Duration) -> None:
        self._fragment_size = fragment_size
        self._lifetime = lifetime
        self._oldest = 0
        self._next = 0
        self._by_packet: dict[int, _Sent] = {}

    def send(self, messages: Sequence[Message], broadcasts: Sequence[Broadcasts] = ()) -> bytes:
        """The packets of all messages as a "PKTS" signal, ordered by (time, id).

        A message longer than the fragment size is cut into fragments that are as equal as their
        grains allow; a grain that is longer by itself is not cut. Of messages handed over at the
        same time, broadcasts come first.
        """
        headers = [each.headers() for each in broadcasts]
        if messages or not headers:
            headers.append(_headers(messages))
        whole = np.concatenate(headers) if len(headers) > 1 else headers[0]
        order = whole["time"].argsort(kind="stable")
        grain = _grains(messages, order) if messages else _BYTE
        whole = whole.take(order)
        size = np.maximum(whole["size"], 1, dtype=np.int64)
        count = -(-size // self._longest(grain))
        sources: list[Sequence[Message] | Broadcasts] = [*broadcasts, messages]
        given = [(each, k) for each in sources for k in range(len(each))]
        ordered = map(given.__getitem__, order.tolist())
        times, counts = whole["time"].tolist(), count.tolist()
        sent = [
            _Sent(source, k, time, pieces)
            for (source, k), time, pieces in zip(ordered, times, counts, strict=True)
        ]
        if len(sent) < sum(counts):
            firsts = (self._next + np.cumsum(count) - count).tolist()
            for each, first in zip(sent, firsts, strict=True):
                each.fragments = _Fragments(first) if each.count > 1 else None
            whole = _cut(whole, count, grain)
            sent = [each for each in sent for _ in range(each.count)]
        whole["id"] = numbers = np.arange(self._next, self._next + len(sent))
        self._by_packet.update(zip(numbers.tolist(), sent, strict=True))
        self._next += len(sent)
        return frame("PKTS", whole)

    def arrivals(self, receptions: Array) -> list[Arrival]:
        """What the receivers of `receptions` have now that they did not have before.

        Args:
            receptions: `RECEPTION` records of fragments received by an addressee of the
                last hop, in order of time, shape (reception,).

        Returns:
            First the messages that are whole, in the order in which they became so; then, once
            for each receiver, the others of which something is of use.
        """
        whole: list[Arrival] = []
        parts: dict[tuple[_Sent, int], set[int]] = {}
        packets, receivers = receptions["packet"].tolist(), receptions["receiver"].tolist()
        for packet, receiver in zip(packets, receivers, strict=True):
            sent = self._by_packet.get(packet)
            if sent is None:
                continue
            if sent.fragments is not None:
                have = sent.fragments.arrived.setdefault(receiver, set())
                have.add(packet - sent.fragments.first)
                if len(have) < sent.count:
                    parts[sent, receiver] = have
                    continue
            whole.append(Arrival(sent.message, receiver, sent.count, range(sent.count)))
        return whole + _usable(parts) if parts else whole

    def is_for(self, packet: int, receiver: int) -> bool:
        """Whether `receiver` is to have a packet, and not to pass it on.

        One that is too old to be remembered is for whoever received it.
        """
        sent = self._by_packet.get(packet)
        return sent is None or sent.message.destination in {receiver, NO_VEHICLE}

    def _longest(self, grain: Array) -> Array | int:
        """Bytes of the longest packet: as many grains as fit, and at least one."""
        if grain is _BYTE:
            return self._fragment_size
        longest: Array = np.maximum(self._fragment_size // grain, 1) * grain
        return longest

    def forget(self, now: Time) -> None:
        """Drop contents older than the lifetime: they can no longer arrive.

        Numbers ascend with time up to one step: what follows one that is young is younger.
        """
        while (sent := self._by_packet.get(self._oldest)) and now - sent.time > self._lifetime:
            del self._by_packet[self._oldest]
            self._oldest += 1


_BYTE: Final = np.ones((), np.int64)
"""The grain of all messages, where none has another one."""


def _usable(parts: Mapping[tuple[_Sent, int], set[int]]) -> list[Arrival]:
    """What is of use of messages that may be incomplete, for each receiver."""
    found = []
    for (sent, receiver), have in parts.items():
        if len(have) < sent.count:
            message = sent.message
            if usable := message.granularity.usable(have, sent.count):
                found.append(Arrival(message, receiver, sent.count, frozenset(usable)))
    return found


def _grains(messages: Sequence[Message], order: Array) -> Array:
    """The grains of all messages in their order [byte], int64; these were the last without it."""
    given = [message.granularity.grain for message in messages]
    if given.count(1) == len(given):
        return _BYTE
    grains = np.ones(len(order), np.int64)
    grains[len(order) - len(messages) :] = given
    return grains.take(order)


def _shares(packet: Array, total: Array | int, count: Array | int) -> Array:
    """How many of `total` grains packet `packet` of `count` carries; the first ones one more."""
    return total // count + (packet < total % count)


def _cut(messages: Array, count: Array, grain: Array) -> Array:
    """The packets of messages that are cut into so many fragments each."""
    packets = messages.repeat(count)
    grains = grain.repeat(count) if grain.ndim else grain
    fragment = np.arange(len(packets)) - (np.cumsum(count) - count).repeat(count)
    packets["size"] = grains * _shares(fragment, packets["size"] // grains, count.repeat(count))
    return packets


def _headers(messages: Sequence[Message]) -> Array:
    """`PACKET` records of these messages, as `Broadcasts.headers` makes them."""
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
