"""Commands one way and replies the other, over a connection that may be cut and come back."""

import enum
import logging
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Final, TypeAlias

import zenoh
from zenoh.handlers import Callback

from adapters.zenoh.session import Keys, is_matched
from adapters.zenoh.threads import stay_known
from orchestrator.remote.patience import SLICE, Patience

_SUSPICIOUS: Final = 0.5
"""How long a connection is lost before that is worth a word: a process that died says so [s]."""

_AGAIN: Final = 0.001
"""How soon to see again whether the other end listens [s]."""

_log = logging.getLogger(__name__)


class News(enum.Enum):
    """What can happen on a line."""

    CONNECTED = enum.auto()
    REPLY = enum.auto()
    DISCONNECTED = enum.auto()
    ENDED = enum.auto()


Event: TypeAlias = tuple[News, bytes]


class Line:
    """The orchestrator's end of the line to one host.

    A lost connection is no end: host or orchestrator may have been stopped for a while, or the
    network. When the host is there again, it is told the last command once more, which does no
    harm if it has carried it out.

    Args:
        session: the orchestrator's.
        keys: of this component in this run.
        component: its name.
        far_end: what is at the other end, for messages.
    """

    def __init__(self, session: zenoh.Session, keys: Keys, component: str, far_end: str) -> None:
        self._component = component
        self._far_end = far_end
        self._news: SimpleQueue[Event] = SimpleQueue()
        self._is_unsaid = False
        self._lost_at: float | None = None
        self._is_told = False
        self._message: bytes | None = None
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

    @property
    def lost_for(self) -> float | None:
        """How long the connection is lost [s]; `None` if it is not."""
        return None if self._lost_at is None else monotonic() - self._lost_at

    def end(self, text: bytes = b"") -> None:
        """Note that the other end is gone; may be called from any thread."""
        self._news.put((News.ENDED, text))

    def await_connection(self, patience: Patience) -> Event:
        """Wait until commands and replies will both arrive.

        Args:
            patience: how long.

        Returns:
            The last event: that the other end is connected, that it has left again, or has ended.

        Raises:
            TimeoutError: the other end is not there in time.
        """
        is_there = False
        while True:
            # declarations travel by themselves: a command sent too early would vanish silently
            if is_there and is_matched(self._commands):
                return News.CONNECTED, b""
            before = monotonic()
            try:
                event = self.next(patience.slice(_AGAIN if is_there else SLICE))
            except TimeoutError:
                if patience.is_over:
                    raise
                continue
            finally:
                patience.spend(before)
            if event[0] is News.ENDED or (is_there and event[0] is News.DISCONNECTED):
                return event
            is_there = is_there or event[0] is News.CONNECTED

    def send(self, message: bytes) -> None:
        """Say a command."""
        self._message, self._is_unsaid = message, False
        self._commands.put(message)

    def say(self) -> None:
        """Say the last command once more."""
        if self._message is not None:
            self._commands.put(self._message)

    def close(self) -> None:
        """Hear nothing any more."""
        for each in (self._replies, self._tokens, self._commands):
            each.undeclare()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it

    def next(self, timeout: float) -> Event:
        """The next event.

        Args:
            timeout: how long to wait [s].

        Raises:
            TimeoutError: there is none in time.
        """
        if self._is_unsaid:
            self._repeat()
        try:
            event = self._news.get(timeout=max(0.0, timeout))
        except Empty:
            self._tell()
            raise TimeoutError from None
        if event[0] is News.DISCONNECTED:
            self._lost_at, self._is_told = monotonic(), False
        elif event[0] is News.CONNECTED:
            self._return()
        return event

    def _return(self) -> None:
        """The host is there; if it was not for a while, what was said meanwhile is lost."""
        if self._lost_at is not None:
            self._is_unsaid = self._message is not None
            if self._is_told:
                _log.warning("`%s`: %s is there again", self._component, self._far_end)
            self._lost_at = None

    def _repeat(self) -> None:
        """Say the last command once more, as soon as somebody hears it."""
        if is_matched(self._commands):
            self._is_unsaid = False
            self.say()

    def _tell(self) -> None:
        """Log, once, that nothing was heard for a while."""
        lost_for = self.lost_for
        if lost_for is not None and not self._is_told and lost_for > _SUSPICIOUS:
            self._is_told = True
            waiting = "it is waited for until its deadline"
            _log.warning(
                "`%s`: lost the connection to %s; %s", self._component, self._far_end, waiting
            )

    def _on_reply(self, sample: zenoh.Sample) -> None:
        stay_known()
        self._news.put((News.REPLY, sample.payload.to_bytes()))

    def _on_token(self, sample: zenoh.Sample) -> None:
        is_there = sample.kind == zenoh.SampleKind.PUT
        self._news.put((News.CONNECTED if is_there else News.DISCONNECTED, b""))
