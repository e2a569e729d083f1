"""Direct feedthrough: initialisation, delays and algebraic loops."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.errors import SystemStructureError
from orchestrator.feedthrough import (
    Loop,
    describe,
    describe_outcome,
    feedthrough_order,
    is_within,
    loops,
)
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Time


def part(inputs: str = "", *, feedthrough: str = "") -> FunctionComponent:
    """A component with the inputs named, and an output `y` that some of them feed through to."""
    return FunctionComponent(
        {
            **{name: Connector(causality=Causality.INPUT) for name in inputs.split()},
            "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset(feedthrough.split())),
        },
        lambda state, inputs, t: (state, {"y": np.array(0.0)}),
    )


def system(parts: dict[str, FunctionComponent], *wires: str) -> System:
    """A system whose wires are written `a.y > b.u`."""
    pairs = [wire.split(" > ") for wire in wires]
    return System(
        parts,
        dict.fromkeys(parts, 1),
        [Connection(Endpoint.parse(source), Endpoint.parse(target)) for source, target in pairs],
    )


def plus_one(name: str) -> FunctionComponent:
    def function(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        return None, {"y": np.asarray(np.asarray(inputs["u"]) + 1.0)}

    return FunctionComponent(part("u", feedthrough="u").connectors, function)


def clock() -> FunctionComponent:
    return FunctionComponent(
        part().connectors, lambda state, inputs, t: (state, {"y": np.array(float(t))})
    )


def test_a_chain_of_feedthrough_has_no_delay_in_gauss_seidel() -> None:
    """Clock > b > c > a, listed in another order: at every time a = clock + 3."""
    parts = {"a": plus_one("a"), "b": plus_one("b"), "c": plus_one("c"), "clock": clock()}
    chain = system(parts, "clock.y > b.u", "b.y > c.u", "c.y > a.u")
    assert feedthrough_order(chain) == ("clock", "b", "c", "a")
    for algorithm, delay in ((GaussSeidel(), 0), (Jacobi(), 3)):
        result = simulate(chain, algorithm, start=0, stop=10, seed=0)
        assert result.values["a"]["y"] == 10 + 3 - delay
    initial = simulate(chain, Jacobi(), start=5, stop=5, seed=0)
    assert initial.values["a"]["y"] == 5 + 3, "initialisation follows feedthrough as well"


def test_without_feedthrough_the_order_is_that_of_the_system() -> None:
    parts = {"a": part("u"), "b": part("u"), "c": part("u")}
    ring = system(parts, "c.y > a.u", "a.y > b.u", "b.y > c.u")
    assert feedthrough_order(ring) == ("a", "b", "c")
    assert loops(ring) == ()


def test_a_loop_is_reported_with_every_connector_on_it_and_a_way_out() -> None:
    parts = {
        "gain": part("u", feedthrough="u"),
        "other": part("u"),
        "sum": part("u v", feedthrough="u v"),
    }
    looped = system(parts, "gain.y > sum.u", "sum.y > gain.u", "other.y > sum.v", "sum.y > other.u")
    (loop,) = loops(looped)
    assert describe(loop) == (
        "algebraic loop: `gain.u` -> `gain.y` -> `sum.u` -> `sum.y` -> `gain.u`; solve it with "
        "`algorithm: quasi-newton` or `fixed-point`, or give Gauss-Seidel "
        "an explicit order, which breaks the loop "
        "with one step of delay, or use Jacobi, which delays every connection"
    )
    with pytest.raises(SystemStructureError) as error:
        simulate(looped, GaussSeidel(), start=0, stop=1, seed=0)
    assert error.value.problems == (describe(loop),)
    for algorithm in (Jacobi(), GaussSeidel(("sum", "gain", "other"))):
        assert simulate(looped, algorithm, start=0, stop=1, seed=0).status == "done"


def test_entangled_loops_are_one_report() -> None:
    """Two loops through `hub`: the shorter is the path, the rest is named."""
    parts = {
        "hub": part("u v", feedthrough="u v"),
        "near": part("u", feedthrough="u"),
        "far": part("u", feedthrough="u"),
    }
    tangle = system(parts, "hub.y > near.u", "near.y > hub.u", "near.y > far.u", "far.y > hub.v")
    (loop,) = loops(tangle)
    assert loop.path == tuple(map(Endpoint.parse, ("hub.u", "hub.y", "near.u", "near.y")))
    assert set(loop.others) == set(map(Endpoint.parse, ("hub.v", "far.u", "far.y")))
    assert "entangled with `hub.v`, `far.u`, `far.y`" in describe(loop)


def test_a_loop_is_solved_if_one_set_has_all_of_it() -> None:
    parts = {name: part("u", feedthrough="u") for name in "abc"}
    (loop,) = loops(system(parts, "a.y > b.u", "b.y > a.u"))
    assert is_within(loop, [frozenset("c"), frozenset("abc")])
    assert not is_within(loop, [frozenset("ac"), frozenset("b")])
    assert not is_within(loop, [])
    assert describe_outcome(loop, is_solved=True).endswith("solved at every communication point")


def test_a_component_connected_to_itself_is_a_loop() -> None:
    own = system({"a": part("u", feedthrough="u")}, "a.y > a.u")
    assert loops(own) == (Loop((Endpoint("a", "u"), Endpoint("a", "y"))),)
    assert loops(system({"a": part("u")}, "a.y > a.u")) == ()


def test_components_may_depend_on_each_other_without_a_loop() -> None:
    """A passes u to y, B passes u to y, but each reads the other's z, which nothing affects."""

    def two_outputs() -> FunctionComponent:
        connectors = {**part("u", feedthrough="u").connectors}
        connectors["z"] = Connector(causality=Causality.OUTPUT)
        outputs = {"y": np.array(0.0), "z": np.array(0.0)}
        return FunctionComponent(connectors, lambda state, inputs, t: (state, dict(outputs)))

    crossed = system({"b": two_outputs(), "a": two_outputs()}, "a.z > b.u", "b.z > a.u")
    assert loops(crossed) == ()
    assert GaussSeidel().turns(crossed) == ("b", "a")


@settings(deadline=None)
@given(
    count=st.integers(1, 8),
    edges=st.lists(st.tuples(st.integers(0, 7), st.integers(0, 7)), max_size=16),
)
def test_the_order_keeps_every_dependency_it_can(count: int, edges: list[tuple[int, int]]) -> None:
    """All components once; without loops every source comes before its targets."""
    names = [f"c{k}" for k in range(count)]
    wires = {(a % count, b % count) for a, b in edges}
    parts = {
        name: part(
            " ".join(f"u{a}" for a, b in wires if b == k),
            feedthrough=" ".join(f"u{a}" for a, b in wires if b == k),
        )
        for k, name in enumerate(names)
    }
    graph = system(parts, *(f"c{a}.y > c{b}.u{a}" for a, b in wires))
    order = feedthrough_order(graph)
    assert sorted(order) == names
    place = {name: index for index, name in enumerate(order)}
    backwards = [(a, b) for a, b in wires if place[f"c{a}"] >= place[f"c{b}"]]
    assert bool(loops(graph)) == bool(backwards)
