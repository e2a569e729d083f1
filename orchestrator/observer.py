"""Observers: they watch a simulation and change nothing."""

import abc
import sys
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Final, NoReturn, TextIO

from tqdm import tqdm
from typing_extensions import override

from orchestrator.early_end import EarlyEnd
from orchestrator.signal import Signals
from orchestrator.stretch import Stretch
from orchestrator.system import Endpoint, System
from orchestrator.timebase import Time, seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class WallTime:
    """Where the wall time of a run went [s].

    Attributes:
        components: time spent in the calls of each component; for a concurrent component the
            time it was waited for.
        observers: time spent in observers.
        orchestrator: everything else: gathering, checking and publishing signals.
    """

    components: Mapping[str, float]
    observers: float
    orchestrator: float

    @property
    def total(self) -> float:
        """The duration of the run [s]."""
        return sum(self.components.values()) + self.observers + self.orchestrator


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulationResult:
    """What became of a simulation.

    Attributes:
        start: the first communication point [ns].
        time: the last communication point that was reached [ns].
        values: the outputs published there, by component and connector. Those that nobody looked
            at during the run are read at its end; they are missing where a step was under way or
            the run failed.
        wall_time: where the time went.
        error: what made the run fail, or `None`.
        early_end: why it ended before its stop time without failing, or `None`.
        coupling: what the coupling algorithm counted, by name, such as steps that were taken back.
    """

    start: Time
    time: Time
    values: Mapping[str, Signals]
    wall_time: WallTime
    error: BaseException | None = None
    early_end: EarlyEnd | None = None
    coupling: Mapping[str, int] = field(default_factory=dict)

    @property
    def status(self) -> str:
        """`done`, `failed` or `interrupted`."""
        if self.error is None:
            return "done"
        return "failed" if isinstance(self.error, Exception) else "interrupted"

    @property
    def speed(self) -> float:
        """Simulated seconds per second of wall time."""
        return seconds(self.time - self.start) / self.wall_time.total


class Observer(abc.ABC):
    """Watches a simulation from communication point to communication point.

    Order of calls: `begin`, `observe` at every communication point from the first on, `end`.
    `end` is called also after an error and also if `begin` failed.
    """

    @abc.abstractmethod
    def begin(self, system: System, start: Time, stop: Time) -> None:
        """A run of `system` from `start` to `stop` [ns] begins; no component is set up yet.

        It may end before `stop`, where an output says so or a component asks for it; the result has
        the time.
        """

    @abc.abstractmethod
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        """The simulation is at `t`.

        Args:
            t: the communication point [ns].
            published: the components that published outputs at `t`; all at the first point.
            values: the published outputs of all components. The mappings change at the next
                communication point; the signals in them never do and may be kept.
        """

    sees_stretches: ClassVar[bool] = False
    """Whether `observe_stretch` may be called in place of `observe` for points that follow each
    other; otherwise compiled code takes no part in the run."""

    def wants(self, system: System) -> Collection[Endpoint]:
        """The outputs that it looks at; asked for after `begin`, if it `sees_stretches`.

        Every value of them is in a stretch. Others may be missing from `values`, for nobody may
        have asked the component for them.
        """
        del system
        return ()

    def look_up(self) -> None:
        """Nothing is observed for a while: compiled code works, or a run steps again.

        That is, to where it was cut off. Whoever may want to end it does so here; others do
        nothing. What was published until then is observed before the run ends.
        """

    def observe_stretch(self, stretch: Stretch) -> None:
        """The simulation went on to `stretch.time` by way of other communication points."""
        self.observe(stretch.time, tuple(stretch.samples), stretch.values)

    @abc.abstractmethod
    def end(self, result: SimulationResult) -> None:
        """The run is over, and every component is closed."""


class ProgressMeter(Observer):
    """Draws a bar: simulated seconds, simulated seconds per second, remaining time.

    Args:
        stream: where to draw.
    """

    sees_stretches = True

    REDRAWS: Final = 1000
    """How often a bar is drawn over a run, at most."""

    FORMAT: Final = "{l_bar}{bar}| {n:.2f}/{total:.2f} s [{elapsed}<{remaining}, {rate_noinv_fmt}]"

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._bar: tqdm[NoReturn] | None = None
        self._drawn: Time = 0
        self._pause: Time = 0

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        self._drawn = start
        self._pause = max((stop - start) // self.REDRAWS, 1)
        self._bar = tqdm(
            total=seconds(stop - start),
            file=self._stream,
            unit=" sim-s",
            bar_format=self.FORMAT,
        )

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        if t - self._drawn >= self._pause:
            self._draw(t)

    @override
    def end(self, result: SimulationResult) -> None:
        if self._bar is not None:
            if result.error is None:
                self._bar.total = seconds(result.time - result.start)  # it may have ended early
            self._draw(result.time)
            self._bar.close()

    def _draw(self, t: Time) -> None:
        if self._bar is not None:
            self._bar.update(seconds(t - self._drawn))
            self._drawn = t


class NoProgress(Observer):
    """Draws nothing."""

    sees_stretches = True

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        pass

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        pass

    @override
    def end(self, result: SimulationResult) -> None:
        pass


def progress_meter(*, always: bool = False, stream: TextIO | None = None) -> Observer:
    """A `ProgressMeter` on `stream` (standard error), if that is a terminal or `always` is set."""
    target = sys.stderr if stream is None else stream
    return ProgressMeter(target) if always or target.isatty() else NoProgress()
