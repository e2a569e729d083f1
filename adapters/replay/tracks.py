"""Who is on the road, under which number, from a first sample to a last."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
import numpy.typing as npt

from adapters.replay.source import Frame
from adapters.traffic.bodies import Body, is_motorised
from orchestrator.timebase import Duration, Time

Tracks: TypeAlias = npt.NDArray[Any]
"""An array of `SAMPLE`s, shape (road user,)."""

SAMPLE: Final = np.dtype(
    [
        ("number", np.int64),
        ("time", np.int64),
        ("name", object),
        ("type", object),
        ("center", np.float64, (2,)),
        ("heading", np.float64),
        ("speed", np.float64),
        ("size", np.float64, (3,)),
        ("antenna_height", np.float64),
        ("body", np.int32),
        ("equipped", np.bool_),
        ("lidar", np.bool_),
    ]
)
"""One road user at one time of the file; the names say what connectors of `vehicle` say."""

_NEVER: Final = np.iinfo(np.int64).min
_FEW: Final = 1024
"""Names that are kept without looking whether they are still needed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Equipment:
    """Which road users have what.

    Attributes:
        radio_share: of the road users, those with a V2X radio.
        lidar_share: of the road users, those with a lidar.
        persons: whether bicycles and persons on foot may have them, too.
    """

    radio_share: float
    lidar_share: float
    persons: bool


@dataclass(slots=True)
class _RoadUser:
    number: int
    seen: Time
    equipped: bool
    lidar: bool


class Roster:
    """Gives road users their numbers and equipment, in the order of their first samples.

    A road user that is not seen for longer than `maximum_gap` has left; whoever has its id later is
    another one. Two numbers are drawn for everyone, needed or not: a larger share equips more road
    users and takes nothing from those who had it, and who is drawn does not depend on the
    communication step size.

    Args:
        equipment: who has what.
        maximum_gap: between samples of one road user [ns].
        rng: for the draws.
    """

    def __init__(
        self, equipment: Equipment, maximum_gap: Duration, rng: np.random.Generator
    ) -> None:
        self._equipment = equipment
        self._gap = maximum_gap
        self._rng = rng
        self._count = 0
        self._users: dict[str, _RoadUser] = {}
        self._purge_at = _FEW

    def number(self, frame: Frame) -> Tracks:
        """The samples of the next frame, ascending by number, shape (road user,)."""
        users = [
            self._user(key, frame.time, body)
            for key, body in zip(frame.keys, frame.body.tolist(), strict=True)
        ]
        rows = np.empty(len(users), SAMPLE)
        rows["number"] = [user.number for user in users]
        rows["time"] = frame.time
        rows["name"], rows["type"] = frame.names, frame.types
        rows["center"], rows["heading"], rows["speed"] = frame.center, frame.heading, frame.speed
        rows["size"], rows["antenna_height"] = frame.size, frame.antenna_height
        rows["body"] = frame.body
        rows["equipped"] = [user.equipped for user in users]
        rows["lidar"] = [user.lidar for user in users]
        self._forget(frame.time)
        return rows[np.argsort(rows["number"])]

    def _user(self, key: str, time: Time, body: int) -> _RoadUser:
        known = self._users.get(key)
        if known is not None and time - known.seen <= self._gap:
            known.seen = time
            return known
        radio, lidar = self._rng.random(2).tolist()
        may_have = self._equipment.persons or is_motorised(Body(body))
        user = _RoadUser(
            number=self._count,
            seen=time,
            equipped=may_have and radio < self._equipment.radio_share,
            lidar=may_have and lidar < self._equipment.lidar_share,
        )
        self._count += 1
        self._users[key] = user
        return user

    def _forget(self, time: Time) -> None:
        """Drop those who have left, now and then, so that memory does not grow with the file."""
        if len(self._users) >= self._purge_at:
            first = time - self._gap
            self._users = {key: user for key, user in self._users.items() if user.seen >= first}
            self._purge_at = max(_FEW, 2 * len(self._users))


class Window:
    """The file around a time: what was seen last of everyone, and what will be seen next.

    It holds the samples of `maximum_gap` ahead, and no more.

    Args:
        frames: of the file.
        roster: numbers them.
        maximum_gap: between samples of one road user [ns].

    Attributes:
        first: the first time of the file [ns].
        last: its last time [ns], as far as it has been read.
        is_read: whether it has been read to its end.
    """

    def __init__(self, frames: Iterator[Frame], roster: Roster, maximum_gap: Duration) -> None:
        self._frames = frames
        self._roster = roster
        self._gap = maximum_gap
        self._ahead: list[tuple[Time, Tracks]] = []
        self._held = np.empty(0, SAMPLE)
        self._next = self._held
        self._continues = np.zeros(0, np.bool_)
        self.is_read = False
        self.last: Time = 0
        self._read()
        self.first = self.last

    def at(self, time: Time) -> tuple[Tracks, Tracks]:
        """The last samples at or before `time`, and the next ones, of everyone who is there.

        Args:
            time: of the file [ns]; it must not go back.

        Returns:
            Both ascending by number, of the same road users, shape (road user,); where a last
            sample is the end of a road user's way, and of `time`, the next is the same.
        """
        while not self.is_read and self.last <= time + self._gap:
            self._read()
        passed = 0
        while passed < len(self._ahead) and self._ahead[passed][0] <= time:
            self._pass(self._ahead[passed][1])
            passed += 1
        if passed:
            del self._ahead[:passed]
            self._look_ahead()
        is_there = self._continues | (self._held["time"] == time)
        return self._held[is_there], self._next[is_there]

    def _read(self) -> None:
        frame = next(self._frames, None)
        if frame is None:
            self.is_read = True
        else:
            self.last = frame.time
            self._ahead.append((frame.time, self._roster.number(frame)))

    def _pass(self, rows: Tracks) -> None:
        """These are now the last samples of those whom they are of."""
        others = self._held[~np.isin(self._held["number"], rows["number"], assume_unique=True)]
        joined = np.concatenate([others, rows]) if len(others) else rows
        self._held = joined[np.argsort(joined["number"])] if len(others) else joined

    def _look_ahead(self) -> None:
        """Find the next sample of everyone; who has none leaves after the last."""
        held = self._held
        self._next, self._continues = held.copy(), np.zeros(len(held), np.bool_)
        for time, rows in self._ahead:
            open_ = np.flatnonzero(~self._continues)
            if not len(open_) or time > held["time"][open_].max() + self._gap:
                break
            if not len(rows):
                continue
            wanted = held["number"][open_]
            found = np.minimum(np.searchsorted(rows["number"], wanted), len(rows) - 1)
            is_found = rows["number"][found] == wanted
            self._next[open_[is_found]] = rows[found[is_found]]
            self._continues[open_[is_found]] = True
        stays = self._continues | (held["time"] == held["time"].max(initial=_NEVER))
        self._held, self._next = held[stays], self._next[stays]
        self._continues = self._continues[stays]
