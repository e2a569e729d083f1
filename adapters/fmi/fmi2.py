"""One instance of an FMI 2.0 FMU; its steps are those of Co-Simulation."""

import ctypes
import itertools
import weakref
from collections.abc import Mapping, Sequence
from ctypes import c_double, c_int, c_size_t, c_void_p
from typing import Any, Final, NamedTuple

import fmpy
import fmpy.fmi2
import numpy as np
import numpy.typing as npt
from typing_extensions import override

from adapters.fmi.block import Block
from adapters.fmi.errors import FmuError, listed
from adapters.fmi.handle import FunctionNames
from adapters.fmi.instance import DISCARD, OK
from adapters.fmi.kind import Kind
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.outcome import MADE, StepOutcome
from adapters.fmi.parcels import Parcel
from adapters.fmi.rates import later, tell_rates
from adapters.fmi.unpacked import LoadedFmu

_VALUES: Final = (c_void_p, c_void_p, c_size_t, c_void_p)
_STEP: Final = (c_void_p, c_double, c_double, c_int)
_DERIVATIVE: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_void_p)
_DTYPES: Final[Mapping[str, npt.DTypeLike]] = {
    "Real": np.float64,
    "Integer": np.int32,
    "Boolean": np.int32,  # fmi2Boolean is an int
}
_LAST_SUCCESSFUL_TIME, _TERMINATED = 2, 3  # fmi2StatusKind

# FMPy's native helper, which formats messages with C's printf, knows one receiver in a process;
# the component environment tells it whose message it is.
_LOGS: "weakref.WeakValueDictionary[int, MessageLog]" = weakref.WeakValueDictionary()
_NUMBERS: Final = itertools.count(1)


@fmpy.fmi2.fmi2CallbackLoggerTYPE  # type: ignore[untyped-decorator]  # FMPy has no types
def _on_message(
    environment: int | None, _: bytes, status: int, category: bytes, message: bytes
) -> None:
    log = _LOGS.get(environment or 0)
    if log is not None:
        log.receive(status, category, message)


class _Told(NamedTuple):
    """What the FMU was told of its inputs before a step.

    Attributes:
        time: where the step begins [s].
        values: of inputs.
        rates: their derivatives, the first one first.
    """

    time: float
    values: Mapping[str, float]
    rates: Mapping[str, Sequence[float]]


class Fmi2Instance(LoadedInstance):
    """FMI 2.0.4, section 4.2: scalars only, synchronous steps."""

    names = FunctionNames(
        prefix="fmi2",
        instantiate="fmi2Instantiate",
        state="FMUstate",
        deserialize="fmi2DeSerializeFMUstate",
        directional="fmi2GetDirectionalDerivative",
    )
    dtypes = _DTYPES
    _told: "_Told | None" = None

    @override
    def _instantiate(self, name: str, fmu: LoadedFmu) -> int | None:
        number = next(_NUMBERS)
        _LOGS[number] = self._log
        callbacks = fmpy.fmi2.fmi2CallbackFunctions()
        callbacks.logger = _on_message
        callbacks.allocateMemory = fmpy.fmi2.defaultCallbacks.allocateMemory
        callbacks.freeMemory = fmpy.fmi2.defaultCallbacks.freeMemory
        callbacks.componentEnvironment = number
        _format_messages(callbacks)
        self._callbacks = callbacks  # the FMU keeps the address
        resources = fmu.resources
        is_stepped = self._description.kind is Kind.CO_SIMULATION
        instance: int | None = fmu.call(
            "fmi2Instantiate",
            name.encode(),
            fmpy.fmi2.fmi2CoSimulation if is_stepped else fmpy.fmi2.fmi2ModelExchange,
            self._description.token.encode(),
            resources.as_uri().encode(),
            ctypes.byref(callbacks),
            0,
            int(self._log.is_verbose),
        )
        return instance

    @override
    def configure(self, lengths: Mapping[str, int]) -> None:
        if lengths:
            raise FmuError("FMI 2.0 has no structural parameters")

    @override
    def _write_block(self, block: Block, names: list[str]) -> None:
        function = self._fmu.function(f"fmi2Set{block.kind}", _VALUES)
        for references, count, address, _ in block.calls(names):
            status = function(self._instance, references, count, address)
            if status != OK:
                self._guard.check(f"fmi2Set{block.kind} of {listed(names)}", status)

    @override
    def _write_parcel(self, parcel: Parcel, elements: Sequence[bytes]) -> None:
        pointers = (ctypes.c_char_p * len(elements))(*elements)
        self._move("fmi2SetString", parcel, pointers)

    @override
    def _read_parcel(self, parcel: Parcel) -> list[bytes]:
        pointers = (ctypes.c_char_p * len(parcel.names))()
        self._move("fmi2GetString", parcel, pointers)
        return [text or b"" for text in pointers]

    def _move(self, name: str, parcel: Parcel, pointers: Any) -> None:
        function = self._fmu.function(name, _VALUES)
        status = function(self._instance, parcel.references, len(pointers), pointers)
        if status != OK:
            self._guard.check(f"{name} of {listed(parcel.names)}", status)

    @override
    def _call_derivative(self, function: str, arguments: Sequence[Any]) -> None:
        unknowns, knowns, (seed, _, found, _) = arguments[:2], arguments[2:4], arguments[4:]
        entry = self._fmu.function(function, _DERIVATIVE)
        self._guard.check(function, entry(self._instance, *unknowns, *knowns, seed, found))

    @override
    def tell_rates(self, rates: Mapping[str, Sequence[float]], t: float) -> None:
        values = {name: float(self._block_of[name].views[name]) for name in rates}
        self._told = _Told(t, values, rates)
        tell_rates(self._handle, self._description, rates)

    def _tell_again(self, told: "_Told", t: float) -> None:
        """Set what inputs are at `t` [s], within a step that is made in several calls."""
        changed = {n: later(told.values[n], told.rates[n], t - told.time) for n in told.rates}
        self.write({name: np.array(value) for name, (value, _) in changed.items()})
        tell_rates(self._handle, self._description, {n: rates for n, (_, rates) in changed.items()})

    @override
    def enter_initialisation(
        self, t: float, *, stop: float | None, tolerance: float | None
    ) -> None:
        self._handle.call(
            "fmi2SetupExperiment",
            int(tolerance is not None),
            tolerance or 0.0,
            t,
            int(stop is not None),
            stop or 0.0,
        )
        self._handle.call("fmi2EnterInitializationMode")

    @override
    def step(self, t: float, h: float) -> StepOutcome:
        self._log.recent.clear()
        if self._told is not None and t > self._told.time:
            self._tell_again(self._told, t)
        function = self._fmu.function("fmi2DoStep", _STEP)
        status = function(self._instance, t, h, int(not self._may_restore))
        return MADE if status == OK else self.outcome(status, t)

    @override
    def outcome(self, status: int, t: float) -> StepOutcome:
        if status != DISCARD:
            self._guard.check("fmi2DoStep", status)
            return MADE
        time, is_over = c_double(t), c_int()
        for kind, function, value in (
            (_LAST_SUCCESSFUL_TIME, "fmi2GetRealStatus", time),
            (_TERMINATED, "fmi2GetBooleanStatus", is_over),
        ):
            before = value.value
            if self._fmu.call(function, self._instance, kind, ctypes.byref(value)) != OK:
                value.value = before  # an FMU need not know
        return StepOutcome(time=time.value, is_discarded=True, wants_end=bool(is_over.value))

    @override
    def _read_block(self, block: Block, elements: Any) -> None:
        function = self._fmu.function(f"fmi2Get{block.kind}", _VALUES)
        status = function(self._instance, block.references, len(block.variables), elements)
        if status != OK:
            self._guard.check(f"fmi2Get{block.kind}", status)


def _format_messages(callbacks: Any) -> None:
    """Let the printf arguments of messages be filled in, where FMPy can do that."""
    try:
        from fmpy.logging import addLoggerProxy  # noqa: PLC0415  (a native library; not everywhere)
    except (ImportError, OSError):
        return
    addLoggerProxy(ctypes.byref(callbacks))
