"""Operating-system processes that host components.

A host is spawned, never forked: a fork would share the sessions and threads of libraries that
do not survive it. Parent and child agree on this:

* The first line on the child's standard input is JSON: how to connect, what may be created there,
  and what to log. It is not an argument because arguments can be read by every user of the machine.
* Standard input then stays open and silent. Its end means that the parent is gone, however
  that came about, or wants the child to end, which it does at once, with all that it started.
* The child has a folder for temporary files of its own, which the parent removes afterwards.
* What the child writes to standard output or error goes to the log of the parent, as far as there
  is room for it, and the last lines of it into the error message if the child dies.
"""

import contextlib
import json
import logging
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from orchestrator.byte_size import format_size
from orchestrator.process_end import ended
from orchestrator.reaping import children_of
from orchestrator.remote.host import HostChannel
from orchestrator.remote.memory_watch import watch_memory
from orchestrator.remote.output import Output
from orchestrator.scratch import discard, temporary_folder

_log = logging.getLogger(__name__)

_THREAD_VARIABLES: Final = (
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)
"""Set to 1 unless the user set them: the processes share the cores among them already."""

_KEPT_MEMORY: Final = {
    "MALLOC_MMAP_THRESHOLD_": str(32 << 20),
    "MALLOC_TRIM_THRESHOLD_": str(64 << 20),
}
"""What glibc keeps of memory that is freed, unless the user says so [byte]: the most that it comes
to keep by itself. In a host, which has little else, the arrays of every step would go back to the
system, and come from there in the next one, page by page."""

_GUARD_TAKES: Final = 6.0
"""How long to leave the end of a host to its guard [s]."""

_TEMPORARY: Final = ("TMPDIR", "TEMP", "TMP")
"""Where programs put their temporary files, on one system or another."""


class HostProcess:
    """One child process that hosts one component.

    Args:
        component: the name of the component.
        channel: how the child connects; it is imported there by its name.
        options: arguments of `channel`, in terms of JSON.
        on_exit: called from another thread, once, after the child has ended.
        admits: the digest of what it may create, see `orchestrator.remote.admission`.
        descriptors: that the child inherits, under the same numbers (POSIX).
    """

    def __init__(
        self,
        component: str,
        channel: type[HostChannel],
        options: Mapping[str, Any],
        on_exit: Callable[[], None],
        *,
        admits: str,
        descriptors: Sequence[int] = (),
    ) -> None:
        self._component = component
        self._on_exit = on_exit
        self._reason = ""
        self._has_ended = threading.Event()
        # what a library leaves in the temporary folder of a process that crashes goes with it
        self._temporary = temporary_folder("host")
        self._process = subprocess.Popen(
            # -P: a module in the working directory must not replace one of ours
            [sys.executable, "-P", "-m", "orchestrator.remote.host_main", component],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={
                **_KEPT_MEMORY,
                **child_environment(),
                **dict.fromkeys(_TEMPORARY, str(self._temporary)),
            },
            # Ctrl-C in a terminal goes to all processes of its session; ours are ended in order
            start_new_session=True,
            pass_fds=tuple(descriptors),
        )
        assert self._process.stdout is not None  # noqa: S101 - asked for above
        self._output = Output(component, self._process.stdout)
        threading.Thread(target=self._watch, name=f"{component} exit", daemon=True).start()
        self._tell(
            {
                "channel": f"{channel.__module__}:{channel.__qualname__}",
                "options": dict(options),
                "admits": admits,
                "log_level": logging.getLogger().getEffectiveLevel(),
            }
        )

    @property
    def pid(self) -> int:
        """The process id."""
        return self._process.pid

    def wait(self, timeout: float) -> bool:
        """Wait up to `timeout` [s] for the process to end; whether it has."""
        return self._has_ended.wait(timeout)

    def kill(self) -> None:
        """End the process and all that it started, at once, and wait for that."""
        if sys.platform == "linux" and not self._has_ended.is_set():
            # its guard ends the others first, wherever they are; see `orchestrator.remote.guard`
            self._close_input()
            self._signal(signal.SIGCONT)
            self._has_ended.wait(_GUARD_TAKES)
        if not self._has_ended.is_set():
            with contextlib.suppress(ProcessLookupError):
                if sys.platform == "win32":
                    self._process.kill()
                else:
                    os.killpg(self._process.pid, signal.SIGKILL)
            self._has_ended.wait()
        self._close_input()

    def _signal(self, number: int) -> None:
        with contextlib.suppress(ProcessLookupError):
            os.kill(self._process.pid, number)

    def limit_memory(self, limit: int) -> None:
        """End the process when it has more than `limit` [byte] of memory for itself (Linux)."""

        def end(amount: int) -> None:
            self._reason = (
                f"its process was ended with {format_size(amount)} of memory; "
                f"its `memory` allows {format_size(limit)}"
            )
            _log.debug("`%s`: %s", self._component, self._reason)
            self.kill()

        watch_memory(self._hosting, limit, self._has_ended, end)

    def _hosting(self) -> int:
        """The process that hosts the component; the one that was started guards it (Linux)."""
        return next(iter(children_of(self._process.pid)), self._process.pid)

    def obituary(self) -> str:
        """How the process ended, as a predicate, and what it said last."""
        code = self._process.returncode
        if self._reason:
            how = self._reason
        elif code is None:
            how = "its process is still running"
        else:
            how = f"its process {ended(code)}"
        return f"{how}{self.last_words()}"

    def last_words(self) -> str:
        """The last lines of output, as an appendix to an error message."""
        lines = "".join(f"\n    {line}" for line in self._output.last_lines)
        return f"; it wrote last:{lines}" if lines else ""

    def _tell(self, instructions: Mapping[str, Any]) -> None:
        stream = self._process.stdin
        if stream is not None:
            # a child that died already is reported by `_watch`
            with contextlib.suppress(BrokenPipeError):
                stream.write(json.dumps(instructions).encode() + b"\n")
                stream.flush()

    def _close_input(self) -> None:
        if self._process.stdin is not None:
            with contextlib.suppress(OSError):
                self._process.stdin.close()

    def _watch(self) -> None:
        if sys.platform == "linux":
            # While the process is a zombie its number cannot be given to another one, so this
            # ends what it started (the simulator behind a component, say) and nothing else.
            os.waitid(os.P_PID, self._process.pid, os.WEXITED | os.WNOWAIT)
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._output.wait(0.5)
        discard(self._temporary)
        self._has_ended.set()
        self._on_exit()


def child_environment() -> dict[str, str]:
    """The environment in which a Python process finds the same modules, and takes one thread."""
    path = os.pathsep.join(entry or str(Path.cwd()) for entry in sys.path)
    defaults = dict.fromkeys(_THREAD_VARIABLES, "1")
    return {**defaults, **os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1"}
