"""The co-simulation algorithms on a system with a closed solution, and their invariants."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import permutations
from types import MappingProxyType

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component, ConcurrentComponent, WrappedComponent
from orchestrator.errors import ComponentError, SystemStructureError
from orchestrator.observer import NoProgress
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Duration, Time, nanoseconds, seconds
from orchestrator.transformation import Transformation

CONNECTORS: Mapping[str, Connector] = {
    "u": Connector(causality=Causality.INPUT),
    "x": Connector(causality=Causality.OUTPUT),
}


class Relaxation(Component):
    """x' = a x + b u, solved exactly over each step for a constant input u."""

    connectors = CONNECTORS

    def __init__(self, a: float, b: float, x0: float) -> None:
        self._a, self._b, self._x0 = a, b, x0
        self._x = x0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = self._x0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        growth = float(np.exp(self._a * seconds(h)))
        u = float(np.asarray(inputs["u"]))
        self._x = growth * self._x + self._b * u * (growth - 1.0) / self._a

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(self._x)}


class Elsewhere(WrappedComponent, ConcurrentComponent):
    """Wraps a component so that its step is done when it is waited for."""

    def __init__(self, component: Component, log: list[str], name: str) -> None:
        super().__init__(component)
        self._log, self._name = log, name
        self._work: tuple[Signals, Time, Duration] = ({}, 0, 0)

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._log.append(f"begin {self._name} at {t}")
        self._work = (inputs, t, h)

    @override
    def finish_step(self) -> None:
        self._log.append(f"finish {self._name}")
        self._wrapped.step(*self._work)


def link(source: str, target: str) -> Connection:
    return Connection(Endpoint.parse(source), Endpoint.parse(target))


def coupled(steps: Mapping[str, Duration], order: tuple[str, ...] = ("left", "right")) -> System:
    """x' = -x + y, y' = -2 y + x: two relaxations in a loop."""
    parts = {"left": Relaxation(-1.0, 1.0, 1.0), "right": Relaxation(-2.0, 1.0, 0.0)}
    wires = [link("left.x", "right.u"), link("right.x", "left.u")]
    return System({name: parts[name] for name in order}, steps, wires)


def final(algorithm: CosimulationAlgorithm, system: System, stop: str = "1") -> dict[str, float]:
    result = simulate(system, algorithm, start=0, stop=nanoseconds(stop), seed=0)
    return {name: float(np.asarray(values["x"])) for name, values in result.values.items()}


def exact() -> float:
    """x(1) of the coupled system, by eigendecomposition."""
    values, vectors = np.linalg.eigh(np.array([[-1.0, 1.0], [1.0, -2.0]]))
    return float((vectors @ (np.exp(values) * (vectors.T @ np.array([1.0, 0.0]))))[0])


def order_of_convergence(algorithm: CosimulationAlgorithm, ratio: int) -> float:
    """The slope of the error over the step size of `left`; `right` takes `ratio` steps in each."""
    texts = ["0.1", "0.05", "0.025", "0.0125"]
    errors = []
    for text in texts:
        h = nanoseconds(text)
        system = coupled({"left": h, "right": h // ratio})
        errors.append(abs(final(algorithm, system)["left"] - exact()))
    return float(np.polyfit(np.log([float(text) for text in texts]), np.log(errors), deg=1)[0])


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel(), GaussSeidel(("right", "left"))])
@pytest.mark.parametrize("ratio", [1, 4, 5])
def test_the_error_falls_with_the_first_power_of_the_step_size(
    algorithm: CosimulationAlgorithm, ratio: int
) -> None:
    assert order_of_convergence(algorithm, ratio) == pytest.approx(1.0, abs=0.1)


def test_two_half_steps_beside_a_whole_one_are_the_midpoint_rule() -> None:
    """`left` sees `right` half a step ago, `right` sees `left` at both ends in turn.

    Only if the steps interleave exactly as documented do the first-order errors cancel.
    """
    algorithm = GaussSeidel(("left", "right"))
    assert order_of_convergence(algorithm, ratio=2) == pytest.approx(2.0, abs=0.1)


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_jacobi_does_not_depend_on_the_order_of_the_components(data: st.DataObject) -> None:
    count = data.draw(st.integers(2, 4))
    names = [f"c{k}" for k in range(count)]
    steps = {name: 10**8 * data.draw(st.sampled_from([1, 2, 5])) for name in names}
    wires = [link(f"{data.draw(st.sampled_from(names))}.x", f"{name}.u") for name in names]
    results = []
    for order in permutations(names):
        parts: dict[str, Component] = {
            name: Relaxation(-1.0 - k, 0.5, 1.0 / (k + 1)) for k, name in enumerate(names)
        }
        system = System({name: parts[name] for name in order}, steps, wires)
        results.append(final(Jacobi(), system))
    assert all(result == results[0] for result in results)


@pytest.mark.parametrize("algorithm", [Jacobi(), GaussSeidel()])
def test_the_result_does_not_depend_on_where_a_component_steps(
    algorithm: CosimulationAlgorithm,
) -> None:
    steps = {"left": 10**8, "right": 2 * 10**8}
    local = coupled(steps)
    mixed = {**local.components, "right": Elsewhere(local.components["right"], [], "right")}
    remote = System(mixed, steps, local.connections)
    assert final(algorithm, remote) == final(algorithm, local)


def test_jacobi_waits_for_a_concurrent_component_where_its_step_ends() -> None:
    """Two steps of the local component fit beside one of the concurrent one."""
    log: list[str] = []

    def note(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        log.append(f"local to {t}")
        return None, {"x": np.array(0.0)}

    system = System(
        {
            "local": FunctionComponent(CONNECTORS, note),
            "b": Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, "b"),
            "a": Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, "a"),
        },
        {"local": 1, "a": 2, "b": 2},
        [],
    )
    simulate(system, Jacobi(), start=0, stop=2, seed=0)
    assert log == [
        "local to 0",
        "begin b at 0",
        "begin a at 0",
        "local to 1",
        "local to 2",
        "finish b",
        "finish a",
    ]


def test_gauss_seidel_lets_concurrent_components_that_do_not_read_each_other_overlap() -> None:
    """A and b read the local one; c reads b and so has to wait for it."""
    log: list[str] = []
    parts: dict[str, Component] = {"local": Relaxation(-1.0, 1.0, 1.0)}
    parts |= {name: Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, name) for name in "abc"}
    wires = [link("local.x", "a.u"), link("local.x", "b.u"), link("b.x", "c.u")]
    system = System(parts, dict.fromkeys(parts, 1), wires)
    simulate(system, GaussSeidel(("local", "a", "b", "c")), start=0, stop=1, seed=0)
    assert log == [
        "begin a at 0",
        "begin b at 0",
        "finish a",
        "finish b",
        "begin c at 0",
        "finish c",
    ]


def test_gauss_seidel_begins_at_once_what_reads_nobody() -> None:
    """A reads nobody, and steps beside two steps of the local one; b has to wait for that."""
    log: list[str] = []

    def note(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        log.append(f"local to {t}")
        return None, {"x": np.array(0.0)}

    parts: dict[str, Component] = {"local": FunctionComponent(CONNECTORS, note)}
    parts |= {name: Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, name) for name in "ab"}
    wires = [link("a.x", "local.u"), link("local.x", "b.u")]
    system = System(parts, {"local": 1, "a": 2, "b": 2}, wires)
    simulate(system, GaussSeidel(("a", "local", "b")), start=0, stop=4, seed=0)
    assert log == [
        "local to 0",
        "begin a at 0",
        "local to 1",
        "finish a",
        "begin a at 2",  # not at the stop time
        "local to 2",
        "begin b at 0",
        "finish b",
        "local to 3",
        "finish a",
        "local to 4",
        "begin b at 2",
        "finish b",
    ]


def test_gauss_seidel_begins_before_its_turn_what_reads_nobody_who_is_still_to_publish() -> None:
    """B reads a; c, behind b, reads only the local one, and works beside both.

    D reads c, and its last step is waited for when all others have stepped.
    """
    log: list[str] = []
    parts: dict[str, Component] = {"local": Relaxation(-1.0, 1.0, 1.0)}
    parts |= {name: Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, name) for name in "abcd"}
    wires = [link("local.x", f"{name}.u") for name in "ac"]
    wires += [link("a.x", "b.u"), link("c.x", "d.u")]
    system = System(parts, dict.fromkeys(parts, 1), wires)
    simulate(system, GaussSeidel(("local", "a", "b", "c", "d")), start=0, stop=1, seed=0)
    assert log == [
        "begin a at 0",
        "begin c at 0",
        "finish a",
        "begin b at 0",
        "finish b",
        "finish c",
        "begin d at 0",
        "finish d",
    ]


def test_gauss_seidel_begins_the_next_step_when_all_that_it_will_see_is_published() -> None:
    """A and the local one read each other; the driver behind them, which a does not read, waits."""
    log: list[str] = []

    def noting(name: str) -> Component:
        def note(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
            log.append(f"{name} to {t}")
            return None, {"x": np.array(0.0)}

        return FunctionComponent(CONNECTORS, note)

    parts: dict[str, Component] = {
        "a": Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, "a"),
        "local": noting("local"),
        "driver": noting("driver"),
    }
    wires = [link("a.x", "local.u"), link("local.x", "a.u"), link("local.x", "driver.u")]
    system = System(parts, dict.fromkeys(parts, 1), wires)
    simulate(
        system,
        GaussSeidel(("a", "local", "driver")),
        start=0,
        stop=2,
        seed=0,
        observers=[Noting(log)],
    )
    assert log == [
        "local to 0",
        "driver to 0",
        "begin a at 0",
        "observe 0",
        "finish a",
        "local to 1",
        "begin a at 1",
        "driver to 1",
        "observe 1",
        "finish a",
        "local to 2",  # the last point: nothing begins there
        "driver to 2",
        "observe 2",
    ]


def test_what_begins_before_its_turn_fails_in_its_turn() -> None:
    """C is gone when it is to begin beside a; it is a whose error ends the run, as one by one."""
    log: list[str] = []
    parts: dict[str, Component] = {"local": Relaxation(-1.0, 1.0, 1.0)}
    found = {name: Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, name) for name in "abc"}

    def gone(inputs: Signals, t: Time, h: Duration) -> None:
        raise ComponentError("c", t, "is gone")

    def failing() -> None:
        raise ComponentError("b", 0, "fails")

    found["c"].begin_step = gone  # type: ignore[method-assign]
    wires = [link("local.x", "a.u"), link("a.x", "b.u"), link("local.x", "c.u")]
    system = System({**parts, **found}, dict.fromkeys((*parts, *found), 1), wires)
    algorithm = GaussSeidel(("local", "a", "b", "c"))
    with pytest.raises(ComponentError, match="`c` at t = 0 s: is gone"):
        simulate(system, algorithm, start=0, stop=1, seed=0)
    found["a"].finish_step = failing  # type: ignore[method-assign]
    with pytest.raises(ComponentError, match="fails"):
        simulate(system, algorithm, start=0, stop=1, seed=0)


def test_gauss_seidel_begins_at_once_what_sees_all_that_it_will_see() -> None:
    """A reads b, which is behind it; b reads a, whose step is twice as long: at every second point.

    C reads b as well, which publishes before its turn whenever its step ends.
    """
    log: list[str] = []

    def note(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        log.append(f"local to {t}")
        return None, {"x": np.array(0.0)}

    parts: dict[str, Component] = {"local": FunctionComponent(CONNECTORS, note)}
    parts |= {name: Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, name) for name in "abc"}
    wires = [link("b.x", "a.u"), link("a.x", "b.u"), link("b.x", "c.u")]
    system = System(parts, {"local": 1, "a": 2, "b": 2, "c": 2}, wires)
    simulate(system, GaussSeidel(("local", "a", "b", "c")), start=0, stop=2, seed=0)
    assert log == [
        "local to 0",
        "begin a at 0",
        "local to 1",
        "local to 2",
        "finish a",
        "begin b at 0",
        "finish b",
        "begin c at 0",
        "finish c",
    ]
    log.clear()
    system = System(parts, {"local": 1, "a": 2, "b": 1, "c": 2}, wires)
    simulate(system, GaussSeidel(("local", "a", "b", "c")), start=0, stop=2, seed=0)
    assert log == [
        "local to 0",
        "begin b at 0",  # a publishes at 2
        "local to 1",
        "finish b",
        "begin a at 0",  # not before: b has published at 1
        "local to 2",
        "finish a",
        "begin b at 1",
        "finish b",
        "begin c at 0",
        "finish c",
    ]


class Sum(Component):
    """x becomes u + v + t + 1, t in nanoseconds."""

    connectors: Mapping[str, Connector] = MappingProxyType(
        {**CONNECTORS, "v": Connector(causality=Causality.INPUT)}
    )

    def __init__(self) -> None:
        self._x = 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._x = float(np.asarray(inputs["u"])) + float(np.asarray(inputs["v"])) + t + 1

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(self._x)}


@pytest.mark.parametrize("swapped", [False, True])
def test_what_reads_two_earlier_waves_begins_after_the_later_of_them(*, swapped: bool) -> None:
    """D reads a and b, which reads a; m and n follow each other, so that d has time."""
    log: list[str] = []
    order = tuple("abmnd")
    parts: dict[str, Component] = {name: Elsewhere(Sum(), log, name) for name in order}
    first, second = ("v", "u") if swapped else ("u", "v")
    wires = [link("a.x", "b.u"), link("b.x", "m.u"), link("m.x", "n.u")]
    wires += [link("a.x", f"d.{first}"), link("b.x", f"d.{second}")]
    system = System(parts, dict.fromkeys(order, 1), wires)
    found = final(GaussSeidel(order), system, stop="1e-9")
    assert found == {"a": 1.0, "b": 2.0, "m": 3.0, "n": 4.0, "d": 4.0}  # 1 + 2 + 1
    assert log.index("finish b") < log.index("begin d at 0") < log.index("finish m")


@pytest.mark.parametrize("concurrent", ["", "b", "abc"])
def test_each_sees_at_once_all_who_are_before_it_in_the_order(concurrent: str) -> None:
    """C reads a, with b between them, which reads nobody: no step is lost on the way."""
    local: dict[str, Component] = {name: Sum() for name in "abc"}
    parts = {n: Elsewhere(p, [], n) if n in concurrent else p for n, p in local.items()}
    system = System(parts, dict.fromkeys("abc", 1), [link("a.x", "c.u"), link("a.x", "c.v")])
    found = final(GaussSeidel(tuple("abc")), system, stop="2e-9")
    assert found == {"a": 2.0, "b": 2.0, "c": 6.0}  # c: 2 + 2 + 1 + 1


class Noting(NoProgress):
    """Logs what it observes."""

    sees_stretches = False

    def __init__(self, log: list[str]) -> None:
        self._log = log

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self._log.append(f"observe {t}")


@pytest.mark.parametrize("fails", [False, True])
def test_a_step_that_begins_early_goes_on_while_values_are_observed(*, fails: bool) -> None:
    """If it cannot begin, what was reached is observed first, and the run fails at its turn."""
    log: list[str] = []
    part = Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, "a")
    begin = part.begin_step

    def begin_step(inputs: Signals, t: Time, h: Duration) -> None:
        begin(inputs, t, h)
        if fails and t == 1:
            raise ComponentError("a", t, "is gone")

    part.begin_step = begin_step  # type: ignore[method-assign]
    parts: dict[str, Component] = {"a": part, "b": Relaxation(-1.0, 1.0, 1.0)}
    system = System(parts, {"a": 1, "b": 1}, [link("b.x", "a.u"), link("a.x", "b.u")])
    expected = ["begin a at 0", "observe 0", "finish a", "begin a at 1", "observe 1"]
    algorithm = GaussSeidel(("a", "b"))
    if fails:
        with pytest.raises(ComponentError, match=r"^component `a` at t = 1e-09 s: is gone$"):
            simulate(system, algorithm, start=0, stop=2, seed=0, observers=[Noting(log)])
        assert log == expected
    else:
        simulate(system, algorithm, start=0, stop=2, seed=0, observers=[Noting(log)])
        assert log == [*expected, "finish a", "observe 2"]


def test_gauss_seidel_does_not_begin_early_what_sees_a_late_value() -> None:
    """What is late by half a step of b was not published when the step of a begins."""
    log: list[str] = []
    parts = {name: Elsewhere(Relaxation(-1.0, 1.0, 1.0), log, name) for name in "ab"}
    late = replace(link("b.x", "a.u"), way=Transformation(delay=2))
    system = System(parts, {"a": 4, "b": 4}, [late])
    simulate(system, GaussSeidel(("a", "b")), start=0, stop=4, seed=0)
    assert log == ["begin b at 0", "begin a at 0", "finish a", "finish b"]


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_the_values_of_gauss_seidel_do_not_depend_on_who_is_concurrent(
    data: st.DataObject,
) -> None:
    names = [f"c{k}" for k in range(data.draw(st.integers(2, 6)))]
    steps = {name: 10**8 * data.draw(st.sampled_from([1, 2, 5])) for name in names}
    inputs = [f"{name}.{u}" for name in names for u in "uv"]
    read = data.draw(st.sets(st.sampled_from(inputs), min_size=1))
    wires = [link(f"{data.draw(st.sampled_from(names))}.x", each) for each in sorted(read)]
    order = tuple(data.draw(st.permutations(names)))
    local: dict[str, Component] = {name: Sum() for name in names}
    mixed = {
        name: Elsewhere(part, [], name) if data.draw(st.booleans()) else part
        for name, part in local.items()
    }
    algorithm = GaussSeidel(order)
    expected = final(algorithm, System(local, steps, wires))
    assert final(algorithm, System(mixed, steps, wires)) == expected


def test_an_explicit_order_names_every_component_once() -> None:
    system = coupled({"left": 1, "right": 1})
    with pytest.raises(SystemStructureError) as error:
        GaussSeidel(("lefd", "right", "right")).turns(system)
    assert error.value.problems == (
        "the order of Gauss-Seidel: there is no component `lefd`; did you mean `left`?",
        "the order of Gauss-Seidel: `right` is named twice",
        "the order of Gauss-Seidel: `left` missing; name every component, or leave `order` out",
    )
