"""A component that walks at random, in a file of its own, and scenarios of it."""

MODULE = """\
from dataclasses import dataclass
from pathlib import Path
import numpy as np
from orchestrator.capabilities import PortableState
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector

HERE = Path(__file__).parent


class Walk(Component, PortableState):
    # a random walk in three dimensions; the weather is an input that nobody declares
    connectors = {"place": Connector(causality=Causality.OUTPUT, shape=(3,), unit="m"),
                  "steps": Connector(causality=Causality.OUTPUT, dtype=np.int64)}

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        table: Path = parameter(doc="the width of a step")

    def __init__(self, parameters):
        self._width = float(parameters.table.read_text())

    def setup(self, start, rng):
        self._rng, self._place, self._steps = rng, np.zeros(3), 0

    def step(self, inputs, t, h):
        self._steps += 1
        self._place = self._place + self._width * self._rng.integers(-1, 2, 3)
        for line in (HERE / "weather").read_text().split() if (HERE / "weather").exists() else ():
            what, at = line.split("@")
            if self._steps == int(at) and what == "storm":
                raise ValueError("lost in a storm")
            if self._steps == int(at):
                self._place[2] += 8.0

    def outputs(self):
        return {"place": self._place, "steps": np.array(self._steps)}

    def dump(self):
        return b"".join([self._place.tobytes(), self._steps.to_bytes(8, "little"),
                         repr(self._rng.bit_generator.state).encode()])

    def load(self, content):
        self._place = np.frombuffer(content[:24]).copy()
        self._steps = int.from_bytes(content[24:32], "little")
        self._rng.bit_generator.state = eval(content[32:], {"array": np.array, "uint64": np.uint64})
"""
BASE = """\
schema: 1
title: A walk
time: {stop: 1 s}
components:
  one:
    type: walk_parts:Walk
    step: 100 ms
    parameters: {table: data/width.txt}
"""
WALK = """\
schema: 1
extends: base.yaml
title: A longer walk
time: {stop: 2 s}
"""
