"""A scenario without simulators, an experiment with it, and what they leave on disk."""

from pathlib import Path
from typing import Final

PARTS: Final = """\
import json
import time
from pathlib import Path
import numpy as np
from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector
from dataclasses import dataclass


@dataclass(frozen=True)
class Parameters:
    sleep: float = parameter(0.0, doc="Time of a step", unit="s")
    size: int = parameter(20, doc="Numbers of a sample")
    cut: float = parameter(9.0, doc="When Ctrl-C comes, where no file `calm` lies", unit="s")


class Noise(Component, PortableState):
    Parameters = Parameters
    connectors = {
        "y": Connector(causality=Causality.OUTPUT, shape=(20,)),
        "level": Connector(causality=Causality.OUTPUT),
        "raw": Connector(causality=Causality.OUTPUT, dtype=None),
    }

    def __init__(self, parameters):
        self._parameters = parameters

    def setup(self, start, rng):
        self._rng = rng

    def initialise(self, inputs):
        self._y = self._rng.normal(size=20)

    def step(self, inputs, t, h):
        time.sleep(self._parameters.sleep)
        if t >= self._parameters.cut * 1e9 and not Path(__file__).with_name("calm").exists():
            raise KeyboardInterrupt
        self._y = self._rng.normal(size=20)

    def outputs(self):
        level = np.asarray(self._y[0])
        return {"y": self._y, "level": level, "raw": self._y.tobytes()[: int(abs(self._y[0]) * 50)]}

    def dump(self):
        state = self._rng.bit_generator.state
        return json.dumps([state, self._y.tolist()]).encode()

    def load(self, content):
        self._rng.bit_generator.state, y = json.loads(content)
        self._y = np.array(y)
"""

SCENARIO: Final = """\
schema: 1
title: Noise
time: {stop: 1 s}
components:
  noise: {type: "relia_parts:Noise", step: 10 ms}
  calm: {type: "relia_parts:Noise", step: 100 ms}
measures:
  mean: {type: signal, signal: calm.level, statistic: mean}
"""

EXPERIMENT: Final = """\
schema: 1
scenario: case.yaml
seeds: 2
factors:
  step:
    short: {components.noise.step: 50 ms}
    long: {components.noise.step: 100 ms}
metrics: {mean: measures.mean.value}
"""


def written(folder: Path) -> Path:
    """The files in `folder`, which is made if it is not there."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "relia_parts.py").write_text(PARTS)
    (folder / "case.yaml").write_text(SCENARIO)
    (folder / "experiment.yaml").write_text(EXPERIMENT)
    return folder
