"""Rates of change: those of inputs that an FMU is told, and those of outputs that it tells."""

import math
from collections.abc import Callable, Mapping, Sequence
from ctypes import c_size_t, c_void_p
from typing import Final

import numpy as np
from typing_extensions import override

from adapters.fmi.block import shape_of
from adapters.fmi.description import FmuDescription
from adapters.fmi.handle import Handle
from adapters.fmi.instance import OK, FmuInstance
from orchestrator.capabilities import CourseFollowing, OutputSlopes, VariableSteps
from orchestrator.course import Course
from orchestrator.signal import Array, Signal, Signals

_FMI2: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_void_p)
_FMI3: Final = (c_void_p, c_void_p, c_size_t, c_void_p, c_void_p, c_size_t)


class FmuCourses(CourseFollowing):
    """What an FMU is told of how its inputs run over the next step (FMI 2.0.4, section 4.2.1).

    Args:
        description: of the FMU.
    """

    def __init__(self, description: FmuDescription) -> None:
        self._input_degree = description.input_degree
        self._courses: Mapping[str, Course] = {}
        self._degrees: dict[str, int] = {}

    @property
    @override
    def input_degree(self) -> int:
        return self._input_degree

    @override
    def follow(self, courses: Mapping[str, Course]) -> None:
        self._courses = courses

    def forget(self) -> None:
        """Begin anew, with another instance."""
        self._courses, self._degrees = {}, {}

    def tell(self, instance: FmuInstance, t: float, h: float) -> None:
        """Set the derivatives for the step from `t` to `t + h` [s], behind its inputs.

        Those of an earlier step that no course speaks of any more are zero again.
        """
        courses, self._courses = self._courses, {}
        if not courses and not self._degrees:
            return
        for name, course in courses.items():
            self._degrees[name] = max(course.degree, self._degrees.get(name, 0))
        rates = {name: _rates(courses.get(name), n, h) for name, n in self._degrees.items() if n}
        if rates:
            instance.tell_rates(rates, t)


class FmuSlopes(OutputSlopes):
    """The derivatives of outputs that an FMU tells.

    Args:
        running: gives the instance.
    """

    def __init__(self, running: Callable[[], FmuInstance]) -> None:
        self._running = running

    @override
    def slopes(self) -> Signals:
        return self._running().told_rates()


def offered(
    description: FmuDescription, courses: FmuCourses, running: Callable[[], FmuInstance]
) -> list[object]:
    """The capabilities of an FMU that have to do with what happens within steps.

    Args:
        description: of the FMU.
        courses: of its inputs.
        running: gives the instance.
    """
    return [
        *([courses] if description.input_degree else []),
        *([FmuSlopes(running)] if description.slopes else []),
        *([VariableSteps()] if description.can_vary_steps else []),
    ]


def later(value: float, rates: Sequence[float], s: float) -> tuple[float, tuple[float, ...]]:
    """What an input and its derivatives are `s` [s] later.

    Args:
        value: of the input.
        rates: its derivatives, the first one first.
        s: positive.
    """
    taylor = (value, *rates)
    found = [
        sum(each * s**j / math.factorial(j) for j, each in enumerate(taylor[k:]))
        for k in range(len(taylor))
    ]
    return found[0], tuple(found[1:])


def _rates(course: Course | None, count: int, h: float) -> tuple[float, ...]:
    known = () if course is None else course.coefficients[1:]
    found = [math.factorial(k) * float(c) / h**k for k, c in enumerate(known, start=1)]
    return (*found, *[0.0] * (count - len(found)))


def tell_rates(
    handle: Handle, description: FmuDescription, rates: Mapping[str, Sequence[float]]
) -> None:
    """Set derivatives of inputs of an FMI 2.0 FMU with respect to time.

    Args:
        handle: of the instance.
        description: of the FMU.
        rates: by input, the first derivative first.

    Raises:
        FmuError: the FMU does not take them.
    """
    listed = [
        (description.variables[name].reference, order, value)
        for name, values in rates.items()
        for order, value in enumerate(values, start=1)
    ]
    references = np.array([each[0] for each in listed], np.uint32)
    orders = np.array([each[1] for each in listed], np.int32)
    elements = np.array([each[2] for each in listed], np.float64)
    status = handle.fmu.function("fmi2SetRealInputDerivatives", _FMI2)(
        handle.address, *_counted(references), orders.ctypes.data, elements.ctypes.data
    )
    if status != OK:
        names = ", ".join(f"`{name}`" for name in rates)
        most = int(orders.max())
        what = f"of {names} up to order {most} (`fmi.input_degree: {most - 1}` asks for less)"
        handle.guard.check(f"fmi2SetRealInputDerivatives {what}", status)


def told_rates(
    handle: Handle, description: FmuDescription, lengths: Mapping[str, int]
) -> dict[str, Signal]:
    """The first derivatives of outputs with respect to time [unit/s], of the shapes of these.

    Args:
        handle: of the instance.
        description: of the FMU.
        lengths: of structural parameters.

    Raises:
        FmuError: the FMU does not give them.
    """
    variables = [description.variables[name] for name in description.slopes]
    shapes = [shape_of(v, lengths) for v in variables]
    ends = np.cumsum([math.prod(shape) for shape in shapes])
    elements = np.empty(int(ends[-1]))
    function, types, more = _getter(description.version, elements)
    references = np.array([v.reference for v in variables], np.uint32)
    orders = np.ones(len(variables), np.int32)
    status = handle.fmu.function(function, types)(
        handle.address, *_counted(references), orders.ctypes.data, elements.ctypes.data, *more
    )
    if status != OK:
        handle.guard.check(function, status)
    return {
        v.name: part.reshape(shape)
        for v, shape, part in zip(variables, shapes, np.split(elements, ends[:-1]), strict=True)
    }


def _getter(version: int, elements: Array) -> tuple[str, tuple[object, ...], tuple[int, ...]]:
    if version == 2:
        return "fmi2GetRealOutputDerivatives", _FMI2, ()
    return "fmi3GetOutputDerivatives", _FMI3, (elements.size,)


def _counted(references: Array) -> tuple[int, int]:
    return references.ctypes.data, references.size
