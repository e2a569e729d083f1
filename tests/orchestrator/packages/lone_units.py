"""A unit that holds what a process can have only one of."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from typing_extensions import override

from orchestrator.component import OncePerProcessComponent
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time


class Lone(OncePerProcessComponent):
    """Holds what it is told."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        holds: str = parameter("", doc="a name; nothing if it is empty")

    def __init__(self, parameters: Parameters) -> None:
        del parameters

    @classmethod
    @override
    def once_per_process(cls, parameters: Parameters) -> str | None:
        return parameters.holds or None

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return MappingProxyType({"y": Connector(causality=Causality.OUTPUT)})

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        del start, rng

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        del inputs, t, h

    @override
    def outputs(self) -> Signals:
        return {"y": np.array(0.0)}
