"""One instance of an FMI 2.0 co-simulation FMU."""

import ctypes
import itertools
import weakref
from collections.abc import Mapping, Sequence
from ctypes import c_double, c_int, c_size_t, c_void_p
from typing import Any, Final

import fmpy
import fmpy.fmi2
import numpy as np
import numpy.typing as npt
from typing_extensions import override

from adapters.fmi.block import Block
from adapters.fmi.errors import FmuError
from adapters.fmi.handle import FunctionNames
from adapters.fmi.instance import DISCARD, OK
from adapters.fmi.loaded import LoadedInstance
from adapters.fmi.messages import MessageLog
from adapters.fmi.rates import tell_rates
from adapters.fmi.unpacked import LoadedFmu

_VALUES: Final = (c_void_p, c_void_p, c_size_t, c_void_p)
_STEP: Final = (c_void_p, c_double, c_double, c_int)
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


class Fmi2Instance(LoadedInstance):
    """FMI 2.0.4, section 4.2: scalars only, synchronous steps."""

    names = FunctionNames(prefix="fmi2", instantiate="fmi2Instantiate", state="FMUstate")
    dtypes = _DTYPES

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
        instance: int | None = fmu.call(
            "fmi2Instantiate",
            name.encode(),
            fmpy.fmi2.fmi2CoSimulation,
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
                listed = ", ".join(f"`{name}`" for name in names)
                self._guard.check(f"fmi2Set{block.kind} of {listed}", status)

    @override
    def _write_string(self, reference: Any, pointer: Any) -> None:
        self._handle.call("fmi2SetString", reference, 1, pointer)

    @override
    def tell_rates(self, rates: Mapping[str, Sequence[float]]) -> None:
        tell_rates(self._handle, self._description, rates)

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
    def step(self, t: float, h: float) -> None:
        self._log.recent.clear()
        function = self._fmu.function("fmi2DoStep", _STEP)
        status = function(self._instance, t, h, int(not self._may_restore))
        self.judge_step(status, t, h)

    @override
    def judge_step(self, status: int, t: float, h: float) -> None:
        if status == DISCARD:
            self._guard.refuse("fmi2DoStep", status, self._progress())
        if status != OK:
            self._guard.check("fmi2DoStep", status)

    def _progress(self) -> str:
        """Why a step was discarded, as far as the FMU tells."""
        time, is_over = c_double(), c_int()
        self._fmu.call(
            "fmi2GetRealStatus", self._instance, _LAST_SUCCESSFUL_TIME, ctypes.byref(time)
        )
        self._fmu.call("fmi2GetBooleanStatus", self._instance, _TERMINATED, ctypes.byref(is_over))
        ends = "; the FMU asks to end the simulation" if is_over.value else ""
        return f" (the last successful time is {time.value:.9g} s{ends})"

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
