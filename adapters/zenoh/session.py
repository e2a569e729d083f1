"""Keys and session settings that both ends of a link share."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import zenoh

LEASE: Final = 5.0
"""The connection to a peer that was silent for so long is given up and made again [s]."""

_WAIT_BEFORE_CLOSE_US: Final = 600_000_000
"""How long a blocking `put` waits for a peer that does not read before its link is closed. The
lease comes first; Zenoh's own 5 s would lose messages silently."""

COMMON: Final[Mapping[str, Any]] = {
    # nobody is looked for, and nobody finds us: the address is handed over
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/link/tx/queue/size/data": 16,
    "transport/link/tx/queue/congestion_control/block/wait_before_close": _WAIT_BEFORE_CLOSE_US,
    "transport/link/rx/buffer_size": 1 << 22,
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

    def alive(self, session: object) -> str:
        """The token that vanishes with the host's `session`."""
        return f"{self._base}/alive/{session}"

    @property
    def _base(self) -> str:
        return f"cs/@v1/{self.run}/{self.component}"


def open_session(settings: Mapping[str, Any]) -> zenoh.Session:
    """Open a session with `settings` on top of the common ones."""
    config = zenoh.Config()
    for key, value in {**COMMON, **settings}.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def is_matched(publisher: zenoh.Publisher) -> bool:
    """Whether somebody receives what `publisher` puts; what is put sooner vanishes silently."""
    status: Any = publisher.matching_status  # an object; Zenoh's type stubs say `bool`
    return bool(status.matching)


def close_session(session: zenoh.Session) -> None:
    """Close `session`; without this a process may hang at its exit."""
    session.close()  # type: ignore[no-untyped-call]  # as Zenoh's type stubs have it
