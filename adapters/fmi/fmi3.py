"""One instance of an FMI 3.0 FMU; its steps are not those of Model Exchange."""

import ctypes
import functools
import struct
from collections.abc import Mapping, Sequence
from ctypes import c_bool, c_double, c_size_t, c_void_p
from typing import Any, Final

import fmpy
import fmpy.fmi3
import numpy as np
from typing_extensions import override

from adapters.fmi.block import Block, blocks
from adapters.fmi.clocks import Clocks, Memory
from adapters.fmi.description import FmuDescription
from adapters.fmi.errors import FmuError, listed
from adapters.fmi.event_mode import EventMode, Events
from adapters.fmi.handle import FunctionNames
from adapters.fmi.instance import DISCARD, OK
from adapters.fmi.intermediate import IntermediateUpdates
from adapters.fmi.kind import Kind
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.outcome import MADE, StepOutcome
from adapters.fmi.parcels import Parcel, parcels
from adapters.fmi.schedule import Announcements, Schedule
from adapters.fmi.unpacked import LoadedFmu
from adapters.fmi.variable import DTYPES, FmuVariable
from orchestrator.signal import Signal

_TIME: Final = struct.Struct("<d")
_ARRAYS: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_size_t)
_BINARIES: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_size_t)
_DERIVATIVE: Final = (c_void_p, *(c_void_p, c_size_t) * 4)
_STEP: Final = (c_void_p, c_double, c_double, c_bool, c_void_p, c_void_p, c_void_p, c_void_p)


class Fmi3Instance(LoadedInstance):
    """FMI 3.0.2, sections 2.2 and 4.2.

    Args:
        description: of the FMU.
        name: of the instance.
        log: receives what the FMU says.
        may_restore: whether a step may be followed by a return to a state before it.
        uses_events: whether its events are handled with it.
    """

    names = FunctionNames(
        prefix="fmi3",
        instantiate="fmi3InstantiateCoSimulation",
        state="FMUState",
        deserialize="fmi3DeserializeFMUState",
        directional="fmi3GetDirectionalDerivative",
    )
    dtypes = DTYPES

    def __init__(
        self,
        description: FmuDescription,
        name: str,
        log: MessageLog,
        *,
        may_restore: bool,
        uses_events: bool = False,
    ) -> None:
        # a step that returned early is followed by a shorter one
        may_vary = description.has_variable_steps
        self._may_return_early = (description.may_return_early or uses_events) and may_vary
        self._uses_events = uses_events
        self._announcements = Announcements()
        self._is_clocked = False  # clocked inputs are set as all others until initialisation ends
        self._clocked = {e for v in description.of("input") if v.is_clocked for e in v.elements}
        self._updates = IntermediateUpdates(
            [description.variables[n] for n in description.intermediate],
            self.dtypes,
            log,
            self._read_block,
        )
        super().__init__(description, name, log, may_restore=may_restore)
        self._clocks = Clocks(
            description.variables.values(), self._handle, self._read_variables, super().write
        )
        self._events: Events = (
            Schedule(self._handle, self._clocks, self._announcements)
            if description.is_scheduled
            else EventMode(self._handle, self._do_step, self._clocks, may_vary=may_vary)
        )
        self._memories: dict[int, tuple[float, Memory]] = {}
        self._flags = [c_bool(), c_bool(), c_bool()]
        self._last_time = c_double()
        self._step_results = [*map(ctypes.byref, self._flags), ctypes.byref(self._last_time)]
        categories = [c for c in description.log_categories if c.startswith("logStatus")]
        if categories and not log.is_verbose:
            names = (ctypes.c_char_p * len(categories))(*(c.encode() for c in categories))
            count = len(categories)
            self._fmu.call("fmi3SetDebugLogging", self._instance, True, count, names)  # noqa: FBT003

    @override
    def _instantiate(self, name: str, fmu: LoadedFmu) -> int | None:
        receive = self._log.receive

        def on_message(_: Any, status: int, category: bytes, message: bytes) -> None:
            receive(status, category, message)

        self._callback = fmpy.fmi3.fmi3LogMessageCallback(on_message)
        is_verbose = self._log.is_verbose
        resources = fmu.resources
        named = (
            name.encode(),
            self._description.token.encode(),
            f"{resources}/".encode() if resources.is_dir() else None,
            False,  # visible
            is_verbose,
        )
        instance: int | None
        if self._description.kind is Kind.MODEL_EXCHANGE:
            instance = fmu.call("fmi3InstantiateModelExchange", *named, None, self._callback)
            return instance
        if self._description.is_scheduled:
            return self._announcements.instantiate(fmu, named, self._callback)
        instance = fmu.call(
            "fmi3InstantiateCoSimulation",
            *named,
            self._uses_events,
            self._may_return_early,
            self._updates.references if self._updates.count else None,
            self._updates.count,
            None,
            self._callback,
            self._updates.callback,
        )
        return instance

    @override
    def _resize_blocks(self) -> None:
        super()._resize_blocks()
        self._updates.resize(self._lengths)

    @override
    def configure(self, lengths: Mapping[str, int]) -> None:
        self._handle.call("fmi3EnterConfigurationMode")
        self.write({name: np.array(n, np.uint64) for name, n in lengths.items()})
        self._handle.call("fmi3ExitConfigurationMode")
        self._lengths.update(lengths)
        self._resize_blocks()

    @override
    def _write_block(self, block: Block, names: list[str]) -> None:
        function = self._fmu.function(f"fmi3Set{block.kind}", _ARRAYS)
        for references, count, address, size in block.calls(names):
            status = function(self._instance, references, count, address, size)
            if status != OK:
                self._guard.check(f"fmi3Set{block.kind} of {listed(names)}", status)

    @override
    def _write_parcel(self, parcel: Parcel, elements: Sequence[bytes]) -> None:
        sizes = (c_size_t * len(elements))(*map(len, elements))
        pointers = (ctypes.c_char_p * len(elements))(*elements)
        self._move("Set", parcel, sizes, pointers)

    @override
    def _read_parcel(self, parcel: Parcel) -> list[bytes]:
        count = len(parcel.names)
        sizes, pointers = (c_size_t * count)(), (c_void_p * count)()
        self._move("Get", parcel, sizes, pointers)
        is_text = parcel.kind == "String"
        return [  # copied at once: the FMU may reuse its memory at the next call
            b"" if not pointer else ctypes.string_at(pointer, -1 if is_text else size)
            for pointer, size in zip(pointers, sizes, strict=True)
        ]

    def _move(self, what: str, parcel: Parcel, sizes: Any, pointers: Any) -> None:
        name, count = f"fmi3{what}{parcel.kind}", len(pointers)
        references = (self._instance, parcel.references, len(parcel.references))
        if parcel.kind == "String":
            status = self._fmu.function(name, _ARRAYS)(*references, pointers, count)
        else:
            status = self._fmu.function(name, _BINARIES)(*references, sizes, pointers, count)
        if status != OK:
            self._guard.check(f"{name} of {listed(parcel.names)}", status)

    @override
    def _call_derivative(self, function: str, arguments: Sequence[Any]) -> None:
        status = self._fmu.function(function, _DERIVATIVE)(self._instance, *arguments)
        self._guard.check(function, status)

    @override
    def enter_initialisation(
        self, t: float, *, stop: float | None, tolerance: float | None
    ) -> None:
        self._handle.call(
            "fmi3EnterInitializationMode",
            tolerance is not None,
            tolerance or 0.0,
            t,
            stop is not None,
            stop or 0.0,
        )

    @property
    @override
    def uses_events(self) -> bool:
        return self._uses_events

    @override
    def exit_initialisation(self, t: float) -> bool:
        self._clocks.start(t)
        super().exit_initialisation(t)
        self._is_clocked = True
        return self._uses_events and self._events.begin(t)

    @override
    def begin_step(self) -> None:
        self._clocks.forget_ticks()

    @override
    def write(self, values: Mapping[str, Signal]) -> None:
        if self._is_clocked and not self._clocked.isdisjoint(values):
            self._clocks.offer({n: v for n, v in values.items() if n in self._clocked})
            values = {n: v for n, v in values.items() if n not in self._clocked}
        super().write(values)

    @override
    def write_jumps(self, values: Mapping[str, Signal], t: float) -> bool:
        if not self._uses_events:
            return super().write_jumps(values, t)
        clocks = self._clocks.triggered(values)
        plain = {n: v for n, v in values.items() if self._variable_of[n].clock is None}
        return self._events.handle(t, functools.partial(self.write, plain), clocks)

    @override
    def read(self) -> dict[str, Signal]:
        clocked = {n: v for n, v in self._clocks.values().items() if self._is_selected(n)}
        return super().read() | clocked

    def _read_variables(self, variables: Sequence[FmuVariable]) -> dict[str, Signal]:
        """Get some of the outputs only."""
        found: dict[str, Signal] = {}
        for block in blocks(variables, self.dtypes):
            block.resize(self._lengths)
            found.update(self._read_elements(block))
        for parcel in parcels(variables):
            found.update(zip(parcel.names, self._read_parcel(parcel), strict=True))
        return found

    @override
    def save(self) -> int:
        state = super().save()
        self._memories[state] = self._events.announced, self._clocks.remember()
        return state

    @override
    def restore(self, state: int, lengths: Mapping[str, int] | None) -> None:
        super().restore(state, lengths)
        self._events.announced, memory = self._memories[state]
        self._clocks.recall(memory)

    @override
    def serialize(self, state: int) -> bytes:
        return _TIME.pack(self._memories[state][0]) + super().serialize(state)

    @override
    def deserialize(self, content: bytes) -> int:
        state = super().deserialize(content[_TIME.size :])
        (announced,) = _TIME.unpack_from(content)
        self._memories[state] = announced, self._clocks.remember()
        return state

    @override
    def forget(self, state: int) -> None:
        super().forget(state)
        self._memories.pop(state, None)

    @override
    def step(self, t: float, h: float) -> StepOutcome:
        return self._events.step(t, h) if self._uses_events else self._do_step(t, h)

    def _do_step(self, t: float, h: float) -> StepOutcome:
        self._log.recent.clear()
        function = self._fmu.function("fmi3DoStep", _STEP)
        self._last_time.value = t
        status = function(self._instance, t, h, not self._may_restore, *self._step_results)
        needs_event, is_over, is_early = self._flags
        is_event = needs_event.value and self._uses_events
        if status == OK and not (is_over.value or is_early.value or is_event):
            return MADE
        return self.outcome(status, t)

    @override
    def outcome(self, status: int, t: float) -> StepOutcome:
        is_discarded = status == DISCARD
        if status > OK and not is_discarded:
            self._guard.check("fmi3DoStep", status)
        needs_event, is_over, is_early = (flag.value for flag in self._flags)
        reached = self._last_time.value
        if is_early and not self._may_return_early:
            raise FmuError(
                f"fmi3DoStep returned early, at {reached:.9g} s, although that was not allowed"
            )
        return StepOutcome(
            time=reached if is_discarded or is_early else None,
            is_discarded=is_discarded,
            is_early=is_early and not is_discarded,
            wants_end=is_over,
            needs_event=needs_event,
        )

    @override
    def _flag_addresses(self) -> tuple[int, ...]:
        return tuple(map(ctypes.addressof, self._flags))

    @override
    def _last_time_address(self) -> int:
        return ctypes.addressof(self._last_time)

    @override
    def _read_block(self, block: Block, elements: Any) -> None:
        function = self._fmu.function(f"fmi3Get{block.kind}", _ARRAYS)
        count = len(block.variables)
        status = function(self._instance, block.references, count, elements, block.size)
        if status != OK:
            self._guard.check(f"fmi3Get{block.kind}", status)
