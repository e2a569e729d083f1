"""One unit of a plan: its calls, and where their values come from."""

import ctypes
from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, Final

import numpy as np

from orchestrator.algorithm.participant import Participant
from orchestrator.errors import ComponentError
from orchestrator.native import NativeKind, NativeUnit, NativeVariable
from orchestrator.plan import layouts
from orchestrator.plan.memory import Outputs
from orchestrator.plan.outside import OutsideSources
from orchestrator.signal import Array, Causality, Connector, Signal, Signals
from orchestrator.stretch import Rows, Samples
from orchestrator.system import Feed, System
from orchestrator.timebase import Duration, Time

_IN_MEMORY: Final[Mapping[NativeKind, np.dtype[Any]]] = {
    NativeKind.BOOLEAN8: np.dtype(np.uint8),
    NativeKind.BOOLEAN32: np.dtype("i4"),
}
"""Element types in the memory of an FMU where they are not those of the signal."""


_CACHE_LINE: Final = 64


class UnitPlan:
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
        self._groups = _by_type(
            unit, [n for n, c in connectors.items() if c.causality is Causality.OUTPUT]
        )
        names = [name for group in self._groups.values() for name in group]
        own = {name: connectors[name] for name in names}
        shapes = {name: unit.variables[name].shape for name in names}
        self.published = Outputs(own, shapes)
        self._pending = Outputs(own, shapes) if is_parallel else self.published
        self._recorded = [name for name in names if name in recorded]
        self._shown: dict[str, Signal] = {}
        self._keep: list[Any] = []  # what the table points to
        self._copies: list[tuple[Feed, layouts.Copy]] = []
        self._setting_names: list[tuple[str, list[str]]] = []
        self._rings: dict[str, Array] = {}
        self._start: Time = 0
        self._describe(table, unit)
        unit.owner.count_calls(ctypes.addressof(table) + layouts.Unit.calls.offset)

    @property
    def step_size(self) -> Duration:
        """The communication step of the component [ns]."""
        return int(self.participant.step_size)

    @property
    def rows(self) -> int:
        """How often it published in the last stretch."""
        return int(self._table.rows)

    def source(self, output: str) -> tuple[int, int]:
        """The addresses of a published output and of the number of publications."""
        counter = ctypes.addressof(self._table) + layouts.Unit.publications.offset
        return self.published.address(output), counter

    @property
    def recorded_bytes(self) -> int:
        """What it records at one point, Binary left out [byte]."""
        places = self.published.places
        return 8 + sum(places[name].size for name in self._recorded if name in places)

    # ---- the table ----

    def _describe(self, table: layouts.Unit, unit: NativeUnit) -> None:
        table.instance, table.step, table.version = unit.instance, unit.step, unit.version
        table.keeps_state = unit.keeps_state
        table.step_size = self.step_size
        table.pending = self._pending.block.ctypes.data
        table.published = self.published.block.ctypes.data
        table.size = len(self.published.block)
        table.pending_bytes, table.published_bytes = self._pending.bytes, self.published.bytes
        table.binaries = len(self.published.binaries)
        table.flag = (ctypes.c_void_p * 3)(*unit.flags)
        table.last_time = unit.last_time
        gettings = [self._getting(type_, names) for type_, names in self._groups.items()]
        table.getting = self._kept((layouts.Getting * len(gettings))(*gettings))
        table.gettings = len(gettings)
        table.track = self._kept((layouts.Track * len(self._recorded))())
        table.tracks = len(self._recorded)
        for track, name in zip(self._tracks(), self._recorded, strict=True):
            track.source = self.published.address(name)
            track.is_binary = name in self.published.binaries
            track.size = 8 if track.is_binary else self.published.places[name].size

    def _tracks(self) -> list[layouts.Track]:
        return [self._table.track[k] for k in range(len(self._recorded))]

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
            signal=self._pending.address(names[0]),
        )
        if kind is NativeKind.BINARY:
            call.is_binary = True
            call.sizes = self._kept(np.zeros(len(names), np.uintp)).ctypes.data
            call.pointers = self._kept(np.zeros(len(names), np.uintp)).ctypes.data
            return call
        call.count = sum(self._unit.variables[name].count for name in names)
        call.elements = call.signal
        if kind in _IN_MEMORY:
            call.elements = self._kept(np.zeros(call.count, _IN_MEMORY[kind])).ctypes.data
        return call

    def connect(self, source: "Sources") -> None:
        """Let the driven inputs be set from their sources."""
        feeds = {feed.input: feed for feed in self._feeds}
        groups = _by_type(self._unit, list(feeds))
        settings = []
        for type_, names in groups.items():
            settings.append(self._setting(type_, [feeds[name] for name in names], source))
            self._setting_names.append((type_, names))
        self._table.setting = self._kept((layouts.Setting * len(settings))(*settings))
        self._table.settings = len(settings)

    def _setting(self, type_: str, feeds: Sequence[Feed], source: "Sources") -> layouts.Setting:
        names = [feed.input for feed in feeds]
        kind = self._variable(names).kind
        dtype = _IN_MEMORY.get(kind, np.dtype(self._connectors[names[0]].dtype))
        counts = [self._unit.variables[name].count for name in names]
        copies = self._kept((layouts.Copy * len(feeds))())
        call = layouts.Setting(
            function=self._unit.setters[type_],
            reference=self._references(names),
            references=len(names),
            kind=kind,
            copy=copies,
            copies=len(feeds),
        )
        if kind is NativeKind.BINARY:
            call.is_binary = True
            call.elements = self._kept(np.zeros(2 * len(names), np.uintp)).ctypes.data
        else:
            elements = self._kept(np.zeros(max(sum(counts), 1), dtype))
            call.elements, call.count = elements.ctypes.data, sum(counts)
        item, offset = dtype.itemsize, 0
        for copy, feed, count in zip(copies, feeds, counts, strict=True):
            copy.source, copy.version = source.of(feed.component, feed.output)
            if kind is not NativeKind.BINARY:
                copy.to = call.elements + offset
                offset += count * item
                copy.size = count if kind is NativeKind.BOOLEAN32 else count * item
            self._copies.append((feed, copy))
        if kind not in {NativeKind.BINARY, NativeKind.BOOLEAN32} and _are_adjacent(copies):
            call.elements = copies[0].source  # no need to copy them
            for copy in copies:
                copy.to = copy.source
        return call

    # ---- stretches ----

    def room(self, points: int) -> int:
        """How much memory so many samples take [byte]."""
        return sum(_room(points * track.size) for track in self._tracks())

    def reserve(self, points: int, memory: Array) -> None:
        """Use `memory` for so many samples.

        Args:
            points: how many.
            memory: uint8, shape (byte,), as large as `room` says.
        """
        for track, name in zip(self._tracks(), self._recorded, strict=True):
            size = points * track.size
            self._rings[name] = memory[:size]
            track.row = memory.ctypes.data
            memory = memory[_room(size) :]

    def enter(self, t: Time, start: Time, published: Mapping[str, Signals]) -> None:
        """Take over what Python did since the last stretch."""
        self._start = start
        for name, value in self.participant.published.items():
            if value is not self._shown.get(name):
                self.published.put(name, value, self._library)
                self._shown[name] = value
        if self._pending is not self.published and self._is_under_way(t):
            for name, value in self.participant.pending.items():
                self._pending.put(name, value, self._library)
        owner = self._unit.owner
        for feed, copy in self._copies:
            version = ctypes.c_uint64.from_address(copy.version).value
            is_set = owner.is_written(feed.input, published[feed.component][feed.output])
            copy.seen = version if is_set else version - 1 & (1 << 64) - 1

    def _is_under_way(self, t: Time) -> bool:
        """Whether a step that was begun before `t` ends behind it."""
        return (t - self._start) % self.step_size != 0

    def show(self, scale: float) -> None:
        """Let Python see what was published."""
        if self.rows:
            self._shown = dict(self.published.values())
        pending = self._shown
        if self._pending is not self.published:
            pending = dict(self._pending.values())
        self.participant.go_on(self._shown, pending, int(self._table.spent * scale))

    def leave(self, t: Time, published: Mapping[str, Signals]) -> None:
        """Let the component go on where the engine was, when all units are shown."""
        written = {
            feed.input: published[feed.component][feed.output]
            for feed, copy in self._copies
            if copy.seen == ctypes.c_uint64.from_address(copy.version).value
        }
        under_way = self._is_under_way(t)
        read = self.participant.pending if under_way else self.participant.published
        self._unit.owner.adopt([feed.input for feed, _ in self._copies], written, dict(read))

    def times(self, t: Time) -> Array:
        """When it published in the stretch that began at `t` [ns], int64, shape (sample,)."""
        h = self.step_size
        first = t + h - (t - self._start) % h
        return first + h * np.arange(self.rows, dtype=np.int64)

    def samples(self, times: Array) -> Samples:
        """What it published in the last stretch.

        Args:
            times: as `times` says, shape (sample,).
        """
        count = self.rows
        rows = {}
        for track, name in zip(self._tracks(), self._recorded, strict=True):
            data = self._rings[name][: count * track.size]
            if track.is_binary:
                content = track.bytes
                binary = ctypes.string_at(content.data, content.size) if content.size else b""
                rows[name] = Rows(binary, data.view(np.int64))
            else:
                rows[name] = Rows(data.tobytes(), shape=self._unit.variables[name].shape)
        return Samples(times, rows)

    def fail(self, outcome: int, call: int, status: int, t: Time) -> ComponentError:
        """The error for what stopped the engine in the step from `t`."""
        owner = self._unit.owner
        try:
            if outcome == layouts.SET_FAILED:
                owner.setting_failed(*self._setting_names[call], status)
            elif outcome == layouts.STEP_FAILED:
                owner.step_failed(status, t, self.step_size)
            elif outcome == layouts.GET_FAILED:
                owner.getting_failed(list(self._groups)[call], status)
            elif outcome == layouts.NOT_FINITE:
                self.participant.check(self._pending.values(), t)
        except Exception as error:
            return self.participant.failure(t, error)
        return ComponentError(self.participant.name, t, "there is no room for its outputs")

    def release(self) -> None:
        """Free what the engine allocated, and let go of the component."""
        self._unit.owner.count_calls(None)
        for outputs in (self.published, self._pending):
            outputs.release(self._library)
        for track in self._tracks():
            self._library.plan_release(ctypes.byref(track.bytes))


class Sources:
    """Where units find the outputs of others.

    Args:
        system: all components.
        units: what the engine steps, by name.
        library: the engine.
    """

    def __init__(self, system: System, units: Mapping[str, UnitPlan], library: Any) -> None:
        read: defaultdict[str, list[str]] = defaultdict(list)
        for name in units:
            for feed in system.feeds[name]:
                if feed.component not in units and feed.output not in read[feed.component]:
                    read[feed.component].append(feed.output)
        self._units = units
        self.outside = {
            name: OutsideSources(name, outputs, system.connectors[name], library)
            for name, outputs in read.items()
        }

    def of(self, component: str, output: str) -> tuple[int, int]:
        """The addresses of an output and of the number that counts its values."""
        if component in self.outside:
            source = self.outside[component]
            return source.outputs.address(output), source.version(output)
        return self._units[component].source(output)


def _are_adjacent(copies: Sequence[layouts.Copy]) -> bool:
    """Whether the sources lie one after the other in memory, as they are to be set."""
    return all(one.source + one.size == other.source for one, other in pairwise(copies))


def _room(size: int) -> int:
    """Memory for the samples of one signal [byte].

    Rows of powers of two would all begin at the same place of a cache; so they are one line apart.
    """
    return (size // _CACHE_LINE + 2) * _CACHE_LINE


def _by_type(unit: NativeUnit, names: Sequence[str]) -> dict[str, list[str]]:
    groups: defaultdict[str, list[str]] = defaultdict(list)
    for name in names:
        groups[unit.variables[name].type].append(name)
    return dict(groups)
