"""Steps elsewhere begin when all that they read is made, and nothing depends on when that is."""

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from types import MappingProxyType

import numpy as np
from hypothesis import given, settings, strategies as st
from typing_extensions import override

from orchestrator.algorithm.gauss_seidel import GaussSeidel
from orchestrator.capabilities import EndRequest, EndRequesting
from orchestrator.component import Capability, Component, ConcurrentComponent, WrappedComponent
from orchestrator.errors import ComponentError
from orchestrator.observer import NoProgress
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, StepSize, Time

CONNECTORS: Mapping[str, Connector] = MappingProxyType(
    {
        "u": Connector(causality=Causality.INPUT, dtype=np.int64),
        "v": Connector(causality=Causality.INPUT, dtype=np.int64),
        "x": Connector(causality=Causality.OUTPUT, dtype=np.int64),
    }
)


class Mill(Component):
    """Grinds all that it has read, and when, into a number: another input gives another one."""

    connectors = CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self.x = 1

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        u, v = (int(np.asarray(inputs[name])) for name in "uv")
        self.x = (31 * self.x + 7 * u + 3 * v + t + h) % 1_000_003

    @override
    def outputs(self) -> Signals:
        return {"x": np.array(self.x)}


class Elsewhere(WrappedComponent, ConcurrentComponent):
    """Steps when it is asked whether it has; whether it has then is up to `is_done`."""

    def __init__(self, name: str, log: list[str], is_done: Callable[[], bool]) -> None:
        self.mill = Mill()
        super().__init__(self.mill)
        self.fails_at: Time | None = None
        self._name, self._log, self._is_done = name, log, is_done
        self._work: tuple[Signals, Time, Duration] | None = None

    @override
    def begin_step(self, inputs: Signals, t: Time, h: Duration) -> None:
        assert self._work is None
        self._log.append(f"{self._name} begins at {t}")
        self._work = (inputs, t, h)

    @override
    def has_finished(self) -> bool:
        assert self._work is not None
        return self._is_done()

    @override
    def finish_step(self) -> None:
        assert self._work is not None
        work, self._work = self._work, None
        self._log.append(f"{self._name} is done")
        if work[1] == self.fails_at:
            raise ValueError("no more")
        self.mill.step(*work)


class Asking(Elsewhere, EndRequesting):
    """One that asks for the end at `end`, within a step."""

    end: Time = 0

    @override
    def capability(self, kind: type[Capability]) -> Capability | None:
        return self if isinstance(self, kind) else None

    @property
    @override
    def end_request(self) -> EndRequest | None:
        return EndRequest(time=self.end, why="enough") if self.mill.x != 1 else None


class Seen(NoProgress):
    """All that was published, and when."""

    sees_stretches = False

    def __init__(self, log: list[str]) -> None:
        self.log, self.values = log, list[tuple[Time, Mapping[str, int]]]()

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self.log.append(f"seen at {t}")
        self.values.append((t, {name: int(np.asarray(values[name]["x"])) for name in published}))


def run(
    parts: Mapping[str, Component],
    steps: Mapping[str, StepSize],
    wires: Sequence[str],
    *,
    stop: Time,
    log: list[str] | None = None,
) -> Seen:
    """What is seen of a run in the order of `parts`, also of one that fails."""
    connections = [
        Connection(Endpoint.parse(source), Endpoint.parse(target))
        for source, _, target in (wire.partition(" > ") for wire in wires)
    ]
    seen = Seen([] if log is None else log)
    system = System(parts, steps, connections)
    try:
        simulate(system, GaussSeidel(tuple(parts)), start=0, stop=stop, seed=0, observers=[seen])
    except ComponentError as error:
        seen.log.append(str(error))
    return seen


def chain(
    log: list[str], *, done: bool = True, source: Elsewhere | None = None
) -> Mapping[str, Component]:
    """A source every 2, two that follow it every 4, and a clock here every 1."""
    first = Elsewhere("a", log, lambda: done) if source is None else source
    away = {name: Elsewhere(name, log, lambda: done) for name in "bc"}
    return {"a": first, **away, "clock": Mill()}


STEPS = {"a": 2, "b": 4, "c": 4, "clock": 1}
WIRES = ["a.x > b.u", "b.x > c.u", "a.x > c.v"]


def test_what_reads_a_step_begins_when_that_is_done_not_when_it_is_published() -> None:
    log: list[str] = []
    run(chain(log), STEPS, WIRES, stop=4, log=log)
    assert log == [
        "a begins at 0",
        "a is done",
        "seen at 0",
        "seen at 1",  # b is going to read what a publishes at 4, not at 2
        "a begins at 2",
        "a is done",
        "b begins at 0",
        "seen at 2",
        "b is done",
        "c begins at 0",
        "seen at 3",
        "c is done",
        "seen at 4",
    ]


def test_what_is_not_done_is_waited_for_in_its_turn() -> None:
    log: list[str] = []
    run(chain(log, done=False), STEPS, WIRES, stop=4, log=log)
    assert log[-7:] == [
        "seen at 3",
        "a is done",
        "b begins at 0",
        "b is done",
        "c begins at 0",
        "c is done",
        "seen at 4",
    ]


def test_who_is_behind_is_read_as_it_was_before() -> None:
    """The clock is behind a: at 2 a reads what it has published at 1, as all have then."""
    log: list[str] = []
    run(chain(log), STEPS, [*WIRES, "clock.x > a.u"], stop=4, log=log)
    assert log[:5] == ["seen at 0", "a begins at 0", "seen at 1", "a is done", "seen at 2"]


def test_a_step_that_fails_does_so_in_its_turn() -> None:
    """At 4, not when it is done; what was reached before is seen, and nobody reads of it."""
    log: list[str] = []
    source = Elsewhere("a", log, lambda: True)
    source.fails_at = 2
    run(chain(log, source=source), STEPS, WIRES, stop=8, log=log)
    assert log == [
        "a begins at 0",
        "a is done",
        "seen at 0",
        "seen at 1",
        "a begins at 2",
        "a is done",
        "seen at 2",
        "seen at 3",
        log[-1],
    ]
    assert log[-1].startswith("component `a` at t = 2e-09 s: ValueError: no more")


def test_nobody_reads_a_step_that_was_not_made_to_its_end() -> None:
    log: list[str] = []
    source = Asking("a", log, lambda: True)
    source.end = 3
    run(chain(log, source=source), {**STEPS, "a": 4}, WIRES, stop=8, log=log)
    assert log == ["a begins at 0", "a is done", "seen at 0", "seen at 1", "seen at 2", "seen at 3"]


@settings(max_examples=200, deadline=None)
@given(data=st.data())
def test_no_value_depends_on_when_a_step_is_done(data: st.DataObject) -> None:
    names = [f"c{k}" for k in range(data.draw(st.integers(3, 6)))]
    sizes: st.SearchStrategy[StepSize] = st.sampled_from([1, 2, 3, 4, 6, 12, Fraction(12, 5)])
    steps: dict[str, StepSize] = {name: data.draw(sizes) for name in names}
    inputs = [f"{name}.{u}" for name in names for u in "uv"]
    read = data.draw(st.sets(st.sampled_from(inputs), min_size=2))
    wires = [f"{data.draw(st.sampled_from(names))}.x > {each}" for each in sorted(read)]
    rng = data.draw(st.randoms(use_true_random=False))
    expected = run({name: Mill() for name in names}, steps, wires, stop=24)
    away: dict[str, Component] = {
        name: Elsewhere(name, [], lambda: rng.random() < 0.7) if rng.random() < 0.8 else Mill()
        for name in names
    }
    assert run(away, steps, wires, stop=24).values == expected.values
