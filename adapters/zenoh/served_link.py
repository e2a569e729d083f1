"""A component on another host, as the run sees it."""

import json
import logging
from contextlib import suppress
from time import monotonic
from typing import Final

import zenoh
from typing_extensions import override
from zenoh.handlers import Callback

from adapters.zenoh.knock import Knock
from adapters.zenoh.line import Event, Line, News
from adapters.zenoh.session import Keys, served_key
from orchestrator.hosts_file import HostEndpoint
from orchestrator.remote.patience import Patience
from orchestrator.remote.transport import Link, LinkLostError

_GONE: Final = (News.DISCONNECTED, News.ENDED)


class ServedLink(Link):
    """The line to one served component.

    A lost connection may come back until the deadline of the command that is waited for. The
    component is lost for good if the other side says so, if it was started anew, or if its machine
    answers that nobody listens any more.

    Args:
        session: of the run, connected to the host.
        keys: of this component in this run.
        component: its name.
        host: its name.
        endpoint: of the host.
        serving: what the host calls this time of serving.
    """

    def __init__(
        self,
        session: zenoh.Session,
        keys: Keys,
        component: str,
        *,
        host: str,
        endpoint: HostEndpoint,
        serving: str,
    ) -> None:
        self._component = component
        self._host = host
        self._obituary = ""
        self._has_left = False
        self._knock = Knock(endpoint)
        self._site = serving
        self._serving = served_key(component, serving)
        self._line = Line(session, keys, component, f"host `{host}`")
        self._declared = (
            session.declare_subscriber(keys.end, Callback(self._on_end, indirect=False)),
            session.declare_subscriber(keys.log, Callback(self._on_log, indirect=False)),
            session.liveliness().declare_subscriber(
                served_key(component, "*"), Callback(self._on_serving, indirect=False), history=True
            ),
            session.liveliness().declare_token(keys.run_alive(session.zid())),
        )

    def await_connection(self, patience: Patience) -> None:
        """Wait until commands and replies will both arrive.

        Args:
            patience: how long.

        Raises:
            TimeoutError: the other side is not there in time.
            LinkLostError: it has ended, or was there and is not any more.
        """
        event, _ = self._check(self._line.await_connection(patience))
        if event is News.DISCONNECTED:
            raise LinkLostError("the connection was lost at once")

    @override
    def send(self, message: bytes) -> None:
        if self._obituary:
            raise LinkLostError(self._obituary)
        self._line.send(message)

    @override
    def receive(self, timeout: float) -> bytes:
        deadline = monotonic() + timeout
        while True:
            try:
                event, payload = self._check(self._line.next(deadline - monotonic()))
            except TimeoutError:
                self._look_after()
                raise
            if event is News.REPLY:
                return payload

    @property
    @override
    def site(self) -> str:
        return self._site

    @property
    @override
    def condition(self) -> str:
        lost = f"the connection to host `{self._host}` is lost"
        return "" if self._line.lost_for is None else lost

    @override
    def abandon(self) -> None:
        self._obituary = self._obituary or "it was given up by the run"
        self._knock.forget()
        if not self._has_left:
            self._has_left = True
            self._line.send(b"")

    @override
    def limit_memory(self, limit: int | None) -> None:
        pass  # who serves the component limits it, by the same scenario

    def leave(self) -> bool:
        """Say that the component is needed no more; whether that was not said before."""
        is_news = not self._has_left
        self.abandon()
        return is_news

    def await_farewell(self, deadline: float) -> None:
        """Wait until the other side has heard that it is needed no more, and has said all.

        Args:
            deadline: on the clock of `time.monotonic` [s].
        """
        with suppress(TimeoutError):
            while self._line.next(deadline - monotonic())[0] not in _GONE:
                pass

    def undeclare(self) -> None:
        """Take part in nothing any more, so that another one can take the place of this link."""
        for each in self._declared:
            each.undeclare()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it
        self._line.close()

    def _check(self, event: Event) -> Event:
        """The event; the end of the component raises `LinkLostError`."""
        if event[0] is News.ENDED:
            self._lose(event[1].decode(errors="replace"))
        if event[0] is News.CONNECTED:
            self._knock.forget()
        if self._obituary:
            raise LinkLostError(self._obituary)
        return event

    def _look_after(self) -> None:
        """Find out whether a connection that is lost can come back at all."""
        if self._line.lost_for is not None and self._knock.is_refused:
            self._lose("nobody listens there any more; `nlosim serve` has ended or was killed")
            raise LinkLostError(self._obituary)

    def _lose(self, how: str) -> None:
        self._obituary = self._obituary or f"on host `{self._host}`: {how}"

    def _on_end(self, sample: zenoh.Sample) -> None:
        self._line.end(sample.payload.to_bytes())

    def _on_serving(self, sample: zenoh.Sample) -> None:
        is_there = sample.kind == zenoh.SampleKind.PUT
        if is_there and str(sample.key_expr) != self._serving:
            self._line.end(b"`nlosim serve` was started anew; it knows nothing of this run")

    def _on_log(self, sample: zenoh.Sample) -> None:
        for name, level, text in json.loads(sample.payload.to_bytes()):
            logger = logging.getLogger(name)
            if logger.isEnabledFor(level):
                logger.handle(logger.makeRecord(name, level, self._component, 0, text, (), None))
