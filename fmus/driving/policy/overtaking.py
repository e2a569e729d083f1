"""Overtaking on a two-way road: pass, drop back, return."""

import enum
from dataclasses import replace
from typing import Final

from typing_extensions import override

from fmus.driving.policy.ego import Ego
from fmus.driving.policy.following import following
from fmus.driving.policy.lane_change import LaneChange, beside
from fmus.driving.policy.lateral import LateralPlanner, Plan
from fmus.driving.policy.overtaking_parameters import Overtaking
from fmus.driving.policy.passing import SURE, Column, Drive, Situation
from fmus.driving.policy.road_users import RoadUsers
from fmus.driving.policy.route import Segments
from orchestrator.signal import Array
from orchestrator.timebase import NANOSECONDS_PER_SECOND, Time

_SHARE: Final = 0.5
"""A pass that has begun goes on while this share of the clearance is left."""
_IN_LANE: Final = LaneChange(begin=0.0, length=1.0, start=0.0, end=0.0)


class Phase(enum.Enum):
    """How far the ego has got with overtaking."""

    KEEPING = "keeping"
    """It is in its lane."""
    PASSING = "passing"
    """It is on its way to the other lane, or there."""
    DROPPING_BACK = "dropping back"
    """It brakes there until the one it wanted to pass is ahead again."""
    RETURNING = "returning"
    """It is on its way back."""


class Overtaker(LateralPlanner):
    """Passes who holds it up, where `gap_acceptance` allows it.

    Args:
        wanted: how it overtakes.
        drive: how it drives otherwise.
    """

    def __init__(self, wanted: Overtaking, drive: Drive) -> None:
        self._wanted = wanted
        self._drive = drive
        self._sign = 1.0 if wanted.side == "left" else -1.0
        self._phase = Phase.KEEPING
        self._line: Segments | None = None
        self._way = 0.0
        self._change = _IN_LANE
        self._since: Time | None = None

    @override
    def plan(self, ego: Ego, corners: Array, velocity: Array, now: Time) -> Plan:
        if self._line is not None:
            self._way += max(float(self._line.project(ego.position)[0]), 0.0)
        self._line = Segments.of(ego.route)
        others = RoadUsers.along(self._line, corners, velocity)
        situation = Situation(
            ego=ego,
            others=others if self._sign > 0.0 else others.mirrored(),
            wanted=self._wanted,
            drive=self._drive,
        )
        match self._phase:
            case Phase.KEEPING:
                plan = self._keep(situation, now)
            case Phase.PASSING:
                plan = self._pass(situation, now)
            case Phase.DROPPING_BACK:
                plan = self._drop_back(situation)
            case Phase.RETURNING:
                plan = self._return(situation)
        change = self._change if self._sign > 0.0 else self._change.mirrored()
        return replace(plan, path=beside(ego.route, change, self._way))

    def _keep(self, situation: Situation, now: Time) -> Plan:
        leader = situation.leader()
        if leader is None or not self._may_pass(situation, leader):
            self._since = None
        elif self._lasts(now, self._wanted.patience):
            self._go(Phase.PASSING, situation.length_of_change(), self._wanted.offset)
        return self._behind(situation, leader)

    def _may_pass(self, situation: Situation, leader: Column) -> bool:
        column = situation.ahead()
        if column is None or not situation.is_held_up_by(leader):
            return False
        if not situation.is_straight(column) or situation.is_overtaken(column):
            return False
        return situation.completing(column).clearance >= self._wanted.clearance

    def _pass(self, situation: Situation, now: Time) -> Plan:
        column = situation.left_to_pass()
        if column is None:
            if self._lasts(now, SURE):
                self._go(Phase.RETURNING, situation.length_of_change(), 0.0)
            return self._onward(situation)
        self._since = None
        completing = situation.completing(column)
        if completing.clearance >= _SHARE * self._wanted.clearance:
            return self._onward(situation)
        if situation.dropping_back(column).clearance <= completing.clearance:
            return self._onward(situation)  # beyond the critical position
        self._phase = Phase.DROPPING_BACK
        return self._drop_back(situation)

    def _drop_back(self, situation: Situation) -> Plan:
        column = situation.ahead()
        if column is None or column.rear - situation.half >= self._wanted.standstill:
            self._go(Phase.RETURNING, situation.length_of_change(behind=column), 0.0)
            return self._behind(situation, column)
        row = situation.completing(column).row
        return Plan(path=situation.ego.route, limit=-self._wanted.braking, yields_to=row)

    def _return(self, situation: Situation) -> Plan:
        if self._change.is_over(self._way):
            self._phase, self._since = Phase.KEEPING, None
        return self._behind(situation, situation.leader())

    def _go(self, phase: Phase, length: float, offset: float) -> None:
        """Begin to change lanes: over a length [m], to an offset [m]."""
        self._phase, self._since = phase, None
        self._change = self._change.towards(offset, self._way, length)

    def _lasts(self, now: Time, seconds: float) -> bool:
        """Whether what is true now has been for so long [s]."""
        if self._since is None:
            self._since = now
        return now - self._since >= round(seconds * NANOSECONDS_PER_SECOND)

    def _behind(self, situation: Situation, leader: Column | None) -> Plan:
        """Keep the distance to who is ahead."""
        if leader is None:
            return self._onward(situation)
        limit = following(
            situation.ego.speed,
            leader.rear - situation.half,
            leader.pace,
            acceleration=self._drive.acceleration,
            braking=self._wanted.braking,
            headway=self._wanted.headway,
            standstill=self._wanted.standstill,
        )
        return Plan(path=situation.ego.route, limit=limit)

    def _onward(self, situation: Situation) -> Plan:
        return Plan(path=situation.ego.route)
