"""Which components of a scenario run in processes of their own, and how they are reached."""

import enum
import sys
from collections.abc import Mapping
from typing import Final

LOCAL: Final = "local"
IN_PROCESS: Final = "in-process"
LOOPBACK: Final = "loopback"

HERE: Final = (IN_PROCESS, LOOPBACK)
"""Transports that leave everything in the orchestrator's process."""


class Isolation(enum.Enum):
    """What a scenario says of `process`."""

    NEVER = False
    ON_REQUEST = "on-request"
    ALWAYS = True

    @property
    def written(self) -> str:
        """The text that a scenario file has."""
        return self.value if isinstance(self.value, str) else str(self.value).lower()

    def is_behind(self, transport: str | None) -> bool:
        """Whether the component is reached through a transport.

        Args:
            transport: the one that was asked for; `None` if none was.
        """
        if transport is None:
            return self is Isolation.ALWAYS
        return transport != IN_PROCESS and self is not Isolation.NEVER


ISOLATIONS: Final[Mapping[bool | str, Isolation]] = {each.value: each for each in Isolation}
"""All of them by what a scenario file writes."""


def usual_transport() -> str:
    """The transport of components that are always apart, where none was asked for.

    Windows cannot hand sockets to a process as `local` does it.
    """
    return "zenoh" if sys.platform == "win32" else LOCAL
