"""A bad environment: no room, no rights, few descriptors, little memory, no one who reads on."""

import os
import random
import resource
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

from orchestrator.recording.reader import Recording
from tests.reliability.area import Outcome, of_cases
from tests.reliability.commands import Said
from tests.reliability.programs import Program
from tests.reliability.small_runs import written

_LIMIT: Final = 180.0

_COMMANDS: Final[Mapping[str, Sequence[str]]] = {
    "run": ("run", "case.yaml", "--out", "out", "--checkpoint", "200ms"),
    "run, process": ("run", "process.yaml", "--out", "out", "--json"),
    "experiment": ("experiment", "experiment.yaml", "--out", "out", "--workers", "1", "--quiet"),
    "report": ("report", "whole"),
    "check": ("check", "case.yaml"),
    "export": ("export", "whole", "--csv"),
    "verify": ("verify", "run", "whole"),
    "components": ("components",),
}


def _limit(kind: int, amount: int) -> None:
    resource.setrlimit(kind, (amount, amount))


@dataclass(frozen=True, slots=True, kw_only=True)
class Condition:
    """Something that is not as usual.

    Attributes:
        prepare: from a random amount to what is done in the process before it begins.
        variables: of its environment.
        output: where standard output leads: `full` (`/dev/full`), `closed`, or a file.
        folder: whether the folder cannot be written to.
        pauses: whether the process is stopped for a while, again and again.
    """

    prepare: Callable[[random.Random], Callable[[], None]] = field(default=lambda rng: lambda: None)
    variables: Mapping[str, str] = field(default_factory=dict)
    output: str = "file"
    folder: bool = False
    pauses: bool = False


def _files(rng: random.Random) -> Callable[[], None]:
    return partial(_limit, resource.RLIMIT_FSIZE, int(10 ** rng.uniform(2, 6)))


def _descriptors(rng: random.Random) -> Callable[[], None]:
    return partial(_limit, resource.RLIMIT_NOFILE, rng.randrange(8, 120))


def _memory(rng: random.Random) -> Callable[[], None]:
    return partial(_limit, resource.RLIMIT_AS, rng.randrange(150, 1500) * 1_000_000)


def _stdout_closed(rng: random.Random) -> Callable[[], None]:
    which = rng.choice(((1,), (2,), (0, 1), (1, 2), (0, 1, 2)))

    def close() -> None:
        for number in which:
            os.close(number)

    return close


_ASCII: Final = {"PYTHONIOENCODING": "ascii", "LC_ALL": "C", "LANG": "C", "PYTHONUTF8": "0"}

_CONDITIONS: Final[Mapping[str, Condition]] = {
    "disk full": Condition(prepare=_files),
    "few descriptors": Condition(prepare=_descriptors),
    "little memory": Condition(prepare=_memory),
    "read-only folder": Condition(folder=True),
    "output full": Condition(output="full"),
    "output closed": Condition(prepare=_stdout_closed),
    "nobody reads on": Condition(output="pipe"),
    "ASCII only": Condition(variables=_ASCII),
    "pauses": Condition(pauses=True),
}


def _is_possible(name: str) -> str:
    """Why a condition cannot be had here; empty if it can."""
    if name == "read-only folder" and os.geteuid() == 0 and not _chattr():
        return "root may write everywhere, and `chattr +i` has no effect here"
    return ""


def _chattr() -> bool:
    """Whether a folder can be made one that root cannot write to, either."""
    if shutil.which("chattr") is None:
        return False
    with tempfile.TemporaryDirectory(prefix="reliability-") as folder:
        done = subprocess.run(["chattr", "+i", folder], check=False, capture_output=True)
        subprocess.run(["chattr", "-i", folder], check=False, capture_output=True)
        return done.returncode == 0


def _performed(seed: int, number: int, whole: Path) -> Outcome:
    rng = random.Random(f"environment {seed} {number}")  # noqa: S311
    name = [*_CONDITIONS][number % len(_CONDITIONS)]
    command = [*_COMMANDS][number % len(_COMMANDS)]  # 9 and 8: every pair comes
    kind = f"{name}: {command}"
    if impossible := _is_possible(name):
        return Outcome(number, f"{name}: left out, {impossible}", is_expected=True)
    condition = _CONDITIONS[name]
    with tempfile.TemporaryDirectory(prefix="reliability-") as place:
        folder = Path(place) / "case"
        shutil.copytree(whole, folder)
        program = Program(
            folder=folder,
            arguments=_COMMANDS[command],
            variables=condition.variables,
            prepare=condition.prepare(rng),
        )
        began = time.monotonic()
        said = _ended(program, condition, rng)
        seconds = time.monotonic() - began
        why = _fault(name, said) or _readable(folder / "out") or program.left()
        return Outcome(number, kind, not why, why, seconds=seconds)


def _ended(program: Program, condition: Condition, rng: random.Random) -> Said:
    """Run the command under the condition."""
    program.temporary.mkdir()
    (program.folder / "said.txt").touch()
    if condition.folder:
        _protect(program.folder, rights="+i", mode=0o555)
    try:
        process = _started(program, condition)
        for _ in range(3 if condition.pauses else 0):
            time.sleep(rng.uniform(0.1, 1.5))
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGSTOP)
                time.sleep(rng.uniform(0.1, 0.7))
                os.killpg(process.pid, signal.SIGCONT)
        try:
            code = process.wait(_LIMIT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            code = 124
    finally:
        if condition.folder:
            _protect(program.folder, rights="-i", mode=0o755)
    return program.said(code)


def _protect(folder: Path, *, rights: str, mode: int) -> None:
    if os.geteuid() == 0:
        subprocess.run(["chattr", rights, str(folder)], check=True, capture_output=True)
    else:
        folder.chmod(mode)


def _started(program: Program, condition: Condition) -> "subprocess.Popen[bytes]":
    if condition.output == "full":
        with Path("/dev/full").open("wb") as full:
            return program.started(full.fileno())
    if condition.output == "pipe":
        read, write = os.pipe()
        os.close(read)
        try:
            return program.started(write)
        finally:
            os.close(write)
    return program.started()


def _fault(name: str, said: Said) -> str:
    """What is not as it is documented."""
    if said.code == 124:
        return f"it hangs: not over after {_LIMIT:g} s"
    if name == "output closed":  # what is said may go nowhere
        return "" if said.code in {0, 2} else said.fault((0, 2))
    allowed = {"disk full": (0, 2), "few descriptors": (0, 2, 3), "little memory": (0, 2, 3)}
    return said.fault(allowed.get(name, (0, 2) if name != "pauses" else (0,)))


def _readable(run: Path) -> str:
    """What cannot be read of a run that is there."""
    try:
        if (run / "manifest.json").exists() and (run / "signals" / "index.json").exists():
            recording = Recording(run)
            for signal_ in recording.signals:
                len(recording[signal_])
    except Exception as error:
        return f"what is left cannot be read: {error!r:.200}"
    return ""


def _some(seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    with tempfile.TemporaryDirectory(prefix="reliability-") as place:
        whole = written(Path(place) / "whole")
        case = (whole / "case.yaml").read_text()
        process = case.replace("step: 10 ms}", "step: 10 ms, process: true}")
        (whole / "process.yaml").write_text(process)
        made = Program(folder=whole, arguments=("run", "case.yaml", "--out", "whole"))
        said = made.run(_LIMIT)
        if said.code:
            raise RuntimeError(f"the run that others read ended with {said}")
        (whole / "said.txt").unlink()
        shutil.rmtree(made.temporary)
        for number in numbers:
            yield _performed(seed, number, whole)


ENVIRONMENT: Final = of_cases(
    "environment",
    "commands where files cannot grow, a folder is read-only, descriptors or memory are few, "
    "standard output is full, closed, ASCII only or read by nobody, and with pauses: done, or "
    "exit code 2 (3, if a component failed) and a message",
    full=1_000,
    small=6,
    some=_some,
)
