"""The functions that Model Exchange adds to those of every FMU."""

import abc
import ctypes
from ctypes import c_double, c_size_t, c_void_p
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from typing_extensions import override

from adapters.fmi.handle import Handle
from adapters.fmi.instance import DISCARD, OK
from orchestrator.signal import Array

_PLAIN: Final = (c_void_p,)
_TIME: Final = (c_void_p, c_double)
_VECTOR: Final = (c_void_p, c_void_p, c_size_t)


@dataclass(frozen=True, slots=True, kw_only=True)
class Update:
    """What an FMU says when its discrete states have been updated.

    Attributes:
        is_incomplete: they have to be updated again.
        is_over: the FMU asks to end the simulation.
        next_event: when its next time event is [s]; `None` if it does not know of one.
    """

    is_incomplete: bool
    is_over: bool
    next_event: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class CompletedStep:
    """What an FMU says about a completed step of the solver.

    Attributes:
        is_event: there is a step event.
        is_over: the FMU asks to end the simulation.
    """

    is_event: bool
    is_over: bool


class ContinuousFunctions(abc.ABC):
    """Functions of one instance (FMI 2.0.4, section 3.2; FMI 3.0.2, section 3.2).

    Vectors are addresses of float64 elements. Those functions that a solver calls at points of
    its choice return whether the FMU could evaluate them there; `Discard` says that it could not.

    Args:
        handle: of the instance.
        prefix: of the names of functions.
        rates: what the function for derivatives is called.
    """

    def __init__(self, handle: Handle, prefix: str, rates: str) -> None:
        self._handle, self._prefix = handle, prefix
        self._instance = handle.address
        self._rates = rates
        function = handle.fmu.function
        self._set_time = function(f"{prefix}SetTime", _TIME)
        self._set_states = function(f"{prefix}SetContinuousStates", _VECTOR)
        self._get_rates = function(f"{prefix}{rates}", _VECTOR)
        self._get_indicators = function(f"{prefix}GetEventIndicators", _VECTOR)

    def set_time(self, t: float) -> bool:
        """Let it be `t` [s]."""
        return self._accept("SetTime", self._set_time(self._instance, t))

    def set_states(self, address: int, count: int) -> bool:
        """Set the continuous states."""
        return self._accept("SetContinuousStates", self._set_states(self._instance, address, count))

    def get_rates(self, address: int, count: int) -> bool:
        """Get the derivatives of the continuous states."""
        return self._accept(self._rates, self._get_rates(self._instance, address, count))

    def get_indicators(self, address: int, count: int) -> bool:
        """Get the event indicators."""
        return self._accept(
            "GetEventIndicators", self._get_indicators(self._instance, address, count)
        )

    def _accept(self, name: str, status: int) -> bool:
        if status == OK:
            return True
        if status == DISCARD:
            return False
        self._handle.guard.check(self._prefix + name, status)
        return True

    def states(self, count: int) -> Array:
        """The continuous states, float64, shape (count,)."""
        return self._vector("GetContinuousStates", count)

    def nominals(self, count: int) -> Array:
        """Their nominal values, float64, shape (count,)."""
        return self._vector("GetNominalsOfContinuousStates", count)

    def _vector(self, name: str, count: int) -> Array:
        found = np.zeros(count)
        if count:
            self._call(name, _VECTOR, found.ctypes.data, count)
        return found

    def enter_event_mode(self) -> None:
        """Let discrete variables change."""
        self._call("EnterEventMode", _PLAIN)

    def enter_continuous_time_mode(self) -> None:
        """Let time go on."""
        self._call("EnterContinuousTimeMode", _PLAIN)

    def _call(self, name: str, types: tuple[Any, ...], *arguments: Any) -> None:
        function = self._handle.fmu.function(self._prefix + name, types)
        self._handle.guard.check(self._prefix + name, function(self._instance, *arguments))

    @abc.abstractmethod
    def counts(self, states: int, indicators: int) -> tuple[int, int]:
        """How many continuous states and event indicators there are.

        Args:
            states: as many as the description has.
            indicators: likewise.
        """

    @abc.abstractmethod
    def update(self) -> Update:
        """Update the discrete states, once."""

    @abc.abstractmethod
    def complete_step(self, *, keeps_state: bool) -> CompletedStep:
        """Say that a step of the solver is complete.

        Args:
            keeps_state: whether no state before this point will be returned to.
        """

    @abc.abstractmethod
    def directional(self, unknowns: Array, knowns: Array, seed: Array, found: Array) -> bool:
        """Get derivatives of `unknowns` along a change of `knowns`.

        Args:
            unknowns: value references, uint32, shape (unknown,).
            knowns: value references, uint32, shape (known,).
            seed: the change, float64, shape (known,).
            found: is filled with the derivatives, float64, shape (unknown,).
        """


class Functions2(ContinuousFunctions):
    """Those of FMI 2.0."""

    def __init__(self, handle: Handle) -> None:
        super().__init__(handle, "fmi2", "GetDerivatives")
        self._info = _EventInfo2()
        self._flags = (ctypes.c_int * 2)()

    @override
    def counts(self, states: int, indicators: int) -> tuple[int, int]:
        return states, indicators

    @override
    def update(self) -> Update:
        self._call("NewDiscreteStates", (c_void_p, c_void_p), ctypes.addressof(self._info))
        info = self._info
        return Update(
            is_incomplete=bool(info.incomplete),
            is_over=bool(info.over),
            next_event=info.next_event if info.has_next_event else None,
        )

    @override
    def complete_step(self, *, keeps_state: bool) -> CompletedStep:
        first = ctypes.addressof(self._flags)
        types = (c_void_p, ctypes.c_int, c_void_p, c_void_p)
        self._call("CompletedIntegratorStep", types, int(keeps_state), first, first + 4)
        return CompletedStep(is_event=bool(self._flags[0]), is_over=bool(self._flags[1]))

    @override
    def directional(self, unknowns: Array, knowns: Array, seed: Array, found: Array) -> bool:
        types = (c_void_p, c_void_p, c_size_t, c_void_p, c_size_t, c_void_p, c_void_p)
        function = self._handle.fmu.function("fmi2GetDirectionalDerivative", types)
        status = function(
            self._instance,
            *(unknowns.ctypes.data, unknowns.size),
            *(knowns.ctypes.data, knowns.size),
            seed.ctypes.data,
            found.ctypes.data,
        )
        return self._accept("GetDirectionalDerivative", status)


class _EventInfo2(ctypes.Structure):
    _fields_ = (
        ("incomplete", ctypes.c_int),
        ("over", ctypes.c_int),
        ("nominals_changed", ctypes.c_int),
        ("states_changed", ctypes.c_int),
        ("has_next_event", ctypes.c_int),
        ("next_event", c_double),
    )


class Functions3(ContinuousFunctions):
    """Those of FMI 3.0."""

    def __init__(self, handle: Handle) -> None:
        super().__init__(handle, "fmi3", "GetContinuousStateDerivatives")
        self._flags = (ctypes.c_bool * 5)()
        self._next = c_double()
        self._count = c_size_t()

    @override
    def counts(self, states: int, indicators: int) -> tuple[int, int]:
        del states, indicators
        found = []
        for name in ("GetNumberOfContinuousStates", "GetNumberOfEventIndicators"):
            self._call(name, (c_void_p, c_void_p), ctypes.addressof(self._count))
            found.append(self._count.value)
        return found[0], found[1]

    @override
    def update(self) -> Update:
        first = ctypes.addressof(self._flags)
        addresses = (*(first + k for k in range(5)), ctypes.addressof(self._next))
        self._call("UpdateDiscreteStates", (c_void_p,) * 7, *addresses)
        incomplete, over, _, _, has_next = self._flags
        return Update(
            is_incomplete=incomplete,
            is_over=over,
            next_event=self._next.value if has_next else None,
        )

    @override
    def complete_step(self, *, keeps_state: bool) -> CompletedStep:
        first = ctypes.addressof(self._flags)
        types = (c_void_p, ctypes.c_bool, c_void_p, c_void_p)
        self._call("CompletedIntegratorStep", types, keeps_state, first, first + 1)
        return CompletedStep(is_event=self._flags[0], is_over=self._flags[1])

    @override
    def directional(self, unknowns: Array, knowns: Array, seed: Array, found: Array) -> bool:
        types = (c_void_p, *(c_void_p, c_size_t) * 4)
        function = self._handle.fmu.function("fmi3GetDirectionalDerivative", types)
        vectors = (unknowns, knowns, seed, found)
        arguments = (word for each in vectors for word in (each.ctypes.data, each.size))
        return self._accept("GetDirectionalDerivative", function(self._instance, *arguments))
