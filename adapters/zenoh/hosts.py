"""The run's end of the way to other hosts: it meets all components, then it begins."""

import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from types import MappingProxyType
from typing import Any, Final

import zenoh
from typing_extensions import override
from zenoh.handlers import Callback

from adapters.zenoh.credentials import session_settings
from adapters.zenoh.refusal import refusal
from adapters.zenoh.served_link import ServedLink
from adapters.zenoh.session import (
    LEASE,
    RETRY,
    Keys,
    close_session,
    is_connected,
    meeting_key,
    open_session,
)
from orchestrator.errors import ComponentError, ComponentTypeError
from orchestrator.hosts_file import RUN, Hosts
from orchestrator.network import HostsTransport, Wanted
from orchestrator.remote.patience import Patience
from orchestrator.remote.transport import Link, LinkLostError
from orchestrator.statement import Statement, differences

_CONNECT: Final = 0.5
"""How long to try to connect to one host before it is the turn of another one [s]."""

_ANSWER: Final = 10.0
"""How long a host may take to answer whether it has a component [s]."""

_PAUSE: Final = 0.2
"""The time after which hosts are asked again [s]."""

_REMIND: Final = 10.0
"""How often to say what is waited for, while that stays the same [s]."""


_FAREWELL: Final = 2.0
"""How long all hosts, together, may take to hear that they are needed no more [s]."""


class _RefusedError(Exception):
    """A host has the component not, or another one."""


@dataclass(slots=True)
class _Waiting:
    """What components are waited for, as far as it was told."""

    tell: Callable[[str], None]
    told: str = ""
    at: float = field(default_factory=monotonic)

    def say(self, reasons: Mapping[str, str]) -> None:
        """Tell the reasons, by component, if they are new or were not told for a while."""
        text = "; ".join(f"`{name}`: {why}" for name, why in reasons.items())
        if text and (text != self.told or monotonic() - self.at > _REMIND):
            self.told, self.at = text, monotonic()
            self.tell(f"waiting for {text}")


class ZenohHosts(HostsTransport):
    """Meets components at the endpoints of their hosts, each host in a session of its own.

    Args:
        hosts: where they are.
        wanted: the components, by name.
        run: its name, for people on the other side.
        tell: is called with a line whenever there is something new to wait for.
        lease: how long either end may be silent before the connection counts as lost [s].
    """

    def __init__(
        self,
        hosts: Hosts,
        wanted: Mapping[str, Wanted],
        run: str,
        tell: Callable[[str], None],
        *,
        lease: float = LEASE,
    ) -> None:
        self._hosts = hosts
        self._wanted = wanted
        self._run = run
        self._tell = tell
        self._lease = lease
        self._sessions: dict[str, zenoh.Session] = {}
        self._silent: set[str] = set()
        self._links: dict[str, ServedLink] = {}
        self._runs: dict[str, str] = {}
        self._shelf = secrets.token_hex(16)
        self._found: dict[str, Statement] = {}

    @property
    @override
    def found(self) -> Mapping[str, Statement]:
        return MappingProxyType(self._found)

    @override
    def open(self, names: Sequence[str], timeout: float) -> Mapping[str, Link]:
        began, waiting = monotonic(), _Waiting(self._tell)
        left = list(names)
        while left:
            reasons: dict[str, str] = {}
            refusals: list[str] = []
            self._silent.clear()
            for name in left:
                try:
                    reason = self._meet(name)
                except _RefusedError as refused:
                    refusals += [f"`{name}` on host {refused}"]
                    continue
                if reason:
                    reasons[name] = reason
            if refusals:
                raise ComponentTypeError("\n".join(refusals))
            left = [name for name in names if name in reasons or self._is_lost(name)]
            waiting.say(reasons)
            for name, reason in reasons.items():
                patience = self._wanted[name].deadlines.create
                if monotonic() - began > patience:
                    what = f"{reason}, for {patience:g} s; its `deadline.create` allows no more"
                    raise ComponentError(name, None, what)
            if left:
                sleep(_PAUSE)
        return MappingProxyType(self._links)

    @override
    def renew(self, name: str, timeout: float) -> Link:
        self._links.pop(name).undeclare()
        del self._runs[name]
        self.open([name], timeout)
        return self._links[name]

    @override
    def close(self) -> None:
        links, self._links = self._links, {}
        sessions, self._sessions = self._sessions, {}
        try:
            leaving = [link for link in links.values() if link.leave()]
            deadline = monotonic() + _FAREWELL
            for link in leaving:
                link.await_farewell(deadline)
        finally:
            for session in sessions.values():
                close_session(session)

    def _meet(self, name: str) -> str:
        """Ask for a component, and take it if it is free.

        Returns:
            Why it has to be waited for; empty if it is there.

        Raises:
            _RefusedError: it cannot be used; each reason.
        """
        wanted = self._wanted[name]
        host, endpoint = wanted.host, self._hosts.endpoint(wanted.host)
        session = self._session(host)
        nobody = f"nobody answers at host `{host}` ({endpoint})"
        if session is None:
            refused = refusal(self._hosts, host)
            return f"host `{host}` ({endpoint}): {refused}" if refused else nobody
        run = self._runs.setdefault(name, secrets.token_hex(8))  # also if it has to ask again
        request = {
            "run": run,
            "shelf": self._shelf,
            "name": self._run,
            "patience": wanted.patience,
            "statement": wanted.statement.to_document(),
        }
        answer = _ask(session, meeting_key(name), request)
        if answer is None:
            return f"host `{host}` ({endpoint}) serves nothing" if is_connected(session) else nobody
        there = _agreed(host, wanted.statement, answer)
        if there is None or not answer.get("accepted"):
            return f"host `{host}`: {answer.get('wait', 'it gives no reason')}"
        self._found[name] = there
        link = ServedLink(
            session,
            Keys(run, name),
            name,
            host=host,
            endpoint=endpoint,
            serving=str(answer.get("serving", "")),
        )
        self._links[name] = link
        try:
            link.await_connection(Patience(min(_ANSWER, wanted.deadlines.create)))
        except (TimeoutError, LinkLostError) as error:
            self._links.pop(name).undeclare()
            return f"host `{host}`: {str(error) or 'it is not connected yet'}"
        return ""

    def _is_lost(self, name: str) -> bool:
        """Whether a component that was there is not any more; it is asked for anew then."""
        try:
            self._links[name].receive(0.0)
        except TimeoutError:
            pass
        except LinkLostError:
            self._links.pop(name).undeclare()
            del self._runs[name]
            return True
        return False

    def _session(self, host: str) -> zenoh.Session | None:
        """The session with a host; `None` if it cannot be reached now."""
        if host not in self._sessions and host not in self._silent:
            settings = {
                "mode": "client",
                "connect/endpoints": [str(self._hosts.endpoint(host))],
                "connect/timeout_ms": int(1000 * _CONNECT),
                "connect/retry": RETRY,
                "transport/link/tx/lease": int(1000 * self._lease),
                **session_settings(self._hosts, RUN, listens=False),
            }
            try:
                self._sessions[host] = open_session(settings)
            except zenoh.ZError:
                self._silent.add(host)
        return self._sessions.get(host)


def _agreed(host: str, here: Statement, answer: Mapping[str, Any]) -> Statement | None:
    """What the other side says of the component, if that is what the run means, or nothing yet."""
    if "serves" in answer:
        others = ", ".join(f"`{each}`" for each in _listed(answer["serves"]))
        raise _RefusedError(f"`{host}`: it serves {others}, not this one")
    said = answer.get("statement")
    there = Statement.from_document(said) if isinstance(said, dict) else None
    unlike = [] if there is None else differences(here, there)
    unlike = unlike or _listed(answer.get("refused", []))
    if unlike:
        raise _RefusedError(f"`{host}`: {'; '.join(unlike)}")
    return there


def _ask(session: zenoh.Session, key: str, request: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The answer to a request; `None` if nobody answers."""
    answers: SimpleQueue[bytes] = SimpleQueue()

    def note(reply: zenoh.Reply) -> None:
        if reply.ok is not None:
            answers.put(reply.ok.payload.to_bytes())

    done = Callback(note, lambda: answers.put(b""), indirect=False)
    session.get(key, done, payload=json.dumps(request).encode(), timeout=_ANSWER)
    try:
        return _read(answers.get(timeout=_ANSWER + 1.0))
    except Empty:
        return None


def _read(payload: bytes) -> Mapping[str, Any] | None:
    """What an answer says; `None` if it is none."""
    try:
        answer = json.loads(payload or b"null")
    except (ValueError, RecursionError):
        return None
    return answer if isinstance(answer, dict) else None


def _listed(value: object) -> list[str]:
    """Texts that the other side says; one that it says is all."""
    return [str(each) for each in value] if isinstance(value, list) else [str(value)]
