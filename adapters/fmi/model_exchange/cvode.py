"""CVODE of SUNDIALS, which comes with FMPy: BDF of variable order and step, events by root finding.

FMPy's own class leaks most of what it allocates and loses what is raised in a callback, so this
one binds the functions itself.
"""

import ctypes
import functools
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from ctypes import c_char_p, c_double, c_int, c_int64, c_long, c_void_p
from typing import Any, Final

import numpy as np
from typing_extensions import override

from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange.solver import Problem, Reached, Solver
from orchestrator.errors import ComponentTypeError
from orchestrator.signal import Array

_BDF: Final = 2
_ONE_STEP: Final = 2
_ROOT: Final = 2
_RETRY, _STOP = 1, -1
"""What a callback returns: try elsewhere, or give up."""

_RATES: Final = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_void_p)
_SIGNS: Final = ctypes.CFUNCTYPE(c_int, c_double, c_void_p, c_void_p, c_void_p)
_JACOBIAN: Final = ctypes.CFUNCTYPE(
    c_int, c_double, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p
)
_MESSAGE: Final = ctypes.CFUNCTYPE(
    None, c_int, c_char_p, c_char_p, c_char_p, c_int, c_void_p, c_void_p
)
_FUNCTIONS: Final[dict[str, dict[str, tuple[Any, ...]]]] = {
    "sundials_core": {
        "SUNContext_Create": (c_int, c_int, c_void_p),
        "SUNContext_ClearErrHandlers": (c_int, c_void_p),
        "SUNContext_PushErrHandler": (c_int, c_void_p, _MESSAGE, c_void_p),
        "SUNContext_Free": (c_int, c_void_p),
        "SUNLinSolFree": (c_int, c_void_p),
    },
    "sundials_nvecserial": {
        "N_VNew_Serial": (c_void_p, c_int64, c_void_p),
        "N_VGetArrayPointer_Serial": (c_void_p, c_void_p),
        "N_VDestroy_Serial": (None, c_void_p),
    },
    "sundials_sunmatrixdense": {
        "SUNDenseMatrix": (c_void_p, c_int64, c_int64, c_void_p),
        "SUNDenseMatrix_Data": (c_void_p, c_void_p),
        "SUNMatDestroy_Dense": (None, c_void_p),
    },
    "sundials_sunlinsoldense": {"SUNLinSol_Dense": (c_void_p, c_void_p, c_void_p, c_void_p)},
    "sundials_cvode": {
        "CVodeCreate": (c_void_p, c_int, c_void_p),
        "CVodeInit": (c_int, c_void_p, _RATES, c_double, c_void_p),
        "CVodeReInit": (c_int, c_void_p, c_double, c_void_p),
        "CVodeSVtolerances": (c_int, c_void_p, c_double, c_void_p),
        "CVodeRootInit": (c_int, c_void_p, c_int, _SIGNS),
        "CVodeSetMaxStep": (c_int, c_void_p, c_double),
        "CVodeSetLinearSolver": (c_int, c_void_p, c_void_p, c_void_p),
        "CVodeSetJacFn": (c_int, c_void_p, _JACOBIAN),
        "CVodeSetStopTime": (c_int, c_void_p, c_double),
        "CVode": (c_int, c_void_p, c_double, c_void_p, c_void_p, c_int),
        "CVodeGetReturnFlagName": (c_char_p, c_long),
        "CVodeFree": (None, c_void_p),
    },
}


@functools.cache
def library() -> dict[str, Any]:
    """The functions of SUNDIALS, by name.

    Raises:
        ComponentTypeError: FMPy brings no SUNDIALS for this machine.
    """
    try:
        from fmpy.sundials import libraries  # noqa: PLC0415  (native libraries; not everywhere)
    except (ImportError, OSError, AssertionError) as error:
        what = "the solver `cvode` is not there for this machine; write `fmi.solver: dopri5`"
        raise ComponentTypeError(f"{what} ({error})") from error
    found: dict[str, Any] = {}
    for name, functions in _FUNCTIONS.items():
        for function, (result, *arguments) in functions.items():
            bound = getattr(libraries, name)[function]  # a new object: FMPy's keeps its types
            bound.restype, bound.argtypes = result, arguments
            found[function] = bound
    return found


class CVode(Solver):
    """Variable order and step: stiff and other problems, to a tolerance.

    Args:
        problem: to be integrated.
        tolerance: relative; the absolute one of a state is 0.01 of it times its nominal value
            (FMI 2.0.4, section 2.2.7).
        longest_step: upper bound of its steps [s].
    """

    def __init__(
        self, problem: Problem, *, tolerance: float, longest_step: float = math.inf
    ) -> None:
        self._call = library()
        self._problem = problem
        self._tolerance, self._longest = tolerance, longest_step
        self._t = 0.0
        self._failure: BaseException | None = None
        self._message = ""
        self._addresses: dict[int, int] = {}
        self._reached = c_double()
        self._frees: list[Callable[[], Any]] = []
        self._rates = _RATES(self._on_rates)  # SUNDIALS keeps their addresses
        self._signs = _SIGNS(self._on_signs)
        self._jacobian = _JACOBIAN(self._on_jacobian)
        self._receive = _MESSAGE(self._on_message)
        self._is_initialised = False
        try:
            self._allocate()
        except BaseException:
            self.free()
            raise

    def _allocate(self) -> None:
        call, size = self._call, self._problem.size
        context = c_void_p()
        self._check("SUNContext_Create", 0, ctypes.byref(context))
        self._frees.append(lambda: call["SUNContext_Free"](ctypes.byref(context)))
        self._check("SUNContext_ClearErrHandlers", context)  # they print
        self._check("SUNContext_PushErrHandler", context, self._receive, None)
        self._vector = self._made("N_VNew_Serial", size, context, free="N_VDestroy_Serial")
        self._tolerances = self._made("N_VNew_Serial", size, context, free="N_VDestroy_Serial")
        self._states = self._elements(self._address(self._vector), size)
        matrix = self._made("SUNDenseMatrix", size, size, context, free="SUNMatDestroy_Dense")
        self._columns = self._elements(call["SUNDenseMatrix_Data"](matrix), size, size)
        arguments = (self._vector, matrix, context)
        self._linear = self._made("SUNLinSol_Dense", *arguments, free="SUNLinSolFree")
        self._matrix = matrix
        self._memory = c_void_p(call["CVodeCreate"](_BDF, context))
        if self._memory.value is None:
            raise MemoryError
        self._frees.append(lambda: call["CVodeFree"](ctypes.byref(self._memory)))

    def _made(self, function: str, *arguments: Any, free: str) -> int:
        made: int | None = self._call[function](*arguments)
        if not made:
            raise MemoryError
        self._frees.append(lambda: self._call[free](made))
        return made

    @staticmethod
    def _elements(address: int, *shape: int) -> Array:
        """A view of float64 elements at `address`."""
        memory: Any = (c_double * math.prod(shape)).from_address(address)
        found: Array = np.frombuffer(memory, dtype=np.float64).reshape(shape)
        return found

    def _address(self, vector: int) -> int:
        """Where the elements of a vector are; they stay there."""
        found = self._addresses.get(vector)
        if found is None:
            found = self._call["N_VGetArrayPointer_Serial"](vector)
            self._addresses[vector] = found
        return found

    @property
    @override
    def states(self) -> Array:
        return self._states

    @override
    def restart(self, t: float, states: Array, nominals: Array) -> None:
        self._t = t
        self._states[:] = states
        absolute = self._elements(self._address(self._tolerances), len(states))
        absolute[:] = 0.01 * self._tolerance * nominals
        if self._is_initialised:
            self._check("CVodeReInit", self._memory, t, self._vector)
        else:
            self._initialise(t)
        self._check("CVodeSVtolerances", self._memory, self._tolerance, self._tolerances)

    def _initialise(self, t: float) -> None:
        self._check("CVodeInit", self._memory, self._rates, t, self._vector)
        self._is_initialised = True
        self._check("CVodeRootInit", self._memory, self._problem.indicators, self._signs)
        self._check("CVodeSetLinearSolver", self._memory, self._linear, self._matrix)
        if self._problem.has_jacobian:
            self._check("CVodeSetJacFn", self._memory, self._jacobian)
        if math.isfinite(self._longest):
            self._check("CVodeSetMaxStep", self._memory, self._longest)

    @override
    def advance(self, stop: float) -> Reached:
        self._check("CVodeSetStopTime", self._memory, stop)
        reached = ctypes.byref(self._reached)
        with self._raising():
            flag = self._call["CVode"](self._memory, stop, self._vector, reached, _ONE_STEP)
        if flag < 0:
            raise FmuError(f"the solver failed at {self._reached.value:.9g} s: {self._said(flag)}")
        t, before = self._reached.value, self._t
        if t <= before and flag != _ROOT:
            what = "its steps have become too short for the time to go on"
            raise FmuError(f"the solver failed at {t:.9g} s: {what}")
        self._t = t
        return Reached(t, is_event=flag == _ROOT)

    def _said(self, flag: int) -> str:
        name = self._call["CVodeGetReturnFlagName"](flag).decode()
        return f"{self._message} ({name})" if self._message else name

    def _check(self, function: str, *arguments: Any) -> None:
        with self._raising():
            flag = self._call[function](*arguments)
        if flag < 0:
            raise FmuError(f"{function} failed: {self._message or flag}")

    @contextmanager
    def _raising(self) -> Iterator[None]:
        """Raise what a callback has raised meanwhile."""
        self._message, self._failure = "", None
        yield
        failure, self._failure = self._failure, None
        if failure is not None:
            raise failure

    def _on_rates(self, t: float, states: int, rates: int, _: Any) -> int:
        return self._answer(
            lambda: self._problem.rates(t, self._address(states), self._address(rates))
        )

    def _on_signs(self, t: float, states: int, values: int, _: Any) -> int:
        return self._answer(lambda: self._problem.signs(t, self._address(states), values))

    def _on_jacobian(self, t: float, states: int, *_: Any) -> int:
        return self._answer(lambda: self._problem.jacobian(t, self._address(states), self._columns))

    def _answer(self, evaluate: Callable[[], bool]) -> int:
        """What a callback returns; nothing may be raised through C."""
        try:
            return 0 if evaluate() else _RETRY
        except BaseException as error:  # also Ctrl-C; raised again behind C
            self._failure = error
            return _STOP

    def _on_message(self, *words: Any) -> None:
        _, _, _, message, *_ = words
        self._message = (message or b"").decode("utf-8", "replace").strip()

    @override
    def free(self) -> None:
        while self._frees:
            self._frees.pop()()
