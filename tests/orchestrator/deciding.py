"""Components for tests of branching: a noisy point, and who pushes it towards a target."""

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from typing_extensions import override

from orchestrator.algorithm.base import CosimulationAlgorithm
from orchestrator.capabilities import Redrawing
from orchestrator.component import Component, DecidingComponent, Decision
from orchestrator.observer import Observer, SimulationResult
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.simulation import simulate
from orchestrator.system import Connection, Endpoint, System
from orchestrator.timebase import Duration, Time

H = 100_000_000
PUSHES = (-0.8, -0.3, 0.0, 0.3, 0.8)
PERIOD = 5
"""Steps between decisions."""
HORIZON = 8
"""Steps from a decision to its horizon."""
GOAL = 7
"""Hits with which a pusher is done."""
X = Connector(causality=Causality.INPUT)
PUSH = Connector(causality=Causality.OUTPUT, feedthrough=frozenset({"x"}))


class Point(Component):
    """Goes where it is pushed, and astray; `fault(push, time)` is called in every step."""

    def __init__(self, fault: Callable[[float, Time], Any] = lambda push, time: None) -> None:
        self._fault = fault

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {"push": X, "x": Connector(causality=Causality.OUTPUT)}

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng = rng
        self._x = np.array(0.0)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        push = float(np.asarray(inputs["push"]))
        self._fault(push, t)
        self._x = np.array(self._x + push + self._rng.normal())

    @override
    def outputs(self) -> Signals:
        return {"x": self._x}


class ChancyPoint(Point, Redrawing):
    """What it goes astray by can be drawn anew; in every run at the times in `redraws`.

    Args:
        redraws: by the time at which a step begins, the stream from then on.
    """

    def __init__(self, redraws: Mapping[Time, np.random.Generator] | None = None) -> None:
        super().__init__(self._meet)
        self._redraws = redraws or {}

    def _meet(self, push: float, time: Time) -> None:
        if time in self._redraws:
            self.redraw(self._redraws[time])

    @override
    def redraw(self, rng: np.random.Generator) -> None:
        self._rng = rng


class _Pusher:
    """What both pushers have in common: when it is time to choose, and what was achieved."""

    def __init__(self) -> None:
        self.steps = 0
        self.hits = 0
        self.pushed = 0.0

    def look(self, inputs: Signals) -> bool:
        """Whether to choose now."""
        self.steps += 1
        self.hits += abs(float(np.asarray(inputs["x"]))) < 1.0
        return self.steps % PERIOD == 1

    def outputs(self) -> Signals:
        return {
            "push": np.array(self.pushed),
            "hits": np.array(self.hits, np.int64),
            "done": np.array(self.hits >= GOAL),
        }


CONNECTORS = {
    "x": X,
    "push": PUSH,
    "hits": Connector(causality=Causality.OUTPUT, dtype=np.int64),
    "done": Connector(causality=Causality.OUTPUT, dtype=np.bool_),
}


class _PushingComponent(Component):
    """Pushes, and tells what was achieved."""

    connectors = CONNECTORS

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._state = _Pusher()

    @override
    def outputs(self) -> Signals:
        return self._state.outputs()


class Chooser(_PushingComponent, DecidingComponent):
    """Chooses the push after which `x` is near zero most often."""

    def __init__(
        self,
        *,
        pushes: tuple[float, ...] = PUSHES,
        prunes: bool = True,
        draws: int = 0,
        value: Callable[[int], float] = float,
    ) -> None:
        self._pushes = pushes
        self._prunes = prunes
        self._draws = draws
        self._value = value

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        super().setup(start, rng)
        self._decision: Decision | None = None
        self._opened: Time = 0
        self.choices: list[int] = []

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._now = t + h
        if self._state.look(inputs):
            names = tuple(f"push {push:g}" for push in self._pushes)
            self._decision = Decision(
                alternatives=names, horizon=t + h + HORIZON * H, draws=self._draws
            )
            self._opened = t + h

    @property
    @override
    def decision(self) -> Decision | None:
        return self._decision

    @override
    def decide(self, alternative: int) -> None:
        self._decision = None
        self.choices.append(alternative)
        self._state.pushed = self._pushes[alternative]

    @override
    def score(self) -> float:
        return self._value(self._state.hits)

    @override
    def score_bound(self, horizon: Time) -> float:
        if not self._prunes:
            return math.inf
        assert self._opened <= horizon <= self._opened + HORIZON * H
        return self._state.hits + (horizon - self._now) // H


class Planned(_PushingComponent):
    """Does what it was told, and the first alternative afterwards."""

    def __init__(self, choices: list[int], pushes: tuple[float, ...] = PUSHES) -> None:
        self._choices = choices
        self._pushes = pushes

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        super().setup(start, rng)
        self._next = iter(self._choices)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._state.look(inputs):
            self._state.pushed = self._pushes[next(self._next, 0)]


class Trace(Observer):
    """Everything that was published, and when."""

    def __init__(self) -> None:
        self.seen: list[tuple[Time, dict[str, bytes]]] = []

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        signals = {
            f"{c}.{n}": np.asarray(s).tobytes() for c in values for n, s in values[c].items()
        }
        self.seen.append((t, signals))

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def run(
    pusher: Component,
    algorithm: CosimulationAlgorithm,
    *,
    steps: int = 23,
    seed: int = 1,
    point: Component | None = None,
    until: Endpoint | None = None,
) -> tuple[SimulationResult, Trace]:
    """Simulate the pusher, the point, and what the point's readers see in between."""
    components = {"point": Point() if point is None else point, "pusher": pusher}
    system = System(
        components,
        dict.fromkeys(components, H),
        (
            Connection(Endpoint("point", "x"), Endpoint("pusher", "x")),
            Connection(Endpoint("pusher", "push"), Endpoint("point", "push")),
        ),
    )
    trace = Trace()
    result = simulate(
        system, algorithm, start=0, stop=steps * H, seed=seed, observers=(trace,), until=until
    )
    return result, trace
