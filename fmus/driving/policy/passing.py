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
from fmus.driving.policy.route import Segments
from orchestrator.signal import Array

ACROSS: Final = 1.0
"""Who moves across the route no faster than this keeps his lane [m/s]."""

STRAIGHT: Final = math.radians(30.0)
"""A road that turns by less leads straight on: its other lane stays that of oncoming traffic."""

SURE: Final = 0.3
"""So long nobody must have been left to pass before the ego returns [s]: a track may be lost."""


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
class _Motion:
    """The ego's motion until it is back in its lane.

    Attributes:
        time: that it takes [s], infinite if it never is.
        way: that it comes in this time [m].
        speed: at the end [m/s].
    """

    time: float
    way: float
    speed: float


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

    def ahead(self) -> Column | None:
        """The nearest one in the ego's lane that is not behind it, and all it is to be passed with.

        Those are who drives so near ahead of the others that there is no room to return in between.
        """
        left = self._in_lane(self.others.front > -self.half)
        found = self._nearest(left)
        if found is None:
            return None
        for k in np.argsort(left.rear, kind="stable").tolist():
            pace = min(found.pace, max(float(left.pace[k]), 0.0))
            if left.rear[k] - found.front > self.ego.length + 2.0 * self._room(pace):
                break
            found = Column(rear=found.rear, front=max(found.front, float(left.front[k])), pace=pace)
        return found

    def left_to_pass(self) -> Column | None:
        """Whom the ego has not passed yet: who is ahead too near, or behind too near."""
        ahead = self.ahead()
        if ahead is not None and not self._is_free_behind(ahead):
            return ahead
        behind = self.others.front + self.half
        kept = self.wanted.standstill + self.wanted.headway * np.maximum(self.others.pace, 0.0)
        return self._nearest(self._in_lane((behind <= 0.0) & (behind > -kept)))

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
        return self._least(self._pass(column))

    def dropping_back(self, column: Column) -> Prospect:
        """What is left if the ego lets the column go ahead, and returns behind it."""
        distance = self.half - column.rear + self.wanted.standstill
        braking = self.wanted.braking
        lost = time_to_lose(distance, self.ego.speed, column.pace, braking=braking)
        pace, back = max(column.pace, 1.0), self._length_back(column)
        time = lost + back / pace
        slowing = min(lost, self.ego.speed / braking)
        way = (self.ego.speed - 0.5 * braking * slowing) * slowing + back
        return self._least(_Motion(time=time, way=way, speed=pace))

    def is_straight(self, column: Column) -> bool:
        """Whether the route leads straight on for as long as passing the column takes."""
        way = self._pass(column).way
        line = Segments.of(self.ego.route)
        if way > float(line.begin[-1] + line.length[-1]):
            return False
        direction = line.direction[line.begin < way]
        return bool((direction @ direction[0] > math.cos(STRAIGHT)).all())

    def is_overtaken(self, column: Column) -> bool:
        """Whether somebody behind on the other lane would reach the ego before it is back."""
        low, high = self._passing_strip()
        motion = self._pass(column)
        behind = self.others.only(self.others.within(low, high) & (self.others.front <= -self.half))
        faster = behind.only(behind.pace > self.ego.speed)
        reached = faster.front + faster.pace * motion.time >= motion.way - self.half
        return bool(reached.any())

    def _pass(self, column: Column) -> "_Motion":
        """Passing the column and returning before it."""
        drive, speed = self.drive, self.ego.speed
        gained = time_to_gain(
            column.front + self.half + self._room(column.pace),
            speed,
            column.pace,
            acceleration=drive.acceleration,
            cruise=drive.cruise,
        )
        top = max(drive.cruise, speed)
        time = gained + SURE + self.length_of_change() / top
        if math.isinf(time):
            return _Motion(time=time, way=math.inf, speed=top)
        way = float(taking_up_speed(self.ego, drive.cruise, drive.acceleration, np.array(time)))
        return _Motion(time=time, way=way, speed=min(speed + drive.acceleration * time, top))

    def _least(self, motion: "_Motion") -> Prospect:
        """The least clearance to anybody on the other lane, or soon on it."""
        if math.isinf(motion.time):
            return Prospect(clearance=-math.inf, row=None)
        low, high = self._passing_strip()
        others = self.others
        soon = motion.time + self.wanted.clearance
        coming = others.entering(low, high, within=soon, faster=ACROSS)
        coming &= others.front > -self.half
        coming &= ~others.within(-self.side, self.side) | (others.pace < -ACROSS)
        found = others.only(coming)
        least, row = math.inf, None
        for k in range(len(found.row)):
            gap = max(float(found.rear[k]) - self.half, 0.0)
            left = clearance(
                gap,
                -float(found.pace[k]),
                way=motion.way,
                speed=motion.speed,
                time=motion.time,
            )
            if left < least:
                least, row = left, int(found.row[k])
        return Prospect(clearance=least, row=row)

    def _is_free_behind(self, ahead: Column) -> bool:
        """Whether the ego may return to its lane behind somebody who is ahead."""
        room = self.length_of_change() + self._room(self.ego.speed)
        return ahead.rear - self.half > room

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
