"""How long it takes from when a road user is first hidden until an observer knows of it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.messages.records import LINKS
from orchestrator.signal import Array
from studies.measures.bins import spread
from studies.measures.knowledge import NEVER, Knowledge
from studies.measures.sight import LOS

ENDS: Final = ("known before", "known", "in sight", "left", "run over")
"""How a meeting ends: the road user was known when it was first hidden; became known; or, before
that, came in sight, was out of range, or was there when the run was over."""
_BEFORE, _KNOWN, _SIGHT, _LEFT, _OVER = range(len(ENDS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Meetings:
    """Whom observers had around them at each instant, a row for each.

    Attributes:
        times: the instants [ns], ascending, shape (instant,).
        instant: the index of each row, shape (row,).
        observer: who looks, shape (row,).
        road_user: who is looked for, shape (row,).
        link: as `Bodies.links` tells it, shape (row,).
    """

    times: Array
    instant: Array
    observer: Array
    road_user: Array
    link: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstKnowledge:
    """What became of every road user that an observer had hidden near it, a row for each.

    Attributes:
        observer: who looks, shape (row,).
        road_user: who is looked for, shape (row,).
        link: what hid it first, shape (row,).
        since: when it was first near and hidden [ns], shape (row,).
        duration: until it was known, or until the end of the wait for that [ns], shape (row,).
        end: an index into `ENDS`, shape (row,).
    """

    observer: Array
    road_user: Array
    link: Array
    since: Array
    duration: Array
    end: Array

    def numbers(self) -> dict[str, float | int | None]:
        """How many there are of each end, and how long it took."""
        times = self.duration[self.end == _KNOWN] * 1e-6
        counts = {
            f"first_{name.replace(' ', '_')}": int((self.end == k).sum())
            for k, name in enumerate(ENDS)
        }
        place, share = self.curve()
        half = np.flatnonzero(share >= 0.5)
        median = float(place[half[0]]) * 1e3 if len(half) else None
        return {
            "meetings": len(self.end),
            **counts,
            **spread(times, "first", "ms"),
            "first_km_median_ms": median,
        }

    def curve(self) -> tuple[Array, Array]:
        """The share that is known by a time, by Kaplan and Meier; [s] and 0 to 1, shape (n,)."""
        is_event = self.end <= _KNOWN
        moments, inverse = np.unique(self.duration, return_inverse=True)
        events = np.bincount(inverse[is_event], minlength=len(moments))
        left = np.bincount(inverse, minlength=len(moments))
        at_risk = left[::-1].cumsum()[::-1]
        unknown = np.cumprod(1.0 - events / np.maximum(at_risk, 1))
        return moments * 1e-9, 1.0 - unknown

    def table(self) -> dict[str, Array]:
        """A row for each meeting, shape (meeting,); the time is NaN where it is not known."""
        known = self.end <= _KNOWN
        seconds = self.duration * 1e-9
        return {
            "observer": self.observer,
            "road_user": self.road_user,
            "link": np.array(LINKS)[self.link],
            "since_s": self.since * 1e-9,
            "first_s": np.where(known, seconds, np.nan),
            "censored_s": np.where(known, np.nan, seconds),
            "end": np.array(ENDS)[self.end],
        }


def meetings(rows: Meetings, is_known: Array, sources: Sequence[Knowledge]) -> FirstKnowledge:
    """Follow every pair from when the road user is first hidden.

    Args:
        rows: whom observers had around them.
        is_known: whether the observer knew of the road user then, shape (row,).
        sources: of knowledge.
    """
    order = np.lexsort((rows.instant, rows.road_user, rows.observer))
    observer, road_user = rows.observer[order], rows.road_user[order]
    instant, link = rows.instant[order], rows.link[order]
    is_other = np.ones(len(order), bool)  # the row begins another pair
    is_other[1:] = (observer[1:] != observer[:-1]) | (road_user[1:] != road_user[:-1])
    is_gap = np.zeros(len(order), bool)
    is_gap[1:] = instant[1:] != instant[:-1] + 1
    hidden = np.flatnonzero(link != LOS)
    pair = np.cumsum(is_other, dtype=np.int32) - 1
    first = hidden[np.unique(pair[hidden], return_index=True)[1]]
    breaks = np.append(np.flatnonzero(is_other | is_gap | (link == LOS)), len(order))
    after = breaks[np.searchsorted(breaks, first, side="right")]
    end, until = _censored(after, is_other | is_gap, instant, rows.times)
    since = rows.times[instant[first]]
    ids = observer[first].astype(np.int64), road_user[first].astype(np.int64)
    soonest = np.full(len(first), np.iinfo(np.int64).max)
    for source in sources:
        found = source.next(*ids, since)
        soonest = np.where((found != NEVER) & (found < soonest), found, soonest)
    in_time = soonest <= until
    until, end = np.where(in_time, soonest, until), np.where(in_time, _KNOWN, end)
    before = is_known[order][first]
    return FirstKnowledge(
        observer=ids[0],
        road_user=ids[1],
        link=link[first],
        since=since,
        duration=np.where(before, 0, until - since),
        end=np.where(before, _BEFORE, end),
    )


def _censored(after: Array, is_new: Array, instant: Array, times: Array) -> tuple[Array, Array]:
    """Why and when the wait ends at the rows `after`, which end it, shape (meeting,) both."""
    last = instant[after - 1]  # the last instant at which the road user was there, hidden
    is_in_sight = np.zeros(len(after), bool)
    inside = after < len(instant)
    is_in_sight[inside] = ~is_new[after[inside]]
    is_over = ~is_in_sight & (last == len(times) - 1)
    end = np.where(is_in_sight, _SIGHT, np.where(is_over, _OVER, _LEFT))
    return end, times[np.minimum(last + np.where(is_over, 0, 1), len(times) - 1)]
