"""The loop: what it calls, what it reports, and what happens when something fails."""

import io
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import pytest
from typing_extensions import override

from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.algorithm.jacobi import Jacobi
from orchestrator.component import Component, ConcurrentComponent
from orchestrator.errors import ComponentError
from orchestrator.observer import (
    NoProgress,
    Observer,
    ProgressMeter,
    SimulationResult,
    progress_meter,
)
from orchestrator.randomness import stream
from orchestrator.signal import Causality, Connector, Signals, Variability
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.testing import FunctionComponent
from orchestrator.timebase import Duration, Time

SECOND = 1_000_000_000
Y = Connector(causality=Causality.OUTPUT)


class Faulty(Component):
    """Calls `fault(call, time)` wherever it is called, and logs the calls."""

    def __init__(self, name: str, log: list[str], fault: Callable[[str, Time], Any]) -> None:
        self._name, self._log, self._fault = name, log, fault
        self._time: Time = 0

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {"y": Y}

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._time = start
        self._call("setup")

    @override
    def initialise(self, inputs: Signals) -> None:
        self._call("initialise")

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._time = t
        self._call("step")

    @override
    def outputs(self) -> Signals:
        value = self._fault("outputs", self._time)
        return {"y": np.array(1.0)} if value is None else value

    @override
    def close(self) -> None:
        self._call("close")

    def _call(self, call: str) -> None:
        self._log.append(f"{self._name}.{call}")
        self._fault(call, self._time)


class Watcher(Observer):
    """Logs what it is told."""

    def __init__(self, log: list[str]) -> None:
        self.log = log
        self.result: SimulationResult | None = None

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        self.log.append(f"begin {start} {stop}")

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.log.append(f"observe {t} {' '.join(published)}")

    @override
    def end(self, result: SimulationResult) -> None:
        self.log.append(f"end {result.status}")
        self.result = result


def fine(call: str, t: Time) -> None:
    pass


def fail(at_call: str, error: BaseException, at: Time = 0) -> Callable[[str, Time], None]:
    def fault(call: str, t: Time) -> None:
        if call == at_call and t >= at:
            raise error

    return fault


def run(parts: Mapping[str, Component], *observers: Observer, steps: int = 3) -> SimulationResult:
    system = System(parts, dict.fromkeys(parts, SECOND), [])
    return simulate(system, Jacobi(), start=0, stop=steps * SECOND, seed=0, observers=observers)


def test_calls_come_in_the_order_of_the_contract() -> None:
    log: list[str] = []
    result = run({"a": Faulty("a", log, fine), "b": Faulty("b", log, fine)}, Watcher(log), steps=1)
    assert log == [
        f"begin 0 {SECOND}",
        "a.setup",
        "b.setup",
        "a.initialise",
        "b.initialise",
        "observe 0 a b",
        "a.step",
        "b.step",
        f"observe {SECOND} a b",
        "a.close",
        "b.close",
        "end done",
    ]
    assert result.status == "done"
    assert result.time == SECOND
    assert result.values == {"a": {"y": np.array(1.0)}, "b": {"y": np.array(1.0)}}


@pytest.mark.parametrize("seed", [0, 7])
def test_each_component_draws_from_a_stream_of_its_own(seed: int) -> None:
    """Which depends on its name alone: one more component changes nothing for the others."""

    class Drawing(Component):
        connectors = {"y": Y}  # noqa: RUF012

        @override
        def setup(self, start: Time, rng: np.random.Generator) -> None:
            self.drawn = rng.random(3).tolist()

        @override
        def step(self, inputs: Signals, t: Time, h: Duration) -> None:
            pass

        @override
        def outputs(self) -> Signals:
            return {"y": np.array(0.0)}

    parts = {name: Drawing() for name in ("a", "b", "c")}
    for some in ("abc", "ca"):
        system = System({n: parts[n] for n in some}, dict.fromkeys(some, SECOND), [])
        simulate(system, Jacobi(), start=0, stop=SECOND, seed=seed)
        for name in some:
            assert parts[name].drawn == stream(seed, name).random(3).tolist()


def test_observers_hear_who_published_when() -> None:
    log: list[str] = []
    parts = {name: Faulty(name, [], fine) for name in ("slow", "fast")}
    system = System(parts, {"slow": 3, "fast": 2}, [])
    simulate(system, GaussSeidel(), start=0, stop=6, seed=0, observers=[Watcher(log)])
    assert log[1:-1] == [
        "observe 0 slow fast",
        "observe 2 fast",
        "observe 3 slow",
        "observe 4 fast",
        "observe 6 slow fast",
    ]


def test_wall_time_is_accounted_for() -> None:
    result = run({"a": Faulty("a", [], fine)}, Watcher([]))
    wall = result.wall_time
    assert set(wall.components) == {"a"}
    assert min(wall.components["a"], wall.observers, wall.orchestrator) > 0
    assert result.speed == pytest.approx(3 / wall.total)


NAN = {"y": np.array([1.0, np.nan])}


@pytest.mark.parametrize(
    ("outputs", "message"),
    [
        ({"y": np.array(np.nan)}, "output `y` is nan at index []"),
        ({"y": np.array(-np.inf)}, "output `y` is -inf at index []"),
        ({"y": np.zeros(2)}, "output `y` is float64[2], declared float64[]"),
        ({"y": np.array(1)}, "output `y` is int64[], declared float64[]"),
        ({"y": 1.0}, "output `y` is float, declared float64[]; write `np.asarray(...)`"),
        ({"y": np.float64(1)}, "output `y` is float64, declared float64[]; write `np.asarray"),
        ({"y": b""}, "output `y` is bytes, declared float64[]"),
        ({}, "does not write its output `y`"),
        ({"z": np.array(1.0)}, "does not write its output `y` and writes `z` (there are: y), not"),
        ({"y": np.array(1.0), "yy": np.array(1.0)}, "writes `yy` (did you mean `y`?), not an out"),
        ([], "does not write its output `y`"),
        (7, "`outputs` returned `int`, not a mapping from names to values"),
    ],
)
def test_wrong_outputs_end_the_run_with_component_and_time(outputs: Any, message: str) -> None:
    def fault(call: str, t: Time) -> Any:
        return outputs if call == "outputs" and t == 2 * SECOND else None

    with pytest.raises(ComponentError) as error:
        run({"good": Faulty("good", [], fine), "bad": Faulty("bad", [], fault)})
    assert str(error.value).startswith(f"component `bad` at t = 2 s: {message}")


def test_wrong_initial_outputs_are_found_before_the_first_step() -> None:
    log: list[str] = []
    with pytest.raises(ComponentError, match="component `bad` at t = 0 s: output `y` is nan"):
        run({"bad": Faulty("bad", log, lambda call, t: {"y": np.array(np.nan)})})
    assert log == ["bad.setup", "bad.initialise", "bad.close"]


def test_lengths_along_a_named_axis_are_equal() -> None:
    connectors = {
        name: Connector(causality=Causality.OUTPUT, shape=shape)
        for name, shape in {"position": ("vehicle", 3), "heading": ("vehicle",)}.items()
    }

    def uneven(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        return None, {"position": np.zeros((2, 3)), "heading": np.zeros(2 if t == 0 else 3)}

    with pytest.raises(ComponentError) as error:
        run({"traffic": FunctionComponent(connectors, uneven)})
    assert str(error.value) == (
        "component `traffic` at t = 0 s: the outputs differ in length along axis `vehicle`: "
        "2 in `position`, 3 in `heading`"
    )


def test_axes_of_one_component_that_differ_in_a_part_of_their_names_differ_in_length() -> None:
    """Each feeds a component that knows one such axis."""
    gives = {
        f"{side}.{name}": Connector(causality=Causality.OUTPUT, shape=(f"{side}.vehicle",))
        for side in ("left", "right")
        for name in ("x", "y")
    }
    takes = {name: Connector(causality=Causality.INPUT, shape=("vehicle",)) for name in ("x", "y")}
    lengths: dict[str, list[int]] = {"left": [], "right": []}

    def give(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        return None, {name: np.zeros(2 if name.startswith("left") else 3) for name in gives}

    def taker(side: str) -> FunctionComponent:
        def take(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
            lengths[side].append(len(inputs["x"]) + len(inputs["y"]))
            return None, {}

        return FunctionComponent(takes, take)

    components: dict[str, Component] = {"give": FunctionComponent(gives, give)}
    components |= {side: taker(side) for side in lengths}
    links = [
        Connection(Endpoint("give", f"{side}.{name}"), Endpoint(side, name))
        for side in lengths
        for name in takes
    ]
    system = System(components, dict.fromkeys(components, SECOND), links)
    simulate(system, Jacobi(), start=0, stop=3 * SECOND, seed=0)
    assert (set(lengths["left"][1:]), set(lengths["right"][1:])) == ({4}, {6})


def test_a_fixed_output_that_changes_is_a_fault() -> None:
    connectors = {"y": Connector(causality=Causality.OUTPUT, variability=Variability.FIXED)}

    def drift(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        return None, {"y": np.array(float(t >= 2 * SECOND))}

    with pytest.raises(ComponentError, match="at t = 1 s: output `y` changed, but is declared fix"):
        run({"a": FunctionComponent(connectors, drift)})


@pytest.mark.parametrize("call", ["setup", "initialise", "step", "outputs"])
def test_an_exception_ends_the_run_with_component_and_time(call: str) -> None:
    log: list[str] = []
    watcher = Watcher(log)
    parts = {
        "good": Faulty("good", log, fine),
        "bad": Faulty("bad", log, fail(call, KeyError("radio"))),
    }
    with pytest.raises(ComponentError) as error:
        run(parts, watcher)
    assert str(error.value) == "component `bad` at t = 0 s: KeyError: 'radio'"
    assert isinstance(error.value.__cause__, KeyError)
    assert log[-3:] == ["good.close", "bad.close", "end failed"]
    assert watcher.result is not None
    assert watcher.result.error is error.value


def test_a_component_error_keeps_what_it_knows() -> None:
    """A remote component knows its name, perhaps the time; what it lacks is filled in."""
    cases = {
        ("", None): "component `bad` at t = 1 s: lost",
        ("hall.bad", None): "component `hall.bad` at t = 1 s: lost",
        ("bad", 5 * SECOND): "component `bad` at t = 5 s: lost",
    }
    for (name, time), text in cases.items():
        fault = fail("step", ComponentError(name, time, "lost"), at=SECOND)
        with pytest.raises(ComponentError) as error:
            run({"bad": Faulty("bad", [], fault)})
        assert str(error.value) == text


def test_an_array_handed_out_cannot_be_written_to_later() -> None:
    array = np.zeros(3)
    connectors = {"y": Connector(causality=Causality.OUTPUT, shape=(3,))}

    def rewrite(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        array[0] = t
        return None, {"y": array}

    with pytest.raises(
        ComponentError, match="at t = 0 s: ValueError: assignment destination is re"
    ):
        run({"a": FunctionComponent(connectors, rewrite)})


def test_inputs_are_the_objects_that_were_published() -> None:
    """Nothing is copied within one process."""
    value = np.zeros(1000)
    seen: list[object] = []
    wide = Connector(causality=Causality.OUTPUT, shape=(1000,))
    source = FunctionComponent({"y": wide}, lambda state, inputs, t: (None, {"y": value}))
    narrow = Connector(causality=Causality.INPUT, shape=(1000,))

    def look(state: None, inputs: Signals, t: Time) -> tuple[None, Signals]:
        seen.append(inputs["u"])
        return None, {}

    wire = [Connection(Endpoint("source", "y"), Endpoint("sink", "u"))]
    system = System(
        {"source": source, "sink": FunctionComponent({"u": narrow}, look)},
        {"source": 1, "sink": 1},
        wire,
    )
    simulate(system, Jacobi(), start=0, stop=2, seed=0)
    assert seen[1] is value
    assert seen[2] is value


def test_an_error_while_closing_does_not_hide_the_first() -> None:
    def fault(call: str, t: Time) -> None:
        if call in ("step", "close"):
            raise RuntimeError(call)

    log: list[str] = []
    with pytest.raises(ComponentError, match="RuntimeError: step") as error:
        run({"bad": Faulty("bad", log, fault), "good": Faulty("good", log, fine)}, Watcher(log))
    assert error.value.__notes__ == [
        (
            "then, while closing `bad`, ComponentError: "
            "component `bad`: while closing: RuntimeError: close"
        )
    ]
    assert log[-2:] == ["good.close", "end failed"]


def test_an_error_while_closing_alone_is_reported() -> None:
    log: list[str] = []
    with pytest.raises(ComponentError, match="component `bad`: while closing: OSError: stuck"):
        run({"bad": Faulty("bad", [], fail("close", OSError("stuck")))}, Watcher(log))
    assert log[-1] == "end failed"


@pytest.mark.parametrize("call", ["setup", "initialise", "step", "outputs"])
def test_an_interrupt_closes_everything(call: str) -> None:
    log: list[str] = []
    parts = {
        "bad": Faulty("bad", log, fail(call, KeyboardInterrupt())),
        "good": Faulty("good", log, fine),
    }
    with pytest.raises(KeyboardInterrupt):
        run(parts, Watcher(log))
    assert log[-3:] == ["bad.close", "good.close", "end interrupted"]


def test_an_observer_that_fails_ends_the_run_and_the_others_are_ended() -> None:
    class Broken(Watcher):
        @override
        def observe(
            self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]
        ) -> None:
            raise OSError("disk full")

    log: list[str] = []
    with pytest.raises(OSError, match="disk full"):
        run({"a": Faulty("a", log, fine)}, Broken(log), Watcher(log))
    assert log[-3:] == ["a.close", "end failed", "end failed"]


def test_a_concurrent_failure_has_the_time_from_which_the_step_started() -> None:
    class Away(ConcurrentComponent):
        connectors = {"y": Y}  # noqa: RUF012

        @override
        def setup(self, start: Time, rng: np.random.Generator) -> None:
            pass

        @override
        def step(self, inputs: Signals, t: Time, h: Duration) -> None:
            raise NotImplementedError

        @override
        def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
            self._t = t

        @override
        def finish_step(self) -> None:
            if self._t == SECOND:
                raise ConnectionError("host gone")

        @override
        def outputs(self) -> Signals:
            return {"y": np.array(0.0)}

    with pytest.raises(ComponentError, match="`away` at t = 1 s: ConnectionError: host gone"):
        run({"away": Away()})


def test_progress_is_drawn_for_whom_watches() -> None:
    assert isinstance(progress_meter(stream=io.StringIO()), NoProgress)
    run({"a": Faulty("a", [], fine)}, NoProgress())
    stream = io.StringIO()
    meter = progress_meter(always=True, stream=stream)
    assert isinstance(meter, ProgressMeter)
    run({"a": Faulty("a", [], fine)}, meter)
    drawn = stream.getvalue()
    assert "3.00/3.00 s" in drawn
    assert "sim-s/s" in drawn


def test_progress_stops_where_the_run_stopped() -> None:
    stream = io.StringIO()
    meter = progress_meter(always=True, stream=stream)
    with pytest.raises(ComponentError):
        run({"a": Faulty("a", [], fail("step", ValueError("no"), at=2 * SECOND))}, meter)
    assert "2.00/3.00 s" in stream.getvalue()
