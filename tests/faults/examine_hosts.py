"""Runs a case with components on a host, and says what is wrong with what came of it."""

import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from orchestrator.recording.reader import Recording
from orchestrator.run import run_scenario
from orchestrator.scenario.build import load_scenario
from tests.adapters.hosting import Proxy, free_port, until, write_hosts
from tests.faults.judging import LIMIT, Ending, Result, problems, resumed
from tests.faults.on_hosts import HOST, HostCase
from tests.faults.processes import left, marked, parent, reached, variables

_READY: Final = f"ready on host `{HOST}`"

Command = subprocess.Popen[bytes]


def examined_on_hosts(case: HostCase, folder: Path) -> Result:
    """Run `case` in the new folder `folder`, without its fault and with it.

    The server is another process; what goes between it and the run goes through a proxy.
    """
    (folder / "temporary").mkdir(parents=True)
    shutil.copy(Path(__file__).with_name("fault_parts.py"), folder)
    (folder / "calm.yaml").write_text(case.written("none"))
    (folder / "case.yaml").write_text(case.written(case.fault.deed, str(folder)))
    run_scenario(
        load_scenario(folder / "calm.yaml"),
        folder / "calm",
        transport="in-process",
        figure=False,
    )
    reference = Recording(folder / "calm")
    with ExitStack() as stack:
        port = free_port()
        write_hosts(folder / "there.yaml", {HOST: port})
        proxy = stack.enter_context(
            Proxy(port, delay=case.delay, jitter=case.jitter, cut=case.cut, seed=case.number)
        )
        # a proxy answers where nobody listens any more; a network says so
        is_missed = case.fault.victim == "serve" and case.fault.number is signal.SIGKILL
        write_hosts(folder / "here.yaml", {HOST: port if is_missed else proxy.port})
        serve = stack.enter_context(_Server(folder))
        run = _started(folder, "run")
        before = time.monotonic()
        try:
            if case.fault.deed == "gate" and reached(folder, run):
                _disturb(case, folder, run, serve.process, proxy)
            run.wait(LIMIT)
        except subprocess.TimeoutExpired:
            wrong = [f"it hangs: not over after {LIMIT:g} s"]
            run.kill()
            run.wait()
        else:
            due = Ending(
                exit_code=case.fault.exit_code, says=case.fault.says, status=case.fault.status
            )
            wrong = list(problems(due, folder, run.returncode, reference))
        seconds = time.monotonic() - before
        at = None
        if run.returncode and not wrong:
            proxy.is_shut = False
            if "serve" in case.fault.victim:
                wrong += serve.ended()
                serve = stack.enter_context(_Server(folder))
            at, again = resumed(folder, reference)
            wrong += again
        wrong += serve.ended()
    return Result(
        exit_code=run.returncode,
        seconds=seconds,
        resumed=at,
        problems=(*wrong, *left(folder)),
    )


class _Server:
    """`nlosim serve`, ready; killed at the end if it is still there.

    Args:
        folder: of the case.
    """

    def __init__(self, folder: Path) -> None:
        self._said = folder / f"serve-{time.monotonic_ns()}.txt"
        self.process = _command(folder, self._said, "serve", "case.yaml", "--hosts", "there.yaml")

    def __enter__(self) -> "_Server":
        if not until(lambda: _READY in self._said.read_text() or self.process.poll() is not None):
            raise RuntimeError("the server is not ready")
        if self.process.poll() is not None:
            raise RuntimeError(self._said.read_text())
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait()

    def ended(self) -> list[str]:
        """End it, as Ctrl-C does, unless it has been; what is wrong with how it ends."""
        for number in (signal.SIGCONT, signal.SIGINT):
            if self.process.poll() is None:
                self.process.send_signal(number)
        try:
            code = self.process.wait(20)
        except subprocess.TimeoutExpired:
            return ["the server does not end"]
        said = self._said.read_text(errors="replace")
        if code not in {4, -signal.SIGKILL}:
            return [f"the server ended with exit code {code}: {said[-300:]!r}"]
        return [f"a traceback of the server: {said[-300:]!r}"] if "Traceback" in said else []


def _started(folder: Path, out: str) -> Command:
    options = ["--hosts", "here.yaml", "--quiet", "--no-figure", "--checkpoint", "100ms"]
    return _command(folder, folder / "run.txt", "run", "case.yaml", "--out", out, *options)


def _command(folder: Path, said: Path, *words: str) -> Command:
    with said.open("wb") as stream:
        return subprocess.Popen(
            [sys.executable, "-m", "orchestrator", *words],
            cwd=folder,
            stdout=stream,
            stderr=stream,
            env=variables(folder),
            start_new_session=True,
            preexec_fn=_hear,  # noqa: PLW1509 - short, and the proxy's thread holds no lock here
        )


def _hear() -> None:
    """Hear Ctrl-C, also where this process ignores it (`nohup`)."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _disturb(case: HostCase, folder: Path, run: Command, serve: Command, proxy: Proxy) -> None:
    """What happens while `far` waits in its step."""
    victim, number = case.fault.victim, case.fault.number
    if "line" in victim:
        proxy.is_shut = "for ever" in victim
        proxy.cut_all()
    else:
        pid = {"waiting": run.pid, "serve": serve.pid}.get(victim.partition(" ")[0])
        pid = pid or next(p for p, _ in marked(str(folder)) if parent(p) == run.pid)
        os.kill(pid, number)
        if number is signal.SIGSTOP:
            if "for ever" in victim:
                return
            time.sleep(case.pause)
            os.kill(pid, signal.SIGCONT)
    if number is not signal.SIGKILL:
        time.sleep(0.3)
    (folder / "go").touch()
