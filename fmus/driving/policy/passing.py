"""What passing the one ahead, or dropping back behind, would mean now."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from fmus.driving.policy.conflict import taking_up_speed
from fmus.driving.policy.ego import Ego
from fmus.driving.policy.gap_acceptance import clearance, time_to_gain, time_to_lose
from fmus.driving.policy.lane_change import length_of_change
from fmus.driving.policy.overtaking_parameters import Overtaking
from fmus.driving.policy.road_users import RoadUsers
from orchestrator.signal import Array

ACROSS: Final = 1.0
"""Who moves across the route no faster than this keeps his lane [m/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """How the ego drives otherwise.

    Attributes:
        cruise: the speed that it takes up [m/s].
        acceleration: with which it does [m/s^2].
        lateral_margin: room that it keeps beside its body [m].
    """

    cruise: float
    acceleration: float
    lateral_margin: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """Who is to be passed: one vehicle, or several with no room to return between them.

    Attributes:
        rear, front: where it begins and ends along the route, from the ego's centre on [m].
        pace: of its slowest [m/s].
    """

    rear: float
    front: float
    pace: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Prospect:
    """What comes of a choice.

    Attributes:
        clearance: how long after the ego is back in its lane it would meet the first one on the
            other lane [s]; infinite if nobody comes.
        row: of that one, `None` if nobody comes.
    """

    clearance: float
    row: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """The ego among others at one time; the lane on which it passes is on the left here.

    Attributes:
        ego: as it is.
        others: along its route.
        wanted: how it overtakes.
        drive: how it drives otherwise.
    """

    ego: Ego
    others: RoadUsers
    wanted: Overtaking
    drive: Drive

    @property
    def half(self) -> float:
        """Half the length of the ego [m]."""
        return 0.5 * self.ego.length

    @property
    def side(self) -> float:
        """Half the width of the strip that the ego needs [m]."""
        return 0.5 * self.ego.width + self.drive.lateral_margin

    def length_of_change(self, behind: Column | None = None) -> float:
        """The way that it takes to change lanes [m], also back behind somebody, at his pace."""
        cruise = self.drive.cruise if behind is None else behind.pace
        top = max(cruise, self.ego.speed)
        return length_of_change(self.wanted.offset, top, self.wanted.lateral_acceleration)

    def leader(self) -> Column | None:
        """The nearest one ahead in the ego's lane that does not come towards it."""
        return self._nearest(self._in_lane(self.others.rear > 0.0))

    def column(self) -> Column | None:
        """Whom the ego has not passed yet, as far as there is no room to return in between."""
        left = self._in_lane(self.others.front + self.half + self._kept(self.others.pace) > 0.0)
        found = self._nearest(left)
        if found is None:
            return None
        for k in np.argsort(left.rear, kind="stable").tolist():
            pace = min(found.pace, float(left.pace[k]))
            if left.rear[k] - found.front > self.ego.length + 2.0 * self._room(pace):
                break
            front = max(found.front, float(left.front[k]))
            found = Column(rear=found.rear, front=front, pace=max(pace, 0.0))
        return found

    def is_free_beside(self, column: Column | None) -> bool:
        """Whether the ego may return to its lane: the column is farther than that takes."""
        if column is None:
            return True
        room = self.length_of_change() + self._room(self.ego.speed)
        return column.rear - self.half > room

    def is_held_up_by(self, leader: Column) -> bool:
        """Whether the ego follows somebody who is too slow for it.

        Who follows has a headway of 3 s or less (Highway Capacity Manual, Transportation Research
        Board, 2000, chapter 12).
        """
        near = max(3.0 * self.ego.speed, 2.0 * self.wanted.standstill)
        is_slow = leader.pace <= self.drive.cruise - self.wanted.advantage
        return is_slow and leader.rear - self.half <= near

    def completing(self, column: Column) -> Prospect:
        """What is left if the ego passes the column."""
        distance = column.front + self.half + self._room(column.pace)
        gained = time_to_gain(
            distance,
            self.ego.speed,
            column.pace,
            acceleration=self.drive.acceleration,
            cruise=self.drive.cruise,
        )
        top = max(self.drive.cruise, self.ego.speed)
        time = gained + self.length_of_change() / top
        if math.isinf(time):
            return Prospect(clearance=-math.inf, row=None)
        drive = self.drive
        way = taking_up_speed(self.ego, drive.cruise, drive.acceleration, np.array(time))
        reached = min(self.ego.speed + drive.acceleration * time, top)
        return self._least(way=float(way), speed=reached, time=time)

    def dropping_back(self, column: Column) -> Prospect:
        """What is left if the ego lets the column go ahead, and returns behind it."""
        distance = self.half - column.rear + self.wanted.standstill
        braking = self.wanted.braking
        lost = time_to_lose(distance, self.ego.speed, column.pace, braking=braking)
        pace, back = max(column.pace, 1.0), self._length_back(column)
        time = lost + back / pace
        if math.isinf(time):
            return Prospect(clearance=-math.inf, row=None)
        slowing = min(lost, self.ego.speed / braking)
        way = (self.ego.speed - 0.5 * braking * slowing) * slowing + back
        return self._least(way=way, speed=pace, time=time)

    def is_overtaken(self, column: Column) -> bool:
        """Whether somebody behind on the lane for passing would run into the ego there."""
        low, high = self._passing_strip()
        behind = self.others.only(self.others.within(low, high) & (self.others.front <= -self.half))
        faster = behind.only(behind.pace > self.ego.speed)
        time = (self.drive.cruise - self.ego.speed) / self.drive.acceleration
        way = self.ego.speed * time + 0.5 * self.drive.acceleration * time * time
        return bool((faster.pace * max(time, 0.0) - way > -self.half - faster.front).any())

    def _least(self, *, way: float, speed: float, time: float) -> Prospect:
        """The least clearance to anybody on the lane for passing, or soon on it."""
        low, high = self._passing_strip()
        others = self.others
        coming = others.entering(low, high, within=time + self.wanted.clearance, faster=ACROSS)
        coming &= others.front > -self.half
        coming &= ~others.within(-self.side, self.side) | (others.pace < -ACROSS)
        found = others.only(coming)
        least, row = math.inf, None
        for k in range(len(found.row)):
            left = clearance(
                max(float(found.rear[k]) - self.half, 0.0),
                -float(found.pace[k]),
                way=way,
                speed=speed,
                time=time,
            )
            if left < least:
                least, row = left, int(found.row[k])
        return Prospect(clearance=least, row=row)

    def _length_back(self, column: Column) -> float:
        """The way that it takes to return behind the column, at its pace [m]."""
        return length_of_change(self.wanted.offset, column.pace, self.wanted.lateral_acceleration)

    def _passing_strip(self) -> "tuple[float, float]":
        return self.wanted.offset - self.side, self.wanted.offset + self.side

    def _in_lane(self, rows: Array) -> RoadUsers:
        others = self.others
        return others.only(rows & others.within(-self.side, self.side) & (others.pace > -ACROSS))

    def _nearest(self, others: RoadUsers) -> Column | None:
        if len(others.row) == 0:
            return None
        k = int(np.argmin(others.rear))
        return Column(
            rear=float(others.rear[k]),
            front=float(others.front[k]),
            pace=max(float(others.pace[k]), 0.0),
        )

    def _room(self, pace: float) -> float:
        """The gap to keep to somebody at this speed [m]."""
        return self.wanted.standstill + self.wanted.headway * pace

    def _kept(self, pace: Array) -> Array:
        kept: Array = self.wanted.standstill + self.wanted.headway * np.maximum(pace, 0.0)
        return kept
