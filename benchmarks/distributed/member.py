"""A member of the ring as a component."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter_ns

import numpy as np
from typing_extensions import override

from benchmarks.distributed.ring import PARALLEL, Ring
from orchestrator.component import Component
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time


class Member(Component):
    """Adds 1 to every element of what the member before it gives."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        """Which member it is."""

        number: int = parameter(doc="of the member, from 0 on")
        members: int = parameter(doc="how many there are")
        size: int = parameter(doc="of the array [byte]")
        stamps: str = parameter("", doc="the file for when its steps began, and the last one ended")

    def __init__(self, parameters: Parameters) -> None:
        self._file = parameters.stamps
        self._stamps: list[int] = []
        ring = Ring(parameters.size, PARALLEL, parameters.members)
        self._y = ring.start(parameters.number)
        shape = (ring.length,)
        self._connectors = {
            "u": Connector(causality=Causality.INPUT, shape=shape),
            "y": Connector(causality=Causality.OUTPUT, shape=shape),
        }

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return self._connectors

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        del start, rng

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._stamps.append(perf_counter_ns())
        self._y = np.asarray(inputs["u"]) + 1.0

    @override
    def outputs(self) -> Signals:
        return {"y": self._y}

    @override
    def close(self) -> None:
        if self._file:
            Path(self._file).write_text(json.dumps([*self._stamps, perf_counter_ns()]))
