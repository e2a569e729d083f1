"""The end of a host that serves components: where runs ask for them, and how they use them."""

import json
import logging
import re
import threading
from collections.abc import Mapping
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any, Final

import zenoh
from typing_extensions import override
from zenoh.handlers import Callback

from adapters.zenoh.session import (
    Keys,
    close_session,
    is_matched,
    meeting_key,
    open_session,
    served_key,
)
from orchestrator.network import Lobby, Reception, Records, Visit

_RUN: Final = re.compile(r"[0-9a-f]{8,64}")
"""What a run may call itself: a chunk of a key, and nothing else."""

_MOST: Final = 64
"""Requests that may wait to be answered."""

_AGAIN: Final = 0.001
"""How soon to see again whether somebody listens [s]."""

_log = logging.getLogger(__name__)


class _Voice:
    """Says one thing at a time, as soon as somebody listens; said sooner it would vanish silently.

    Args:
        session: of the visit.
        key: under which it is heard.
    """

    def __init__(self, session: zenoh.Session, key: str) -> None:
        self._publisher = session.declare_publisher(
            key, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        self._unsaid: bytes | None = None

    def say(self, payload: bytes) -> None:
        """Say `payload` in place of what was not said yet."""
        self._unsaid = payload
        self.is_done()

    def forget(self) -> None:
        """Leave unsaid what was not said yet."""
        self._unsaid = None

    def is_done(self) -> bool:
        """Whether all was said, by now."""
        if self._unsaid is not None and is_matched(self._publisher):
            payload, self._unsaid = self._unsaid, None
            self._publisher.put(payload)
        return self._unsaid is None

    def close(self) -> None:
        """Say nothing any more."""
        self._publisher.undeclare()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it


class ZenohVisit(Visit):
    """A run's use of one component, in the session that listens.

    Args:
        session: that listens.
        keys: of the component in this run.
    """

    def __init__(self, session: zenoh.Session, keys: Keys) -> None:
        self._commands: SimpleQueue[bytes] = SimpleQueue()
        self._command = self._reply = self._loss = b""
        self._absent_since: float | None = monotonic()
        self._is_over = False
        self._output, self._end = _Voice(session, keys.output), _Voice(session, keys.end)
        self._logs = session.declare_publisher(
            keys.log, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )
        self._declared = (
            session.declare_subscriber(keys.command, Callback(self._on_command, indirect=False)),
            session.liveliness().declare_subscriber(
                keys.run_alive("*"), Callback(self._on_token, indirect=False), history=True
            ),
            # last: whoever sees the token may rely on all of the above
            session.liveliness().declare_token(keys.alive(session.zid())),
        )

    @property
    @override
    def absence(self) -> float:
        since = self._absent_since
        return 0.0 if since is None else monotonic() - since

    @property
    @override
    def is_over(self) -> bool:
        return self._is_over

    @override
    def receive(self, timeout: float) -> bytes:
        deadline = monotonic() + timeout
        while True:
            is_said = all([self._output.is_done(), self._end.is_done()])
            left = max(0.0, deadline - monotonic())
            is_hurried = not is_said and self._absent_since is None
            try:
                command = self._commands.get(timeout=min(left, _AGAIN) if is_hurried else left)
            except Empty:
                if left:
                    continue
                raise TimeoutError from None
            if not command or command != self._command:
                self._command, self._reply = command, b""
                self._output.forget()
                return command
            if self._loss:  # what was said was not heard
                self._end.say(self._loss)
            elif self._reply:
                self._output.say(self._reply)

    @override
    def send(self, reply: bytes) -> None:
        self._reply = reply
        self._output.say(reply)

    @override
    def lose(self, how: str) -> None:
        self._loss = how.encode()
        self._end.say(self._loss)

    @override
    def log(self, records: Records) -> None:
        if is_matched(self._logs):
            self._logs.put(json.dumps(records).encode())

    @override
    def close(self) -> None:
        for each in (*self._declared, self._logs):
            each.undeclare()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it
        for voice in (self._output, self._end):
            voice.close()

    def _on_command(self, sample: zenoh.Sample) -> None:
        command = sample.payload.to_bytes()
        self._is_over = self._is_over or not command
        self._commands.put(command)

    def _on_token(self, sample: zenoh.Sample) -> None:
        is_there = sample.kind == zenoh.SampleKind.PUT
        self._absent_since = None if is_there else monotonic()


class ZenohLobby(Lobby):
    """Listens at an endpoint, and answers runs in a thread of its own.

    Args:
        settings: of the session that listens.
        reception: decides.
        serving: what this time of serving is called; another one has another name.

    Raises:
        zenoh.ZError: the session cannot be opened, such as when the port is taken.
    """

    def __init__(self, settings: Mapping[str, Any], reception: Reception, serving: str) -> None:
        self._reception = reception
        self._serving = serving
        self._queries: SimpleQueue[zenoh.Query | None] = SimpleQueue()
        self._session: zenoh.Session | None = None
        self._session = session = open_session(settings)
        # every component has this answer, served or not: who asks for another one is told
        self._meetings = session.declare_queryable(
            meeting_key("*"), Callback(self._on_query, indirect=False)
        )
        self._tokens = [
            session.liveliness().declare_token(served_key(name, serving))
            for name in reception.names
        ]
        self._thread = threading.Thread(target=self._answer, name="meetings", daemon=True)
        self._thread.start()

    @override
    def close(self) -> None:
        if self._session is not None:
            session, self._session = self._session, None
            self._queries.put(None)
            self._thread.join()
            close_session(session)

    def _on_query(self, query: zenoh.Query) -> None:
        if self._queries.qsize() < _MOST:
            self._queries.put(query)
        else:
            query.drop()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it

    def _answer(self) -> None:
        while (query := self._queries.get()) is not None:
            with query:
                try:
                    self._meet(query)
                except Exception:  # whatever a stranger sends, others are answered
                    _log.warning("a request could not be answered", exc_info=True)

    def _meet(self, query: zenoh.Query) -> None:
        session, component = self._session, str(query.key_expr).split("/")[3]
        try:
            request = json.loads(b"null" if query.payload is None else query.payload.to_bytes())
        except (ValueError, RecursionError):
            return
        is_sound = isinstance(request, dict) and _RUN.fullmatch(str(request.get("run")))
        if session is None or not is_sound:
            return
        answer: dict[str, Any]
        if component in self._reception.names:
            answer = {**self._reception.meet(component, request), "serving": self._serving}
        else:
            answer = {"serves": list(self._reception.names)}
        if answer.get("accepted") and not answer.get("again"):
            visit = ZenohVisit(session, Keys(request["run"], component))
            if not self._reception.welcome(component, request, visit):
                answer = {"wait": "it is not to be had any more"}
        query.reply(query.key_expr, json.dumps(answer).encode())
