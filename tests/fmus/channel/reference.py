"""What becomes of frames at one receiver, told by looking at every instant: slow and simple.

Free space; the frames' times on air are given. The order of events at the same instant is that
of the channel: ends, own ends, own starts, begins; of equal ones the lower packet number first.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from .harness import LIGHT_SPEED

CARRIER: Final = 5.9e9
EDGES: Final = (-5e6, 0.0, 5e6)
PREAMBLE: Final = 32_000_000  # [ps]
CENTER: Final = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Sending:
    """One frame, or noise."""

    number: int
    source: int
    start: int  # [ns]
    duration: int  # [ns]
    power_dbm: float
    is_noise: bool = False
    channel_offset: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Receiver:
    """What one radio is and does."""

    id: int
    noise_dbm: float
    sensitivity_dbm: float
    capture_margin_db: float = math.inf


@dataclass(slots=True)
class Arrival:
    """A frame at the receiver."""

    sending: Sending
    begin: int  # [ps]
    end: int
    power: tuple[float, ...]  # [mW]; 0 in the bands that it does not share
    verdict: str = ""

    def is_on_air(self, instant: int) -> bool:
        """Whether it is at the receiver then."""
        return self.begin <= instant < self.end


@dataclass(frozen=True, slots=True)
class Fate:
    """D: decoded, or tried to be; else as in OUTCOMES. SNIR only for D and C."""

    letter: str
    end: int  # [ps]
    snir_db: float


def _mw(dbm: float) -> float:
    return float(10 ** (dbm / 10))


def _arrive(sending: Sending, distance: float) -> Arrival:
    delay = int(distance * 1e12 / LIGHT_SPEED + 0.5)
    power = tuple(
        _mw(sending.power_dbm) * (LIGHT_SPEED / (CARRIER + edge) / (4 * math.pi * distance)) ** 2
        * (abs(band - CENTER - sending.channel_offset) <= 1)
        for band, edge in enumerate(EDGES)
    )  # fmt: skip
    begin = sending.start * 1000 + delay
    return Arrival(sending, begin, begin + sending.duration * 1000, power)


def _snir_db(arrival: Arrival, others: Sequence[Arrival], noise: float) -> float:
    """The lowest one over time, preamble not counted, and bands."""
    first = arrival.begin + PREAMBLE
    instants = [first, *(o.begin for o in others if first <= o.begin < arrival.end)]
    return 10 * math.log10(
        min(
            arrival.power[band] / (noise + sum(o.power[band] for o in others if o.is_on_air(t)))
            for band in range(len(EDGES))
            for t in instants
        )
    )


class _Radio:
    """A receiver, event by event."""

    def __init__(self, receiver: Receiver, arrivals: Sequence[Arrival]) -> None:
        self.noise = _mw(receiver.noise_dbm)
        self.sensitivity = _mw(receiver.sensitivity_dbm)
        self.margin = _mw(receiver.capture_margin_db)
        self.arrivals = arrivals
        self.locked: Arrival | None = None
        self.sends_since: int | None = None
        self.fates: dict[int, Fate] = {}

    def others(self, arrival: Arrival) -> list[Arrival]:
        return [a for a in self.arrivals if a is not arrival]

    def start_sending(self, now: int) -> None:
        self.sends_since = now
        if self.locked:
            self.locked.verdict, self.locked = "T", None

    def end_sending(self, _: int) -> None:
        self.sends_since = None

    def begin(self, arrival: Arrival, now: int) -> None:
        rest = sum(a.power[CENTER] for a in self.others(arrival) if a.is_on_air(now))
        if arrival.power[CENTER] < self.sensitivity:
            arrival.verdict = "U"
        elif self.sends_since is not None:
            arrival.verdict = "T"
        elif self.locked is None:
            arrival.verdict, self.locked = "D", arrival
        elif arrival.power[CENTER] >= self.margin * (rest + self.noise):
            self.locked.verdict = "C"
            arrival.verdict, self.locked = "D", arrival
        else:
            arrival.verdict = "B"

    def end(self, arrival: Arrival, now: int) -> None:
        if self.locked is arrival:
            self.locked = None
        letter = arrival.verdict
        if letter != "U" and self.sends_since is not None and self.sends_since < now:
            letter = "T"
        snir = math.nan
        if letter in "DC":
            snir = _snir_db(arrival, self.others(arrival), self.noise)
        self.fates[arrival.sending.number] = Fate(letter, now, snir)


def receive(
    receiver: Receiver, distances: dict[int, float], sendings: Sequence[Sending]
) -> dict[int, Fate]:
    """The fate of each frame at the receiver, by number.

    Args:
        distances: from the receiver to each other vehicle [m].
    """
    arrivals = [_arrive(s, distances[s.source]) for s in sendings if s.source != receiver.id]
    radio = _Radio(receiver, arrivals)
    events: list[tuple[int, int, int, Callable[[int], None]]] = []
    for a in arrivals:
        if not a.sending.is_noise:
            events.append((a.end, 0, a.sending.number, partial(radio.end, a)))
            events.append((a.begin, 3, a.sending.number, partial(radio.begin, a)))
    for s in sendings:
        if s.source == receiver.id and not s.is_noise:
            end = (s.start + s.duration) * 1000
            events.append((end, 1, s.number, radio.end_sending))
            events.append((s.start * 1000, 2, s.number, radio.start_sending))
    for now, _, _, happen in sorted(events, key=lambda event: event[:3]):
        happen(now)
    return radio.fates
