"""`python -m tests.faults.starved`: runs that hardly get a processor come to their end.

Each run, and all that belongs to it, is at nice 19, beside nine processes at nice 19 that work all
the time. It goes on where it was interrupted; remove the table to begin anew.
"""

import argparse
import csv
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from orchestrator.recording.reader import Recording
from tests.adapters.hosting import SCENARIO, Site, free_port
from tests.faults.company import NICE, company

WAYS: Final = ("local", "zenoh", "hosts")
_RUNS: Final = 10
_BUSY: Final = 9
_LIMIT: Final = 3600.0
"""What takes longer hangs [s]."""

_COLUMNS: Final = ("way", "run", "exit_code", "seconds", "processor_seconds", "problems")


@dataclass(frozen=True, slots=True, kw_only=True)
class Starved:
    """What became of a run.

    Attributes:
        seconds: that it took [s].
        processor_seconds: that it had a processor, with all that it started [s].
        problems: what was not as it is to be; empty if all was.
    """

    exit_code: int
    seconds: float
    processor_seconds: float
    problems: str


def starved(way: str, folder: Path, *, busy: int = _BUSY, nice: int = NICE) -> Starved:
    """A run of 100 ms with three components in processes of their own, or on a host.

    Args:
        way: a transport, or `hosts`.
        folder: is created.
        busy: how many processes there are beside it.
        nice: of all that belongs to the run.
    """
    text = SCENARIO.replace("host: gpu", "host: partner")
    if way != "hosts":
        text = text.replace("host: partner", "process: true")
    site = Site(folder, text, {"partner": free_port()})
    expected = site.run("here", away=False, transport="in-process").fingerprint
    nlosim = ["nice", "-n", str(nice), sys.executable, "-m", "orchestrator"]
    command = [*nlosim, "run", "ring.yaml", "--out", "out", "--no-figure", "--quiet"]
    with ExitStack() as stack:
        stack.enter_context(company(busy))
        if way == "hosts":
            stack.enter_context(_serving(site, nlosim))
            command += ["--hosts", "hosts.yaml"]
        else:
            command += ["--transport", way]
        before = time.monotonic()
        with (folder / "run.txt").open("wb") as said:
            run = subprocess.Popen(command, cwd=folder, stdout=said, stderr=said)
            pid, code, used = _waited(run)
        assert pid == run.pid
        seconds = time.monotonic() - before
    problems = ""
    if code:
        problems = (folder / "run.txt").read_text(errors="replace")[-300:]
    elif Recording(folder / "out").manifest["fingerprint"] != expected:
        problems = "another fingerprint"
    return Starved(exit_code=code, seconds=seconds, processor_seconds=used, problems=problems)


def _waited(run: "subprocess.Popen[bytes]") -> tuple[int, int, float]:
    """The number of a process, its exit code and the processor time that it took [s]."""
    deadline = time.monotonic() + _LIMIT
    while True:
        pid, status, usage = os.wait4(run.pid, os.WNOHANG)
        if pid:
            run.returncode = os.waitstatus_to_exitcode(status)
            return pid, run.returncode, usage.ru_utime + usage.ru_stime
        if time.monotonic() > deadline:
            run.kill()
        time.sleep(0.05)


@contextmanager
def _serving(site: Site, nlosim: Sequence[str]) -> Iterator[None]:
    said = site.folder / "serve.txt"
    with said.open("wb") as stream:
        serve = subprocess.Popen(
            [*nlosim, "serve", "ring.yaml", "--once"],
            cwd=site.folder,
            stdout=stream,
            stderr=stream,
        )
    try:
        while "ready on host" not in said.read_text():
            if serve.poll() is not None:
                raise RuntimeError(said.read_text())
            time.sleep(0.05)
        yield
    finally:
        serve.terminate()
        serve.wait()


def main(say: Callable[[str], object] = sys.stdout.write) -> int:
    """Make the runs; exit code 1 if one of them is not as it is to be."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=_RUNS, help="by each way")
    parser.add_argument("--out", type=Path, default=Path("docs/results/starved.csv"))
    given = parser.parse_args()
    done = rows(given.out)
    with given.out.open("a", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS, lineterminator="\n")
        if not done:
            writer.writeheader()
        known = {(row["way"], int(row["run"])) for row in done}
        for number in range(given.runs):
            for way in WAYS:
                if (way, number) in known:
                    continue
                with TemporaryDirectory() as folder:
                    found = starved(way, Path(folder) / "site")
                row = {
                    "way": way,
                    "run": number,
                    "exit_code": found.exit_code,
                    "seconds": f"{found.seconds:.1f}",
                    "processor_seconds": f"{found.processor_seconds:.1f}",
                    "problems": found.problems,
                }
                writer.writerow(row)
                file.flush()
                say(f"{way} {number}: {found.seconds:.1f} s, {found.problems or 'ok'}\n")
    return int(any(row["problems"] for row in rows(given.out)))


def rows(table: Path) -> list[Mapping[str, str]]:
    """Of a table of such runs; none if there is no such file."""
    if not table.exists():
        return []
    with table.open(newline="") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    sys.exit(main())
