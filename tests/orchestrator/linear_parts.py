"""Linear subsystems that are exact over every step, and what their coupling gives exactly."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.capabilities import (
    CourseFollowing,
    InitialEvaluation,
    OutputSlopes,
    PointEvaluation,
    PortableState,
    VariableSteps,
)
from orchestrator.component import Capability, Component, RestorableComponent
from orchestrator.course import Course
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Array, Causality, Connector, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time, seconds


def exponential(matrix: Array) -> Array:
    """The matrix exponential, by a series of a matrix that is halved often enough."""
    halvings = max(0, int(np.ceil(np.log2(max(float(np.abs(matrix).sum()), 1e-9))))) + 4
    small = matrix / 2.0**halvings
    result = term = np.eye(len(matrix))
    for k in range(1, 16):
        term = term @ small / k
        result = result + term
    for _ in range(halvings):
        result = result @ result
    return result


@dataclass(frozen=True, kw_only=True)
class Part:
    """x' = A x + B u, y = C x + D u, with names of the elements of u and y.

    Attributes:
        a: shape (state, state).
        b: shape (state, input).
        c: shape (output, state).
        d: shape (output, input).
        start: x at 0 s, shape (state,).
        inputs: names.
        outputs: names.
    """

    a: Any
    b: Any
    c: Any
    d: Any
    start: Any
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def matrices(self) -> tuple[Array, Array, Array, Array]:
        n, m, p = len(self.start), len(self.inputs), len(self.outputs)
        shapes = [(n, n), (n, m), (p, n), (p, m)]
        given = (self.a, self.b, self.c, self.d)
        a, b, c, d = (
            np.reshape(np.array(values, float), shape)
            for values, shape in zip(given, shapes, strict=True)
        )
        return a, b, c, d


EVERYTHING = frozenset(
    {InitialEvaluation, PointEvaluation, CourseFollowing, OutputSlopes, VariableSteps}
)


class Linear(
    RestorableComponent[tuple[Any, Any]],
    PointEvaluation,
    CourseFollowing,
    OutputSlopes,
    VariableSteps,
    PortableState,
):
    """A `Part` as a component, with some of its capabilities.

    Args:
        part: the equations.
        kinds: the capabilities.
    """

    def __init__(self, part: Part, kinds: frozenset[type] = frozenset({InitialEvaluation})) -> None:
        self._part, self._kinds = part, kinds
        self._a, self._b, self._c, self._d = part.matrices()
        self._x = np.zeros(0)
        self._u = np.zeros(0)
        self._courses: Mapping[str, Course] = {}
        self._cache: dict[Duration, list[Array]] = {}
        self.steps: list[tuple[Time, Duration]] = []
        self.followed: list[Mapping[str, Course]] = []

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        part = self._part
        through = {
            y: frozenset(u for u, g in zip(part.inputs, row, strict=True) if g != 0)
            for y, row in zip(part.outputs, self._d, strict=True)
        }
        return {
            **{
                u: Connector(causality=Causality.INPUT, variability=Variability.CONTINUOUS)
                for u in part.inputs
            },
            **{
                y: Connector(
                    causality=Causality.OUTPUT,
                    variability=Variability.CONTINUOUS,
                    feedthrough=through[y],
                )
                for y in through
            },
        }

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        return super().capability(kind) if kind in self._kinds else None

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = np.array(self._part.start, float)
        self._u = np.zeros(len(self._part.inputs))
        self.steps = []

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return self._outputs(self._vector(inputs))

    @override
    def initialise(self, inputs: Signals) -> None:
        self._u = self._vector(inputs)

    @property
    @override
    def input_degree(self) -> int:
        return 2

    @override
    def follow(self, courses: Mapping[str, Course]) -> None:
        self._courses = courses
        self.followed.append(courses)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self.steps.append((t, h))
        zero = np.zeros(len(self._part.inputs))
        terms = [self._vector(inputs), zero.copy(), zero.copy()]
        for name, course in self._courses.items():
            for k, c in enumerate(course.coefficients):
                terms[k][self._part.inputs.index(name)] = float(c)
        self._courses = {}
        if h not in self._cache:
            self._cache[h] = self._discrete(seconds(h))
        growth, *effects = self._cache[h]
        self._x = growth @ self._x + sum(e @ u for e, u in zip(effects, terms, strict=True))
        self._u = np.asarray(sum(terms))

    def _discrete(self, h: float) -> list[Array]:
        """What the state, and 1, s, s^2 at the input, do over a step; s runs from 0 to 1."""
        n, m = self._b.shape
        whole = np.zeros((n + 3 * m, n + 3 * m))
        whole[:n, :n], whole[:n, n : n + m] = self._a * h, self._b * h
        whole[n : n + m, n + m : n + 2 * m] = np.eye(m)
        whole[n + m : n + 2 * m, n + 2 * m :] = 2 * np.eye(m)
        e = exponential(whole)[:n]
        return [e[:, :n], *(e[:, n + k * m : n + (k + 1) * m] for k in range(3))]

    @override
    def outputs(self) -> Signals:
        return self._outputs(self._u)

    @override
    def slopes(self) -> Signals:
        """Those of outputs without feedthrough."""
        slope = self._c @ (self._a @ self._x + self._b @ self._u)
        return {
            y: np.array(slope[k]) for k, y in enumerate(self._part.outputs) if not self._d[k].any()
        }

    @override
    def save(self) -> tuple[Any, Any]:
        return self._x, self._u

    @override
    def restore(self, state: tuple[Any, Any]) -> None:
        self._x, self._u = state

    @override
    def dump(self) -> bytes:
        return json.dumps([self._x.tolist(), self._u.tolist()]).encode()

    @override
    def load(self, content: bytes) -> None:
        self._x, self._u = map(np.array, json.loads(content))

    def _vector(self, inputs: Signals) -> Array:
        return np.array([float(np.asarray(inputs[u])) for u in self._part.inputs])

    def _outputs(self, u: Array) -> Signals:
        y = self._c @ self._x + self._d @ u
        return {name: np.array(y[k]) for k, name in enumerate(self._part.outputs)}


@dataclass(frozen=True)
class Network:
    """Parts and the wires between them, each like `a.y > b.u`."""

    parts: Mapping[str, Part]
    wires: tuple[str, ...]

    def system(
        self, h: Duration, kinds: frozenset[type] = frozenset({InitialEvaluation})
    ) -> tuple[System, dict[str, Linear]]:
        made = {name: Linear(part, kinds) for name, part in self.parts.items()}
        components: dict[str, Component] = dict(made)
        return System(components, dict.fromkeys(made, h), connections(self.wires)), made

    def exact(self, times: Sequence[float]) -> dict[str, Array]:
        """All outputs, `part.output`, at `times` [s]: each of shape (time,)."""
        blocks = [part.matrices() for part in self.parts.values()]
        a, b, c, d = (_diagonal([each[k] for each in blocks]) for k in range(4))
        inputs = [f"{n}.{u}" for n, p in self.parts.items() for u in p.inputs]
        outputs = [f"{n}.{y}" for n, p in self.parts.items() for y in p.outputs]
        wired = np.zeros((len(inputs), len(outputs)))
        for wire in self.wires:
            source, target = wire.split(" > ")
            wired[inputs.index(target), outputs.index(source)] = 1.0
        seen = np.linalg.solve(np.eye(len(outputs)) - d @ wired, c)
        start = np.concatenate([np.asarray(p.start, float) for p in self.parts.values()])
        closed = a + b @ wired @ seen
        found = np.array([seen @ (exponential(closed * t) @ start) for t in times])
        return {name: found[:, k] for k, name in enumerate(outputs)}


def connections(wires: Sequence[str]) -> list[Connection]:
    ends = (wire.split(" > ") for wire in wires)
    return [Connection(Endpoint.parse(a), Endpoint.parse(b)) for a, b in ends]


def _diagonal(blocks: Sequence[Array]) -> Array:
    found = np.zeros((sum(b.shape[0] for b in blocks), sum(b.shape[1] for b in blocks)))
    row = column = 0
    for block in blocks:
        found[row : row + block.shape[0], column : column + block.shape[1]] = block
        row, column = row + block.shape[0], column + block.shape[1]
    return found


class Trace(Observer):
    """Keeps all outputs at every communication point."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.rows: list[dict[str, float]] = []

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None: ...

    @override
    def end(self, result: SimulationResult) -> None: ...

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.times.append(seconds(t))
        self.rows.append(
            {f"{n}.{y}": float(np.asarray(v)) for n, own in values.items() for y, v in own.items()}
        )


def traced(system: System, algorithm: CosimulationAlgorithm, stop: Time) -> Trace:
    trace = Trace()
    simulate(system, algorithm, start=0, stop=stop, seed=0, observers=[trace])
    return trace


def largest_error(
    network: Network,
    algorithm: CosimulationAlgorithm,
    h: Duration,
    stop: Time,
    *,
    outputs: Sequence[str],
    kinds: frozenset[type] = frozenset({InitialEvaluation}),
) -> float:
    """Over all communication points and `outputs`, against the matrix exponential."""
    trace = traced(network.system(h, kinds)[0], algorithm, stop)
    exact = network.exact(trace.times)
    return max(
        float(np.max(np.abs(np.array([row[y] for row in trace.rows]) - exact[y]))) for y in outputs
    )


def order(errors: Sequence[float], steps: Sequence[Duration]) -> float:
    """The slope of errors over steps, both in logarithms."""
    return float(np.polyfit(np.log(np.asarray(steps, float)), np.log(errors), deg=1)[0])
