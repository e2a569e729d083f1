"""Keys and session settings that both ends of a link share."""

import json
import logging
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import zenoh

from orchestrator import leaving

_log = logging.getLogger(__name__)

LEASE: Final = 5.0
"""The connection to a peer that was silent for so long is given up and made again [s]."""

RETRY: Final = {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 2}
"""How soon to connect again after the connection was lost."""

_WAIT_BEFORE_CLOSE_US: Final = 600_000_000
"""How long a blocking `put` waits for a peer that does not read before its link is closed. The
lease comes first; Zenoh's own 5 s would lose messages silently."""

_PENDING: Final = 512
"""Connections that have not said yet who they are, at most; each takes a descriptor."""

_INTRODUCTION_MS: Final = 2000
"""How long a connection may take to say who it is. Zenoh's own 10 s, and 100 connections, let
anybody who opens more of them keep our hosts out."""

_CLOSING: Final = 15.0
"""How long closing a session may take [s]. Zenoh waits 10 s for tasks of its own; what takes longer
waits for threads that have died."""

_left_open: Final[list[zenoh.Session]] = []
"""Sessions that could not be closed. To forget one would close it, and wait again."""

COMMON: Final[Mapping[str, Any]] = {
    # nobody is looked for, and nobody finds us: the address is handed over
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/link/tx/queue/size/data": 16,
    "transport/link/tx/queue/congestion_control/block/wait_before_close": _WAIT_BEFORE_CLOSE_US,
    "transport/link/rx/buffer_size": 1 << 22,
    "transport/unicast/accept_pending": _PENDING,
    "transport/unicast/accept_timeout": _INTRODUCTION_MS,
    # Shared memory would halve the time of a message of 1 MB, but its segments (17 MB a process)
    # outlive the process, even one that closed its session, and where /dev/shm is small (64 MB in
    # a container) a host dies of it.
    "transport/shared_memory/enabled": False,
    # `lowlatency` loses messages of more than 60 kB without an error
    "transport/unicast/lowlatency": False,
}


@dataclass(frozen=True, slots=True)
class Keys:
    """The keys of one component in one run.

    Chunks that start with `@` are hidden from `**`, so that watching everything else
    does not catch the data path.
    """

    run: str
    component: str

    @property
    def command(self) -> str:
        """Commands to the host."""
        return f"{self._base}/cmd"

    @property
    def output(self) -> str:
        """Its replies."""
        return f"{self._base}/out"

    @property
    def end(self) -> str:
        """How the component was lost, from who serves it."""
        return f"{self._base}/end"

    @property
    def log(self) -> str:
        """Log records from who serves the component."""
        return f"{self._base}/log"

    def alive(self, session: object) -> str:
        """The token that vanishes with the host's `session`."""
        return f"{self._base}/alive/{session}"

    def run_alive(self, session: object) -> str:
        """The token that vanishes with the `session` of the run."""
        return f"{self._base}/run/{session}"

    @property
    def _base(self) -> str:
        return f"cs/@v1/{self.run}/{self.component}"


def meeting_key(component: str) -> str:
    """Where a run asks for a component that is served."""
    return f"cs/@v1/serve/{component}/meet"


def served_key(component: str, serving: str) -> str:
    """The token of a component that is served, as long as `serving` lasts."""
    return f"cs/@v1/serve/{component}/alive/{serving}"


def open_session(settings: Mapping[str, Any]) -> zenoh.Session:
    """Open a session with `settings` on top of the common ones."""
    leaving.called_from_outside()  # its threads outlive the session
    config = zenoh.Config()
    for key, value in {**COMMON, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def is_matched(publisher: zenoh.Publisher) -> bool:
    """Whether somebody receives what `publisher` puts; what is put sooner vanishes silently."""
    status: Any = publisher.matching_status  # an object; Zenoh's type stubs say `bool`
    return bool(status.matching)


def is_connected(session: zenoh.Session) -> bool:
    """Whether `session` has a connection to another one now."""
    return any((*session.info.peers_zid(), *session.info.routers_zid()))


def close_session(session: zenoh.Session) -> None:
    """Close `session`; without this a process may hang at its exit.

    Where memory is short, Zenoh's threads die, and what waits for them never comes back: such a
    session is left open, for the end of the process.
    """
    closing = threading.Thread(target=_close, args=(session,), name="closing", daemon=True)
    try:
        closing.start()
    except (RuntimeError, MemoryError) as error:  # no more threads: Zenoh would need some, too
        _left_open.append(session)
        _log.warning("a session is left open: %s", error)
        return
    closing.join(_CLOSING)
    if closing.is_alive():
        _left_open.append(session)
        _log.warning("a session is left open: it was not closed within %g s", _CLOSING)


def _close(session: zenoh.Session) -> None:
    try:
        session.close()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it
    except zenoh.ZError as error:  # it waits for strangers that have not said who they are
        _log.debug("a session was not closed in time: %s", error)
