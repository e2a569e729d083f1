"""What a component in another process may take, and what is done when its process is lost."""

import enum
import sys
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True, kw_only=True)
class Deadlines:
    """How long a host may take before it counts as hung, in seconds of wall-clock time.

    Attributes:
        create: to start, and to create its component [s].
        setup: to set it up, or to initialise it [s].
        step: for one communication step [s].
        close: to close its component [s].
        interrupted: to finish a step that nobody waits for any more [s].
    """

    create: float = 60.0
    setup: float = 60.0
    step: float = 30.0
    close: float = 5.0
    interrupted: float = 0.1


class OnFailure(enum.Enum):
    """What is done when the process of a component is lost: it died, or does not answer."""

    ABORT = "abort"
    RESTART = "restart"


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What the host of one component may take.

    Attributes:
        deadlines: of its replies.
        memory: that its process may have for itself [byte]; `None`: any amount.
        on_failure: what is done when its process is lost.
    """

    deadlines: Deadlines = Deadlines()
    memory: int | None = None
    on_failure: OnFailure = OnFailure.ABORT


USUAL: Final = Limits()


def can_limit_memory() -> bool:
    """Whether this system tells how much memory another process has."""
    return sys.platform == "linux"
