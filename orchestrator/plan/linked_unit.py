"""A unit of a plan that steps in another process."""

import ctypes
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.participants import ConcurrentParticipant
from orchestrator.native import NativeLink, NativeUnit
from orchestrator.plan import layouts
from orchestrator.plan.attendance import Attendance, LinkAttendance
from orchestrator.plan.memory import Outputs
from orchestrator.plan.unit import UnitPlan
from orchestrator.signal import Connector, Signals
from orchestrator.timebase import Time


class LinkedUnitPlan(UnitPlan):
    """What the engine knows of a unit behind a link.

    Its outputs come to lie in two rooms in turn, which the engine only reads. Beside them there are
    two blocks for what Python knows: values from before a stretch, and replies that are no usual
    ones.

    Args:
        participant: the unit among all.
        unit: its variables.
        link: to the process.
        settings: all others of `UnitPlan`.
    """

    def __init__(
        self,
        *,
        participant: ConcurrentParticipant,
        unit: NativeUnit,
        link: NativeLink,
        **settings: Any,
    ) -> None:
        self._link = link
        self._concurrent = participant
        self._blocks: dict[int, Outputs] = {}
        super().__init__(participant=participant, unit=unit, **settings)

    @override
    def _made(
        self, own: Mapping[str, Connector], shapes: Mapping[str, tuple[int, ...]]
    ) -> tuple[Outputs, Outputs]:
        ours = Outputs(own, shapes), Outputs(own, shapes)
        rooms = self._link.lay_out(ours[0].places, len(ours[0].block))
        theirs = [Outputs(own, shapes, room) for room in rooms]
        self._blocks = {each.bases[0] or 0: each for each in (*ours, *theirs)}
        return ours

    @override
    def _attended(self) -> Attendance:
        return LinkAttendance(self._concurrent, self._link, self._adopt)

    @property
    @override
    def published(self) -> Outputs:
        return self._blocks[self._table.published]

    @property
    @override
    def _pending(self) -> Outputs:
        return self._blocks[self._table.pending]

    @override
    def _describe(self, table: layouts.Unit, unit: NativeUnit) -> None:
        super()._describe(table, unit)
        table.link = ctypes.cast(self._link.address, ctypes.POINTER(layouts.Link))

    @override
    def _memory_of(
        self,
        names: Sequence[str],
        count: int,
        dtype: "np.dtype[Any]",
        copies: Sequence[layouts.Copy],
    ) -> int | None:
        (name,) = names  # each is of its own type
        return self._link.inputs[name]

    @override
    def take_turns(self, names: Sequence[str]) -> None:
        """Know when it may begin its steps before its turn."""
        table = self._table
        own = names.index(self.participant.name)
        read = sorted(names.index(each) for each in self.participant.sources if each in names)
        reads = [layouts.Read(index, index < own) for index in read]
        table.read, table.reads = self._kept((layouts.Read * len(reads))(*reads)), len(reads)
        table.early = 1 + max((k for k in read if k < own), default=-1)
        table.onward = max([own, *read])
        if self._mixes.inputs:  # they are made in its turn
            table.early = table.onward = layouts.NEVER

    @override
    def enter(self, t: Time, published: Mapping[str, Signals]) -> None:
        self._link.enter(is_begun=self.participant.is_begun)
        super().enter(t, published)

    @override
    def _take_over(self, t: Time, published: Mapping[str, Signals]) -> None:
        if self.published not in self._outputs:  # the engine cannot write there
            self._table.published, self._shown = self._spare().bases[0], {}
        super()._take_over(t, published)

    @override
    def _adopt(self, outputs: Signals) -> None:
        if self._pending not in self._outputs:
            self._table.pending = self._spare().bases[0]
        super()._adopt(outputs)

    def _spare(self) -> Outputs:
        """A block of ours that has neither what is published nor what is pending."""
        used = self._table.published, self._table.pending
        return next(each for each in self._outputs if each.bases[0] not in used)

    @override
    def _go_on(self, t: Time, spent_ns: int) -> None:
        under_way = self._link.leave()
        if under_way is None:
            super()._go_on(t, spent_ns)
        else:
            self._concurrent.go_on_waiting(self._shown, *under_way, spent_ns)


def unit_plan(*, unit: NativeUnit, **settings: Any) -> UnitPlan:
    """The plan of a unit of this process, or of one behind a link; see both for `settings`."""
    if unit.link is None:
        return UnitPlan(unit=unit, **settings)
    return LinkedUnitPlan(unit=unit, link=unit.link, **settings)
