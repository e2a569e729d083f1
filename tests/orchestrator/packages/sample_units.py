"""Small components that tests of scenarios and of the command line wire together."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

import numpy as np
from typing_extensions import override

from orchestrator.absence import Need, Undriven
from orchestrator.component import Component
from orchestrator.measure import Answer, Measure
from orchestrator.parameters import ParameterProblem, parameter
from orchestrator.recording.reader import Recording
from orchestrator.report import Report
from orchestrator.signal import Causality, Connector, Signals
from orchestrator.timebase import Duration, Time
from tests.idle import Idle

if TYPE_CHECKING:
    from matplotlib.axes import Axes  # takes longer than all else in a process of a test

_OUT = Causality.OUTPUT
_IN = Causality.INPUT


class Sender(Component):
    """Drives around."""

    connectors: ClassVar[Mapping[str, Connector]] = {
        "vehicle.x": Connector(causality=_OUT, unit="m"),
        "vehicle.y": Connector(causality=_OUT, unit="m"),
        "power": Connector(causality=_OUT, unit="dBm"),
    }

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        power: float = parameter(26.0, unit="dBm", minimum=-40, maximum=33, doc="transmit power")
        count: int = parameter(3, minimum=1, doc="number of vehicles")
        mode: Literal["fast", "slow"] = parameter("fast", doc="how it drives")
        offsets: tuple[float, ...] = parameter((), unit="m", doc="lateral offsets")
        label: str = parameter("", doc="a name")
        noisy: bool = parameter(False, doc="whether positions are random")
        trace: Path | None = parameter(None, doc="a file")

    def __init__(self, parameters: Parameters) -> None:
        if parameters.mode == "slow" and parameters.count > 5:
            raise ValueError("`slow` allows for 5 vehicles at most")
        self.parameters = parameters
        self._x = 0.0
        self._rng = np.random.default_rng(0)

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._x = 0.0
        self._rng = rng

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._x += self._rng.random() if self.parameters.noisy else 1.0

    @override
    def outputs(self) -> Signals:
        values = {"vehicle.x": self._x, "vehicle.y": -self._x, "power": self.parameters.power}
        return {name: np.asarray(value) for name, value in values.items()}


class Receiver(Component):
    """Passes on what it sees; fails when told to."""

    connectors: ClassVar[Mapping[str, Connector]] = {
        "vehicle.x": Connector(causality=_IN, unit="m"),
        "vehicle.y": Connector(causality=_IN, unit="m"),
        "u": Connector(causality=_IN, unit="m"),
        "y": Connector(causality=_OUT, unit="m", feedthrough=frozenset({"vehicle.x", "u"})),
    }

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        gain: float = parameter(doc="factor on what it sees")
        fails_at: float = parameter(1e9, unit="s", doc="when it raises an error")
        interrupts_at: float = parameter(1e9, unit="s", doc="when it raises KeyboardInterrupt")

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self._y = 0.0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._y = 0.0

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        if t >= self.parameters.fails_at * 1e9:
            raise RuntimeError("the antenna fell off")
        if t >= self.parameters.interrupts_at * 1e9:
            raise KeyboardInterrupt
        self._y = self.parameters.gain * (float(inputs["vehicle.x"]) + float(inputs["u"]))

    @override
    def outputs(self) -> Signals:
        return {"y": np.asarray(self._y)}


class Alarm(Component):
    """Goes off at some time."""

    connectors: ClassVar[Mapping[str, Connector]] = {
        "bell.rings": Connector(causality=_OUT, dtype=np.bool_),
        "lamps": Connector(causality=_OUT, dtype=np.bool_, shape=(2,)),
    }

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        after: float = parameter(0.5, unit="s", doc="when it goes off")

    def __init__(self, parameters: Parameters) -> None:
        self.parameters = parameters
        self._t = 0

    @override
    def setup(self, start: Time, rng: np.random.Generator) -> None:
        self._t = start

    @override
    def step(self, inputs: Signals, t: Time, h: Duration) -> None:
        self._t = t + h

    @override
    def outputs(self) -> Signals:
        rings = self._t >= self.parameters.after * 1e9
        return {"bell.rings": np.asarray(rings), "lamps": np.array([rings, rings])}


class Carts(Idle):
    """Roll, each until somebody steers it."""

    @dataclass(frozen=True, slots=True, kw_only=True)
    class Parameters:
        names: tuple[str, ...] = parameter(doc="of the carts")

    def __init__(self, parameters: Parameters) -> None:
        self._names = parameters.names

    @property
    @override
    def connectors(self) -> Mapping[str, Connector]:
        steered = {
            f"{name}.wheel": Connector(
                causality=_IN,
                unit="m",
                undriven=Undriven(f"`{name}` rolls on", Need.NEVER),
                parameter=("names", k),
            )
            for k, name in enumerate(self._names)
        }
        return {**steered, "horn": Connector(causality=_IN)}

    @override
    def outputs(self) -> Signals:
        return {}


class Isolated(Idle):
    """Has no connectors."""

    connectors: ClassVar[Mapping[str, Connector]] = {}

    @override
    def outputs(self) -> Signals:
        return {}


class Broken(Isolated):
    """Cannot even be created."""

    def __init__(self) -> None:
        raise ZeroDivisionError("oops")


class Trace(Report):
    """How far the car drove."""

    @override
    def metrics(self, recording: Recording) -> Mapping[str, Any]:
        series = recording["car.vehicle.x"]
        return {"samples": len(series), "distance_m": float(series.values[-1])}

    @override
    def summary(self, metrics: Mapping[str, Any], manifest: Mapping[str, Any]) -> str:
        return f"{manifest['scenario']['title']}: {metrics['samples']} samples"

    @override
    def figure(self, recording: Recording, metrics: Mapping[str, Any], path: Path) -> None:
        path.write_bytes(b"\x89PNG\r\n\x1a\n")


class Buggy(Trace):
    """Raises an error."""

    @override
    def metrics(self, recording: Recording) -> Mapping[str, Any]:
        raise LookupError("no such thing")


@dataclass(frozen=True, slots=True, kw_only=True)
class Span(Measure):
    """Between the least and the greatest value of a signal."""

    signal: str = parameter(doc="`component.connector`")
    scale: float = parameter(1.0, unit="m", minimum=0.001, doc="what one is")

    @override
    def problems(self, components: Sequence[str]) -> Iterator[ParameterProblem]:
        if self.signal.partition(".")[0] not in components:
            yield ParameterProblem(("signal",), f"`{self.signal}` is of no component")

    @override
    def compute(self, recording: Recording) -> Mapping[str, float | int | bool | str | None]:
        values = recording[self.signal].values
        return {"span": float(np.ptp(values)) / self.scale, "samples": len(values), "none": None}


@dataclass(frozen=True, slots=True)
class Clumsy(Measure):
    """Raises an error."""

    @override
    def compute(self, recording: Recording) -> Mapping[str, float | int | bool | str | None]:
        raise LookupError("no such number")


@dataclass(frozen=True, slots=True)
class Leaving(Measure):
    """Ends the process."""

    @override
    def compute(self, recording: Recording) -> Mapping[str, float | int | bool | str | None]:
        sys.exit(0)


@dataclass(frozen=True, slots=True)
class Course(Measure):
    """Samples of a signal, as a table and as a panel."""

    signal: str = parameter(doc="`component.connector`")

    @override
    def compute(self, recording: Recording) -> Answer:
        series = recording[self.signal]
        values = np.where(series.times > 0, series.values, np.nan)

        def panel(axes: "Axes") -> None:
            axes.plot(series.times, values)

        return Answer(
            numbers={"samples": len(series)},
            tables={"values": {"time_ns": series.times, "value": values}},
            panel=panel,
        )
