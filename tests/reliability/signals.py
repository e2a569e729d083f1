"""Signals to `run`, `experiment`, `train` and `serve` at random moments."""

import json
import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from orchestrator.recording.reader import Recording
from tests.reliability.area import Outcome, of_cases
from tests.reliability.programs import Program
from tests.reliability.small_runs import written

_LIMIT: Final = 120.0
"""Longer than that after the signal, it hangs [s]."""

_SIGNALS: Final = (
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGHUP,
    signal.SIGKILL,
)

_SLOW: Final = ["--set", "components.noise.parameters.sleep=0.02", "--quiet", "--no-figure"]
_COMMANDS: Final[Mapping[str, tuple[Sequence[str], float]]] = {
    "run": (("run", "case.yaml", "--out", "run", *_SLOW), 5.0),
    "run, process": (("run", "process.yaml", "--out", "run", *_SLOW), 6.0),
    "experiment": (("experiment", "slow.yaml", "--out", "ex", "--workers", "2", "--quiet"), 9.0),
    "train": (("train", "train.yaml", "--out", "train", "--workers", "1", "--quiet"), 9.0),
    "serve": (("serve", "hosted.yaml", "--hosts", "hosts.yaml", "--host", "partner"), 5.0),
}
"""By name: a command, and the time within which a signal comes [s]."""

_HOSTS: Final = 'hosts:\n  partner: {{endpoint: "tcp/127.0.0.1:{}"}}\n'
"""With a port above those that the system gives out, of each case its own."""


def _files(folder: Path, number: int) -> None:
    written(folder)
    case = (folder / "case.yaml").read_text()
    process = case.replace("step: 10 ms}", "step: 10 ms, process: true}")
    (folder / "process.yaml").write_text(process)
    (folder / "hosted.yaml").write_text(case.replace("10 ms}", "10 ms, host: partner}"))
    (folder / "hosts.yaml").write_text(_HOSTS.format(61_000 + number % 4000))
    slow = (
        folder / "experiment.yaml"
    ).read_text() + "set: {components.calm.parameters.sleep: 0.2}\n"
    (folder / "slow.yaml").write_text(slow.replace("seeds: 2", "seeds: 20"))
    recipe = Path(__file__).parents[2] / "studies" / "training" / "recipes" / "blind.yaml"
    scenarios = recipe.parents[3] / "scenarios"
    text = recipe.read_text().replace("../../../scenarios", str(scenarios))
    lines = [line for line in text.splitlines() if not line.startswith("checkpoint:")]
    (folder / "train.yaml").write_text("\n".join([*lines, "checkpoint: net.safetensors", ""]))


def _drawn(seed: int, number: int) -> tuple[str, signal.Signals, bool, float]:
    """The command, the signal, whether it comes twice, and when [s]."""
    rng = random.Random(f"signals {seed} {number}")  # noqa: S311
    name = [*_COMMANDS][number % len(_COMMANDS)]
    which = _SIGNALS[number % len(_SIGNALS)]  # 5 and 4: every pair comes
    return name, which, rng.random() < 0.25, rng.uniform(0.0, _COMMANDS[name][1])


def _performed(seed: int, number: int) -> Outcome:
    name, which, twice, moment = _drawn(seed, number)
    kind = f"{name}: {which.name}"
    with tempfile.TemporaryDirectory(prefix="reliability-") as place:
        folder = Path(place) / "case"
        _files(folder, number)
        program = Program(folder=folder, arguments=_COMMANDS[name][0])
        began = time.monotonic()
        process = program.started()
        why = _struck(program, process, which, moment, twice=twice)
        why = why or _readable(folder)
        left = program.left()
        why = why or left
        shutil.rmtree(folder, ignore_errors=True)
        return Outcome(number, kind, not why, why, seconds=time.monotonic() - began)


def _struck(
    program: Program,
    process: "subprocess.Popen[bytes]",
    which: signal.Signals,
    moment: float,
    *,
    twice: bool,
) -> str:
    """Send the signal; what is wrong with how the command ended."""
    try:
        code = process.wait(moment)
    except subprocess.TimeoutExpired:
        is_early = not hears(process.pid)
        os.kill(process.pid, which)
        if twice:
            time.sleep(0.05)
            process.poll()
            if process.returncode is None:
                os.kill(process.pid, which)
        try:
            code = process.wait(_LIMIT)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return f"it hangs: not over {_LIMIT:g} s after {which.name}"
        # the command may just have ended
        is_deaf = which is signal.SIGKILL or is_early
        said = program.said(code)
        if is_early and "KeyboardInterrupt" in said.text:  # as Python itself ends by SIGINT
            return ""
        wrong = said.fault((0, 4, -which) if is_deaf else (0, 4))
        return wrong and f"{which.name} at {moment:.2f} s{' twice' if twice else ''}: {wrong}"
    return program.said(code).fault((0,))


def hears(pid: int) -> bool:
    """Whether a command has come as far as to hear requests; while Python starts, nobody does.

    How long that takes depends on what else the machine does. Python itself hears SIGINT before.
    """
    lines = Path(f"/proc/{pid}/status").read_text().splitlines()
    masks = dict(line.split(":\t", 1) for line in lines if line.startswith("Sig"))
    heard = int(masks["SigCgt"], 16) | int(masks["SigIgn"], 16)
    return bool(heard >> (signal.SIGTERM - 1) & 1)


def _readable(folder: Path) -> str:
    """What cannot be read of what is left of a run or an experiment."""
    try:
        for manifest in folder.rglob("manifest.json"):
            recording = Recording(manifest.parent)
            if not recording.manifest["status"]:
                return "the manifest says no status"
            for name in recording.signals:
                len(recording[name])
        for journal in folder.rglob("*.jsonl"):
            *lines, _ = journal.read_text().split("\n")
            for line in lines:
                json.loads(line)
    except Exception as error:
        return f"what is left cannot be read: {error!r:.200}"
    return ""


def _some(seed: int, numbers: Sequence[int]) -> Iterator[Outcome]:
    for number in numbers:
        yield _performed(seed, number)


SIGNALS: Final = of_cases(
    "signals",
    "SIGINT, SIGTERM, SIGHUP, some twice, and SIGKILL to run, experiment, train and serve at a "
    "random moment: exit code 4 or the signal's, a manifest and a journal that can be read, and no "
    "process and no temporary folder is left",
    full=300,
    small=4,
    some=_some,
)
