"""The run's end of a tap: an observer that shows the latest values to whoever has connected.

It has no thread and never waits. A few times a second of wall time, and for no more than a small
share of it, the run looks whether somebody wants something, and hands the latest values to the
operating system for those who have taken the ones before. Whoever reads too slowly misses messages,
and is told how many.
"""

import logging
import secrets
import select
import socket
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import monotonic, perf_counter
from types import TracebackType
from typing import Any, Final, Self

import numpy as np
from typing_extensions import override

from orchestrator.observer import Observer, SimulationResult
from orchestrator.patterns import meant
from orchestrator.signal import Causality, Connector, Signal, Signals
from orchestrator.stretch import Stretch
from orchestrator.system import System
from orchestrator.tap.place import FILE, Place
from orchestrator.tap.stream import PUBLICATIONS, PUBLISHED, Kind, Message, Schema
from orchestrator.tap.watcher import EVERYTHING, MOST_PER_SECOND, Watcher
from orchestrator.timebase import Time

SHARE: Final = 0.01
"""How much of the wall time of a run taps take at most, but for the ends of single messages."""

LARGEST: Final = 1 << 16
"""Values that are larger are sent to those who name signals, not to those who want all [byte]."""

_MOST: Final = 16
"""Readers at a time."""

_FAREWELL: Final = 0.2
"""How long the end of a run waits for readers to take the last message [s]."""

_SIGNALS: Final = 1 << 16
"""Signals that a schema has room for."""

_log = logging.getLogger(__name__)


class Tap(Observer):
    """Shows a run to those who know the token in its directory.

    Args:
        share: how much of the wall time it takes at most.
        clock: of the wall time [s].
    """

    sees_stretches = True

    def __init__(self, *, share: float = SHARE, clock: Callable[[], float] = perf_counter) -> None:
        self._share = share
        self._clock = clock
        self._due = self._began = clock()
        self._socket: socket.socket | None = None
        self._file = Path()
        self._token = secrets.token_hex(16)
        self._watchers: list[Watcher] = []
        self._run = ""
        self._interval = (0, 0)
        self._outputs: dict[str, Connector] = {}
        self._ends: dict[str, tuple[str, str]] = {}
        self._published: dict[str, Time] = {}
        self._publications: dict[str, int] = {}
        self._points = 0

    def listen(self, directory: Path) -> None:
        """Let readers come from now on; they find the address in the directory of the run."""
        self._socket = socket.create_server(("127.0.0.1", 0), backlog=_MOST)
        self._socket.setblocking(False)  # noqa: FBT003 - as Python has it
        self._file = directory.absolute() / FILE
        self._run = directory.absolute().name
        Place(self._socket.getsockname()[1], self._token).write(directory)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._close()

    @override
    def begin(self, system: System, start: Time, stop: Time) -> None:
        self._began = self._clock()
        self._interval = (start, stop)
        self._published = dict.fromkeys(system.components, start)
        self._publications = dict.fromkeys(system.components, 0)
        for component, connectors in system.connectors.items():
            for name, connector in connectors.items():
                is_shown = connector.is_binary or not np.dtype(connector.dtype).hasobject
                if connector.causality is Causality.OUTPUT and is_shown:
                    self._outputs[f"{component}.{name}"] = connector
                    self._ends[f"{component}.{name}"] = (component, name)

    @override
    def observe(self, t: Time, published: tuple[str, ...], values: Mapping[str, Signals]) -> None:
        self._points += 1
        for name in published:
            self._published[name] = t
            self._publications[name] += 1
        if self._clock() >= self._due:
            self._tend(t, values)

    @override
    def observe_stretch(self, stretch: Stretch) -> None:
        self._points += stretch.count
        for name, samples in stretch.samples.items():
            if len(samples.times):
                self._published[name] = int(samples.times[-1])
                self._publications[name] += len(samples.times)
        if self._clock() >= self._due:
            self._tend(stretch.time, stretch.values)

    @override
    def end(self, result: SimulationResult) -> None:
        early, error = result.early_end, result.error
        document = {
            "status": result.status,
            "error": None if error is None else str(error) or type(error).__name__,
            "ended_early": None if early is None else early.text,
        }
        with self._harmless():
            self._welcome()
            for watcher in self._watchers:
                watcher.look()
                watcher.send(self._values(watcher, result.time, result.values))
                watcher.send(self._message(Kind.END, result.time, document=document))
            self._say_farewell()
        self._close()

    def _tend(self, t: Time, values: Mapping[str, Signals]) -> None:
        """See to all readers; what that takes is made up for by a pause."""
        began = self._clock()
        with self._harmless():
            self._welcome()
            for watcher in self._watchers:
                watcher.look()
                if watcher.is_due(began):
                    watcher.send(self._values(watcher, t, values))
            self._watchers = [each for each in self._watchers if not each.is_gone]
        now = self._clock()
        self._due = now + max(1 / MOST_PER_SECOND, (now - began) / self._share)

    def _welcome(self) -> None:
        while self._socket is not None:
            try:
                connection, _ = self._socket.accept()
            except OSError:  # nobody is there
                return
            if len(self._watchers) < _MOST:
                self._watchers.append(Watcher(connection, self._token, self._schema))
            else:
                connection.close()

    def _schema(self, patterns: Sequence[str]) -> Schema:
        """What a reader is shown: outputs that match one of its patterns."""
        wanted = {name for pattern in patterns for name in meant(pattern, self._outputs)}
        names = [name for name in self._outputs if name in wanted]
        shown = {name: self._outputs[name] for name in names[: _SIGNALS - 2]}
        # somebody who wants to see everything does not mean 2 MB of points ten times a second
        largest = LARGEST if list(patterns) == [EVERYTHING] else None
        components = tuple(self._published)
        return Schema.of(self._run, self._interval, components, shown, largest)

    def _values(self, watcher: Watcher, t: Time, values: Mapping[str, Signals]) -> Message:
        schema = watcher.schema
        shown: dict[str, Signal] = {
            PUBLISHED: np.array(list(self._published.values()), np.int64),
            PUBLICATIONS: np.array(list(self._publications.values()), np.int64),
        }
        largest = None if schema is None else schema.largest
        for name in () if schema is None else schema.connectors:
            if name in self._ends:
                component, connector = self._ends[name]
                value = values.get(component, {}).get(connector)
                if value is not None and (largest is None or _size(value) <= largest):
                    shown[name] = value
        return self._message(Kind.VALUES, t, left_out=watcher.left_out, values=shown)

    def _message(self, kind: Kind, t: Time, **content: Any) -> Message:
        wall = round((self._clock() - self._began) * 1e9)
        return Message(kind=kind, t=t, points=self._points, wall=wall, **content)

    def _say_farewell(self) -> None:
        """Give readers a moment to take what was sent last."""
        deadline = monotonic() + _FAREWELL
        while behind := [each for each in self._watchers if each.is_behind and not each.is_gone]:
            left = deadline - monotonic()
            if left <= 0:
                return
            select.select([], behind, [], left)
            for watcher in behind:
                watcher.flush()

    def _harmless(self) -> "_Harmless":
        return _Harmless(self._close)

    def _close(self) -> None:
        watchers, self._watchers = self._watchers, []
        for watcher in watchers:
            watcher.close()
        if self._socket is not None:
            self._socket.close()
            self._socket = None
            with suppress(OSError):
                self._file.unlink()


def _size(value: Signal) -> int:
    return len(value) if isinstance(value, bytes) else value.nbytes


class _Harmless:
    """A block whose errors end the tap, and never the run."""

    def __init__(self, close: Callable[[], None]) -> None:
        self._close = close

    def __enter__(self) -> None:
        pass

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> bool:
        if isinstance(error, Exception):
            _log.warning("the tap of this run is closed: %s: %s", type(error).__name__, error)
            self._close()
            return True
        return False
