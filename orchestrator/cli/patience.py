"""A component that does not come back from a call keeps its run from hearing a request to stop.

Python hears signals between two of its own instructions, so code of an FMU that never returns keeps
them waiting. Whoever waits for the run's process tells the user, and ends it at his second request.
"""

import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from time import monotonic
from typing import Final

from orchestrator.cli.requests import SAME_REQUEST
from orchestrator.last_call import CutOff, called

_LONGEST: Final = 2.0
"""How long a call may go on after a request [s]."""


class Patience:
    """How long a run that was asked to stop is waited for.

    Args:
        directory: of the run, once it has begun.
    """

    def __init__(self, directory: Callable[[], Path | None]) -> None:
        self._directory = directory
        self._asked: list[float] = []
        self._call: CutOff | None = None
        self.is_over = False

    def ask(self) -> None:
        """Note that the run is asked to stop."""
        now = monotonic()
        if not self._asked or now - self._asked[-1] >= SAME_REQUEST:
            self._asked.append(now)
            self._call = self._called()

    @property
    def pause(self) -> float | None:
        """When to `look` next, if nothing comes before [s]; `None`: there is no need to."""
        return _LONGEST if self._call is not None else None

    def look(self) -> None:
        """See whether the run is in the same call still; at the second request that is its end."""
        now, before = self._called(), self._call
        if now != before:
            self._call = now  # a call that came later has the same time again
        elif len(self._asked) > 1:
            self.is_over = True
        else:
            self._call = None  # the next request asks again
            with suppress(OSError):  # the terminal may be gone
                sys.stderr.write(
                    f"\nwaiting: {now} and has not come back; again to end the process\n"
                )

    def _called(self) -> CutOff | None:
        directory = self._directory()
        found = None if directory is None else called(directory)
        return found if found is not None and found.component else None
