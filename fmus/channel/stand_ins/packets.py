"""Packets from the input and on relays, until their frames are due."""

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Final

from fmus.channel.stand_ins.airtime import LONGEST_FRAME
from fmus.channel.stand_ins.radios import Radios
from fmus.messages.records import NO_VEHICLE
from orchestrator.signal import Array
from orchestrator.timebase import Duration, Time

_LONGEST_DURATION: Final = 2**31 - 1  # of a TRANSMISSION record [ns]


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Frame:
    """One transmission of a packet; ordered by (time, packet, hop).

    Attributes:
        time: handed to the radio, which sends at once [ns].
        packet: its number.
        hop: 0 = sent by the source.
        stops: source, relays and destination in order; the last is `NO_VEHICLE` for broadcast.
        size: MAC service data unit [byte].
        duration: on air [ns]; 0: what size and bit rate make.
        power_offset: over the radios' transmit power [dB].
        kind: see `fmus.messages.records`.
    """

    time: Time
    packet: int
    hop: int = 0
    stops: tuple[int, ...] = field(compare=False)
    size: int = field(compare=False)
    duration: Duration = field(compare=False)
    power_offset: float = field(compare=False)
    access_category: int = field(compare=False)
    kind: int = field(compare=False)

    @property
    def transmitter(self) -> int:
        """The vehicle that sends it."""
        return self.stops[self.hop]

    @property
    def addressee(self) -> int:
        """The vehicle it is for, `NO_VEHICLE` for broadcast."""
        return self.stops[self.hop + 1]

    @property
    def is_last_hop(self) -> bool:
        """Whether no relay passes it on."""
        return self.hop + 2 == len(self.stops)

    def passed_on(self, time: Time) -> "Frame":
        """The next hop, handed to the relay's radio at `time` [ns]."""
        return replace(self, time=time, hop=self.hop + 1)


@dataclass(frozen=True, slots=True)
class WaitingState:
    """What `Waiting` knows."""

    frames: tuple[Frame, ...]
    known: frozenset[int]
    highest: int


class Waiting:
    """Frames that are not due yet, by time.

    A packet that stays in the input over several steps is taken in once; ids are unique in a
    run. A packet whose time lies before the step is sent when the step begins.
    """

    def __init__(self, mac_header: int) -> None:
        self._mac_header = mac_header
        self._frames: list[Frame] = []
        self._known: frozenset[int] = frozenset()
        self._highest = NO_VEHICLE

    def accept(self, packets: Array, radios: Radios, now: Time) -> None:
        """Take in the packets of the input that were not in it before.

        Args:
            packets: `PACKET` records of shape (packet,).
            radios: of the scene at `now`.
            now: start of the step [ns].

        Raises:
            ValueError: a packet is malformed; the message names it.
        """
        self._highest = max(self._highest, radios.highest)
        ids = packets["id"].tolist()
        known, self._known = self._known, frozenset(ids)
        if len(self._known) < len(ids):
            twice = next(number for number in ids if ids.count(number) > 1)
            raise ValueError(f"packets: id {twice} appears twice; ids are unique in a run")
        new = [index for index, number in enumerate(ids) if number not in known]
        for index, frame in zip(new, _frames(packets[new], now), strict=True):
            problem = self._problem(frame, radios)
            if problem:
                raise ValueError(f"packets[{index}]{problem}")
            self.add(frame)

    def add(self, frame: Frame) -> None:
        """Add one frame."""
        heapq.heappush(self._frames, frame)

    def due(self, end: Time) -> Iterator[Frame]:
        """Take the frames whose time lies before `end` [ns], also those added meanwhile."""
        while self._frames and self._frames[0].time < end:
            yield heapq.heappop(self._frames)

    def save(self) -> WaitingState:
        """The state, to be restored any number of times."""
        return WaitingState(tuple(self._frames), self._known, self._highest)

    def restore(self, state: WaitingState) -> None:
        """Return to `state`."""
        self._frames = [*state.frames]
        self._known, self._highest = state.known, state.highest

    def _problem(self, frame: Frame, radios: Radios) -> str:
        """What is wrong with a packet, as the end of a message; empty if nothing is.

        A source that has left is no mistake; one that has never been there is.
        """
        source = frame.stops[0]
        if not 0 <= source <= self._highest:
            return f".source: there is no vehicle {source}"
        if source in radios.silent:
            return f".source: vehicle {source} is not equipped"
        if frame.size + self._mac_header > LONGEST_FRAME:
            return (
                f".size: {frame.size} bytes and {self._mac_header} of headers do not fit into one "
                f"frame of {LONGEST_FRAME} bytes; split the packet"
            )
        return _problem_of_the_way(frame.stops) or _problem_on_air(frame)


def _problem_of_the_way(stops: tuple[int, ...]) -> str:
    if min(stops) < NO_VEHICLE or NO_VEHICLE in stops[:-1]:
        return f": {list(stops)} is no way from a source over relays to a destination"
    if len(set(stops)) < len(stops):
        return f": a vehicle stands twice on the way {list(stops)}"
    return ""


def _problem_on_air(frame: Frame) -> str:
    if not 0 <= frame.duration <= _LONGEST_DURATION:
        return f".duration: {frame.duration} ns is not within 0 and {_LONGEST_DURATION} ns"
    if frame.access_category > 3:
        return f".access_category is {frame.access_category}; it must be 0 to 3"
    if not math.isfinite(frame.power_offset):
        return f".power_offset is {frame.power_offset} dB"
    return ""


def _frames(rows: Array, now: Time) -> Iterator[Frame]:
    """The first hop of each `PACKET` record."""
    for row in rows:
        relays = row["route"].tolist()
        while relays and relays[-1] == NO_VEHICLE:
            relays.pop()
        yield Frame(
            time=max(int(row["time"]), now),
            packet=int(row["id"]),
            stops=(int(row["source"]), *relays, int(row["destination"])),
            size=int(row["size"]),
            duration=int(row["duration"]),
            power_offset=float(row["power_offset"]),
            access_category=int(row["access_category"]),
            kind=int(row["kind"]),
        )
