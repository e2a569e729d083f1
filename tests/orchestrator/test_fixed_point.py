"""Fixed-point iteration: algebraic loops are solved, steps are taken back exactly, order one."""

from collections.abc import Callable, Iterator, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from typing_extensions import override

from orchestrator.algorithm.age import Age
from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.algorithm.fixed_point import FixedPoint
from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.capabilities import InitialEvaluation
from orchestrator.component import Component, RestorableComponent
from orchestrator.errors import ComponentError, SystemStructureError
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Duration, Time, nanoseconds, seconds
from tests.orchestrator.packages.remote_units import Drawing

H = 10**8
LOOP_GAIN = -0.8 * 0.5


def link(source: str, target: str) -> Connection:
    return Connection(Endpoint.parse(source), Endpoint.parse(target))


def wired(
    parts: Mapping[str, Any], wires: str, sizes: Mapping[str, Duration] = MappingProxyType({})
) -> System:
    """`wires` is like `a.y > b.u, b.y > a.u`; components step every `H` unless `sizes` differs."""
    links = [link(*wire.strip().split(" > ")) for wire in wires.split(",")] if wires else []
    return System(parts, {name: sizes.get(name, H) for name in parts}, links)


def number(value: Any) -> float:
    return float(np.asarray(value))


def algebraic(function: Callable[[float, float], float]) -> FunctionComponent:
    """y = f(u, t), with t in seconds."""
    connectors = {
        "u": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
    }
    return FunctionComponent(
        connectors, lambda s, i, t: (s, {"y": np.array(function(number(i["u"]), seconds(t)))})
    )


class Plant(RestorableComponent[float], InitialEvaluation):
    """x' = -x + u, exact for constant u; w = x + u / 2; counts its steps."""

    def __init__(self) -> None:
        self.steps = 0
        self._x, self._u = 1.0, 0.0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "u": Connector(causality=Causality.INPUT),
            "x": Connector(causality=Causality.OUTPUT),
            "w": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x, self._u, self.steps = 1.0, 0.0, 0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self.steps += 1
        self._u = number(inputs["u"])
        decay = np.exp(-seconds(h))
        self._x = decay * self._x + (1 - decay) * self._u

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(self._x), "w": np.array(self._x + 0.5 * self._u)}

    @override
    def evaluate(self, inputs: Signals) -> Signals:
        return {"x": np.array(self._x), "w": np.array(self._x + 0.5 * number(inputs["u"]))}

    @override
    def initialise(self, inputs: Signals) -> None:
        self._u = number(inputs["u"])

    @override
    def save(self) -> float:
        return self._x

    @override
    def restore(self, state: float) -> None:
        self._x = state


def controlled(h: Duration) -> System:
    """x' = -x + z with z = -0.8 w + sin t and w = x + z / 2: an algebraic loop of gain -0.4."""
    parts = {"plant": Plant(), "control": algebraic(lambda w, t: -0.8 * w + float(np.sin(t)))}
    wires = "plant.w > control.u, control.y > plant.u"
    return wired(parts, wires, {"plant": h, "control": h})


def solved_control(x: float, t: float) -> float:
    """The value of z where the loop closes."""
    return float((-0.8 * x + np.sin(t)) / (1 - LOOP_GAIN))


def exact_state(t: float) -> float:
    """The solution x(t) of x' = -a x + b sin t with x(0) = 1."""
    b = 1 / (1 - LOOP_GAIN)
    a = 1 + 0.8 * b
    particular = b * (a * np.sin(t) - np.cos(t)) / (1 + a * a)
    return float((1 + b / (1 + a * a)) * np.exp(-a * t) + particular)


class Watch(Observer):
    """Keeps the values of every communication point."""

    def __init__(self) -> None:
        self.seen: dict[Time, dict[str, dict[str, Any]]] = {}

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None: ...

    @override
    def end(self, result: SimulationResult) -> None: ...

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.seen[t] = {name: dict(own) for name, own in values.items()}


def watched(system: System, algorithm: CosimulationAlgorithm, stop: Time) -> Watch:
    watch = Watch()
    simulate(system, algorithm, start=0, stop=stop, seed=0, observers=[watch])
    return watch


def loop_residual(algorithm: CosimulationAlgorithm, h: Duration, since: float = -1.0) -> float:
    """How far the control signal is from closing the loop, at worst, after `since` [s]."""
    seen = watched(controlled(h), algorithm, nanoseconds("2")).seen
    return max(
        abs(number(v["control"]["y"]) - solved_control(number(v["plant"]["x"]), seconds(t)))
        for t, v in seen.items()
        if seconds(t) > since
    )


def state_errors(algorithm: CosimulationAlgorithm, steps: list[Duration]) -> list[float]:
    stop = nanoseconds("2")
    ends = [watched(controlled(h), algorithm, stop).seen[stop] for h in steps]
    return [abs(number(end["plant"]["x"]) - exact_state(2.0)) for end in ends]


def test_the_error_with_an_algebraic_loop_falls_with_the_first_power_of_the_step_size() -> None:
    steps = [nanoseconds(text) for text in ("0.1", "0.05", "0.025", "0.0125")]
    errors = state_errors(FixedPoint(), steps)
    assert np.polyfit(np.log(steps), np.log(errors), deg=1)[0] == pytest.approx(1.0, abs=0.05)


def test_the_loop_is_closed_at_every_point_and_not_by_the_others() -> None:
    """The others lag by a step, long after the start as well; ours is the tolerance."""
    assert loop_residual(FixedPoint(), H) < 2e-9
    for other in (Jacobi(), GaussSeidel(("plant", "control"))):
        coarse, fine = (loop_residual(other, h, since=1.0) for h in (H // 2, H // 10))
        assert coarse > 5e-3
        assert coarse / fine == pytest.approx(5, rel=0.1)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
def test_the_tolerance_bounds_what_is_left(tolerance: float) -> None:
    algorithm = FixedPoint(relative_tolerance=0, absolute_tolerance=tolerance)
    # of a contraction by 0.4, the rest is at most 0.4 / (1 - 0.4) of the last change
    assert loop_residual(algorithm, H) <= tolerance


def test_the_relative_tolerance_is_of_the_value() -> None:
    def factory(scale: float) -> System:
        jump = {0.0: scale}  # the start is solved more exactly, so what is tested is another loop
        parts = {
            "a": algebraic(lambda u, t: 0.5 * u + jump.get(t, 2 * scale)),
            "b": algebraic(lambda u, t: u),
        }
        return wired(parts, "a.y > b.u, b.y > a.u")

    for scale in (1e-6, 1.0, 1e6):
        algorithm = FixedPoint(relative_tolerance=1e-3, absolute_tolerance=0)
        (end,) = (v for t, v in watched(factory(scale), algorithm, H).seen.items() if t == H)
        assert 0 < abs(number(end["a"]["y"]) / (4 * scale) - 1) < 1e-3


@settings(max_examples=40, deadline=None)
@given(
    gains=st.lists(st.floats(-0.9, 0.9), min_size=1, max_size=4),
    offsets=st.lists(st.floats(-5, 5), min_size=4, max_size=4),
)
def test_a_ring_of_any_length_is_solved(gains: list[float], offsets: list[float]) -> None:
    """y_k = g_k y_(k-1) + c_k around a ring has one solution, whoever goes first."""
    count = len(gains)
    names = [f"c{k}" for k in range(count)]
    parts = {
        name: algebraic(lambda u, t, k=k: gains[k] * u + offsets[k])  # type: ignore[misc]
        for k, name in enumerate(names)
    }
    wires = ", ".join(f"{names[k - 1]}.y > {name}.u" for k, name in enumerate(names))
    seen = watched(wired(parts, wires), FixedPoint(maximum_iterations=1000), 2 * H).seen
    matrix = np.eye(count)
    for k in range(count):
        matrix[k, k - 1] -= gains[k]
    wanted = np.linalg.solve(matrix, offsets[:count])
    for t in (H, 2 * H):
        found = [number(seen[t][name]["y"]) for name in names]
        np.testing.assert_allclose(found, wanted, atol=2e-7, rtol=2e-7)


def test_a_loop_that_does_not_contract_is_an_error_with_its_name_and_time() -> None:
    parts = {"a": algebraic(lambda u, t: -2 * u + 1 + t), "b": algebraic(lambda u, t: u)}
    system = wired(parts, "a.y > b.u, b.y > a.u")
    with pytest.raises(ComponentError) as error:
        simulate(system, FixedPoint(maximum_iterations=20), start=0, stop=3 * H, seed=0)
    assert (error.value.component, error.value.time) in {("a", 0), ("b", 0)}
    assert "after 20 iterations `y` still changes by" in error.value.message
    assert "`relaxation` below 1" in error.value.message


def test_relaxation_solves_a_loop_that_does_not_contract() -> None:
    parts = {"a": algebraic(lambda u, t: -2 * u + 1), "b": algebraic(lambda u, t: u)}
    system = wired(parts, "a.y > b.u, b.y > a.u")
    seen = watched(system, FixedPoint(relaxation=0.5), H).seen
    assert number(seen[H]["a"]["y"]) == pytest.approx(1 / 3, abs=1e-8)
    assert number(seen[H]["b"]["y"]) == pytest.approx(1 / 3, abs=1e-8)


def test_who_is_in_no_cycle_steps_once_and_sees_what_was_agreed() -> None:
    """Source before the loop, sink behind it: neither is repeated, the loop is."""
    plant = Plant()
    source, sink, heard = algebraic(lambda u, t: t), Plant(), Plant()
    parts: dict[str, Component] = {
        "sink": sink,
        "plant": plant,
        "heard": heard,
        "control": algebraic(lambda w, t: -0.8 * w),
        "source": source,
    }
    wires = "plant.w > control.u, control.y > plant.u, control.y > sink.u, source.y > heard.u"
    seen = watched(wired(parts, wires), FixedPoint(), 5 * H).seen
    assert sink.steps == heard.steps == 5
    assert plant.steps > 5 * 5
    for values in list(seen.values())[1:]:
        used = 2 * (number(values["sink"]["w"]) - number(values["sink"]["x"]))
        assert used == pytest.approx(number(values["control"]["y"]), abs=1e-15)


def test_a_system_without_cycles_gives_the_bytes_of_gauss_seidel() -> None:
    def chain() -> System:
        parts = {"a": Plant(), "b": Plant(), "c": algebraic(lambda u, t: u - t)}
        return wired(parts, "a.w > b.u, b.w > c.u", {"b": 2 * H})

    runs = [watched(chain(), algorithm, 8 * H).seen for algorithm in (FixedPoint(), GaussSeidel())]
    assert runs[0] == runs[1]


def test_a_step_that_is_repeated_draws_the_same_numbers() -> None:
    """Otherwise the loop would not agree, and the next step would begin elsewhere in the stream."""
    seen = watched(wired({"a": Drawing()}, "a.y > a.u"), FixedPoint(), 4 * H).seen
    alone = watched(wired({"a": Drawing()}, ""), FixedPoint(), 4 * H).seen
    for t in range(H, 5 * H, H):
        assert number(seen[t]["a"]["y"]) == pytest.approx(2 * number(alone[t]["a"]["y"]), abs=1e-8)


def test_only_algebraic_loops_are_repeated_if_asked_for() -> None:
    """`slow` has no feedthrough: what it reads is delayed, the loop is solved nonetheless."""
    slow = FunctionComponent(
        {"u": Connector(causality=Causality.INPUT), "y": Connector(causality=Causality.OUTPUT)},
        lambda s, i, t: (s, {"y": i["u"]}),
    )
    parts = {
        "slow": slow,
        "a": algebraic(lambda u, t: 0.5 * u + 1),
        "b": FunctionComponent(
            {
                "u": Connector(causality=Causality.INPUT),
                "v": Connector(causality=Causality.INPUT),
                "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u", "v"})),
            },
            lambda s, i, t: (s, {"y": np.array(number(i["u"]) + number(i["v"]))}),
        ),
    }
    system = wired(parts, "a.y > b.u, b.y > a.u, b.y > slow.u, slow.y > b.v")
    every, some = FixedPoint(), FixedPoint(iterate="algebraic-loops")
    assert every.solved(system) == (frozenset({"slow", "a", "b"}),)
    assert some.solved(system) == (frozenset({"a", "b"}),)
    assert some.ages(system)["slow", "b"] == Age(youngest=0, oldest=0)
    assert some.ages(system)["b", "slow"] == Age(youngest=H, oldest=H)
    assert every.ages(system)["b", "slow"] == Age(youngest=0, oldest=0)
    seen = watched(system, some, 3 * H).seen
    for t in (H, 2 * H, 3 * H):
        before = seen[t - H]["b"]["y"]
        assert number(seen[t]["slow"]["y"]) == number(before)
        assert number(seen[t]["b"]["y"]) == pytest.approx(2 + 2 * number(before), abs=1e-7)


class Stubborn(Component):
    """y = u, and no way back."""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {
            "u": Connector(causality=Causality.INPUT),
            "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
        }

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None: ...

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None: ...

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(0.0)}


def test_components_that_cannot_be_restored_are_refused_by_name() -> None:
    parts = {"a": Stubborn(), "b": Plant(), "c": Stubborn(), "outside": Stubborn()}
    wires = "a.y > b.u, b.w > c.u, c.y > a.u, c.y > outside.u"
    with pytest.raises(SystemStructureError) as error:
        simulate(wired(parts, wires), FixedPoint(), start=0, stop=H, seed=0)
    first, second = error.value.problems
    assert first.startswith("`a` depends on itself through `b`, `c`, so fixed-point iteration has")
    assert "it cannot return to an earlier state" in first
    assert "`iterate: algebraic-loops`" in first
    assert second.startswith("`c` depends on itself through `a`, `b`")


def test_signals_that_are_no_floats_have_to_be_equal() -> None:
    """A counter that follows another one around a loop settles, one that runs away does not."""

    def counters(growth: int, since: Time = 0) -> System:
        connectors = {
            "u": Connector(causality=Causality.INPUT, dtype=np.int64),
            "y": Connector(
                causality=Causality.OUTPUT, dtype=np.int64, feedthrough=frozenset({"u"})
            ),
        }
        limited = FunctionComponent(
            connectors,
            lambda s, i, t: (
                s,
                {"y": np.asarray(min(int(number(i["u"])) + (growth if t >= since else 0), 7))},
            ),
        )
        copy = FunctionComponent(connectors, lambda s, i, t: (s, {"y": np.array(i["u"])}))
        return wired({"limited": limited, "copy": copy}, "limited.y > copy.u, copy.y > limited.u")

    assert int(watched(counters(1), FixedPoint(), H).seen[H]["copy"]["y"]) == 7
    with pytest.raises(ComponentError, match="still changes by more than the tolerance"):
        simulate(counters(-1, since=H), FixedPoint(), start=0, stop=H, seed=0)
    with pytest.raises(ComponentError, match="does not agree with what it reads at the start"):
        simulate(counters(-1), FixedPoint(), start=0, stop=H, seed=0)


def growing() -> Iterator[FixedPoint]:
    yield FixedPoint()
    yield FixedPoint(relaxation=0.5)


@pytest.mark.parametrize("algorithm", list(growing()))
def test_arrays_may_change_their_length_between_repetitions(algorithm: FixedPoint) -> None:
    """As many items as the sum of the items says, until both agree."""
    vector = {
        "u": Connector(causality=Causality.INPUT, shape=("item",)),
        "y": Connector(causality=Causality.OUTPUT, shape=("item",), feedthrough=frozenset({"u"})),
    }
    grow = FunctionComponent(
        vector, lambda s, i, t: (s, {"y": np.ones(min(3, np.size(i["u"]) + 1))})
    )
    echo = FunctionComponent(vector, lambda s, i, t: (s, {"y": np.array(i["u"])}))
    system = wired({"grow": grow, "echo": echo}, "grow.y > echo.u, echo.y > grow.u")
    seen = watched(system, algorithm, H).seen
    np.testing.assert_array_equal(seen[H]["echo"]["y"], [1, 1, 1])


def test_what_was_published_before_a_failed_iteration_stays_readable() -> None:
    parts = {"a": algebraic(lambda u, t: (3 if t > 0.15 else 0.5) * u + 1)}
    watch = Watch()
    with pytest.raises(ComponentError):
        simulate(
            wired(parts, "a.y > a.u"), FixedPoint(), start=0, stop=3 * H, seed=0, observers=[watch]
        )
    assert sorted(watch.seen) == [0, H]
    assert number(watch.seen[H]["a"]["y"]) == pytest.approx(2, abs=1e-8)


def test_bytes_have_to_be_equal_to_the_last() -> None:
    """A zero byte at the end is a difference, as it is none for NumPy's strings."""
    feedthrough = frozenset({"u"})
    connectors = {
        "u": Connector(causality=Causality.INPUT, dtype=None, mime_type="a/b", start=b""),
        "y": Connector(
            causality=Causality.OUTPUT, dtype=None, mime_type="a/b", feedthrough=feedthrough
        ),
    }
    longer = FunctionComponent(connectors, lambda s, i, t: (s, {"y": bytes(i["u"])[:3] + b"\0"}))
    copy = FunctionComponent(connectors, lambda s, i, t: (s, {"y": bytes(i["u"])}))
    system = wired({"longer": longer, "copy": copy}, "longer.y > copy.u, copy.y > longer.u")
    assert watched(system, FixedPoint(), H).seen[H]["copy"]["y"] == b"\0" * 4


def test_the_tolerance_may_be_zero() -> None:
    """Then the outputs are equal to the last bit."""
    parts = {"a": algebraic(lambda u, t: 0.25 * u + 1), "b": algebraic(lambda u, t: u)}
    algorithm = FixedPoint(relative_tolerance=0, absolute_tolerance=0)
    end = watched(wired(parts, "a.y > b.u, b.y > a.u"), algorithm, H).seen[H]
    assert number(end["a"]["y"]) == number(end["b"]["y"]) == 0.25 * number(end["a"]["y"]) + 1


@pytest.mark.parametrize("broken", ["save", "restore"])
def test_a_state_that_cannot_be_taken_is_an_error_of_the_component(
    broken: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = Plant()
    whole: Callable[..., Any] = getattr(plant, broken)

    def fail(*arguments: Any) -> Any:
        if plant.steps < 50:
            return whole(*arguments)
        raise OSError("out of space")

    monkeypatch.setattr(plant, broken, fail)
    parts = {"plant": plant, "control": algebraic(lambda w, t: -0.8 * w)}
    system = wired(parts, "plant.w > control.u, control.y > plant.u")
    with pytest.raises(ComponentError) as error:
        simulate(system, FixedPoint(), start=0, stop=50 * H, seed=0)
    doing = {"save": "saving", "restore": "restoring"}[broken]
    assert error.value.component == "plant"
    assert error.value.time in (H, 2 * H, 3 * H)
    assert error.value.message == f"while {doing} its state: OSError: out of space"


def test_components_that_only_seem_to_loop_are_not_repeated() -> None:
    """Feedthrough goes both ways between `a` and `b`, but along different connectors."""
    crossed = {
        "u": Connector(causality=Causality.INPUT),
        "v": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
        "z": Connector(causality=Causality.OUTPUT),
    }
    made = [
        FunctionComponent(crossed, lambda s, i, t: (s, {"y": i["u"], "z": np.array(seconds(t))}))
        for _ in range(2)
    ]
    loop = {"c": algebraic(lambda u, t: 0.5 * u + 1), "d": algebraic(lambda u, t: u)}
    parts = {"a": made[0], "c": loop["c"], "b": made[1], "d": loop["d"]}
    wires = "a.z > b.u, b.z > a.u, b.y > a.v, c.y > d.u, d.y > c.u"
    system = wired(parts, wires)
    some = FixedPoint(iterate="algebraic-loops")
    assert some.solved(system) == (frozenset({"c", "d"}),)
    turns = some.turns(system)
    assert sorted(turns) == ["a", "b", "c", "d"]
    assert abs(turns.index("c") - turns.index("d")) == 1
    assert FixedPoint().solved(system) == (frozenset({"a", "b"}), frozenset({"c", "d"}))


def test_loops_that_share_a_component_are_one_group() -> None:
    two = {
        "u": Connector(causality=Causality.INPUT),
        "v": Connector(causality=Causality.INPUT),
        "y": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"u"})),
        "z": Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"v"})),
    }
    hub = FunctionComponent(two, lambda s, i, t: (s, {"y": i["u"], "z": i["v"]}))
    parts = {"p": algebraic(lambda u, t: 0.5 * u + 1), "hub": hub, "q": algebraic(lambda u, t: u)}
    system = wired(parts, "p.y > hub.u, hub.y > p.u, q.y > hub.v, hub.z > q.u")
    some = FixedPoint(iterate="algebraic-loops")
    assert some.solved(system) == (frozenset({"p", "hub", "q"}),)
