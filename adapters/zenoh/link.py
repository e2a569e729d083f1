"""One host as the orchestrator sees it: its process, its keys, and what is new about both."""

import enum
import logging
from collections.abc import Mapping
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from typing import Any, Final, TypeAlias

import zenoh
from typing_extensions import override
from zenoh.handlers import Callback

from adapters.zenoh.channel import ZenohChannel
from adapters.zenoh.session import Keys, is_matched
from orchestrator.errors import ComponentError
from orchestrator.remote.process import HostProcess
from orchestrator.remote.transport import LinkLostError, ProcessLink

_SUSPICIOUS: Final = 0.5
"""How long a connection is lost before that is worth a word: a process that died says so [s]."""

_log = logging.getLogger(__name__)


class _News(enum.Enum):
    CONNECTED = enum.auto()
    REPLY = enum.auto()
    DISCONNECTED = enum.auto()
    EXITED = enum.auto()


_Event: TypeAlias = tuple[_News, bytes]


class ZenohLink(ProcessLink):
    """The link to one host. Declares its keys and spawns its process; does not wait for it.

    A lost connection is no end: host or orchestrator may have been stopped for a while, or the
    network. When the host is there again, it is told the last command once more, which does no
    harm if it has carried it out.

    Args:
        session: the orchestrator's.
        keys: of this component in this run.
        component: its name.
        options: arguments of `ZenohChannel`.
    """

    def __init__(
        self, session: zenoh.Session, keys: Keys, component: str, options: Mapping[str, Any]
    ) -> None:
        self._component = component
        self._news: SimpleQueue[_Event] = SimpleQueue()
        self._obituary = ""
        self._message = b""
        self._is_unsaid = False
        self._lost_at: float | None = None
        self._is_told = False
        # Direct callbacks run in Zenoh's own thread, so they only pass things on; the default
        # ones start a Python thread each, which costs more than the step of a small component.
        self._replies = session.declare_subscriber(
            keys.output, Callback(self._on_reply, indirect=False)
        )
        self._tokens = session.liveliness().declare_subscriber(
            keys.alive("*"), Callback(self._on_token, indirect=False), history=True
        )
        self._commands = session.declare_publisher(
            keys.command, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        self._process = HostProcess(
            component, ZenohChannel, options, lambda: self._news.put((_News.EXITED, b""))
        )

    def await_connection(self, deadline: float) -> None:
        """Wait until commands and replies will both arrive.

        Args:
            deadline: on the clock of `time.monotonic` [s].

        Raises:
            ComponentError: the process ended, or is not there in time.
        """
        try:
            while self._next(deadline - monotonic())[0] is not _News.CONNECTED:
                pass
        except TimeoutError:
            raise self._not_ready() from None
        except LinkLostError as error:
            raise ComponentError(self._component, None, str(error)) from None
        # declarations travel by themselves: a command sent too early would vanish silently
        while not is_matched(self._commands):
            if monotonic() > deadline:
                raise self._not_ready()
            sleep(0.001)

    @override
    def send(self, message: bytes) -> None:
        if self._obituary:
            raise LinkLostError(self._obituary)
        self._message, self._is_unsaid = message, False
        self._commands.put(message)

    @override
    def receive(self, timeout: float) -> bytes:
        deadline = monotonic() + timeout
        while True:
            event, payload = self._next(deadline - monotonic())
            if event is _News.REPLY:
                return payload

    @property
    @override
    def condition(self) -> str:
        return "" if self._lost_at is None else "the connection to its process is lost"

    @override
    def abandon(self) -> None:
        self._process.kill()
        self._obituary = self._obituary or "its process was ended by the orchestrator"

    @override
    def dismiss(self) -> None:
        if not self._obituary:
            self._commands.put(b"")

    def _next(self, timeout: float) -> _Event:
        """The next event but the end of the host, which raises `LinkLostError`."""
        self._repeat()
        try:
            event, payload = self._news.get(timeout=max(0.0, timeout))
        except Empty:
            self._tell()
            raise TimeoutError from None
        if event is _News.EXITED:
            self._obituary = self._process.obituary()
        elif event is _News.DISCONNECTED:
            self._lost_at, self._is_told = monotonic(), False
        elif event is _News.CONNECTED:
            self._return()
        if self._obituary:
            raise LinkLostError(self._obituary)
        return event, payload

    def _return(self) -> None:
        """The host is there; if it was not for a while, what was said meanwhile is lost."""
        if self._lost_at is not None:
            self._is_unsaid = bool(self._message)
            if self._is_told:
                _log.warning("`%s`: its process is there again", self._component)
            self._lost_at = None

    def _repeat(self) -> None:
        """Say the last command once more, as soon as somebody hears it."""
        if self._is_unsaid and is_matched(self._commands):
            self._is_unsaid = False
            self._commands.put(self._message)

    def _tell(self) -> None:
        """Log, once, that nothing was heard for a while."""
        lost_at = self._lost_at
        if lost_at is not None and not self._is_told and monotonic() - lost_at > _SUSPICIOUS:
            self._is_told = True
            waiting = "lost the connection to its process; it is waited for until its deadline"
            _log.warning("`%s`: %s", self._component, waiting)

    def _not_ready(self) -> ComponentError:
        said = self._process.last_words()
        return ComponentError(self._component, None, f"its process was not ready in time{said}")

    def _on_reply(self, sample: zenoh.Sample) -> None:
        self._news.put((_News.REPLY, sample.payload.to_bytes()))

    def _on_token(self, sample: zenoh.Sample) -> None:
        is_there = sample.kind == zenoh.SampleKind.PUT
        self._news.put((_News.CONNECTED if is_there else _News.DISCONNECTED, b""))
