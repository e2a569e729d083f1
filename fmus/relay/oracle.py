"""The best relay in hindsight: what any policy could at most have gained by a choice."""

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np
from typing_extensions import override

from fmus.messages.records import NO_VEHICLE
from fmus.relay.inputs import Inputs
from fmus.relay.offers import Offers
from fmus.relay.selection import SelectionParameters, situation
from fmus.relay.situation import Choice
from fmus.relay.unit import RelayUnit
from fmus.relay.whereabouts import Whereabouts
from orchestrator.component import DecidingComponent, Decision
from orchestrator.errors import CosimError
from orchestrator.parameters import parameter
from orchestrator.signal import Signals
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Duration, Time, nanoseconds, seconds

LAG: Final[Duration] = 200_000_000
"""From a choice to its first packet of sensor data, at most [ns]: 100 ms until the ego's next
request, which names the relay, and 100 ms until the sharer's next scan, as by default."""


class Oracle(RelayUnit, DecidingComponent):
    """The relay, or the direct link, over which most sensor data reach the ego; it is tried out.

    It decides when fusion is triggered and after each window, among the same candidates as the
    other policies and the direct link. Each is tried in a copy of the whole simulation; the one
    with most packets at the ego at the horizon is taken. Ties keep the current choice, then
    prefer the direct link, then the relay whose longer hop is shorter. It is the best for each
    window given the windows before, not the best sequence. A relay that falls silent is no
    reason to choose again: that it will was known.

    With `draws` it is fair: it knows the world to come, bodies, movements and load, but not what
    radios will draw. Each alternative is then tried with random numbers drawn anew, the same for
    all of them, and the run itself goes on with its own.

    The horizon is by default a window and `LAG` after the choice: so much later a choice takes
    effect, and so much longer it stays in effect. Until then all alternatives fare alike.
    """

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters(SelectionParameters):
        """How far it sees, and what bounds the search."""

        horizon: float | None = parameter(
            None,
            unit="s",
            minimum=0.001,
            doc="after which outcomes are compared; without, the window and 200 ms",
        )
        rate: float = parameter(
            10.0,
            unit="Hz",
            minimum=0.0,
            doc="packets of sensor data sent to the ego per second at most; an alternative that "
            "cannot catch up at this rate is given up early. 0: none is",
        )
        draws: int = parameter(
            0,
            minimum=0,
            doc="0: it knows the random draws to come; else it knows the world only, tries the "
            "best alternatives with so many other draws, and takes the best mean",
        )
        alternatives: int = parameter(
            0,
            minimum=0,
            doc="how many are tried at most: the current choice, the direct link, then relays by "
            "their longer hop, the shortest first. 0: all",
        )

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._window = nanoseconds(parameters.window)
        given = parameters.horizon
        self._horizon = self._window + LAG if given is None else nanoseconds(given)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        super().setup(start, rng)
        self._whereabouts = Whereabouts()
        self._offers = Offers(self._parameters.offering, rng)
        self._next_choice = start
        self._open: _Choices | None = None
        self._supply = _Supply(self._parameters.rate, start, 0)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._open is not None:
            raise CosimError("its decision was never taken; only `simulate` can run an oracle")
        now, known = t + h, Inputs.read(inputs)
        self._whereabouts.update(known, now)
        self._supply.update(known.sensor_data_count, now, h)
        sharer = known.wanted_sharer
        if sharer == NO_VEHICLE:
            self._course.pause()
        elif self._course.is_new(sharer) or now >= self._next_choice:
            self._open = _Choices(self._alternatives(known, sharer, now), sharer, now)
            self._next_choice = now + self._window
            self._supply = self._supply.afresh()

    @property
    @override
    def decision(self) -> Decision | None:
        if self._open is None:
            return None
        names = ("direct" if r == NO_VEHICLE else f"vehicle {r}" for r in self._open.relays)
        return Decision(
            alternatives=tuple(names),
            horizon=self._open.time + self._horizon,
            draws=self._parameters.draws,
        )

    @override
    def decide(self, alternative: int) -> None:
        taken, self._open = self._open, None
        if taken is not None:
            self._course.take(Choice(relay=taken.relays[alternative]), taken.sharer)

    @override
    def score(self) -> float:
        return self._supply.count

    @override
    def score_bound(self, horizon: Time) -> float:
        return self._supply.bound(horizon)

    def _alternatives(self, known: Inputs, sharer: int, now: Time) -> tuple[int, ...]:
        current = None if self._course.is_new(sharer) else self._course.relay
        where = self._whereabouts.of(sharer, now)
        found = situation(known, where, current, self._parameters, self._offers)
        if found is None:
            return (NO_VEHICLE,)
        ordered = sorted((NO_VEHICLE, *found.candidates), key=found.tie_break)
        return tuple(ordered[: self._parameters.alternatives or None])


@dataclass(frozen=True, slots=True)
class _Choices:
    """An open decision: between these relays, for this sharer, since this time."""

    relays: tuple[int, ...]
    sharer: int
    time: Time


class _Supply:
    """The packets of sensor data that reached the ego, and how many more can until a horizon.

    Each may arrive up to one step later than it would at a steady rate.

    Args:
        rate: how many are sent per second at most; 0 for "unknown".
        start: [ns].
        before: how many there were at `start`.

    Attributes:
        count: how many there are now.
    """

    def __init__(self, rate: float, start: Time, before: int) -> None:
        self.count = before
        self._rate = rate
        self._start = start
        self._before = before
        self._now = start
        self._latest: Duration = 0

    def afresh(self) -> "_Supply":
        """A supply at this rate that starts now, with what there is now."""
        return _Supply(self._rate, self._now, self.count)

    def update(self, count: int, now: Time, h: Duration) -> None:
        """There were `count` packets at `now`, one step of `h` after the last update.

        Raises:
            CosimError: there were more than `rate` allows, so nothing could be excluded.
        """
        self.count, self._now, self._latest = count, now, h
        new = count - self._before
        if self._rate > 0.0 and new > self._most(now - self._start + h):
            raise CosimError(
                f"{new} packets of sensor data reached the ego within "
                f"{seconds(now - self._start):g} s, which the parameter `rate` "
                f"({self._rate:g} Hz) excludes; set it to what sharers send, or to 0 Hz"
            )

    def bound(self, horizon: Time) -> float:
        """How many there can be at `horizon` at most."""
        if self._rate == 0.0:
            return math.inf
        in_all = self._before + self._most(horizon - self._start)
        return min(in_all, self.count + self._most(horizon - self._now + self._latest))

    def _most(self, span: Duration) -> int:
        """What can be sent in `span` [ns]; exact, so that 22 is not 23 by a rounding error."""
        return math.ceil(Fraction(str(self._rate)) * span / NANOSECONDS_PER_SECOND)
