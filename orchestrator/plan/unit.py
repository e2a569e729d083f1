"""One unit of a plan: its calls, and where their values come from."""

import ctypes
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.mixing import PastValues, not_finite
from orchestrator.algorithm.participant import Participant
from orchestrator.errors import ComponentError, defects
from orchestrator.native import NativeKind, NativeUnit, NativeVariable
from orchestrator.plan import layouts
from orchestrator.plan.attendance import Attendance
from orchestrator.plan.copies import Driven, are_adjacent
from orchestrator.plan.memory import Outputs
from orchestrator.plan.mixes import UnitMixes
from orchestrator.plan.past import Past
from orchestrator.plan.points import grid_of, points
from orchestrator.plan.recorded import Recorded
from orchestrator.plan.sources import Readable, Sources
from orchestrator.signal import Array, Connector, Signal, Signals
from orchestrator.stretch import Samples
from orchestrator.system import Feed
from orchestrator.timebase import StepSize, Time

_IN_MEMORY: Final[Mapping[NativeKind, np.dtype[Any]]] = {
    NativeKind.BOOLEAN8: np.dtype(np.uint8),
    NativeKind.BOOLEAN32: np.dtype("i4"),
}
"""Element types in the memory of an FMU where they are not those of the signal."""


_BYTES: Final = frozenset({NativeKind.BINARY, NativeKind.TEXT})


class UnitPlan(Readable):
    """What the engine knows of one unit.

    Args:
        participant: the unit among all.
        unit: its functions and variables.
        connectors: of the component.
        feeds: its driven inputs.
        recorded: names of outputs of which every value is wanted.
        table: what the engine reads.
        is_parallel: whether outputs are published after all have stepped.
        library: the engine.
    """

    def __init__(
        self,
        *,
        participant: Participant,
        unit: NativeUnit,
        connectors: Mapping[str, Connector],
        feeds: Sequence[Feed],
        recorded: Sequence[str],
        table: layouts.Unit,
        is_parallel: bool,
        library: Any,
    ) -> None:
        self.participant = participant
        self._unit = unit
        self._connectors = connectors
        self._feeds = feeds
        self._table = table
        self._library = library
        self._groups = _by_type(unit, list(participant.pending))
        names = [name for group in self._groups.values() for name in group]
        own = {name: connectors[name] for name in names}
        shapes = {name: unit.variables[name].shape for name in names}
        self._is_parallel = is_parallel
        self._outputs = self._made(own, shapes)
        inputs = {feed.input: unit.variables[feed.input].shape for feed in feeds}
        inputs |= {
            each.input: unit.variables[each.input].shape for each in participant.inputs.mixed
        }
        self._mixes = UnitMixes(participant.inputs.mixed, connectors, inputs)
        self._pasts: dict[str, Past] = {}
        self._recorded = Recorded([name for name in names if name in recorded], self._outputs[0])
        self._shown: dict[str, Signal] = {}
        self._left: Time | None = None  # what the engine knows of this point is all there is
        self._keep: list[Any] = []  # what the table points to
        self._driven: list[Driven] = []
        self._setting_names: list[tuple[str, list[str]]] = []
        self._attendance = self._attended()
        self._describe(table, unit)
        unit.owner.count_calls(ctypes.addressof(table) + layouts.Unit.calls.offset)

    def _made(
        self, own: Mapping[str, Connector], shapes: Mapping[str, tuple[int, ...]]
    ) -> tuple[Outputs, Outputs]:
        """Memory for its outputs: what is published first, and what is pending."""
        first = Outputs(own, shapes)
        return first, (Outputs(own, shapes) if self._is_parallel else first)

    def _attended(self) -> Attendance:
        """What completes its steps."""
        return Attendance(self.participant, self._unit.owner)

    @property
    def step_size(self) -> StepSize:
        """The communication step of the component [ns]."""
        return self.participant.step_size

    @property
    def rows(self) -> int:
        """How often it published in the last stretch."""
        return int(self._table.rows)

    @property
    def published(self) -> Outputs:
        """The outputs that others see; by Jacobi, they and the pending ones change places."""
        return self._outputs[self._table.published != self._outputs[0].bases[0]]

    @property
    def _pending(self) -> Outputs:
        return self._outputs[self._table.pending != self._outputs[0].bases[0]]

    @override
    def source(self, output: str) -> layouts.Source:
        table, unit = ctypes.addressof(self._table), layouts.Unit
        is_array = output in self._outputs[0].places
        base = (unit.published if is_array else unit.published_bytes).offset
        offset = self._outputs[0].offset(output)
        return layouts.Source(table + base, offset, table + unit.publications.offset)

    @override
    def past(self, output: str) -> layouts.Past:
        return self._pasts[output].table

    @override
    def shape(self, output: str) -> tuple[int, ...]:
        return self._outputs[0].places[output].shape

    @property
    def recorded_bytes(self) -> int:
        """What it records at one point, Binary left out [byte]."""
        return self._recorded.point_bytes

    # ---- the table ----

    def _describe(self, table: layouts.Unit, unit: NativeUnit) -> None:
        table.instance, table.step, table.version = unit.instance, unit.step, unit.version
        table.keeps_state = unit.keeps_state
        table.grid = grid_of(self.participant.grid)
        table.published, table.published_bytes = self._outputs[0].bases
        table.pending, table.pending_bytes = self._outputs[1].bases
        table.flag = (ctypes.c_void_p * 3)(*unit.flags)
        table.last_time = unit.last_time
        table.attend = self._attendance.address
        gettings = [self._getting(type_, names) for type_, names in self._groups.items()]
        table.getting = self._kept((layouts.Getting * len(gettings))(*gettings))
        table.gettings = len(gettings)
        self._recorded.describe(table)

    def _kept(self, what: Any) -> Any:
        """`what`, which lives as long as the plan."""
        self._keep.append(what)
        return what

    def _references(self, names: Sequence[str]) -> int:
        references = [self._unit.variables[name].reference for name in names]
        return int(self._kept(np.array(references, np.uint32)).ctypes.data)

    def _variable(self, names: Sequence[str]) -> NativeVariable:
        return self._unit.variables[names[0]]

    def _getting(self, type_: str, names: Sequence[str]) -> layouts.Getting:
        kind = self._variable(names).kind
        call = layouts.Getting(
            function=self._unit.getters[type_],
            reference=self._references(names),
            references=len(names),
            kind=kind,
            signal=self._outputs[0].offset(names[0]),
        )
        if kind in _BYTES:
            call.is_binary = True
            call.sizes = self._kept(np.zeros(len(names), np.uintp)).ctypes.data
            call.pointers = self._kept(np.zeros(len(names), np.uintp)).ctypes.data
            return call
        call.count = sum(self._unit.variables[name].count for name in names)
        if kind in _IN_MEMORY:
            call.elements = self._kept(np.zeros(call.count, _IN_MEMORY[kind])).ctypes.data
        return call

    def remember(self, histories: Iterable[PastValues]) -> None:
        """Keep the past of these outputs."""
        for each in histories:
            place = self._outputs[0].places[each.output]
            source = self.source(each.output)
            self._pasts[each.output] = Past(each, source, self.step_size, place.dtype, place.shape)
        pointers = [ctypes.pointer(each.table) for each in self._pasts.values()]
        self._table.past = self._kept((ctypes.POINTER(layouts.Past) * len(pointers))(*pointers))
        self._table.pasts = len(pointers)

    def connect(self, sources: Sources) -> None:
        """Let the driven inputs be set from their sources."""
        self._mixes.connect(sources)
        self._table.mix, self._table.mixes = self._mixes.table, len(self._mixes.inputs)
        feeds = {feed.input: feed for feed in self._feeds}
        driven = {*feeds, *self._mixes.inputs}
        groups = _by_type(self._unit, [name for name in self._connectors if name in driven])
        settings = []
        for type_, names in groups.items():
            found = {
                name: sources.of(feeds[name].component, feeds[name].output)
                if name in feeds
                else self._mixes.source(name)
                for name in names
            }
            settings.append(self._setting(type_, found, feeds))
            self._setting_names.append((type_, names))
        self._table.setting = self._kept((layouts.Setting * len(settings))(*settings))
        self._table.settings = len(settings)

    def _setting(
        self, type_: str, sources: Mapping[str, layouts.Source], feeds: Mapping[str, Feed]
    ) -> layouts.Setting:
        names = list(sources)
        kind = self._variable(names).kind
        dtype = _IN_MEMORY.get(kind, np.dtype(self._connectors[names[0]].dtype))
        counts = [self._unit.variables[name].count for name in names]
        copies = self._kept((layouts.Copy * len(names))())
        call = layouts.Setting(
            function=self._unit.setters[type_],
            reference=self._references(names),
            references=len(names),
            kind=kind,
            copy=copies,
            copies=len(names),
            count=0 if kind in _BYTES else sum(counts),
        )
        for copy, name, count in zip(copies, names, counts, strict=True):
            copy.source = sources[name]
            copy.size = count if kind is NativeKind.BOOLEAN32 else count * dtype.itemsize
            self._driven.append(Driven.of(name, feeds.get(name), copy))
        if kind in _BYTES:
            call.is_binary = True
            call.elements = self._kept(np.zeros(2 * len(names), np.uintp)).ctypes.data
        elif (to := self._memory_of(names, call.count, dtype, copies)) is not None:
            call.elements = to
            for copy, count in zip(copies, counts, strict=True):
                copy.to, to = to, to + count * dtype.itemsize
        return call

    def _memory_of(
        self,
        names: Sequence[str],
        count: int,
        dtype: "np.dtype[Any]",
        copies: Sequence[layouts.Copy],
    ) -> int | None:
        """Where inputs are put together that one call sets; `None`: they lie so already."""
        kind = self._variable(names).kind
        if kind is not NativeKind.BOOLEAN32 and are_adjacent(copies):
            return None
        return int(self._kept(np.zeros(max(count, 1), dtype)).ctypes.data)

    def take_turns(self, names: Sequence[str]) -> None:
        """Know the names of all units, in the order of their turns."""

    # ---- stretches ----

    def room(self, points: int) -> int:
        """How much memory so many samples take [byte]."""
        return self._recorded.room(points)

    def reserve(self, points: int, address: int, memory: memoryview) -> None:
        """Use `memory` for so many samples, see `Recorded.reserve`."""
        self._recorded.reserve(points, address, memory)

    def enter(self, t: Time, published: Mapping[str, Signals]) -> None:
        """Take over what Python did since the last stretch."""
        self._table.ending = self._attendance.ending
        if t != self._left:
            self._take_over(t, published)
        self._mixes.enter()
        for past in self._pasts.values():
            past.enter()

    def _take_over(self, t: Time, published: Mapping[str, Signals]) -> None:
        """Bring in the values of all signals; those before `t` were not the engine's."""
        for name, value in self.participant.published.items():
            if value is not self._shown.get(name):
                self.published.put(name, value, self._library)
                self._shown[name] = value
        if self._is_parallel and self._is_under_way(t):
            self._adopt(self.participant.pending)
        owner = self._unit.owner
        for each in self._driven:
            feed = each.feed
            is_set = feed is not None and owner.is_written(
                each.name, published[feed.component][feed.output]
            )
            each.enter(is_set=is_set)

    def _adopt(self, outputs: Signals) -> None:
        """Let these be the pending outputs."""
        for name, value in outputs.items():
            self._pending.put(name, value, self._library)

    def _is_under_way(self, t: Time) -> bool:
        """Whether a step that was begun before `t` ends behind it."""
        return self.participant.grid.number(t) is None

    def _reached(self, t: Time) -> Time:
        """Where the step ends that was made last before `t`, or begun there."""
        grid = self.participant.grid
        last = grid.at(grid.last(t))
        return grid.after(t) if self._is_parallel and last != t else last

    def show(self, t: Time, scale: float) -> None:
        """Let Python see what was published up to `t` [ns]; of its time, `scale` is true."""
        if self.rows:
            self._shown = dict(self.published.values())
        self._go_on(t, int(self._table.spent * scale))

    def _go_on(self, t: Time, spent_ns: int) -> None:
        """Let the participant go on at `t` [ns]."""
        is_ahead = self._is_parallel and self._is_under_way(t)
        pending = dict(self._pending.values()) if is_ahead else self._shown
        self.participant.go_on(self._shown, pending, self._reached(t), spent_ns)

    def leave(self, t: Time, published: Mapping[str, Signals]) -> None:
        """Let the component go on where the engine was, when all units are shown."""
        self._left = t
        written = {
            each.name: published[feed.component][feed.output]
            for each in self._driven
            if (feed := each.feed) is not None and each.is_newest
        }
        under_way = self._is_under_way(t)
        read = self.participant.pending if under_way else self.participant.published
        self._attendance.publish(is_reached=not under_way)
        self._unit.owner.adopt([each.name for each in self._driven], written, dict(read))
        self._mixes.leave()
        for past in self._pasts.values():
            past.leave()

    def times(self, t: Time) -> Array:
        """When it published in the stretch that began at `t` [ns], int64, shape (sample,)."""
        return points(self.participant.grid, t, self.rows)

    def samples(self, times: Array, *, are_kept: bool) -> Samples:
        """What it published in the last stretch.

        Args:
            times: as `times` says, shape (sample,).
            are_kept: whether the memory of rows is not used again.
        """
        return Samples(times, self._recorded.rows(self.rows), are_kept)

    def fail(self, outcome: int, call: int, status: int, t: Time) -> ComponentError:
        """The error for what stopped the engine in the step from `t`."""
        owner = self._unit.owner
        if outcome == layouts.MIX_NOT_FINITE:
            return self.participant.failure(t, not_finite(self._mixes.inputs[call]))
        if outcome == layouts.STEP_FAILED and (error := self._attendance.error(t)) is not None:
            return error
        try:
            if outcome == layouts.SET_FAILED:
                owner.setting_failed(*self._setting_names[call], status)
            elif outcome == layouts.GET_FAILED:
                owner.getting_failed(list(self._groups)[call], status)
            elif outcome == layouts.NOT_FINITE:
                self.participant.accept(self._pending.values(), t)
        except defects() as error:
            return self.participant.failure(t, error)
        return ComponentError(self.participant.name, t, "there is no room for its outputs")

    def release(self) -> None:
        """Free what the engine allocated, and let go of the component."""
        self._unit.owner.count_calls(None)
        for outputs in self._outputs:
            outputs.release(self._library)
        self._recorded.release(self._library)


def _by_type(unit: NativeUnit, names: Sequence[str]) -> dict[str, list[str]]:
    groups: defaultdict[str, list[str]] = defaultdict(list)
    for name in names:
        groups[unit.variables[name].type].append(name)
    return dict(groups)
