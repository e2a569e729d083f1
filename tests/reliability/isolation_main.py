"""The process that makes copies of itself for cases; see `isolation.py`."""

import importlib
import json
import logging
import os
import resource
import select
import shutil
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any, TextIO

from tests.reliability.area import Outcome


def main() -> int:
    """Perform what standard input asks for; one line of JSON per case."""
    order = json.load(sys.stdin)
    logging.lastResort = None  # millions of cases have much to warn of
    warnings.simplefilter("ignore")
    lines = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print is not for who reads the lines
    module, function = order["performer"].split(":")
    folder = Path(order["folder"])
    perform = getattr(importlib.import_module(module), function)(order["seed"], folder)
    numbers = range(*order["range"]) if "range" in order else order["numbers"]
    at = 0
    while at < len(numbers):
        some = numbers[at : at + order["together"]]
        at += _performed(perform, some, order, lines)
    return 0


def _performed(
    perform: Callable[[int], Outcome],
    numbers: Sequence[int],
    order: dict[str, Any],
    lines: TextIO,
) -> int:
    """Perform cases in a copy of this process; how many were, with that which ended the copy."""
    folder = Path(order["folder"]) / "temporary"
    folder.mkdir()
    read, write = os.pipe()
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        os.close(read)
        _child(perform, numbers, order["megabytes"], folder, write)
    os.close(write)
    done = 0
    began = time.monotonic()
    why = ""
    rest = b""
    while done < len(numbers):
        left = began + order["seconds"] - time.monotonic()
        if left <= 0 or not select.select([read], [], [], left)[0]:
            why = f"not over after {order['seconds']:g} s"
            break
        found = os.read(read, 1 << 16)
        if not found:
            break
        *whole, rest = (rest + found).split(b"\n")
        for line in whole:
            lines.write(line.decode() + "\n")
            done += 1
            began = time.monotonic()
    os.close(read)
    with suppress(ProcessLookupError):
        os.killpg(pid, signal.SIGKILL)
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
    status = os.waitpid(pid, 0)[1]
    if done < len(numbers):
        kind = getattr(perform, "kind", lambda number: "?")(numbers[done])
        how = os.waitstatus_to_exitcode(status)
        why = why or f"the process ended with {signal.Signals(-how).name if how < 0 else how}"
        seconds = time.monotonic() - began
        outcome = Outcome(numbers[done], kind, False, why, seconds=seconds)
        lines.write(json.dumps(asdict(outcome)) + "\n")
        done += 1
    lines.flush()
    shutil.rmtree(folder, ignore_errors=True)
    return done


def _child(
    perform: Callable[[int], Outcome],
    numbers: Sequence[int],
    megabytes: float,
    folder: Path,
    write: int,
) -> None:
    """Perform `numbers` and end this process."""
    code = 1
    try:
        os.setsid()
        tempfile.tempdir = os.environ["TMPDIR"] = str(folder)
        limit = _address_space() + int(megabytes * 1e6)
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        for number in numbers:
            alone = len(numbers) == 1
            before = _memory(fresh=True) if alone else 0.0
            began = time.perf_counter()
            outcome = asdict(perform(number))
            outcome["seconds"] = outcome["seconds"] or time.perf_counter() - began
            if alone:
                outcome["peak_mb"] = outcome["peak_mb"] or max(_memory() - before, 0.0)
            os.write(write, json.dumps(outcome).encode() + b"\n")
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        os._exit(code)


def _memory(*, fresh: bool = False) -> float:
    """The most memory that this process had [MB]; from now on, if `fresh`."""
    if fresh:
        with suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
    with suppress(OSError):
        for line in Path("/proc/self/status").read_text().splitlines():
            if line.startswith("VmHWM"):
                return float(line.split()[1]) / 1e3
    return 0.0


def _address_space() -> int:
    """Of this process [byte]."""
    with suppress(OSError):
        return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    return 0


if __name__ == "__main__":
    sys.exit(main())
