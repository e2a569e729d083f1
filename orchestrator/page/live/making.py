"""Newer and newer pages of a run that goes on."""

import threading
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, thread_time
from typing import Final

from orchestrator.errors import CosimError
from orchestrator.page.page import last_time, page_of
from orchestrator.recording.reader import Recording
from orchestrator.timebase import Time, seconds

_LEAST: Final = 1.0
"""The time between two pages at least [s]: the recorder writes twice a second."""

_SHARE: Final = 3.0
"""So many times the CPU time of a page nothing is made: it takes a quarter of a processor."""

_KEPT: Final = 2
"""Pages that can be asked for: the newest, and the one that a browser may still be loading."""

_PATIENCE: Final = 5
"""So many looks in a row have to fail before that is a problem: the files change meanwhile."""

_OFTEN: Final = 0.5
"""The time between two looks at how far the run is [s]."""

_MENDED: Final = (CosimError, OSError, ValueError)
"""What reading files raises that are just being written."""

RUNNING: Final = "running"


@dataclass(frozen=True, slots=True, kw_only=True)
class LiveState:
    """What a browser is told, again and again.

    Attributes:
        version: of the newest page; 0: there is none yet.
        status: of the run, as its manifest has it.
        reached: until when the run is recorded [s].
        wait: how long after a page the next one comes [s].
        problem: why there is no newer page; empty if nothing is wrong.
    """

    version: int = 0
    status: str = RUNNING
    reached: float = 0.0
    wait: float = _LEAST
    problem: str = ""


class LivePages:
    """Makes pages of one run as it goes on; others ask for them from any thread.

    Args:
        directory: of the run.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self._pages: dict[int, bytes] = {}
        self._shown: tuple[str, Time] | None = None
        self._known = ("", 0)
        self._looked = -_OFTEN
        self._failures, self._problem = 0, ""
        self._wait = _LEAST
        self._lock = threading.Lock()

    def state(self) -> LiveState:
        """What is known by now of the run, which is looked at twice a second at most."""
        with self._lock:
            if monotonic() - self._looked >= _OFTEN:
                self._look()
            status, reached = self._known
            return LiveState(
                version=max(self._pages, default=0),
                status=status,
                reached=seconds(reached),
                wait=self._wait,
                problem=self._problem if self._failures >= _PATIENCE else "",
            )

    def page(self, version: int) -> bytes | None:
        """A page as HTML; `None` if there is none of this version any more."""
        return self._pages.get(version)

    def make(self) -> bool:
        """Make a page if there is something new; whether the run may tell more."""
        began = thread_time()
        with self._lock:
            self._look()
            known = self._known
        if known != self._shown and not self._failures:
            try:
                document, reached = page_of(self.directory)
            except _MENDED as error:
                self._fail(error)
            else:
                self._add(document.text())
                self._shown = known
                with self._lock:
                    self._known = (self._known[0], max(self._known[1], reached))
        self._wait = max(_LEAST, (1 + _SHARE) * (thread_time() - began))
        return known[0] == RUNNING or bool(self._failures)

    def serve(self, ended: threading.Event) -> None:
        """Make pages until `ended` is set, or the run tells nothing more."""
        while not ended.is_set():
            began = monotonic()
            if not self.make():
                return
            ended.wait(max(0.0, self._wait - (monotonic() - began)))

    def _look(self) -> None:
        self._looked = monotonic()
        try:
            recording = Recording(self.directory)
            self._known = (str(recording.manifest.get("status")), last_time(recording))
        except _MENDED as error:
            self._fail(error)
        else:
            self._failures = 0

    def _fail(self, error: Exception) -> None:
        self._failures += 1
        self._problem = f"The run cannot be read: {error}"

    def _add(self, text: str) -> None:
        version = max(self._pages, default=0) + 1
        self._pages = {
            **{k: page for k, page in self._pages.items() if k > version - _KEPT},
            version: text.encode(),
        }
