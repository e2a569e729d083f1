"""A component with parameters of every structure, and what it receives as its output."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from typing_extensions import override

from orchestrator.component import Component
from orchestrator.distribution import Constant, DistributedText, Distribution
from orchestrator.parameters import parameter
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """A place on a lane."""

    lane: str = parameter(doc="of the road network")
    position: float = parameter(0.0, unit="m", minimum=0.0, doc="from its beginning")


@dataclass(frozen=True, slots=True, kw_only=True)
class Entity:
    """Somebody who takes part."""

    role: Literal["ego", "collider"] = parameter("collider", doc="what it does")
    speed: Distribution = parameter(
        Constant(8.5), unit="m/s", minimum=0.0, maximum=50.0, doc="at the start"
    )
    kind: DistributedText = parameter(DistributedText(("car",)), doc="of vehicle")
    start: Start | None = parameter(None, doc="where it starts; null: anywhere")
    files: tuple[Path, ...] = parameter((), doc="with traces")

    def __post_init__(self) -> None:
        if self.role == "ego" and not self.kind.is_constant:
            raise ValueError("the kind of the ego must be one")


@dataclass(frozen=True, slots=True, kw_only=True)
class Stop:
    """When the encounter ends."""

    after: float = parameter(unit="s", minimum=0.0, doc="from its beginning")
    level: float = parameter(0.0, unit="dBm", doc="at which it ends")


class Encounter(Component):
    """Who takes part in an encounter, as text."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        entities: Mapping[str, Entity | None] = parameter({}, doc="by name; null takes one away")
        stops: tuple[Stop, ...] = parameter((), doc="one of which ends the encounter")
        origin: Start = parameter(Start(lane="a"), doc="of all places")
        power: Distribution = parameter(Constant(20.0), unit="dBm", doc="of all radios")
        temperature: Distribution | None = parameter(None, unit="degC", doc="of the air")
        limits: Mapping[str, Stop] = parameter({}, doc="by name")

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self._speeds = ""

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        return {"text": Connector(causality=Causality.OUTPUT, dtype=None, mime_type="text/plain")}

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        drawn = {n: e.speed.draw(rng) for n, e in self.parameters.entities.items() if e}
        self._speeds = repr(drawn)

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None: ...

    @override
    def outputs(self) -> Signals:
        return {"text": f"{self.parameters!r} {self._speeds}".encode()}
