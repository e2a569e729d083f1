"""A small world to train in: a ball that wind pushes, and a policy that pushes it back.

The expert pushes with -0.5 times the position; the network is that one number, and an offset.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.recording.reader import Recording
from orchestrator.report import Report
from orchestrator.signal import Array, Causality, Connector, Signals
from orchestrator.timebase import Duration, Time
from studies.training.learner import EpochResult, Learner, Optimisation, RecordedRun
from tests.idle import Idle

GAIN: Final = -0.5
"""What the expert multiplies the position by."""

SCENARIO: Final = """\
schema: 1
title: A ball in the wind
time: {start: 0 s, stop: 1 s}
components:
  policy: {type: toy-policy, step: 100 ms}
recording: {include: [policy.sample]}
report: toy-report
"""

TRAINING: Final = """\
schema: 1
scenario: ball.yaml
seed: 7
network: {type: toy-learner}
scenes:
  wind:
    calm: {components.policy.parameters.wind: 0.1}
    storm: {components.policy.parameters.wind: 1.0}
  start:
    left: {components.policy.parameters.start: -2}
    right: {components.policy.parameters.start: 2}
expert: {runs: 4}
dagger: {rounds: 2, runs: 3, beta: 0.5, decay: 0.5}
validation: {runs: 2}
optimisation: {epochs: 6, batch: 8, rate: 0.05, patience: 2}
device: cpu
checkpoint: toy.safetensors
"""


BYTES: Final = {"sample": Connector(causality=Causality.OUTPUT, dtype=None)}
NUMBERS = {"sample": Connector(causality=Causality.OUTPUT)}
"""A sample as training expects it."""


class Policy(Component):
    """Pushes a ball back to where it belongs."""

    connectors = BYTES

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        network: str = parameter("", doc="a checkpoint; the expert drives if empty")
        beta: float = parameter(1.0, minimum=0.0, maximum=1.0, doc="share of the expert's commands")
        wind: float = parameter(0.5, doc="how hard it blows")
        start: float = parameter(1.0, doc="where the ball is at first")
        fails: tuple[int, ...] = parameter((), doc="last digits of the first random number")
        silent: bool = parameter(False, doc="whether there are no samples")

    def __init__(self, parameters: Parameters) -> None:
        self._parameters = parameters
        self._network = (GAIN, 0.0)
        if parameters.network:
            found = json.loads(Path(parameters.network).read_text())
            self._network = (found["gain"], found["offset"])

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._rng = rng
        self._position = self._parameters.start
        self._sample = b""
        self._fate = int(rng.integers(10))

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if self._fate in self._parameters.fails:
            raise RuntimeError("the ball burst")
        expert = GAIN * self._position
        if not self._parameters.silent:
            self._sample = np.array([self._position, expert]).tobytes()
        gain, offset = self._network
        own = gain * self._position + offset
        command = expert if self._rng.random() < self._parameters.beta else own
        self._position += command + self._parameters.wind * self._rng.normal()

    @override
    def outputs(self) -> Signals:
        return {"sample": self._sample}


class PlainPolicy(Policy):
    """Has a sample that is no bytes."""

    connectors = NUMBERS

    @override
    def outputs(self) -> Signals:
        return {"sample": np.asarray(0.0)}


class Bystander(Idle):
    """Cannot be trained."""

    connectors = BYTES

    @override
    def outputs(self) -> Signals:
        return {"sample": b""}


class Companion(Bystander):
    """Uses the network, too, and does not know the one that the scenario names."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        network: str = parameter("", doc="a checkpoint")

    def __init__(self, parameters: Parameters) -> None:
        if parameters.network == "old":
            raise ValueError("there is no network `old`")


class Fall(Report):
    """Whether the ball rolled away."""

    @override
    def metrics(self, recording: Recording) -> Mapping[str, Any]:
        last = np.frombuffer(recording["policy.sample"][-1])
        is_lost = bool(len(last) == 0 or abs(last[0]) > 1.0)
        return {"collision": is_lost, "success": not is_lost}

    @override
    def summary(self, metrics: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
        return ""

    @override
    def figure(self, recording: Recording, metrics: Mapping[str, Any], path: Path) -> None:
        pass


class Line(Learner):
    """Learns a straight line by stochastic gradient descent with momentum."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        momentum: float = parameter(0.5, minimum=0.0, maximum=0.99, doc="of the descent")
        degree: int = parameter(1, minimum=1, doc="of the polynomial")

    def __init__(
        self, parameters: Parameters, optimisation: Optimisation, seed: int, device: str
    ) -> None:
        if parameters.degree > 1:
            raise ValueError(f"`degree` {parameters.degree} is not supported; write 1")
        self._momentum = parameters.momentum
        self._plan = optimisation
        self._rng = np.random.default_rng(seed)
        self._weights = self._rng.normal(size=2)
        self._velocity = np.zeros(2)
        self._samples = np.zeros((0, 2))
        self._validation = np.zeros((0, 2))

    @override
    def add(self, runs: Iterable[RecordedRun]) -> None:
        self._samples = np.concatenate([self._samples, _table(runs)])

    @override
    def add_validation(self, runs: Iterable[RecordedRun]) -> None:
        self._validation = _table(runs)

    @override
    def begin_round(self, number: int) -> None:
        self._velocity = np.zeros(2)

    @override
    def epoch(self) -> EpochResult:
        order, losses = self._rng.permutation(len(self._samples)), []
        for first in range(0, len(order), self._plan.batch):
            inputs, error = self._error(self._samples[order[first : first + self._plan.batch]])
            losses.append(float(np.mean(error**2)))
            gradient = 2 * inputs.T @ error / len(error)
            self._velocity = self._momentum * self._velocity - self._plan.rate * gradient
            self._weights = self._weights + self._velocity
        _, error = self._error(self._validation)
        validation = float(np.mean(error**2))
        parts = {"validation.largest": float(np.abs(error).max())}
        return EpochResult(training=float(np.mean(losses)), validation=validation, parts=parts)

    def _error(self, samples: Array) -> tuple[Array, Array]:
        inputs = np.stack([samples[:, 0], np.ones(len(samples))], axis=1)
        return inputs, inputs @ self._weights - samples[:, 1]

    @override
    def state(self) -> bytes:
        content = {
            "weights": self._weights.tolist(),
            "velocity": self._velocity.tolist(),
            "rng": self._rng.bit_generator.state,
        }
        return json.dumps(content).encode()

    @override
    def restore(self, state: bytes) -> None:
        content = json.loads(state)
        self._weights = np.array(content["weights"])
        self._velocity = np.array(content["velocity"])
        self._rng.bit_generator.state = content["rng"]

    @override
    def export(self, path: Path) -> None:
        gain, offset = self._weights.tolist()
        path.write_text(json.dumps({"gain": gain, "offset": offset}))


def _table(runs: Iterable[RecordedRun]) -> Array:
    """Positions and the expert's commands, shape (samples, 2)."""
    found = [np.frombuffer(sample) for run in runs for sample in run.samples]
    if any(len(each) != 2 for each in found):
        raise ValueError("a sample has not two numbers")
    return np.stack(found)
