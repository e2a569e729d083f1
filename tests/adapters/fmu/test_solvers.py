"""Solvers of differential equations: order, tolerance, events, memory."""

import ctypes
import math
import resource
from collections.abc import Callable

import numpy as np
import pytest
from typing_extensions import override

from adapters.fmi.errors import FmuError
from adapters.fmi.model_exchange import solvers
from adapters.fmi.model_exchange.cvode import CVode
from adapters.fmi.model_exchange.dormand_prince import DormandPrince
from adapters.fmi.model_exchange.one_step import FixedStep, euler, rk4
from adapters.fmi.model_exchange.solver import Problem, Solver
from orchestrator.signal import Array


def vector(address: int, size: int) -> Array:
    return np.ctypeslib.as_array((ctypes.c_double * size).from_address(address))


class Written(Problem):
    """Made of functions."""

    def __init__(
        self,
        size: int,
        rates: Callable[[float, Array], Array | None],
        signs: Callable[[float, Array], float] | None = None,
        jacobian: Callable[[float, Array], Array] | None = None,
    ) -> None:
        self.size, self.indicators = size, int(signs is not None)
        self.has_jacobian = jacobian is not None
        self._functions = rates, signs, jacobian
        self.calls = 0
        self.latest = -math.inf

    @override
    def rates(self, t: float, states: int, rates: int) -> bool:
        self.calls += 1
        self.latest = max(self.latest, t)
        found = self._functions[0](t, vector(states, self.size))
        if found is not None:
            vector(rates, self.size)[:] = found
        return found is not None

    @override
    def signs(self, t: float, states: int, values: int) -> bool:
        assert self._functions[1] is not None
        self.latest = max(self.latest, t)
        vector(values, 1)[0] = self._functions[1](t, vector(states, self.size))
        return True

    @override
    def jacobian(self, t: float, states: int, columns: Array) -> bool:
        assert self._functions[2] is not None
        columns[:] = self._functions[2](t, vector(states, self.size)).T
        return True


def integrate(solver: Solver, start: Array, stop: float) -> tuple[float, Array, bool]:
    """Up to `stop`, or an event: time, states, whether there was one."""
    solver.restart(0.0, start, np.ones(len(start)))
    t, is_event = 0.0, False
    while t < stop and not is_event:
        reached = solver.advance(stop)
        assert reached.t > t
        t, is_event = reached.t, reached.is_event
    states = solver.states.copy()
    solver.free()
    solver.free()
    return t, states, is_event


def decay(_: float, x: Array) -> Array:
    return np.asarray(-x)


@pytest.mark.parametrize(("method", "order"), [(euler, 1.0), (rk4, 4.0)])
def test_the_error_of_fixed_steps_falls_with_the_order_of_the_method(
    method: Callable[..., Array], order: float
) -> None:
    """x' = -x until 1; 0.3 is no multiple of the step, which is shortened."""
    steps = (0.3, 0.1, 0.04, 0.02)
    errors = []
    for step in steps:
        solver = FixedStep(Written(1, decay), method, step=step)
        t, x, _ = integrate(solver, np.ones(1), 1.0)
        assert t == 1.0
        errors.append(abs(x[0] - math.exp(-1.0)))
    even = [1 / math.ceil(1 / step - 1e-9) for step in steps]
    assert np.polyfit(np.log(even), np.log(errors), 1)[0] == pytest.approx(order, abs=0.12)


def test_the_number_of_fixed_steps_is_the_smallest_that_is_short_enough() -> None:
    for stop, step, count in ((1.0, 0.1, 10), (0.3, 0.1, 3), (1.0, 0.3, 4), (1.0, math.inf, 1)):
        problem = Written(1, decay)
        integrate(FixedStep(problem, euler, step=step), np.ones(1), stop)
        assert problem.calls == count


CONTROLLED: dict[str, Callable[..., Solver]] = {"cvode": CVode, "dopri5": DormandPrince}


@pytest.mark.parametrize("solver", CONTROLLED)
def test_the_error_falls_with_the_tolerance(solver: str) -> None:
    """Over six powers of ten nearly in proportion."""
    tolerances = (1e-4, 1e-6, 1e-8, 1e-10)
    errors = []
    for tolerance in tolerances:
        _, x, _ = integrate(
            CONTROLLED[solver](Written(1, decay), tolerance=tolerance), np.ones(1), 5.0
        )
        errors.append(abs(x[0] - math.exp(-5.0)))
        assert errors[-1] < 2 * tolerance
    assert np.polyfit(np.log(tolerances), np.log(errors), 1)[0] == pytest.approx(0.9, abs=0.2)


@pytest.mark.parametrize("kind", CONTROLLED)
def test_the_absolute_tolerance_goes_by_nominal_values(kind: str) -> None:
    """A state that is small for its nominal value need not be exact, and costs fewer calls."""
    calls = []
    for nominal in (1e-6, 0.05, 1e6):
        problem = Written(1, decay)
        solver = CONTROLLED[kind](problem, tolerance=1e-6)
        solver.restart(0.0, np.full(1, 1e-3), np.full(1, nominal))
        while solver.advance(20.0).t < 20.0:
            pass
        solver.free()
        calls.append(problem.calls)
    assert calls[2] < calls[1] < calls[0]
    assert calls[2] < calls[0] / 4


@pytest.mark.parametrize("kind", CONTROLLED)
def test_absolute_and_relative_tolerance_add_up(kind: str) -> None:
    """x swings around 1 by 1 percent: with a nominal value of 100 both are the same.

    Together they ask for no more than a relative tolerance twice as large alone.
    """
    calls = []
    for nominal, tolerance in ((1e-6, 1e-7), (100.0, 1e-7), (1e-6, 2e-7)):
        problem = Written(1, lambda t, _: np.array([0.1 * math.cos(10 * t)]))
        solver = CONTROLLED[kind](problem, tolerance=tolerance)
        solver.restart(0.0, np.ones(1), np.full(1, nominal))
        while solver.advance(3.0).t < 3.0:
            pass
        solver.free()
        calls.append(problem.calls)
    assert calls[1] < calls[0]
    assert calls[1] == pytest.approx(calls[2], rel=0.05)


def stiff(t: float, x: Array) -> Array:
    return np.array([-1e6 * (x[0] - math.cos(t)) - math.sin(t)])


def test_cvode_takes_a_stiff_problem_in_few_calls() -> None:
    """x follows cos t; explicit methods would take 5,000,000 steps."""
    problem = Written(1, stiff)
    _, x, _ = integrate(CVode(problem, tolerance=1e-6), np.ones(1), 10.0)
    assert x[0] == pytest.approx(math.cos(10.0), abs=1e-5)
    assert problem.calls < 1000


def test_the_error_of_one_step_of_dopri5_is_of_order_six() -> None:
    """x' = -x from 1; its growth over a step of length h is 1 - h + ... - h^5 / 120 + h^6 / 600."""
    steps = (0.4, 0.2, 0.1)
    errors = []
    for h in steps:
        problem = Written(1, decay)
        _, x, _ = integrate(DormandPrince(problem, tolerance=1e3), np.ones(1), h)
        assert problem.calls == 7
        errors.append(abs(x[0] - math.exp(-h)))
        taylor = sum((-h) ** k / math.factorial(k) for k in range(6)) + h**6 / 600
        assert x[0] == pytest.approx(taylor, rel=1e-14)
    assert np.polyfit(np.log(steps), np.log(errors), 1)[0] == pytest.approx(6.0, abs=0.15)


def test_steps_grow_and_shrink_with_the_problem() -> None:
    """A pulse around 5 s needs short steps, and nothing else does."""

    def rates(t: float, _: Array) -> Array:
        return np.array([math.exp(-((t - 5.0) ** 2) / 0.02)])

    solver = DormandPrince(Written(1, rates), tolerance=1e-8, longest_step=0.5)
    solver.restart(0.0, np.zeros(1), np.ones(1))
    steps = [0.0]
    while steps[-1] < 10.0:
        steps.append(solver.advance(10.0).t)
    lengths = np.diff(steps)
    near = abs(np.array(steps[1:]) - 5.0) < 0.3
    assert lengths[near].max() < 0.1
    assert np.sort(lengths)[-12:].min() == pytest.approx(0.5)
    assert solver.states[0] == pytest.approx(math.sqrt(0.02 * math.pi), rel=1e-6)


def test_a_jacobian_saves_calls_of_the_right_hand_side() -> None:
    matrix = np.array([[-1.0, 3.0, 0.0], [0.0, -1e4, 5.0], [0.0, 0.0, -1e6]])

    def rates(_: float, x: Array) -> Array:
        return np.asarray(matrix @ x)

    plain = Written(3, rates)
    informed = Written(3, rates, jacobian=lambda _, __: matrix)
    found = [
        integrate(CVode(each, tolerance=1e-7), np.ones(3), 3.0)[1] for each in (plain, informed)
    ]
    assert informed.calls < plain.calls - 3
    exact = 3 * (math.exp(-3) / 9999)  # of the slow state, beside what it starts with
    assert found[0][0] == pytest.approx(math.exp(-3) + exact, rel=1e-3)
    assert found[1] == pytest.approx(found[0], rel=1e-4, abs=1e-9)


SOLVERS: dict[str, Callable[[Problem], Solver]] = {
    "cvode": lambda p: CVode(p, tolerance=1e-10),
    "dopri5": lambda p: DormandPrince(p, tolerance=1e-10),
    "rk4": lambda p: FixedStep(p, rk4, step=0.25),
    "euler": lambda p: FixedStep(p, euler, step=0.25),
}


@pytest.mark.parametrize("name", SOLVERS)
def test_an_event_is_found_to_the_last_digits(name: str) -> None:
    """x' = 1 passes 2 / 3 from below; the states belong to the time behind it."""
    problem = Written(1, lambda _, __: np.ones(1), lambda _, x: float(x[0]) - 2 / 3)
    t, x, is_event = integrate(SOLVERS[name](problem), np.zeros(1), 1.0)
    assert is_event
    assert t == pytest.approx(2 / 3, rel=1e-14)
    assert x[0] >= 2 / 3
    assert x[0] == pytest.approx(t, rel=1e-14)


@pytest.mark.parametrize("name", SOLVERS)
def test_an_event_depends_on_time_too_and_on_the_first_sign(name: str) -> None:
    """Both directions, and none where the sign stays."""
    for direction in (1, -1):
        problem = Written(1, decay, lambda t, _, d=direction: d * (t - 0.3))  # type: ignore[misc]
        t, _, is_event = integrate(SOLVERS[name](problem), np.ones(1), 1.0)
        assert is_event
        assert t == pytest.approx(0.3, abs=1e-14)
    problem = Written(1, decay, lambda t, _: t - 2.0)
    assert integrate(SOLVERS[name](problem), np.ones(1), 1.0)[::2] == (1.0, False)


@pytest.mark.parametrize("name", SOLVERS)
def test_nothing_is_evaluated_behind_the_stop(name: str) -> None:
    problem = Written(1, decay, lambda t, _: t - 2.0)
    integrate(SOLVERS[name](problem), np.ones(1), 0.7)
    assert problem.latest <= 0.7


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_that_restarts_repeats_itself_to_the_bit(name: str) -> None:
    def rates(t: float, x: Array) -> Array:
        return np.array([x[1], (1 - x[0] ** 2) * x[1] - x[0] + math.sin(t)])

    solver = SOLVERS[name](Written(2, rates))
    runs = []
    for _ in range(2):
        solver.restart(0.0, np.array([2.0, 0.0]), np.ones(2))
        steps = [(solver.advance(1.0).t, solver.states.tobytes())]
        while steps[-1][0] < 1.0:
            steps.append((solver.advance(1.0).t, solver.states.tobytes()))
        runs.append(steps)
    solver.free()
    assert runs[0] == runs[1]


@pytest.mark.parametrize("kind", CONTROLLED)
def test_the_longest_step_is_kept(kind: str) -> None:
    solver = CONTROLLED[kind](Written(1, decay), tolerance=1e-3, longest_step=0.01)
    solver.restart(0.0, np.ones(1), np.ones(1))
    t = 0.0
    while t < 1.0:
        reached = solver.advance(1.0).t
        assert reached - t <= 0.01 * (1 + 1e-9)
        t = reached
    solver.free()


def test_points_that_cannot_be_evaluated_are_avoided_or_named() -> None:
    """x' = -sqrt(x) knows no negative x: from (1 + t0/2)^2 it comes to rest at 2."""

    def root(_: float, x: Array) -> Array | None:
        return None if x[0] < 0 else np.asarray(-np.sqrt(x))

    for make in CONTROLLED.values():
        _, x, _ = integrate(make(Written(1, root), tolerance=1e-6), np.ones(1), 1.9)
        assert x[0] == pytest.approx(0.05**2, abs=1e-5)
    nowhere = DormandPrince(Written(1, lambda _, __: None), tolerance=1e-6)
    with pytest.raises(FmuError, match=r"failed at 0 s: .* go on; .* its derivatives at 0 s"):
        integrate(nowhere, np.ones(1), 1.0)
    never = CVode(Written(1, lambda _, __: None), tolerance=1e-6)
    with pytest.raises(FmuError, match=r"the solver failed at 0 s: .*right-hand side.*CV_FIRST"):
        integrate(never, np.ones(1), 1.0)
    never.free()
    with pytest.raises(FmuError, match=r"derivatives at 0 s \(Discard\); a shorter `fmi.step`"):
        integrate(FixedStep(Written(1, lambda _, __: None), rk4, step=1.0), np.ones(1), 1.0)


@pytest.mark.parametrize("kind", CONTROLLED)
def test_a_solver_that_cannot_go_on_says_why(kind: str) -> None:
    """x' = x^2 has no value at 1."""
    solver = CONTROLLED[kind](Written(1, lambda _, x: np.asarray(x**2)), tolerance=1e-9)
    with pytest.raises(FmuError, match=r"the solver failed at (1|0\.99999\d*) s: its steps have"):
        integrate(solver, np.ones(1), 2.0)
    solver.free()


@pytest.mark.parametrize("error", [KeyboardInterrupt(), FmuError("told to")])
def test_what_a_right_hand_side_raises_comes_through(error: BaseException) -> None:
    def rates(t: float, x: Array) -> Array:
        if t > 0.5:
            raise error
        return np.asarray(-x)

    solver = CVode(Written(1, rates), tolerance=1e-6)
    with pytest.raises(type(error)):
        integrate(solver, np.ones(1), 1.0)
    solver.free()


def test_all_memory_is_given_back() -> None:
    """A matrix of 300 x 300 is 0.7 MB, two of them and vectors for each solver."""

    def use(count: int) -> None:
        for _ in range(count):
            integrate(CVode(Written(300, decay), tolerance=1e-1), np.ones(300), 1e-3)

    use(5)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    use(40)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 10_000  # [kB]


def test_names_are_those_of_the_solvers() -> None:
    for name in solvers.NAMES:
        solver = solvers.made(name, Written(1, decay), tolerance=1e-8, step=0.01)
        _, x, _ = integrate(solver, np.ones(1), 1.0)
        assert x[0] == pytest.approx(math.exp(-1), rel=1e-2)
